"""The files of the CUDA form: the header, the kernels, and the Python module that launches them."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass, replace
from importlib import resources

from kinegen.emit.accuracy import accuracy_lines
from kinegen.emit.cpp.header import HeaderContext, header_context
from kinegen.emit.cuda.launched import Launched, launched_of
from kinegen.emit.environment import environment
from kinegen.emit.functions import LINE
from kinegen.emit.kernels import Kernels, provenance
from kinegen.emit.table import command_lines
from kinegen.naming import docstring_text

LAUNCH = "_launch.py"
"""What every Python module here calls."""


@dataclass(frozen=True, slots=True)
class PackageContext:
    """What the templates of `cuda/` are given besides that of the header.

    Attributes:
        header: Name of the header.
        source: Name of the file with the kernels.
        macro: What macros begin with.
        launched: The kernels, by output.
        docs: What each of them computes, for Python, in lines.
    """

    header: str
    source: str
    macro: str
    launched: tuple[Launched, ...]
    docs: dict[str, tuple[str, ...]]


def header_of(kernels: Kernels) -> HeaderContext:
    """What the template of the header is given: what C++ has, under other names."""
    robot = kernels.robot
    header = f"{robot.name}.cuh"
    return replace(
        header_context(kernels),
        header=header,
        guard=f"KINEGEN_{robot.name.upper()}_CUH_INCLUDED",
        macro=f"KINEGEN_{robot.name.upper()}",
        command=command_lines(kernels, "--languages cuda"),
        accuracy=accuracy_lines(kernels, header),
    )


def package_of(kernels: Kernels) -> PackageContext:
    """What the templates of the kernels and of Python are given."""
    context, name = header_of(kernels), kernels.robot.name
    pairs = zip(kernels.programs, context.functions, strict=True)
    launched = tuple(launched_of(kernels, program, printed) for program, printed in pairs if printed.is_batched)
    docs = {
        each.function.name: tuple(textwrap.wrap(docstring_text(" ".join(each.function.heading)), LINE - 8))
        for each in launched
    }
    return PackageContext(context.header, f"{name}.cu", context.macro, launched, docs)


def emit_cuda(kernels: Kernels) -> dict[str, str]:
    """Print all files.

    Args:
        kernels: The robot and its programs.

    Returns:
        Text by file name.
    """
    context, package = header_of(kernels), package_of(kernels)
    templates = {
        context.header: "cuda/header.cuh.jinja",
        package.source: "cuda/kernels.cu.jinja",
        "__init__.py": "cuda/__init__.py.jinja",
    }
    files = {
        file: environment().get_template(template).render(k=context, p=package) for file, template in templates.items()
    }
    banner = f"# {provenance(kernels.robot)}\n# SPDX-License-Identifier: 0BSD\n"
    runtime = resources.files("kinegen.emit.cuda.runtime")
    return {**files, LAUNCH: banner + runtime.joinpath(LAUNCH).read_text(encoding="utf-8")}
