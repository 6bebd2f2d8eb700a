"""Finds numbers that are nearly special, and numbers that look as if they were written in another unit.

Nothing is ever changed: the kernels keep what the file says, and a twist of 1.5708 degrees is a possible twist. What
depends on a runtime parameter is left alone, since its value may be any.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from functools import partial
from typing import Any

from kinegen.model.expression_parser import PI, Expression, Name, add, linear, multiply, names, negate, number
from kinegen.model.expression_values import METRES, RADIAN, Dimension, checked_value, is_zero
from kinegen.model.joint_bounds import endless, joint_box, reach
from kinegen.model.robot import JointType, JointVariable, Robot, Step
from kinegen.support.dataclass import dataclass

NEAR_ANGLE = math.radians(0.1)
"""Rounding of a data sheet and slips of the pen are smaller than this; real angles of a machine are larger."""

NEAR_LENGTH = 1e-6
"""The same for lengths, relative to the robot's reach."""

SMALLEST_STEP = 1e-6
"""Smaller differences are measured on this one and scaled down, or rounding would be all one sees."""

MINUTE = 1e-6
"""Metres and radians: what moves a tip of a URDF or MJCF file by less is not noted."""

Steps = tuple[Step, ...]

POSES = 64
SEED = 20240229


@dataclass(frozen=True, slots=True)
class Note:
    """A constant that is nearly special."""

    line: int | None  # Its line in the file, or None for the base and the tool
    text: str  # What was found, in one sentence

    def __str__(self) -> str:
        return self.text if self.line is None else f"line {self.line}: {self.text}"


@dataclass(frozen=True, slots=True)
class Place:
    """Where a constant stands."""

    line: int | None  # Its line in the file
    words: str  # What it is called, such as `alpha of joint 2 (shoulder)`
    expression: Expression  # The whole entry
    dimension: Dimension  # Angle or length
    frames: tuple[str, ...]  # Frames that it moves
    altered: Callable[[Expression], Robot]  # Makes the robot that has another entry there


