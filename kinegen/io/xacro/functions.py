"""The functions and methods that an expression may call, as xacro documents them, on plain data alone.

What xacro has beside these (`type`, `vars`, `complex`, `hash`, `slice`) is of no use for a robot. Iterators are lists
here. Methods do not change what they are called on, so that no value contains itself.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from typing import Any

from kinegen.io.xacro.values import (
    MAX_BITS,
    ExpressionError,
    Function,
    at_most,
    elements,
    filled,
    multiply,
    refuse,
    size,
)

_MATH = (
    "acos acosh asin asinh atan atan2 atanh cbrt ceil copysign cos cosh degrees dist e erf erfc exp exp2 expm1 fabs "
    "floor fma fmod frexp fsum gamma gcd hypot inf isclose isfinite isinf isnan isqrt lcm ldexp lgamma log log10 log1p "
    "log2 modf nan nextafter pi pow radians remainder sin sinh sqrt sumprod tan tanh tau trunc ulp"
)
_TOO_LARGE = 500
"""Factorials of larger numbers have more than `MAX_BITS`."""


def _factorial(number: Any) -> Any:
    return math.factorial(number) if number <= _TOO_LARGE else refuse("so large a factorial")


def _chosen(name: str) -> Callable[..., Any]:
    def call(count: Any, taken: Any = None) -> Any:
        if max(count, taken or 0) > _TOO_LARGE:
            refuse("so large a factorial")
        return getattr(math, name)(count, *(() if taken is None else (taken,)))

    return call


def _product(values: Any, *, start: Any = 1) -> Any:
    for each in elements(values):
        start = multiply(start, each)
        size(start)
    return start


def _sum(values: Any, start: Any = 0) -> Any:
    for each in elements(values):
        # Not in place: the start is a value of the file.
        start = start + each
        at_most(len(start) if type(start) in (str, list, tuple) else 0)
    return start


def _range(*bounds: Any) -> list[int]:
    found = range(*bounds)
    # The length of a range does not fit into a C integer where this difference does not.
    at_most(abs(found.stop - found.start) // abs(found.step))
    return list(found)


def _rounded(number: Any, digits: Any = None) -> Any:
    if digits is not None and abs(digits) > MAX_BITS:
        refuse("rounding to so many digits")
    return round(number) if digits is None else round(number, digits)


def _mapped(function: Function, *lists: Any) -> list[Any]:
    call = _called(function)
    return [call(*values) for values in zip(*map(elements, lists), strict=False)]


def _filtered(function: Function | None, values: Any) -> list[Any]:
    call = bool if function is None else _called(function)
    return [each for each in elements(values) if call(each)]


def _called(function: Any) -> Callable[..., Any]:
    """Return what a function is called with by another one; all results together are bounded."""
    if not isinstance(function, Function) or function.takes_functions:
        raise ExpressionError("a function is needed here")
    total = 0

    def call(*values: Any) -> Any:
        nonlocal total
        found = function.call(*values)
        total += size(found)
        at_most(total)
        return found

    return call


def _by_key(call: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function such as `max` that takes another one as `key`."""

    def keyed(*values: Any, key: Any = None, **named: Any) -> Any:
        if any(isinstance(each, Function) for each in (*values, *named.values())):
            raise ExpressionError("a function is not a value")
        return call(*values, key=None if key is None else _called(key), **named)

    return keyed


def _is_instance(value: Any, *kinds: Any) -> bool:
    if not kinds or not all(isinstance(kind, Function) and kind.kind for kind in kinds):
        raise ExpressionError("isinstance takes a value and a type such as str")
    return isinstance(value, tuple(kind.kind for kind in kinds))


def _integer(value: Any = 0, *base: Any) -> int:
    if type(value) is str:
        at_most(len(value) * 100)
    return int(value, *base)


_PYTHON: Mapping[str, Callable[..., Any]] = {
    "abs": abs,
    "all": all,
    "any": any,
    "divmod": divmod,
    "enumerate": lambda values, start=0: list(enumerate(elements(values), start)),
    "len": len,
    "ord": ord,
    "range": _range,
    "reversed": lambda values: elements(values)[::-1],
    "round": _rounded,
    "sum": _sum,
    "zip": lambda *lists, **named: list(zip(*map(elements, lists), **named)),
}
_TYPES: Mapping[str, type] = {
    "bool": bool,
    "dict": dict,
    "float": float,
    "list": list,
    "str": str,
    "tuple": tuple,
    "set": set,
}


