"""Which values of a program are angles, numbers and lengths, and which programs integers cannot evaluate."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from fractions import Fraction

from kinegen.errors import KinegenError
from kinegen.ir.fixed_point.program import above
from kinegen.ir.fixed_point.ranges import Copy, Extent, Extents, Given, Product, Sum, Trigonometric, Value
from kinegen.ir.program import Constant, Operand, Operator, Program, RuntimeParameter, Statement, Temporary, Variable
from kinegen.model.expression_values import Dimension
from kinegen.model.outputs import Quantity
from kinegen.model.robot import JointType, Robot
from kinegen.support.compat import StrEnum

_UNKNOWN = 2.0**100


def exact_sizes(program: Program, angles: frozenset[str]) -> dict[str, float]:
    """Bound the exact values of a program whose inputs are angles or unknown.

    Returns for each other temporary a bound on its magnitude, huge where a length is given at run time. `angles`: its
    temporaries that are angles; they are left out.
    """
    values: list[Value] = []
    places: dict[Operand, int] = {}

    def place(operand: Operand, is_factor: bool) -> int:
        if isinstance(operand, Constant):
            operand = Constant(abs(operand.value)) if is_factor else operand
            given = Given(Extent(above(abs(operand.value)), 0.0), float(operand.value))
        else:
            given = Given(Extent(_UNKNOWN, 0.0))
        if operand not in places:
            places[operand] = len(values)
            values.append(given)
        return places[operand]

    # Angles are left out; sines and cosines are bounded whatever they are of.
    for statement in program.statements:
        if not angles.isdisjoint(statement.results):
            continue
        if statement.operator is Operator.SINCOS:
            value: Value = Trigonometric(statement.operands[0], 0.0, 0.0)
        else:
            is_factor = statement.operator is Operator.MUL
            operands = [place(operand, is_factor) for operand in statement.operands]
            value = _value(statement.operator, operands, statement.operands)
        for name in statement.results:
            places[Temporary(name)] = len(values)
            values.append(value)
    # The same rules as for finished integers, with no rounding errors.
    extents = Extents(values)
    return {name.name: extents.extent(number).size for name, number in places.items() if isinstance(name, Temporary)}


def _value(operator: Operator, places: list[int], operands: tuple[Operand, ...]) -> Value:
    match operator:
        case Operator.ADD | Operator.SUB:
            return Sum(places[0], places[1], 0.0, 1 if operator is Operator.ADD else -1)
        case Operator.MUL:
            product = math.prod(operand.value for operand in operands if isinstance(operand, Constant))
            return Product(places[0], places[1], 0.0, -1 if Fraction(product) < 0 else 1)
        case _:
            return Copy(places[0], 0.0)


class Kind(StrEnum):
    """What a value measures."""

    ANGLE = "angle"
    NUMBER = "number"
    LENGTH = "length"


_COMPUTED = (Quantity.POSE.kind, Quantity.FRAMES.kind, Quantity.POSITION.kind)
_UNIT = 1.0 + 2.0**-20
_SAME_KIND = (Operator.ADD, Operator.SUB, Operator.NEG)


def refuse(robot: Robot, reason: str, line: int | None = None) -> KinegenError:
    """Return the error that says why there are no fixed-point kernels of a robot."""
    return KinegenError(f"no q30 kernels for {robot.name}: {reason}", robot.source, line)


def output_kinds(program: Program) -> tuple[Kind, ...]:
    """Return what each output measures: the last column of a matrix is a length, and so is a point."""
    entries = 12 if program.quantity.is_pose else 3
    return tuple(
        Kind.LENGTH if entries == 3 or place % 4 == 3 else Kind.NUMBER for place in range(len(program.outputs))
    )


def input_kind(robot: Robot, operand: Variable | RuntimeParameter) -> Kind:
    """Return what an input measures.

    Raises KinegenError if it is a runtime parameter that is a plain number, which has no natural scale.
    """
    if isinstance(operand, Variable):
        kind = robot.variables[operand.index].type
        return Kind.LENGTH if kind is JointType.PRISMATIC else Kind.ANGLE
    parameter = next(each for each in robot.runtime_parameters if each.name == operand.name)
    if parameter.dimension is Dimension.NUMBER:
        reason = f"runtime parameter '{parameter.name}' is a plain number; only lengths and angles have a scale"
        raise refuse(robot, reason, parameter.line)
    return Kind.ANGLE if parameter.dimension is Dimension.ANGLE else Kind.LENGTH


def refusal(quantity: Quantity) -> str:
    """Return why integers do not compute a quantity; empty where they do."""
    computed = quantity.kind in _COMPUTED
    return "" if computed else f"q30 kernels compute pose, frames and position, not {quantity}"


def find_kinds(robot: Robot, program: Program) -> dict[str, Kind]:
    """Return the kind of every temporary.

    A constant has the kind that its place asks for. Where a temporary serves as a number and as a length (a link may be
    as long as the cosine of a twist), it gets one of the two kinds; so it does where its constants do not tell.

    Raises:
        KinegenError: If the program computes anything but poses and positions, a length follows an angle (a screw), an
            angle follows a length, a runtime parameter is a plain number, lengths are multiplied, anything is divided,
            or a root, an arc tangent or a selection is made.
    """
    reason = refusal(program.quantity)
    if reason:
        raise KinegenError(f"{reason}; build the others separately, without q30", robot.source)
    angles = _angles(program)
    for statement in program.statements:
        _check(robot, statement, angles)
    pairs = [statement.results for statement in program.statements if statement.operator is Operator.SINCOS]
    kinds = {name: Kind.NUMBER for pair in pairs for name in pair} | dict.fromkeys(angles, Kind.ANGLE)
    # Constants have no kind, and a link of length 1 is not even one of them; but no number is larger than 1.
    sizes = exact_sizes(program, angles)
    kinds |= {name: Kind.LENGTH for name, size in sizes.items() if name not in kinds and size > _UNIT}
    open_ones = [name for statement in program.statements for name in statement.results if name not in kinds]
    _propagate(robot, program, kinds)
    for name in open_ones:
        if name not in kinds:
            kinds[name] = Kind.NUMBER  # the scale of numbers serves whatever is as small
            _propagate(robot, program, kinds)
    return kinds


def _angles(program: Program) -> frozenset[str]:
    found: set[str] = set()
    for statement in reversed(program.statements):
        if statement.operator is Operator.SINCOS or not found.isdisjoint(statement.results):
            found.update(operand.name for operand in statement.operands if isinstance(operand, Temporary))
    return frozenset(found)


def _check(robot: Robot, statement: Statement, angles: frozenset[str]) -> None:
    """Refuse a statement that mixes angles with lengths, or divides."""
    if statement.operator is Operator.DIV:
        raise refuse(robot, "a runtime parameter is in a divisor")
    if statement.operator in (Operator.SQRT, Operator.ATAN2, Operator.SELECT_LT):
        raise refuse(robot, "integers have no roots, arc tangents and selections")
    is_angle = statement.operator is Operator.SINCOS or not angles.isdisjoint(statement.results)
    for operand in statement.operands:
        if isinstance(operand, Temporary):
            if not is_angle and operand.name in angles:
                raise refuse(robot, "an angle sum is also in a length, and binary angles do not count turns")
        elif not isinstance(operand, Constant) and (input_kind(robot, operand) is Kind.ANGLE) != is_angle:
            raise _mixed(robot, operand)


def _mixed(robot: Robot, operand: Variable | RuntimeParameter) -> KinegenError:
    if isinstance(operand, RuntimeParameter):
        line = next(each.line for each in robot.runtime_parameters if each.name == operand.name)
        return refuse(robot, f"runtime parameter '{operand.name}' is in a length and in an angle", line)
    variable = robot.variables[operand.index]
    if variable.type is JointType.PRISMATIC:
        reason = f"an angle follows the shift of joint '{variable.name}', and integers have no scale for that"
    else:
        reason = f"a length follows the angle of joint '{variable.name}', and binary angles do not count turns"
    return refuse(robot, reason, variable.line)


def _propagate(robot: Robot, program: Program, kinds: dict[str, Kind]) -> None:
    """Carry kinds from inputs to results and from results to operands, until nothing is added."""

    def known(operand: Operand) -> Kind | None:
        if isinstance(operand, Temporary):
            return kinds.get(operand.name)
        return None if isinstance(operand, Constant) else input_kind(robot, operand)

    computed = [statement for statement in program.statements if statement.operator is not Operator.SINCOS]
    computed = [statement for statement in computed if kinds.get(statement.name) is not Kind.ANGLE]
    before = -1
    while len(kinds) > before:
        before = len(kinds)
        for operand, kind in zip(program.outputs, output_kinds(program), strict=True):
            if isinstance(operand, Temporary):
                kinds.setdefault(operand.name, kind)
        for statement in (*computed, *reversed(computed)):
            for name, kind in _conclusions(robot, statement, known):
                kinds.setdefault(name, kind)


def _conclusions(
    robot: Robot, statement: Statement, known: Callable[[Operand], Kind | None]
) -> Iterator[tuple[str, Kind]]:
    """Yield what the kinds known so far say about the result and the operands of one statement."""
    result = Temporary(statement.name)
    # Sums and negations: one known member decides all; a length is never a number.
    if statement.operator in _SAME_KIND:
        members = (result, *statement.operands)
        found = {known(member) for member in members}
        if found & {Kind.LENGTH, Kind.NUMBER}:
            kind = Kind.LENGTH if Kind.LENGTH in found else Kind.NUMBER
            yield from ((member.name, kind) for member in members if isinstance(member, Temporary))
        return
    # A product: length times number is a length, and two lengths have no scale.
    factors = [known(operand) for operand in statement.operands]
    if factors.count(Kind.LENGTH) == 2:
        raise refuse(robot, "runtime parameters multiply two lengths, and a square has no scale")
    if Kind.LENGTH in factors:
        yield result.name, Kind.LENGTH
    if factors.count(Kind.NUMBER) == 2 or known(result) is Kind.NUMBER:
        members = (result, *statement.operands)
        yield from ((member.name, Kind.NUMBER) for member in members if isinstance(member, Temporary))
    if known(result) is Kind.LENGTH and factors.count(Kind.NUMBER) == 1:
        yield from (
            (operand.name, Kind.LENGTH)
            for operand, factor in zip(statement.operands, factors, strict=True)
            if isinstance(operand, Temporary) and factor is None
        )
