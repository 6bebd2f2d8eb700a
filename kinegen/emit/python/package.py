"""The public module of a robot: `__init__.py`, with its array handling beside it."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable
from dataclasses import dataclass
from importlib import resources

from kinegen.emit.environment import environment
from kinegen.emit.kernels import QUANTITY_TEXT, Kernels, joint_lines, operation_line, provenance
from kinegen.emit.reals import Real
from kinegen.ir.program import Program
from kinegen.naming import docstring_text, python_identifier
from kinegen.outputs import Quantity
from kinegen.robot.expressions import Arithmetic, Expression, evaluate
from kinegen.robot.model import Robot

LINE = 120
"""Longest line of the module, as the project's formatter has it."""

_FLOATS = Arithmetic(number=float, pi=3.141592653589793, functions={"sqrt": lambda value: float(value) ** 0.5})
_DTYPES = {Real.DOUBLE: "float64", Real.FLOAT: "float32"}


@dataclass(frozen=True, slots=True)
class PublicKernel:
    """One kernel of the module.

    Attributes:
        name: Its name.
        brief: What it computes.
        shape: Shape of the result for one configuration, as Python text.
        result: The same in words.
        operations: What a configuration costs.
    """

    name: str
    brief: str
    shape: str
    result: str
    operations: str


@dataclass(frozen=True, slots=True)
class PackageContext:
    """What the template `python/__init__.py.jinja` is given."""

    name: str
    description: tuple[str, ...]
    provenance: str
    length: str
    dof: int
    joints: tuple[str, ...]
    joint_names: tuple[str, ...]
    limits: tuple[str, ...]
    frames: tuple[str, ...]
    tips: tuple[str, ...]
    parameters: tuple[tuple[str, str], ...]
    kernels: tuple[PublicKernel, ...]
    reals: str
    stamp: str
    exported: tuple[str, ...]


def emit_package(kernels: Kernels, reals: tuple[Real, ...], stamp: str) -> dict[str, str]:
    """Print the public module and the array handling it uses.

    Args:
        kernels: The robot and its programs.
        reals: The number types that were emitted.
        stamp: Digest of the C sources; an extension built from others is not used.

    Returns:
        Text by file name.
    """
    robot = kernels.robot
    functions = tuple(_public(robot, program) for program in kernels.programs)
    has_frames = any(program.quantity is Quantity.FRAMES for program in kernels.programs)
    context = PackageContext(
        name=robot.name,
        description=_paragraph(docstring_text(robot.description)),
        provenance=docstring_text(provenance(robot)),
        length=robot.units.length,
        dof=robot.dof,
        joints=joint_lines(robot),
        joint_names=_quoted(variable.name for variable in robot.variables),
        limits=tuple(_limits(variable.limits) for variable in robot.variables),
        frames=_quoted(robot.frame_names) if has_frames else (),
        tips=_quoted(robot.tips) if robot.is_tree else (),
        parameters=tuple(
            (python_identifier(parameter.name), Real.DOUBLE.literal(value))
            for parameter, value in zip(robot.runtime_parameters, kernels.defaults, strict=True)
        ),
        kernels=functions,
        reals=f"({', '.join(_quoted(_DTYPES[real] for real in reals))}{',' if len(reals) == 1 else ''})",
        stamp=stamp,
        exported=_exported(robot, functions, has_frames),
    )
    array_handling = resources.files("kinegen.native").joinpath("kernel.py").read_text(encoding="utf-8")
    banner = f"# {provenance(robot)}\n# SPDX-License-Identifier: 0BSD\n"
    return {
        "__init__.py": environment().get_template("python/__init__.py.jinja").render(k=context),
        "_kernel.py": banner + array_handling,
        "py.typed": "",
    }


def _paragraph(text: str) -> tuple[str, ...]:
    return tuple(textwrap.wrap(text, LINE, break_long_words=False, break_on_hyphens=False))


def _exported(robot: Robot, functions: tuple[PublicKernel, ...], has_frames: bool) -> tuple[str, ...]:
    names = ["DOF", "JOINTS", "LIMITS", "backend", *(function.name for function in functions)]
    names += ["FRAMES"] * has_frames + ["TIPS"] * robot.is_tree + ["Params"] * bool(robot.runtime_parameters)
    return tuple(sorted(names, key=_export_key))


def _export_key(name: str) -> tuple[int, str]:
    """The order in which the project's linter wants `__all__`: constants, classes, functions."""
    return (0 if name.isupper() else 1 if name[0].isupper() else 2), name


def output_shape(robot: Robot, program: Program) -> tuple[int, ...]:
    """Shape of the result for one configuration; a single tip has no axis of its own."""
    inner = (4, 4) if program.quantity.is_pose else (3,)
    several = robot.is_tree or program.quantity is Quantity.FRAMES
    return (len(program.frames), *inner) if several else inner


def _public(robot: Robot, program: Program) -> PublicKernel:
    shape = output_shape(robot, program)
    several = shape not in ((4, 4), (3,))
    order = "FRAMES" if program.quantity is Quantity.FRAMES else "TIPS"
    text = ", ".join(str(extent) for extent in shape)
    return PublicKernel(
        name=program.quantity.function,
        brief=QUANTITY_TEXT[program.quantity],
        shape=f"({text},)" if len(shape) == 1 else f"({text})",
        result=f"(..., {text}), in the order of `{order}`" if several else f"(..., {text})",
        operations=operation_line(program),
    )


def _limits(limits: tuple[Expression, Expression] | None) -> str:
    if limits is None:
        return "None"
    low, high = (evaluate(bound, {}, _FLOATS) for bound in limits)
    return f"({low!r}, {high!r})"


def _quoted(items: Iterable[str]) -> tuple[str, ...]:
    return tuple(f'"{item}"' for item in items)
