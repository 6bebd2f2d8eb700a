"""Entries of a robot file as text: exact expressions, their units, lines of YAML, actuators."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction

from kinegen.io.robot_file.keys import BARS
from kinegen.model.actuators import Coupling, Drive, Formula, FourBar, Triangle
from kinegen.model.expression_parser import (
    ZERO,
    Atan2,
    Call,
    Expression,
    Name,
    Number,
    Pi,
    Power,
    Product,
    Sum,
    add,
    multiply,
    names,
    negate,
    power,
    substitute,
    without_arcs,
)
from kinegen.model.expression_values import DEGREE, RADIAN, Dimension, checked_value
from kinegen.model.robot import JointType, Robot

_LONGEST_DECIMAL = 40
"""Digits of a decimal; what is longer is written as a fraction, or with an exponent."""


def spell(expression: Expression) -> str:
    """Write an expression, folded and flat as `parse` makes it, so that `parse` gives the same tree."""
    match expression:
        case Number(value):
            return spell_number(value)
        case Pi():
            return "pi"
        case Name(name):
            return name
        case Sum(terms):
            return spell(terms[0]) + "".join(_further(term) for term in terms[1:])
        case Product(factors):
            return _product(factors)
        case Power():
            return _product((expression,))
        case Call(function, argument):
            return f"{function}({spell(argument)})"
        case Atan2(y, x):
            return f"atan2({spell(y)}, {spell(x)})"


def spell_number(value: Fraction) -> str:
    """Return a number as a decimal where it has one, else as a fraction."""
    decimal = _decimal(value)
    return decimal if decimal is not None else f"{value.numerator}/{value.denominator}"


def _decimal(value: Fraction) -> str | None:
    """Return a number as a decimal, exactly; None where it has none, or only a long one."""
    rest, twos, fives = value.denominator, 0, 0
    while rest % 2 == 0:
        rest, twos = rest // 2, twos + 1
    while rest % 5 == 0:
        rest, fives = rest // 5, fives + 1
    places = max(twos, fives)
    if rest != 1:
        return None
    digits = str(abs(value.numerator) * 10**places // value.denominator)
    sign = "-" * (value < 0)
    if places > len(digits) + 4:
        return f"{sign}{digits}e-{places}" if len(digits) <= _LONGEST_DECIMAL and places <= 64 else None
    if len(digits) > _LONGEST_DECIMAL:
        return None
    digits = digits.rjust(places + 1, "0")
    return sign + (f"{digits[:-places]}.{digits[-places:]}" if places else digits)


def _further(term: Expression) -> str:
    """Return a term of a sum after the first, with its sign."""
    text = spell(term)
    # Minus before brackets would be carried into them; `-1*(a + b)` is kept as it is.
    return f" - {text[1:]}" if text.startswith("-") and not text.startswith("-1*(") else f" + {text}"


def _product(factors: tuple[Expression, ...]) -> str:
    """Write factors and divisors in their order, a number first."""
    number, rest = (factors[0].value, factors[1:]) if isinstance(factors[0], Number) else (Fraction(1), factors)
    divisor = ""
    # pi/2 and 2*pi/3 read better than 0.5*pi; the same for what has no decimal.
    if number.denominator != 1 and (_decimal(number) is None or (Pi() in rest and number.denominator <= 360)):
        number, divisor = Fraction(number.numerator), f"/{number.denominator}"
    text = ""
    if number != 1:
        text = "-" if number == -1 and _is_plain(rest[0]) else f"{spell_number(number)}*"
    for place, factor in enumerate(rest):
        if isinstance(factor, Power) and factor.exponent < 0:
            text = text[:-1] if text.endswith("*") else f"{text}1" if place == 0 else text
            text += f"/{_raised(factor.base, -factor.exponent)}"
        else:
            text += f"{'*' if place else ''}{_raised(factor, 1)}"
    return text + divisor


def _is_plain(factor: Expression) -> bool:
    """Tell whether a minus sign can stand before a factor."""
    return not isinstance(factor, Sum) and not (isinstance(factor, Power) and isinstance(factor.base, Sum))


def _raised(base: Expression, exponent: int) -> str:
    match base:
        case Power(inner, further):
            return _raised(inner, further * exponent)
        case Sum() | Product() | Number():
            text = f"({spell(base)})"
        case _:
            text = spell(base)
    return text if exponent == 1 else f"{text}**{exponent}"


def in_degrees(expression: Expression, dimension: Dimension, angles: frozenset[str]) -> Expression:
    """Write an expression in kernel units in degrees: what the reader makes of degrees, undone; a length is as it is.

    In a file in degrees `pi` is half a turn, so an angle that is a plain number of radians cannot be written there;
    then the expression that comes back does not read as the same one, and the writer takes radians.
    """
    if dimension is Dimension.LENGTH:
        return _waves(expression, angles)
    hidden, found = without_arcs(expression)
    terms = hidden.terms if isinstance(hidden, Sum) else (hidden,)
    scale = RADIAN if dimension is Dimension.ANGLE else multiply()
    counted = {name: multiply(DEGREE, Name(name)) for name in angles.union(found)}
    turned = add(*(_waves(_counted(multiply(scale, term), counted), angles) for term in terms))
    return substitute(turned, found)


def _counted(expression: Expression, counted: Mapping[str, Expression]) -> Expression:
    """Replace names outside of sine and cosine, which take angles of their own."""
    match expression:
        case Call("sin" | "cos", _):
            return expression
        case Sum(parts):
            return add(*(_counted(part, counted) for part in parts))
        case Product(parts):
            return multiply(*(_counted(part, counted) for part in parts))
        case Power(base, exponent):
            return power(_counted(base, counted), exponent)
        case Name(name):
            return counted.get(name, expression)
    return substitute(expression, counted) if names(expression) else expression


def _waves(expression: Expression, angles: frozenset[str]) -> Expression:
    """Convert what sine and cosine take."""
    match expression:
        case Call("sin" | "cos" as function, argument):
            return Call(function, in_degrees(argument, Dimension.ANGLE, angles))
        case Call(function, argument):
            return Call(function, _waves(argument, angles))
        case Sum(parts):
            return add(*(_waves(part, angles) for part in parts))
        case Product(parts):
            return multiply(*(_waves(part, angles) for part in parts))
        case Power(base, exponent):
            return power(_waves(base, angles), exponent)
    return expression


Cells = dict[str, str]
"""Keys with their texts, in order."""


def quoted(text: str) -> str:
    """Return a text for a place between braces: a comma would end it."""
    return f'"{text}"' if "," in text else text


def flow(cells: Mapping[str, str]) -> str:
    """Return an entry between braces."""
    return f"{{{', '.join(f'{key}: {text}' for key, text in cells.items())}}}"


def aligned(rows: Sequence[Cells], comments: Sequence[str]) -> list[str]:
    """Write the rows of a list with a comment each; those with the same keys in the same order have columns."""
    widths: dict[tuple[str, ...], list[int]] = {}
    for row in rows:
        found = widths.setdefault(_shape(row), [0] * len(_shape(row)))
        for place, key in enumerate(_shape(row)):
            found[place] = max(found[place], len(row[key]))
    lines = []
    for row, comment in zip(rows, comments, strict=True):
        known = dict(zip(_shape(row), widths[_shape(row)], strict=True))
        parts = [f"{key}: {text}" for key, text in row.items()]
        ends = [*[", "] * (len(parts) - 1), "}"]
        padded = [
            (part + end).ljust(len(key) + 2 + known.get(key, 0) + 2) if end == ", " else part + end
            for key, part, end in zip(row, parts, ends, strict=True)
        ]
        lines.append(f"  - {{{''.join(padded)}" + (f"  # {comment}" if comment else ""))
    return lines


def _shape(row: Cells) -> tuple[str, ...]:
    """Return the keys of a row that make columns: limits and steps are last and of any length."""
    return tuple(key for key in row if key not in ("limits", "ets"))


Spell = Callable[[Expression, Dimension], str]
"""Text of an expression in the units of the file, by what its place measures."""


def actuator_lines(robot: Robot, spell: Spell, *, degrees: bool) -> list[str]:
    """Write `actuators`, nothing where the robot has none; `spell` writes one expression."""
    actuators = robot.actuators
    if not actuators.readings:
        return []
    lines = ["actuators:", "  readings:"]
    for reading in actuators.readings:
        cells = {"dimension": str(reading.dimension)}
        if reading.limits:
            cells["limits"] = f"[{', '.join(spell(limit, reading.dimension) for limit in reading.limits)}]"
        lines.append(f"    {reading.name}: {flow(cells)}")
    writer = _Drives(robot, spell, degrees=degrees)
    lines += ["  joints:", *(f"    - {flow(writer.drive(drive))}" for drive in actuators.drives)]
    if actuators.inverse:
        lines.append("  inverse:")
        known = {reading.name: reading.dimension for reading in actuators.readings}
        lines += [f"    {name}: {spell(value, known[name])}" for name, value in actuators.inverse]
    return lines


class _Drives:
    """Writes entry by entry."""

    def __init__(self, robot: Robot, spell: Spell, *, degrees: bool) -> None:
        self.spell, self.degrees = spell, degrees
        self.values = {each.name: checked_value(each.value, {}) for each in robot.parameters}
        self.readings = {reading.name: reading.dimension for reading in robot.actuators.readings}
        self.slides = {each.name for each in robot.variables if each.type is JointType.PRISMATIC}

    def drive(self, drive: Drive) -> Cells:
        """Return the keys of one entry with their texts."""
        match drive:
            case Coupling():
                return self._coupling(drive)
            case Triangle():
                cells = {"joint": drive.joint, "form": "linear_actuator", "actuator": drive.actuator}
                cells["sides"] = f"[{', '.join(self.spell(side, Dimension.LENGTH) for side in drive.sides)}]"
                cells["length"] = self.spell(self._linear(drive.actuator, drive.length), Dimension.LENGTH)
                return cells | self._turned(drive)
            case FourBar():
                cells = {"joint": drive.joint, "form": "four_bar", "actuator": drive.actuator}
                cells |= {key: self.spell(bar, Dimension.LENGTH) for key, bar in zip(BARS, drive.bars, strict=True)}
                cells["angle"] = self.spell(self._linear(drive.actuator, drive.angle), Dimension.ANGLE)
                return cells | {"branch": "crossed" if drive.crossed else "open"} | self._turned(drive)
            case Formula():
                return {"joint": drive.joint, "value": self.spell(drive.value, self._dimension(drive.joint))}

    def _dimension(self, joint: str) -> Dimension:
        return Dimension.LENGTH if joint in self.slides else Dimension.ANGLE

    def _linear(self, reading: str, factors: tuple[Expression, Expression]) -> Expression:
        return add(multiply(factors[0], Name(reading)), factors[1])

    def _turned(self, drive: Triangle | FourBar) -> Cells:
        offset = {} if drive.offset == ZERO else {"offset": self.spell(drive.offset, Dimension.ANGLE)}
        return ({"sign": "-1"} if drive.sign < 0 else {}) | offset

    def _entry(self, joint: str, reading: str, entry: Expression) -> str:
        """Return an entry of a matrix; a bare number turns a joint by the unit of the file."""
        return self.spell(entry, Dimension.ANGLE if self._is_bare(joint, reading) else Dimension.LENGTH)

    def _is_bare(self, joint: str, reading: str) -> bool:
        return self._dimension(joint) is Dimension.ANGLE and self.readings[reading] is Dimension.NUMBER

    def _coupling(self, drive: Coupling) -> Cells:
        offsets = [
            self.spell(each, self._dimension(joint)) for joint, each in zip(drive.joints, drive.offsets, strict=True)
        ]
        if len(drive.joints) == 1:
            return self._gear(drive, offsets[0])
        lines = [
            f"[{', '.join(self._entry(joint, name, entry) for name, entry in zip(drive.actuators, row, strict=True))}]"
            for joint, row in zip(drive.joints, drive.matrix, strict=True)
        ]
        cells = {"joints": f"[{', '.join(drive.joints)}]", "form": "coupling"}
        cells |= {"actuators": f"[{', '.join(drive.actuators)}]", "matrix": f"[{', '.join(lines)}]"}
        return cells | ({"offsets": f"[{', '.join(offsets)}]"} if set(drive.offsets) != {ZERO} else {})

    def _gear(self, drive: Coupling, offset: str) -> Cells:
        """Return one joint of one reading: its ratio is positive, and may hold runtime parameters."""
        (joint,), (reading,), ((entry,),) = drive.joints, drive.actuators, drive.matrix
        if self.degrees and self._is_bare(joint, reading):
            entry = multiply(RADIAN, entry)
        turned = checked_value(entry, self.values) < 0
        ratio = power(negate(entry) if turned else entry, -1)
        cells = {"joint": joint, "form": "gear", "actuator": reading}
        cells |= {"ratio": self.spell(ratio, Dimension.LENGTH)} | ({"sign": "-1"} if turned else {})
        return cells | ({"offset": offset} if drive.offsets != (ZERO,) else {})
