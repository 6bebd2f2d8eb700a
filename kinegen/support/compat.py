"""What may be missing: names that Python 3.10 lacks, and libraries that come with an extra."""

from __future__ import annotations

import importlib
import sys
from types import ModuleType

from kinegen.errors import KinegenError

__all__ = ["StrEnum", "assert_never", "library"]

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


def library(module: str, purpose: str, extra: str = "workspace") -> ModuleType:
    """Import a library that may not be installed.

    Raises:
        KinegenError: If it is not installed; the message names its purpose here and the extra that installs it.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        name = module.partition(".")[0]
        raise KinegenError(
            f"{purpose} needs {name}, which is not installed (pip install 'kinegen[{extra}]')"
        ) from error
