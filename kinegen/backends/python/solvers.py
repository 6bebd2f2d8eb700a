"""The solvers of the public module: the numbers of each as Python text."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import mpmath

from kinegen.backends import redundancy_range as numbers
from kinegen.backends.bundle import RobotPrograms, provenance
from kinegen.backends.c.inverse_tracker import strides
from kinegen.backends.complete_inverse.elimination import Elimination
from kinegen.backends.complete_inverse.elimination_choice import (
    ACCEPTED,
    ASIDES,
    MERGED,
    NEARLY_REAL,
    SHIFTS,
    complete_of,
)
from kinegen.backends.inverse import allowed, branches_of
from kinegen.backends.python.context import RangeOptions, Tracking
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.solver_parameters import given_joint
from kinegen.backends.templates import environment
from kinegen.model.branches import Branches
from kinegen.model.joint_bounds import reach
from kinegen.model.outputs import POSE_AND_JACOBIAN
from kinegen.model.robot import Robot


def tracking_of(kernels: RobotPrograms) -> Tracking:
    """Return what the template of the public module prints."""
    robot, branches = kernels.robot, branches_of(kernels)
    if branches is None:
        raise ValueError("arms without a closed form are refused before this")
    rigid = tuple(allowed(branches.rigid, real) for real in (ScalarType.DOUBLE, ScalarType.FLOAT))
    return Tracking(
        kernel=POSE_AND_JACOBIAN.function,
        strides=repr(tuple(map(float, strides(robot)))),
        reach=repr(float(reach(robot, robot.tips))),
        rigid=repr(rigid) if branches.reads_attitude else "None",
        given=repr(given_joint(robot, branches)),
    )


def range_options(kernels: RobotPrograms, branches: Branches) -> RangeOptions:
    """Return the arguments of the object in the module."""
    robot = kernels.robot
    is_circle = numbers.range_of(robot, branches, ScalarType.DOUBLE).given < 0
    limits = (line for real in ScalarType for line in ("    (", *_limits(robot, branches, real), "    ),"))
    return RangeOptions(
        redundancy="the arm angle" if is_circle else f"joint {robot.redundancy}",
        most=numbers.RANGES,
        lines=(
            "limits=(",
            *limits,
            "),",
            f"parts={numbers.PARTS},",
            f"budget={numbers.BUDGET},",
            f"most={numbers.RANGES},",
            f"samples={numbers.samples_of(robot, branches, ScalarType.DOUBLE)},",
            f"steps={numbers.STEPS},",
            f"golden={numbers.GOLDEN!r},",
            f"beside={numbers.BESIDE!r},",
        ),
    )


def _limits(robot: Robot, branches: Branches, real: ScalarType) -> tuple[str, ...]:
    """Return the fields of `Limits` for one number type, a line each or a line for each joint."""
    found, fineness = numbers.range_of(robot, branches, real), numbers.FINENESS[real]
    size = reach(robot, robot.tips)
    bounds = [
        "None," if each is None else f"({_number(each[0])}, {_number(each[1])}),"
        for each in numbers.bounds_of(robot, branches, real)
    ]
    turns = [turn if math.isfinite(turn) else 0.0 for turn in branches.turns]
    lines = [
        "(",
        *(f"    {bound}" for bound in bounds),
        "),",
        f"{_row(turns)},",
        f"{_row(numbers.sweeps_of(robot, branches))},",
        f"{_number(size)},",
        f"({_number(found.low)}, {_number(found.high)}),",
        f"{found.given},",
        f"{fineness.depth},",
        f"{_number(fineness.least_off)},",
        f"{_number(fineness.shortest * size)},",
        f"{_number(numbers.gap_of(found, real))},",
    ]
    return tuple(f"        {line}" for line in lines)


def _row(values: Iterable[float]) -> str:
    return f"({', '.join(map(_number, values))})"


def _number(value: float) -> str:
    return repr(float(value)).replace("e+", "e")


TABLES = "_eliminations.py"
"""The module of a package with the constants."""


def emit_tables(kernels: RobotPrograms) -> dict[str, str]:
    """Print the constants of the eliminations of an arm, as a module."""
    complete = complete_of(kernels.robot)
    template = environment().get_template("python/_eliminations.py.jinja")
    text = template.render(
        name=kernels.robot.name,
        provenance=provenance(kernels.robot),
        tables=tuple(map(_fields, complete.eliminations, SHIFTS)),
        bounds=", ".join(map(repr, (ACCEPTED, MERGED, NEARLY_REAL, complete.scale, ASIDES))),
    )
    return {TABLES: text}


def _fields(elimination: Elimination, shift: float) -> dict[str, tuple[str, ...]]:
    """Return the fields of one elimination; each has one line or a line for each row."""
    with mpmath.workdps(30):
        turned = [mpmath.cos(shift), mpmath.sin(shift)]
    return {
        "order": (f"({', '.join(map(str, elimination.order))})",),
        "backwards": (str(elimination.backwards),),
        "closes_first": (str(elimination.closes_first),),
        "real": (str(elimination.real),),
        "shift": (_entries(turned),),
        "left": (_motion(elimination.left),),
        "right": (_motion(elimination.right),),
        "fixed": (_motion(elimination.fixed),),
        "along": tuple(map(_entries, elimination.along)),
        "across_x": tuple(_entries(entry.real for entry in row) for row in elimination.across),
        "across_y": tuple(_entries(entry.imag for entry in row) for row in elimination.across),
        "basis": tuple(_entries(vector[row] for vector in elimination.basis) for row in range(12)),
    }


def _motion(matrix: Any) -> str:
    return _entries(matrix[row, column] for row in range(3) for column in range(4))


def _entries(numbers: Iterable[Any]) -> str:
    values = [float(number) for number in numbers]
    return f"({', '.join(repr(value if abs(value) > 1e-25 else 0.0) for value in values)})"
