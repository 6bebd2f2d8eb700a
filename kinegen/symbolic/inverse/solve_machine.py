"""Both ways to bring the tool of a five-axis machine to a point of the workpiece, along a direction there.

The direction alone decides the two joints that turn (the second problem of Paden and Kahan: two turns about axes that
are not parallel take one direction to another), then the point decides the three that shift, which is linear. Sines and
cosines of both turns are at hand before the angles are.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import sympy as sp

from kinegen.symbolic.fold import Vector
from kinegen.symbolic.inverse.axes import JointAxis
from kinegen.symbolic.inverse.exact import combined, tidy, transposed
from kinegen.symbolic.inverse.geometry import Planar, flat_frame
from kinegen.symbolic.inverse.machine import Arrangement, Machine, seen_in, turned_parts
from kinegen.symbolic.inverse.solutions import Solution
from kinegen.symbolic.inverse.steps import ONE, ZERO, Angle, Steps, fixed
from kinegen.symbolic.inverse.thresholds import ALIGNED, TARGET

_LARGEST = sp.Integer(10) ** 15
_LONGEST = sp.Integer(10) ** 12

BRANCHES = ("tilt forward", "tilt backward")


@dataclass(frozen=True, slots=True)
class Aimed:
    """What a machine is solved for, as symbols.

    Attributes:
        point: Of the tool tip, in the frame of the workpiece.
        axis: Along the tool, in the same frame; of any length.
        near: A joint vector, for what is free.
    """

    point: Vector
    axis: Vector
    near: tuple[sp.Symbol, ...]


def machine_solutions(steps: Steps, machine: Machine, aimed: Aimed) -> Iterator[Solution]:
    """Solve for both branches.

    Args:
        steps: The tape.
        machine: The machine.
        aimed: Point and direction of the tool.

    Yields:
        Tilt forward, then backward.
    """
    square = steps.square(aimed.axis)
    sane = _sane(steps, machine, aimed, square)
    scale = steps.name(1 / steps.root(square))
    a, b, c = (steps.name(entry * scale) for entry in aimed.axis)
    x, y, z = steps.turned(machine.frame, (a, b, c))
    off = steps.square((x, y))
    height, squared = _tilt(steps, machine, z, off)
    within = steps.select(-4 * TARGET, squared, ONE, ZERO)
    root = steps.root(steps.select(ZERO, squared, squared, ZERO))
    rest = steps.name(machine.first.rate * aimed.near[machine.first.number - 1])
    stay = (steps.name(sp.cos(rest)), steps.name(sp.sin(rest)))
    start = fixed(sp.atan2(machine.sine, machine.cosine))
    swing = steps.argument((height, root))
    for sign in (1, -1):
        second = _second(steps, machine, height, sign * root)
        usual = steps.back(_across(steps, machine, second), (x, y))
        size = steps.name(1 / steps.root(steps.square(usual)))
        first = (
            steps.select(off, ALIGNED, stay[0], steps.name(usual[0] * size)),
            steps.select(off, ALIGNED, stay[1], steps.name(usual[1] * size)),
        )
        angle = steps.argument(usual)
        turn = Angle(steps.select(off, ALIGNED, steps.argument(stay).value, angle.value), angle.low, angle.high)
        shifts = _shifts(steps, machine, aimed.point, first, second)
        tilt = start + (swing if sign > 0 else -swing)
        amounts = ((machine.first, turn), (machine.second, tilt), *zip(machine.shifts, shifts, strict=True))
        yield Solution(amounts, (sane, within))


def _sane(steps: Steps, machine: Machine, aimed: Aimed, square: sp.Expr) -> sp.Expr:
    """1 for finite numbers and an axis that is not null; else 0."""
    lengths = (*aimed.point, *aimed.near, *(parameter for parameter, _ in machine.defaults))
    finite = steps.select(steps.name(sp.Add(*(length**2 for length in lengths))), _LARGEST, ONE, ZERO)
    short = steps.select(square, _LONGEST, finite, ZERO)
    return steps.select(1 / _LONGEST, square, short, ZERO)


def _tilt(steps: Steps, machine: Machine, along: sp.Expr, off: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """How high the tool points along the first axis, from the middle of what it can, and the square of what is across.

    With r the radius the square is (r + m - z) (r - m + z) for z = u1 . a. Where a factor is 1 - z or 1 + z, which
    vanishes for a tool along the first axis, it is taken from the part across that axis, without a difference.
    """
    height = steps.name(along - machine.middle) if machine.middle != 0 else along
    if machine.is_square:
        return height, off
    above, below = tidy(machine.radius + machine.middle), tidy(machine.radius - machine.middle)
    upper, lower = steps.name(above - along), steps.name(below + along)
    if above == 1:
        upper = steps.select(ZERO, along, steps.name(off / steps.name(1 + along)), upper)
    if below == 1:
        lower = steps.select(along, ZERO, steps.name(off / steps.name(1 - along)), lower)
    return height, steps.name(upper * lower)


def _second(steps: Steps, machine: Machine, height: sp.Expr, root: sp.Expr) -> Planar:
    """Cosine and sine of the second turn."""
    square = tidy(machine.cosine**2 + machine.sine**2)
    lead = (tidy(machine.cosine / square), tidy(machine.sine / square))
    return steps.times(lead, (height, root))


def _across(steps: Steps, machine: Machine, second: Planar) -> Planar:
    """The tool axis after the second turn, across the first axis."""
    parts = [seen_in(machine.frame, part) for part in turned_parts(machine.second, machine.pointing)]
    x, y = (steps.name(parts[0][i] + parts[1][i] * second[0] + parts[2][i] * second[1]) for i in range(2))
    return x, y


def _shifts(
    steps: Steps, machine: Machine, point: Vector, first: Planar, second: Planar
) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
    """How far the shifts go: the point turned back by what is before them, less the tool turned by what is after."""
    ahead, behind = point, machine.end
    if machine.arrangement is not Arrangement.HEAD:
        ahead = _moved(steps, machine.first, (first[0], -first[1]), ahead)
    if machine.arrangement is Arrangement.TABLE:
        ahead = _moved(steps, machine.second, (second[0], -second[1]), ahead)
    else:
        behind = _moved(steps, machine.second, second, behind)
    if machine.arrangement is Arrangement.HEAD:
        behind = _moved(steps, machine.first, first, behind)
    left = tuple(steps.name(a - b) for a, b in zip(ahead, behind, strict=True))
    return steps.turned(machine.inverse, (left[0], left[1], left[2]))


def _moved(steps: Steps, joint: JointAxis, turn: Planar, point: Vector) -> Vector:
    """A point turned about the axis of a joint, by a turn with this cosine and sine."""
    frame = flat_frame(joint)
    apart = tuple(steps.name(a - b) for a, b in zip(point, joint.point, strict=True))
    x, y, z = steps.turned(frame, (apart[0], apart[1], apart[2]))
    real, imaginary = steps.times(turn, (x, y))
    back = steps.turned(transposed(frame), (real, imaginary, z))
    x, y, z = (steps.name(a + b) for a, b in zip(back, combined((1, joint.point)), strict=True))
    return x, y, z
