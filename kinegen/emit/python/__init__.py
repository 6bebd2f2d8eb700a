"""Python modules: they need NumPy, and call compiled kernels through cffi, or through ctypes where that is missing."""

from __future__ import annotations

from typing import TYPE_CHECKING

from kinegen.emit.language import Language, refuses_nothing
from kinegen.emit.reals import Real

if TYPE_CHECKING:
    from kinegen.emit.kernels import Kernels
    from kinegen.emit.printing import Syntax
    from kinegen.ir.program import Operator


def _syntax(_real: str) -> Syntax[Operator]:
    from kinegen.emit.python.syntax import SYNTAX

    return SYNTAX


def _files(kernels: Kernels, _real: str) -> dict[str, str]:
    """The NumPy form, which takes both number types."""
    # Here, so that the list of languages is quick to read.
    from kinegen.emit.python.formula import emit_formula

    return emit_formula(kernels)


PYTHON = Language(
    name="python",
    title="Python",
    reals=tuple(Real),
    syntax=_syntax,
    files=_files,
    refuses=refuses_nothing,
    tools=("python3",),
    install="Python with NumPy",
    is_extra=False,
)
