"""The files of CUDA: the C++ header for devices, kernels over batches, and the Python that launches them."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from importlib import resources
from types import MappingProxyType

from kinegen.backends.accuracy import accuracy_lines
from kinegen.backends.bundle import RobotPrograms, provenance
from kinegen.backends.cpp.files import HeaderContext, header_context
from kinegen.backends.cpp.functions import Function
from kinegen.backends.cpp.syntax import SYNTAX as PLAIN
from kinegen.backends.cpp.syntax import TRUTHS
from kinegen.backends.metadata import command_lines
from kinegen.backends.routines import LINE
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.templates import rendered
from kinegen.ir.program import Program
from kinegen.model.outputs import Array
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import docstring_text, function

SYNTAX = replace(PLAIN, language="CUDA")

FORMS = tuple(TRUTHS.forms.values())
"""Forms of expressions beside those of the syntax: what makes a truth value."""


WARP = 32
"""Threads that read and write together."""

_BLOCKS = (128, 64, 32)
_SHARED = 48 * 1024
"""Bytes of shared memory that every block may have without asking."""

_MOST = 24 * 1024
"""Bytes that a block of one warp may have: with more, too few warps fit on a multiprocessor to be worth it."""

_BYTES = 8


@dataclass(frozen=True, slots=True)
class Place:
    """Holds an input or a result of one configuration.

    Attributes:
        size: Numbers, the last rows of matrices among them.
        upper: Numbers without these.
        before: Numbers in shared memory before it; of truth values, which are not there, 0.
    """

    name: str
    number: str
    size: int
    upper: int
    shape: tuple[int, ...]
    before: int

    @property
    def is_shared(self) -> bool:
        """Returns whether it goes through shared memory, where that is used at all."""
        return self.number == "Real" and self.size > 0

    @property
    def has_rows(self) -> bool:
        """Returns whether it holds matrices with last rows."""
        return self.upper < self.size

    @property
    def described(self) -> str:
        """The same for the Python module."""
        truth = ", is_truth=True" if self.number == "bool" else ""
        return f'Array("{self.name}", {self.shape}, {self.upper}{truth})'

    def own(self, form: str) -> str:
        """Returns the numbers of an input as a list, from a text with `{index}`; last rows are known."""
        numbers = [form.format(index=index) for index in range(self.upper)]
        return ", ".join([*numbers, *("Real(0.0)", "Real(0.0)", "Real(0.0)", "Real(1.0)")[: self.size - self.upper]])


@dataclass(frozen=True, slots=True)
class Launched:
    """Holds the kernels of one output, whose names by number type are without their ends.

    Attributes:
        block: Threads of a block.
        width: Numbers of shared memory for each thread, odd so that warps read it without conflicts; 0 for none.
    """

    function: Function
    inputs: tuple[Place, ...]
    results: tuple[Place, ...]
    block: int
    width: int
    names: dict[str, str]

    @property
    def has_rows(self) -> bool:
        """Returns whether there are results with last rows that may be left out."""
        return any(each.has_rows for each in self.results)

    def arguments(self, real: str) -> str:
        """Returns what each kernel of a number type is given, as C++ writes it."""
        parts = [f"const {real}* {each.name}, const long long {each.name}_stride" for each in self.inputs]
        numbers = {"Real": real}
        parts += [
            f"{numbers.get(each.number, each.number)}* {each.name}, const long long {each.name}_stride"
            for each in self.results
        ]
        parts += [f"const {real}* given"] * self.function.has_params
        return ", ".join(["const long long n", *parts])

    @property
    def passed(self) -> str:
        """The same as one kernel passes it on."""
        parts = [f"{each.name}, {each.name}_stride" for each in (*self.inputs, *self.results)]
        return ", ".join(["n", *parts, *["given"] * self.function.has_params])


def launched_of(kernels: RobotPrograms, program: Program, printed: Function) -> Launched:
    """Lays out the kernels of one output, whose function in the header is printed."""
    inputs, results = _places(program.signature.inputs), _places(program.signature.results)
    width = max(sum(each.size for each in arrays if each.is_shared) for arrays in (inputs, results)) | 1
    # The largest block whose arrays fit shared memory; none where even one warp is too much.
    fitting = [
        block
        for block in _BLOCKS
        if block * width * _BYTES <= (_SHARED if block > WARP else _MOST)
    ]  # fmt: skip
    return Launched(
        function=printed,
        inputs=inputs,
        results=results,
        block=fitting[0] if fitting else _BLOCKS[0],
        width=width if fitting else 0,
        names={real.value: function(kernels.robot.name, printed.name, real) for real in ScalarType},
    )


def _places(arrays: tuple[Array, ...]) -> tuple[Place, ...]:
    found: list[Place] = []
    before = 0
    for array in arrays:
        number = "bool" if array.is_truth else "Real"
        place = Place(array.name, number, array.blocks * array.stored, array.size, array.shape, before)
        before += place.size if place.is_shared else 0
        found.append(place)
    return tuple(found)


LAUNCH = "_launch.py"
"""What every Python module here calls."""


@dataclass(frozen=True, slots=True)
class PackageContext:
    """Holds what the templates of `cuda/` are given besides that of the header.

    `docs` say for Python what kernels compute.
    """

    header: str
    source: str
    macro: str
    launched: tuple[Launched, ...]
    docs: dict[str, tuple[str, ...]]


def header_of(kernels: RobotPrograms) -> HeaderContext:
    """Returns what the template of the header is given: what C++ has, under other names."""
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


def package_of(kernels: RobotPrograms) -> PackageContext:
    """Returns what the templates of the kernels and of Python are given."""
    context, name = header_of(kernels), kernels.robot.name
    pairs = zip(kernels.programs, context.functions, strict=True)
    launched = tuple(launched_of(kernels, program, printed) for program, printed in pairs if printed.is_batched)
    docs = {
        each.function.name: tuple(textwrap.wrap(docstring_text(" ".join(each.function.heading)), LINE - 8))
        for each in launched
    }
    return PackageContext(context.header, f"{name}.cu", context.macro, launched, docs)


@lru_cache(maxsize=1)
def emit_cuda(kernels: RobotPrograms) -> Mapping[str, str]:
    """Prints all files, by name; they are asked for in each number type."""
    context, package = header_of(kernels), package_of(kernels)
    templates = {
        context.header: "cuda/header.cuh",
        package.source: "cuda/kernels.cu",
        "__init__.py": "cuda/__init__.py",
    }
    # The launcher is the same file for every robot.
    banner = f"# {provenance(kernels.robot)}\n# SPDX-License-Identifier: 0BSD\n"
    runtime = resources.files("kinegen.backends.cuda.vendored")
    launch = banner + runtime.joinpath(LAUNCH).read_text(encoding="utf-8")
    return MappingProxyType({**rendered(templates, k=context, p=package), LAUNCH: launch})
