"""The lengths of the table as named constants, so that a reviewer finds the numbers of the drawing in the code.

In: a robot and its programs. Out: a name for each number that is a length of the table and stands in a kernel, with
the rows that it is from. A number that the table states in two places is one constant, called after both: the kernels
compute with numbers, and cannot say which of two equal ones is meant. What is made of several lengths keeps its digits.

They are macros of the C file, so that every compiler makes the same code as of digits; gcc loads a `static const`
from memory where it does not optimise.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.sections import angle_names
from kinegen.ir.fixed_point.binary_angles import EXACT
from kinegen.ir.program import Constant, Operator, Program, Statement, Variable
from kinegen.model.expression_nodes import Expression, Name, Number, Product
from kinegen.model.expression_parser import ExpressionError, evaluate, linear, names
from kinegen.model.expression_values import FLOAT64, Dimension
from kinegen.model.outputs import Kind
from kinegen.model.robot import Robot, Step
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import macro, prefix

MOST_PLACES = 3
"""Places of the table that one name is made of; a number in more of them keeps its digits."""

LONGEST = 63
"""Characters of a name that every C compiler tells apart."""

_LINEAR = (Operator.ADD, Operator.SUB, Operator.MUL)
_NEAR = 1e-9


@dataclass(frozen=True, slots=True)
class NamedConstant:
    """Names a length of the table by a macro; its source says its unit and where it is from."""

    name: str
    value: Fraction
    literal: str
    source: str


@dataclass(frozen=True, slots=True)
class _Entry:
    """Holds the label of a length in the table, its magnitude, and its place in words.

    The words say `minus` where the table has the negative of it.
    """

    label: str
    place: str
    value: Fraction


def named_constants(kernels: RobotPrograms, real: ScalarType, taken: frozenset[str]) -> tuple[NamedConstant, ...]:
    """Names the lengths that statements compute with, in the order of the table, but for macros that are taken."""
    robot, stem = kernels.robot, prefix(kernels.robot.name, real)
    used = {value for program in kernels.programs for value in _lengths(program)}
    # Equal lengths of several places are one number, with one name.
    places: dict[Fraction, list[_Entry]] = {}
    for entry in _entries(robot):
        places.setdefault(entry.value, []).append(entry)
    ratios = tuple(_ratios(robot))
    found: list[NamedConstant] = []
    for value, entries in places.items():
        labels = tuple(dict.fromkeys(entry.label for entry in entries))
        # A number that is the sine of an angle as well may not be a length in its statement.
        is_ratio = any(math.isclose(value, ratio, rel_tol=_NEAR) for ratio in ratios)
        name = macro(stem, "_".join(labels))
        is_long = len(labels) > MOST_PLACES or len(name) > LONGEST
        if value not in used or is_long or is_ratio or name in taken | {each.name for each in found}:
            continue
        where = "; ".join(f"{label}: {_places(entries, label)}" for label in labels)
        where = where if len(labels) > 1 else _places(entries, labels[0])
        found.append(NamedConstant(name, value, real.literal(value), f"{robot.units.length}, {where}"))
    return tuple(found)


def names_of(constants: Sequence[NamedConstant], program: Program) -> Mapping[Fraction, str]:
    """Returns the names by value, for the statements of one program."""
    return {each.value: each.name for each in constants} if program.quantity.kind in _KINDS else {}


def constant_lines(constants: Sequence[NamedConstant]) -> tuple[str, ...]:
    """Returns one line for each constant: its name, its value as printed, and where it is from."""
    names = max((len(each.name) for each in constants), default=0)
    digits = max((len(each.literal) for each in constants), default=0)
    return tuple(f"{each.name:<{names}}  {each.literal:<{digits}}  {each.source}" for each in constants)


def is_length(statement: Statement, angles: frozenset[str]) -> bool:
    """Returns whether a constant in a statement can be a length: not in an angle, nor a factor of a joint variable."""
    return (
        statement.operator in _LINEAR
        and angles.isdisjoint(statement.results)
        and not (statement.operator is Operator.MUL and any(isinstance(each, Variable) for each in statement.operands))
    )


def _lengths(program: Program) -> Iterator[Fraction]:
    """Yields the magnitudes of the constants that may be lengths."""
    if program.quantity.kind not in _KINDS:
        return
    angles = angle_names(program.statements)
    for statement in program.statements:
        if is_length(statement, angles):
            yield from (abs(each.value) for each in statement.operands if isinstance(each, Constant))


_KINDS = frozenset((Kind.POSE, Kind.FRAMES, Kind.POSITION, Kind.JACOBIAN, Kind.FK_JACOBIAN, Kind.TWIST))
"""Kernels whose constants are lengths, sines and cosines of fixed angles, and rates; others have such as 1/2 too."""


def _entries(robot: Robot) -> Iterator[_Entry]:
    """Yields all lengths of the table that are numbers, in its order."""
    yield from _of_steps(robot, "base", "base", robot.base)
    for row in robot.rows:
        place = f"row {row.number} ({row.name})"
        for key in ("a", "d"):
            yield from _entry(robot, getattr(row, key), f"{key}{row.number}", f"{key} of {place}")
        yield from _of_steps(robot, f"row{row.number}", place, row.steps)
    yield from _of_steps(robot, "tool", "tool", robot.tool)
    for frame in robot.frames:
        yield from _of_steps(robot, f"frame_{frame.name}", f"frame {frame.name}", frame.steps)


def _of_steps(robot: Robot, label: str, place: str, steps: Sequence[Step]) -> Iterator[_Entry]:
    for step in steps:
        if not step.kind.is_rotation:
            name = step.kind.value
            yield from _entry(robot, step.value, f"{label}_{name[-1]}", f"{name} of {place}")


def _entry(robot: Robot, expression: Expression | None, label: str, place: str) -> Iterator[_Entry]:
    """Yields one length; a parameter gives its name, and what depends on joints or runtime parameters has no value."""
    fixed = {parameter.name: parameter for parameter in robot.parameters if not parameter.runtime}
    if expression is None or not set(names(expression)) <= fixed.keys():
        return
    values = {name: evaluate(fixed[name].value, {}, EXACT) for name in names(expression)}
    signed = evaluate(expression, values, EXACT)
    value, place = abs(signed), f"minus {place}" if signed < 0 else place
    core = _positive(expression)
    if isinstance(core, Name) and fixed[core.name].dimension is Dimension.LENGTH:
        label = core.name
    if value:
        yield _Entry(label, place, value)


def _positive(expression: Expression) -> Expression:
    """Returns an expression without a minus in front."""
    if isinstance(expression, Product) and expression.factors[:-1] == (Number(Fraction(-1)),):
        return expression.factors[-1]
    return expression


def _places(entries: Sequence[_Entry], label: str) -> str:
    return ", ".join(entry.place for entry in entries if entry.label == label)


def _ratios(robot: Robot) -> Iterator[float]:
    """Yields what kernels multiply by besides lengths: sines and cosines of fixed angles, rates of joint variables."""
    steps = [*robot.base, *robot.tool, *(step for row in robot.rows for step in row.steps)]
    steps += [step for frame in robot.frames for step in frame.steps]
    angles = [step.value for step in steps if step.kind.is_rotation]
    angles += [each for row in robot.rows for each in (row.alpha, row.theta, row.beta) if each is not None]
    fixed = {entry.name: float(evaluate(entry.value, {}, FLOAT64)) for entry in robot.parameters if not entry.runtime}
    for angle in angles:
        # A joint variable adds to an angle: what is left of it where all variables are zero is the fixed part.
        others = dict.fromkeys(set(names(angle)) - fixed.keys(), 0.0)
        value = float(evaluate(angle, fixed | others, FLOAT64))
        yield from (abs(math.sin(value)), abs(math.cos(value)))
    entries = [*angles, *(step.value for step in steps), *(row.d for row in robot.rows if row.d is not None)]
    for entry in entries:
        yield from _rates(entry, fixed)


def _rates(entry: Expression, fixed: Mapping[str, float]) -> Iterator[float]:
    """Yields the magnitudes by which an entry multiplies joint variables and runtime parameters."""
    try:
        factors, _ = linear(entry, frozenset(names(entry)) - fixed.keys())
    except ExpressionError:  # a product of runtime parameters, or one under a root
        return
    yield from (abs(float(evaluate(factor, fixed, FLOAT64))) for factor in factors.values())
