"""Values of expressions in a xacro file, their bounds, and the operators on them.

Plain data is an int, float, str, bool or None, or a list, tuple, dict or set of plain data, by exact type: nothing of
it has an attribute or a method that leads elsewhere. A `Function` and a namespace (a mapping that is not a `dict`
itself) are no data: an expression can call the one and take names out of the other.
"""

from __future__ import annotations

import ast
import operator
import re
import string
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NoReturn, TypeGuard

from kinegen.support.dataclass import dataclass

MAX_SIZE = 1_000_000
"""Values and characters in one value."""

MAX_STEPS = 200_000
"""Operations in one expression."""

_CHARACTERS_A_STEP = 16

MAX_BITS = 4096
MAX_DEPTH = 40
"""Lists within lists; more lines and dictionaries of one file are never nested."""

_SCALARS = (int, float, str, bool, type(None))
_COLLECTIONS = (list, tuple, dict, set)


class ExpressionError(Exception):
    """An expression does something wrong, or not allowed."""


@dataclass(frozen=True, slots=True)
class Function:
    """A function that an expression may call, on plain data.

    Attributes:
        call: Plain data in, plain data out; it bounds what it makes where that could be much more than it was given.
        takes_functions: Whether functions are among its arguments; they are `Function` then.
        takes_sets: Whether sets are passed on; every other function gets the sorted list.
        kind: The type that a function such as `str` stands for.
    """

    name: str
    call: Callable[..., Any]
    takes_functions: bool = False
    takes_sets: bool = False
    kind: type | None = None


def refuse(what: str) -> NoReturn:
    """Raise an error that names what an expression cannot have."""
    raise ExpressionError(f"{what} is not allowed in an expression")


def is_namespace(value: object) -> TypeGuard[Mapping[str, Any]]:
    """Tell whether a value is something that names are taken out of."""
    return type(value) is not dict and isinstance(value, Mapping)


def size(value: object) -> int:
    """Count values and characters in plain data, as often as it refers to them.

    Raises:
        ExpressionError: If it is not plain data, or too much of it.
    """
    total = 0
    level: list[Any] = [value]
    for _ in range(MAX_DEPTH):
        below: list[Any] = []
        for each in level:
            total += _own_size(each)
            if type(each) in _COLLECTIONS:
                below.extend(each)
                below.extend(each.values() if type(each) is dict else ())
            if total + len(below) > MAX_SIZE:
                raise ExpressionError("a value of an expression is too large")
        if not below:
            return total
        level = below
    raise ExpressionError("lists are nested too deeply in an expression")


def _own_size(value: object) -> int:
    kind = type(value)
    if kind is str:
        return 1 + len(value)  # type: ignore[arg-type]
    if kind is int and value.bit_length() > MAX_BITS:  # type: ignore[attr-defined]
        raise ExpressionError("an integer of an expression is too large")
    if kind not in _SCALARS and kind not in _COLLECTIONS:
        refuse(f"a value of type {kind.__name__[:40]}")
    return 1


def at_most(count: int) -> None:
    """Refuse what would make more than `MAX_SIZE` values or characters, before it is made."""
    if count > MAX_SIZE:
        raise ExpressionError("a value of an expression is too large")


def elements(value: object) -> list[Any]:
    """Return what a loop over plain data goes through; sets in sorted order, so that every run gives the same.

    Raises:
        ExpressionError: If there is nothing to go through.
    """
    if type(value) is set:
        return sorted(value, key=lambda each: (type(each).__name__, repr(each)))
    if type(value) in (str, list, tuple, dict):
        return list(value)  # type: ignore[call-overload, no-any-return]
    raise ExpressionError(f"a value of type {type(value).__name__} has no elements")


