"""What Python 3.10 lacks: `StrEnum` and `assert_never`, as the standard library has them from 3.11 on."""

from __future__ import annotations

import sys

__all__ = ["StrEnum", "assert_never"]

if sys.version_info >= (3, 11):
    from enum import StrEnum
    from typing import assert_never
else:
    from enum import Enum
    from typing import NoReturn

    class StrEnum(str, Enum):
        """Words that are texts; `str` gives the word itself."""

        __str__ = str.__str__

        def __format__(self, format_spec: str) -> str:
            return str(self).__format__(format_spec)

    def assert_never(value: NoReturn) -> NoReturn:
        """Mark a place that is never reached; the type checker proves it."""
        raise AssertionError(f"expected code to be unreachable, but got: {value!r}")
