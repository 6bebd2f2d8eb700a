"""Finds constants that are nearly, but not exactly, special, and says what the difference does to the pose.

In: a robot. Out: one note for each angle close to a multiple of 90 degrees and each length close to zero, such as
89.9999 for 90 or 1.5708 for pi/2. Nothing is ever changed: the kernels keep what the file says. What depends on a
runtime parameter is left alone, since its value may be any.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from decimal import Decimal
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

from kinegen import reference
from kinegen.robot.dimension import Dimension
from kinegen.robot.expressions import PI, Expression, Name, add, linear, multiply, names, negate, number
from kinegen.robot.extent import joint_box, reach
from kinegen.robot.model import Robot, Step
from kinegen.robot.units import RADIAN
from kinegen.robot.values import checked_value, is_zero

NEAR_ANGLE = math.radians(0.1)
"""Rounding of a data sheet and slips of the pen are smaller than this; real angles of a machine are larger."""

NEAR_LENGTH = 1e-6
"""The same for lengths, relative to the robot's reach."""

SMALLEST_STEP = 1e-6
"""Smaller differences are measured on this one and scaled down, or rounding would be all one sees."""

Steps = tuple[Step, ...]

POSES = 64
SEED = 20240229


@dataclass(frozen=True, slots=True)
class Note:
    """A constant that is nearly special.

    Attributes:
        line: Its line in the file, or None for the base and the tool.
        text: What was found, in one sentence.
    """

    line: int | None
    text: str

    def __str__(self) -> str:
        return self.text if self.line is None else f"line {self.line}: {self.text}"


@dataclass(frozen=True, slots=True)
class Place:
    """Where a constant stands.

    Attributes:
        line: Its line in the file.
        words: What it is called, such as `alpha of joint 2 (shoulder)`.
        expression: The whole entry.
        dimension: Angle or length.
        frames: Frames that it moves.
        altered: Makes the robot that has another entry there.
    """

    line: int | None
    words: str
    expression: Expression
    dimension: Dimension
    frames: tuple[str, ...]
    altered: Callable[[Expression], Robot]


def nearly_special(robot: Robot) -> tuple[Note, ...]:
    """Find the constants that are nearly special.

    Args:
        robot: The robot.

    Returns:
        The notes, in the order of the table.
    """
    parameters = {parameter.name: checked_value(parameter.value, {}) for parameter in robot.parameters}
    runtime = frozenset(parameter.name for parameter in robot.runtime_parameters)
    variables = frozenset(variable.name for variable in robot.variables)
    smallest = NEAR_LENGTH * reach(robot, robot.frame_names)
    notes = []
    for place in places(robot):
        factors, constant = linear(place.expression, variables)
        if runtime.intersection(names(constant)):
            continue
        special = _nearest(float(checked_value(constant, parameters)), place.dimension)
        difference = checked_value(add(constant, negate(special)), parameters)
        limit = NEAR_ANGLE if place.dimension is Dimension.ANGLE else smallest
        if not is_zero(difference) and abs(difference) < limit:
            moving = [multiply(factor, Name(name)) for name, factor in factors.items()]
            moved = _effect(place, add(*moving, special), float(difference))
            notes.append(Note(place.line, _sentence(robot, place, (constant, special), moved, parameters)))
    return tuple(notes)


def _nearest(value: float, dimension: Dimension) -> Expression:
    """The special value next to a value: zero, or for an angle any number of quarter turns."""
    quarters = round(2 * value / math.pi) if dimension is Dimension.ANGLE else 0
    return multiply(number(Fraction(quarters, 2)), PI)


def _effect(place: Place, special: Expression, difference: float) -> str:
    """What the difference does, in words."""
    step = math.copysign(max(abs(difference), SMALLEST_STEP), difference)
    exact, other = place.altered(special), place.altered(add(special, number(Fraction(step))))
    moved = _distance(exact, other, place.frames) * difference / step
    frame = "the tip" if place.frames == exact.tips else place.frames[0]
    moves = f"moves {frame} by up to {moved:.2g} {exact.units.length}"
    if place.dimension is not Dimension.ANGLE:
        return f"the difference {moves}"
    turns = f"{abs(difference):.2g} rad"
    return f"the difference {moves} and turns it by {turns}" if moved else f"the difference turns {frame} by {turns}"