class Work:
    """The steps that one expression may still take; the size of all that it makes counts."""

    def __init__(self) -> None:
        self._left = MAX_STEPS

    def spend(self, steps: int) -> None:
        """Take steps. Raises `ExpressionError` if there are not so many left."""
        self._left -= steps
        if self._left < 0:
            raise ExpressionError("an expression takes too many steps")

    def made(self, value: Any) -> Any:
        """Count data that did not exist before, all of it; returns the data."""
        self.spend(size(value) // _CHARACTERS_A_STEP)
        return value

    def weigh(self, value: Any) -> None:
        """Count what goes through the whole of a value."""
        if type(value) is str or type(value) in _COLLECTIONS:
            self.spend(len(value) // _CHARACTERS_A_STEP)

    def passed_over(self, value: Any) -> list[Any]:
        """Count the elements of a value; returns them."""
        found = elements(value)
        self.weigh(found)
        return found


# Bounded repetitions: a long row of zeros that is no field in the end would be tried in every place.
_PERCENT = re.compile(r"%(?:\([^()]{0,80}\))?[#0\- +]{0,5}(\d{0,4})(?:\.(\d{0,4}))?[hlL]?[diouxXeEfFgGcrsa%]")
_SPECIFICATION = re.compile(r"(?:.?[<>=^])?[-+ ]?z?#?0?(\d*)[,_]?(?:\.(\d*))?[bcdeEfFgGosxX%]?", re.DOTALL)
_CONVERSIONS: dict[str | None, Callable[[Any], Any]] = {
    None: lambda value: value,
    "s": str,
    "r": repr,
    "a": ascii,
}
_WIDEST = 200
"""Characters that one number may be padded or rounded to."""


def multiply(left: Any, right: Any) -> Any:
    """Return a product, or a sequence repeated."""
    for sequence, count in ((left, right), (right, left)):
        if type(sequence) in (str, list, tuple) and isinstance(count, int):
            at_most(size(sequence) * max(count, 0))
    return left * right


def power(base: Any, exponent: Any) -> Any:
    """Return a power with a result that has a bounded number of digits."""
    both = isinstance(base, int) and isinstance(exponent, int)
    if both and abs(base) > 1 and base.bit_length() * exponent > MAX_BITS:
        raise ExpressionError("a power in an expression is too large")
    return base**exponent


def shift(number: Any, places: Any) -> Any:
    """Return a shift to the left."""
    if isinstance(places, int) and places > MAX_BITS:
        raise ExpressionError("a power in an expression is too large")
    return number << places


def modulo(left: Any, right: Any) -> Any:
    """Return a remainder, or values written in a text."""
    return _written(left, right) if type(left) is str else left % right


BINARY: Mapping[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: multiply,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: modulo,
    ast.Pow: power,
    ast.LShift: shift,
    ast.RShift: operator.rshift,
    ast.BitOr: operator.or_,
    ast.BitAnd: operator.and_,
    ast.BitXor: operator.xor,
}
UNARY: Mapping[type, Callable[[Any], Any]] = {
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
    ast.Not: operator.not_,
    ast.Invert: operator.invert,
}
COMPARISONS: Mapping[type, Callable[[Any, Any], Any]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Is: operator.is_,
    ast.IsNot: operator.is_not,
    ast.In: lambda left, right: left in right,
    ast.NotIn: lambda left, right: left not in right,
}


def _written(text: str, values: Any) -> str:
    fields = list(_PERCENT.finditer(text))
    # What is not a field as this pattern has it may take its width from the values.
    if "%" in _PERCENT.sub("", text):
        refuse("such a format after '%'")
    _check_widths(field.groups() for field in fields)
    at_most(size(text) + len(fields) * (_WIDEST + size(values)))
    return str(text % values)


def _check_widths(widths: Any) -> None:
    if any(int(number or 0) > _WIDEST for pair in widths for number in pair):
        refuse(f"a width of more than {_WIDEST} characters")


def formatted(value: Any, conversion: str | None, specification: str) -> str:
    """Write one value as a replacement field has it, with the letter after `!` and what follows the colon.

    Raises:
        ExpressionError: If a specification is not one of a number or a text.
    """
    found = _SPECIFICATION.fullmatch(specification)
    if found is None or conversion not in _CONVERSIONS:
        refuse(f"the format {specification[:20]!r}")
    _check_widths([found.groups()])
    return format(_CONVERSIONS[conversion](value), specification)


def filled(text: str, positional: Sequence[Any], named: Mapping[str, Any]) -> str:
    """Fill the replacement fields of a text in, as `str.format` does; a field is a name or a number alone.

    Raises:
        ExpressionError: If a field reaches into a value, or nests another one.
    """
    pieces, total, automatic = [], 0, 0
    for literal, field, specification, conversion in string.Formatter().parse(text):
        pieces.append(literal)
        if field is not None:
            if field and not (field.isascii() and field.isidentifier()) and not re.fullmatch(r"\d{1,4}", field):
                refuse(f"the field {{{field[:20]}}}")
            values: Any = named if field and not field.isdecimal() else positional
            key: Any = field if values is named else int(field or automatic)
            automatic += not field
            pieces.append(formatted(values[key], conversion, specification or ""))
        total += sum(map(len, pieces[-2:]))
        at_most(total)
    return "".join(pieces)
