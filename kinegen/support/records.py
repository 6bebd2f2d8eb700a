"""Frozen records as plain values for JSON, and back.

The types of a record's fields decide what is read, so a value of another shape is an error and never a wrong record.
"""

from __future__ import annotations

import dataclasses
import types
import typing
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Any, Literal, TypeVar

Record = TypeVar("Record")

_DEEPEST = 50


def to_plain(value: Any) -> Any:
    """Return records, enumerations, paths, collections and plain values in the values that JSON knows.

    Raises:
        TypeError: For anything else.
    """
    if isinstance(value, Enum):
        return value.value
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, tuple | list):
        return [to_plain(item) for item in value]
    if isinstance(value, dict):
        return [[to_plain(key), to_plain(item)] for key, item in value.items()]
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: to_plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    raise TypeError(f"a {type(value).__name__} has no plain form")


def from_plain(kind: type[Record], value: Any) -> Record:
    """Return what `to_plain` was given, by its type.

    Raises:
        ValueError: If the plain values are not those of such a record.
    """
    return typing.cast(Record, _read(kind, value, 0))


def _read(kind: Any, value: Any, depth: int) -> Any:
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    _expect(depth <= _DEEPEST, kind, value)
    if origin in (typing.Union, types.UnionType):
        return _read_union(inner, value, depth)
    if origin is Literal:
        _expect(value in inner, kind, value)
        return value
    if origin is tuple:
        return _read_tuple(inner, value, depth)
    # JSON has texts alone for keys, so mappings are lists of pairs.
    if origin is dict:
        _expect(
            isinstance(value, list) and all(isinstance(pair, list) and len(pair) == 2 for pair in value), kind, value
        )
        return {_read(inner[0], key, depth + 1): _read(inner[1], item, depth + 1) for key, item in value}
    if kind is Path:
        return Path(_read(str, value, depth))
    # An integer is a float in JSON, but True is neither.
    if kind is float:
        _expect(type(value) in (int, float), kind, value)
        return float(value)
    if kind in (bool, int, str, type(None)):
        _expect(type(value) is kind, kind, value)
        return value
    if isinstance(kind, type) and issubclass(kind, Enum):
        return kind(value)  # a ValueError by itself
    _expect(dataclasses.is_dataclass(kind) and isinstance(value, dict), kind, value)
    # A record has its fields, each of its type, and nothing else.
    fields = _fields(kind)
    _expect(value.keys() == fields.keys(), kind, value)
    return kind(**{name: _read(field, value[name], depth + 1) for name, field in fields.items()})


def _read_union(kinds: tuple[Any, ...], value: Any, depth: int) -> Any:
    for kind in kinds:
        try:
            return _read(kind, value, depth + 1)
        except ValueError:
            continue
    raise ValueError(f"{str(value)[:60]!r} is none of {kinds}")


def _read_tuple(kinds: tuple[Any, ...], value: Any, depth: int) -> tuple[Any, ...]:
    _expect(isinstance(value, list), kinds, value)
    if len(kinds) == 2 and kinds[1] is Ellipsis:
        return tuple(_read(kinds[0], item, depth + 1) for item in value)
    _expect(len(value) == len(kinds), kinds, value)
    return tuple(_read(kind, item, depth + 1) for kind, item in zip(kinds, value, strict=True))


@cache
def _fields(kind: Any) -> dict[str, Any]:
    hints = typing.get_type_hints(kind)
    return {field.name: hints[field.name] for field in dataclasses.fields(kind)}


def _expect(holds: bool, kind: object, value: object) -> None:
    if not holds:
        raise ValueError(f"{str(value)[:60]!r} is not a {kind}")