def nearly_special(robot: Robot) -> tuple[Note, ...]:
    """Find the constants that are nearly special.

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
            moved = _moved(place, add(*moving, special), float(difference))
            # Nobody wrote the last digits of a file with links; `--snap` takes them away where they matter.
            turned = abs(float(difference)) if place.dimension is Dimension.ANGLE else 0.0
            if robot.links and max(moved * METRES[robot.units.length], turned) < MINUTE:
                continue
            effect = _effect(robot, place, moved, float(difference))
            notes.append(Note(place.line, _sentence(robot, place, (constant, special), effect, parameters)))
    return tuple(notes)


def _nearest(value: float, dimension: Dimension) -> Expression:
    """Returns the special value next to a value: zero, or for an angle any number of quarter turns."""
    quarters = round(2 * value / math.pi) if dimension is Dimension.ANGLE else 0
    return multiply(number(Fraction(quarters, 2)), PI)


def _moved(place: Place, special: Expression, difference: float) -> float:
    """Returns how far the difference moves frames, in the unit of the file."""
    step = math.copysign(max(abs(difference), SMALLEST_STEP), difference)
    exact, other = place.altered(special), place.altered(add(special, number(Fraction(step))))
    return _distance(exact, other, place.frames) * difference / step


def _effect(robot: Robot, place: Place, moved: float, difference: float) -> str:
    """Returns what the difference does, in words."""
    frame = "the tip" if place.frames == robot.tips else place.frames[0]
    moves = f"moves {frame} by up to {moved:.2g} {robot.units.length}"
    if place.dimension is not Dimension.ANGLE:
        return f"the difference {moves}"
    turns = f"{abs(difference):.2g} rad"
    return f"the difference {moves} and turns it by {turns}" if moved else f"the difference turns {frame} by {turns}"


def _sentence(
    robot: Robot, place: Place, found: tuple[Expression, Expression], effect: str, parameters: Mapping[str, Decimal]
) -> str:
    """Returns the note, with the constant and the special value in the units of the file."""
    degrees = place.dimension is Dimension.ANGLE and robot.units.angle == "deg"
    unit = robot.units.angle if place.dimension is Dimension.ANGLE else robot.units.length
    value, special = (checked_value(multiply(RADIAN, each) if degrees else each, parameters) for each in found)
    wanted = _quarters(special) if place.dimension is Dimension.ANGLE and not degrees else f"{special:f}"
    # As few digits as show that it is not the special value.
    texts = [(_rounded(value, digits), _rounded(special, digits)) for digits in (6, 12, 17, 50)]
    written = next((text for text, other in texts if text != other), texts[-1][0])
    return f"{place.words} is {written} {unit}, close to {wanted}, and kept as it is; {effect}"


def _rounded(value: Decimal, digits: int) -> str:
    """Returns a number with some digits, without the zeros at its end."""
    text = f"{value:.{digits}g}"
    return text.rstrip("0").rstrip(".") if "." in text and "e" not in text else text


def _quarters(angle: Decimal) -> str:
    """Returns a number of quarter turns in radians: 0, pi/2, -pi, 3*pi/2."""
    share = Fraction(round(2 * float(angle) / math.pi), 2)
    top = {0: "0", 1: "pi", -1: "-pi"}.get(share.numerator, f"{share.numerator}*pi")
    return top if share.denominator == 1 else f"{top}/2"


def _distance(one: Robot, other: Robot, frames: tuple[str, ...]) -> float:
    """How far frames of two robots get from each other, at random poses, at corners of the joint box and at zero."""
    # Most files have no such constant, and checking them should not wait for NumPy.
    import numpy as np

    from kinegen.verify import reference

    box = np.array(joint_box(one)).reshape(-1, 2)
    generator = np.random.default_rng(SEED)
    random = generator.uniform(box[:, 0], box[:, 1], (POSES, len(box)))
    corners = np.where(generator.integers(0, 2, (POSES, len(box))), box[:, 1], box[:, 0])
    q = np.concatenate([np.zeros((1, len(box))), random, corners])
    left, right = reference.frames(one, q), reference.frames(other, q)
    return max(float(np.linalg.norm(left[name][:, :3, 3] - right[name][:, :3, 3], axis=1).max()) for name in frames)


def places(robot: Robot) -> Iterator[Place]:
    """Yields every entry of the file that may hold a constant."""
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


ROUNDED = 0.002
"""How far pi/2 lies from what people write for it: 1.57, 1.571, 1.5708; also 3.14 for pi."""

SLACK = 0.01
"""A rounded whole turn is no more than a turn."""

LARGEST, SMALLEST = 100.0, 0.003
"""Metres: arms that reach further or less far are fewer than files in the wrong unit."""

TURNS = 4
"""Limits in radians beyond this many turns to a side are more often degrees than a joint without stops."""


def wrong_unit(robot: Robot) -> tuple[Note, ...]:
    """Find the angles and lengths that look as if they were written in another unit.

    Returns:
        The notes: constants in the order of the table, then limits, then the reach.
    """
    return (*_constants(robot), *_limits(robot), *_reach(robot))


def _reach(robot: Robot) -> Iterator[Note]:
    """Yields a reach that no arm has, and one that is usual in another unit; none where slides leave it open."""
    if endless(robot):
        return
    size, unit = reach(robot), robot.units.length
    if unit == "m" and size > LARGEST:
        yield Note(None, f"the arm reaches {size:.4g} m; if the lengths are in millimetres, write length: mm")
    elif unit != "m" and 0 < size * METRES[unit] < SMALLEST:
        yield Note(None, f"the arm reaches {size:.4g} {unit}; if the lengths are in metres, write length: m")


def _constants(robot: Robot) -> Iterator[Note]:
    parameters = {parameter.name: checked_value(parameter.value, {}) for parameter in robot.parameters}
    variables = frozenset(variable.name for variable in robot.variables)
    for place in places(robot):
        if place.dimension is Dimension.ANGLE:
            value = float(checked_value(linear(place.expression, variables)[1], parameters))
            if text := _slip(robot, value):
                yield Note(place.line, f"{place.words} is {text}")


def _limits(robot: Robot) -> Iterator[Note]:
    rows = {row.name: row for row in robot.rows}
    for variable in robot.variables:
        if variable.limits is None:
            continue
        far = max(_values(variable), key=abs)
        text = _stroke(robot, far) if variable.type is JointType.PRISMATIC else _turn(robot, far)
        if text:
            row = rows[variable.name]
            yield Note(row.line, f"a limit of joint {row.number} ({row.name}) is {text}")


def _turn(robot: Robot, angle: float) -> str:
    """Returns what is odd about the limit of a revolute joint, in words; empty if nothing is."""
    text = _slip(robot, angle) or _tiny(robot, angle)
    return text if robot.units.angle == "deg" or abs(angle) > TURNS * math.tau else ""


def _stroke(robot: Robot, length: float) -> str:
    """Returns what is odd about the limit of a prismatic joint of a large arm, in words; empty if nothing is."""
    unit = robot.units.length
    if unit == "m" or not 0 < abs(length) * METRES[unit] < SMALLEST or reach(robot) < LARGEST * abs(length):
        return ""
    return f"{length:.6g} {unit}, a small stroke; if metres were meant, write {length / METRES[unit]:.6g}"


def _values(variable: JointVariable) -> Iterator[float]:
    return (float(checked_value(limit, {})) for limit in variable.limits or ())


def _slip(robot: Robot, angle: float) -> str:
    """Returns what is odd about an angle in radians, in words; empty if nothing is."""
    if robot.units.angle == "deg":
        return _radians_for_degrees(math.degrees(angle))
    return _degrees_for_radians(angle)


def _tiny(robot: Robot, angle: float) -> str:
    """What is odd about a limit in degrees that is no more than a turn in radians, in words; empty if nothing is."""
    degrees = math.degrees(angle)
    if robot.units.angle == "rad" or abs(degrees) > math.tau + SLACK:
        return ""
    return f"{degrees:.6g} deg, a small motion; if radians were meant, write {math.degrees(degrees):.6g}"


def _radians_for_degrees(degrees: float) -> str:
    quarters = round(abs(degrees) / (math.pi / 2))
    if not 1 <= quarters <= 4 or abs(abs(degrees) - quarters * math.pi / 2) > ROUNDED:
        return ""
    sign = "-" if degrees < 0 else ""
    name = f"{sign}{_share(Fraction(quarters, 2))}"
    written = f"{sign}{90 * quarters}"
    return f"{degrees:.6g} deg, close to the number {name}; if radians were meant, write {written}"


def _degrees_for_radians(radians: float) -> str:
    quarters = round(radians / (math.pi / 2))
    if abs(radians) <= math.tau + SLACK or abs(radians - quarters * math.pi / 2) < ROUNDED:
        return ""
    turns = abs(radians) / math.tau
    return f"{radians:.6g} rad, or {turns:.3g} turns; if degrees were meant, write {_in_pi(radians)}"


def _in_pi(degrees: float) -> str:
    share = Fraction(f"{degrees:.6g}") / 180
    return f"{'-' if share < 0 else ''}{_share(abs(share))}" if share.denominator <= 12 else f"{degrees:.6g}*pi/180"


def _share(share: Fraction) -> str:
    """Returns a positive share of pi: `pi`, `pi/2`, `3*pi/2`."""
    top = "pi" if share.numerator == 1 else f"{share.numerator}*pi"
    return top if share.denominator == 1 else f"{top}/{share.denominator}"