def _sentence(
    robot: Robot, place: Place, found: tuple[Expression, Expression], effect: str, parameters: Mapping[str, Decimal]
) -> str:
    """The note, with the constant and the special value in the units of the file."""
    degrees = place.dimension is Dimension.ANGLE and robot.units.angle == "deg"
    unit = robot.units.angle if place.dimension is Dimension.ANGLE else robot.units.length
    value, special = (checked_value(multiply(RADIAN, each) if degrees else each, parameters) for each in found)
    wanted = _quarters(special) if place.dimension is Dimension.ANGLE and not degrees else f"{special:f}"
    # As few digits as show that it is not the special value.
    texts = [(_rounded(value, digits), _rounded(special, digits)) for digits in (6, 12, 17, 50)]
    written = next((text for text, other in texts if text != other), texts[-1][0])
    return f"{place.words} is {written} {unit}, close to {wanted}, and kept as it is; {effect}"


def _rounded(value: Decimal, digits: int) -> str:
    """A number with some digits, without the zeros at its end."""
    text = f"{value:.{digits}g}"
    return text.rstrip("0").rstrip(".") if "." in text and "e" not in text else text


def _quarters(angle: Decimal) -> str:
    """A number of quarter turns in radians: 0, pi/2, -pi, 3*pi/2."""
    share = Fraction(round(2 * float(angle) / math.pi), 2)
    top = {0: "0", 1: "pi", -1: "-pi"}.get(share.numerator, f"{share.numerator}*pi")
    return top if share.denominator == 1 else f"{top}/2"


def _distance(one: Robot, other: Robot, frames: tuple[str, ...]) -> float:
    """How far frames of two robots get from each other, at random poses, at corners of the joint box and at zero."""
    box = np.array(joint_box(one)).reshape(-1, 2)
    generator = np.random.default_rng(SEED)
    random = generator.uniform(box[:, 0], box[:, 1], (POSES, len(box)))
    corners = np.where(generator.integers(0, 2, (POSES, len(box))), box[:, 1], box[:, 0])
    q = np.concatenate([np.zeros((1, len(box))), random, corners])
    left, right = reference.frames(one, q), reference.frames(other, q)
    return max(float(np.linalg.norm(left[name][:, :3, 3] - right[name][:, :3, 3], axis=1).max()) for name in frames)


def places(robot: Robot) -> Iterator[Place]:
    """Every entry of the file that may hold a constant."""
    for index, row in enumerate(robot.rows):
        words = f"joint {row.number} ({row.name})"
        for key in ("alpha", "a", "d", "theta", "beta"):
            entry: Expression | None = getattr(row, key)
            if entry is not None:
                dimension = Dimension.LENGTH if key in ("a", "d") else Dimension.ANGLE
                altered = partial(_with_entry, robot, index, key)
                yield Place(row.line, f"{key} of {words}", entry, dimension, robot.tips, altered)
        yield from _step_places(row.line, words, row.steps, robot.tips, partial(_with_row_steps, robot, index))
    for key, steps in (("base", robot.base), ("tool", robot.tool)):
        yield from _step_places(None, key, steps, robot.tips, partial(_with_fixed, robot, key))
    for index, frame in enumerate(robot.frames):
        altered_steps = partial(_with_frame, robot, index)
        yield from _step_places(frame.line, f"frame {frame.name}", frame.steps, (frame.name,), altered_steps)


def _step_places(
    line: int | None, words: str, steps: tuple[Step, ...], frames: tuple[str, ...], altered: Callable[[Steps], Robot]
) -> Iterator[Place]:
    for index, step in enumerate(steps):
        dimension = Dimension.ANGLE if step.kind.is_rotation else Dimension.LENGTH
        change = partial(_with_step, altered, steps, index)
        yield Place(line, f"{step.kind} of {words}", step.value, dimension, frames, change)


def _with_entry(robot: Robot, index: int, key: str, entry: Expression) -> Robot:
    rows = list(robot.rows)
    change: dict[str, Any] = {key: entry}
    rows[index] = replace(rows[index], **change)
    return replace(robot, rows=tuple(rows))


def _with_row_steps(robot: Robot, index: int, steps: Steps) -> Robot:
    rows = list(robot.rows)
    rows[index] = replace(rows[index], steps=steps)
    return replace(robot, rows=tuple(rows))


def _with_fixed(robot: Robot, key: str, steps: Steps) -> Robot:
    return replace(robot, base=steps) if key == "base" else replace(robot, tool=steps)


def _with_frame(robot: Robot, index: int, steps: Steps) -> Robot:
    frames = list(robot.frames)
    frames[index] = replace(frames[index], steps=steps)
    return replace(robot, frames=tuple(frames))


def _with_step(altered: Callable[[Steps], Robot], steps: Steps, index: int, value: Expression) -> Robot:
    return altered((*steps[:index], replace(steps[index], value=value), *steps[index + 1 :]))
