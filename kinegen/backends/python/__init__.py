"""Python modules: they need NumPy, and call compiled kernels through cffi, or through ctypes where that is missing."""

from __future__ import annotations

from typing import TYPE_CHECKING

from kinegen.backends.language import Language, refuses_nothing
from kinegen.backends.scalar_types import ScalarType

if TYPE_CHECKING:
    from kinegen.backends.bundle import RobotPrograms
    from kinegen.backends.printing import Syntax
    from kinegen.ir.program import Operator


def _syntax(_real: str) -> Syntax[Operator]:
    from kinegen.backends.python.formula import SYNTAX

    return SYNTAX


def _files(kernels: RobotPrograms, _real: str) -> dict[str, str]:
    """Return the NumPy form, which takes both number types."""
    # Here, so that the list of languages is quick to read.
    from kinegen.backends.python.formula import emit_formula

    return emit_formula(kernels)


PYTHON = Language(
    name="python",
    title="Python",
    reals=tuple(ScalarType),
    syntax=_syntax,
    files=_files,
    refuses=refuses_nothing,
    tools=("python3",),
    install="Python with NumPy",
    is_extra=False,
)