def python() -> dict[str, Function]:
    """Return the builtin functions that an expression may call, by name."""
    found = {name: Function(name, call) for name, call in _PYTHON.items()}
    for name, kind in _TYPES.items():
        found[name] = Function(name, kind, takes_sets=name in ("bool", "set", "str"), kind=kind)
    found["int"] = Function("int", _integer, kind=int)
    found["len"] = Function("len", len, takes_sets=True)
    found["repr"] = Function("repr", repr, takes_sets=True)
    found["frozenset"] = Function("frozenset", set, takes_sets=True, kind=set)
    found["map"] = Function("map", _mapped, takes_functions=True)
    found["filter"] = Function("filter", _filtered, takes_functions=True)
    found["isinstance"] = Function("isinstance", _is_instance, takes_functions=True, takes_sets=True)
    choosing: Mapping[str, Callable[..., Any]] = {"max": max, "min": min, "sorted": sorted}
    for name, call in choosing.items():
        found[name] = Function(name, _by_key(call), takes_functions=True)
    return found


def mathematics() -> dict[str, Any]:
    """Functions and constants of `math`, by name; those that this Python does not have are missing."""
    known = {name: getattr(math, name) for name in _MATH.split() if hasattr(math, name)}
    own = {"factorial": _factorial, "comb": _chosen("comb"), "perm": _chosen("perm"), "prod": _product}
    return {name: Function(name, each) if callable(each) else each for name, each in (known | own).items()}


def _joined(text: str, parts: Any) -> str:
    found = elements(parts)
    at_most(sum(map(len, found)) + len(text) * len(found))
    return text.join(found)


def _replaced(text: str, old: str, new: str, count: int = -1) -> str:
    at_most(len(text) + text.count(old) * len(new))
    return text.replace(old, new, count)


def _padded(name: str) -> Callable[..., Any]:
    def call(text: str, width: int, *fill: str) -> Any:
        at_most(width)
        return getattr(text, name)(width, *fill)

    return call


def _expanded(text: str, tabsize: int = 8) -> str:
    at_most(len(text) * max(tabsize, 1))
    return text.expandtabs(tabsize)


_PLAIN_METHODS = (
    "capitalize casefold count endswith find index isalnum isalpha isascii isdecimal isdigit isidentifier islower "
    "isnumeric isprintable isspace istitle isupper lower lstrip partition removeprefix removesuffix rfind rindex "
    "rpartition rsplit rstrip split splitlines startswith strip swapcase title upper"
)
_OF_SETS = "difference intersection isdisjoint issubset issuperset symmetric_difference union"

METHODS: Mapping[type, Mapping[str, Callable[..., Any]]] = {
    str: {
        **{name: getattr(str, name) for name in _PLAIN_METHODS.split()},
        **{name: _padded(name) for name in ("center", "ljust", "rjust", "zfill")},
        "expandtabs": _expanded,
        "format": lambda text, *values, **named: filled(text, values, named),
        "format_map": lambda text, named: filled(text, (), named),
        "join": _joined,
        "replace": _replaced,
    },
    list: {"copy": list.copy, "count": list.count, "index": list.index},
    tuple: {"count": tuple.count, "index": tuple.index},
    dict: {
        "copy": dict.copy,
        "get": dict.get,
        "items": lambda table: list(table.items()),
        "keys": list,
        "values": lambda table: list(table.values()),
    },
    set: {"copy": set.copy, **{name: getattr(set, name) for name in _OF_SETS.split()}},
    int: {"bit_length": int.bit_length},
    float: {"is_integer": float.is_integer},
}
"""Methods of plain data, by type and name; none of them changes it."""

_SEPARATORS = re.compile(r"(?:[^\]\[\\^]|\\[stnrfvdw\\^\]\[-])+")


def tokenized(text: str, sep: str = ",; ", skip_empty: Any = True) -> list[str]:
    """Divide a text as `xacro.tokenize` does; ranges and classes of regular expressions count in `sep`."""
    if not _SEPARATORS.fullmatch(sep):
        refuse(f"the separator {sep[:20]!r}")
    return [part for part in re.split(f"[{sep}]", text) if part or not skip_empty]
