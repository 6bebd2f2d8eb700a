"""A mapping with the keys of a robot file as the text of one, so that it has the same reader and the same messages.

Numbers are written with the digits that Python shows: `0.4318` is 4318/10000. Fractions and decimals are exact.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from decimal import Decimal
from fractions import Fraction
from numbers import Integral, Real
from typing import Any

import yaml

from kinegen.errors import RobotFileError, quote

MAPPING = "<mapping>"
MOST_DEPTH = 20
"""Robot files nest less; a mapping that holds itself would nest for ever."""


def text_of(source: Mapping[str, object]) -> str:
    """The text of a robot file with the same content.

    Args:
        source: Keys and values of a robot file: mappings, sequences, text and numbers.

    Returns:
        YAML; rows of the table are on a line each.

    Raises:
        RobotFileError: If it holds anything else, or nests too deep.
    """
    plain = _plain(source, "", 0)
    return yaml.dump(
        plain, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=math.inf, default_flow_style=None
    )


class _Dumper(yaml.SafeDumper):
    def ignore_aliases(self, data: Any) -> bool:  # noqa: ARG002 - the signature of PyYAML
        """Write everything out; a list may occur twice."""
        return True


def _plain(value: object, where: str, depth: int) -> object:
    if depth > MOST_DEPTH:
        raise RobotFileError(f"{where or 'the mapping'} nests too deep", MAPPING)
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str):
                raise RobotFileError(f"the key {quote(repr(key))}{_of(where)} is not text", MAPPING)
        return {str(key): _plain(each, _under(where, key), depth + 1) for key, each in value.items()}
    if isinstance(value, bool | str):
        return value
    if isinstance(value, Sequence) and not isinstance(value, bytes | bytearray):
        return [_plain(each, f"{where}[{place}]", depth + 1) for place, each in enumerate(value)]
    if isinstance(value, Fraction | Decimal):
        return str(value)
    if isinstance(value, Integral):
        return int(value)
    if isinstance(value, Real):
        return float(value)
    if hasattr(value, "tolist"):  # an array of NumPy
        return _plain(value.tolist(), where, depth + 1)
    raise RobotFileError(f"{where} is {quote(repr(value))}, expected text, a number, a list or a mapping", MAPPING)


def _under(where: str, key: object) -> str:
    return f"{where}.{key}" if where else str(key)


def _of(where: str) -> str:
    return f" of {where}" if where else ""
