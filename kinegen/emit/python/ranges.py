"""The ranges of a redundancy in the public module: its numbers as Python text."""

from __future__ import annotations

import math
from collections.abc import Iterable

from kinegen.emit import redundancy_range as numbers
from kinegen.emit.kernels import Kernels
from kinegen.emit.python.context import RangeOptions
from kinegen.emit.reals import Real
from kinegen.outputs import Branches
from kinegen.robot.extent import reach
from kinegen.robot.model import Robot

RANGED = ("_range_search.py", "_redundancy_range.py")
"""What is copied for the ranges, besides what an inverse needs."""


def range_options(kernels: Kernels, branches: Branches) -> RangeOptions:
    """The arguments of the object in the module.

    Args:
        kernels: The robot and its programs.
        branches: The words of its inverse.
    """
    robot = kernels.robot
    is_circle = numbers.range_of(robot, branches, Real.DOUBLE).given < 0
    limits = (line for real in Real for line in ("    (", *_limits(robot, branches, real), "    ),"))
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
            f"samples={numbers.SAMPLES},",
            f"steps={numbers.STEPS},",
            f"golden={numbers.GOLDEN!r},",
            f"beside={numbers.BESIDE!r},",
        ),
    )


def _limits(robot: Robot, branches: Branches, real: Real) -> tuple[str, ...]:
    """The fields of `Limits` for one number type, a line each or a line for each joint."""
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
    ]
    return tuple(f"        {line}" for line in lines)


def _row(values: Iterable[float]) -> str:
    return f"({', '.join(map(_number, values))})"


def _number(value: float) -> str:
    return repr(float(value)).replace("e+", "e")
