"""C99 for firmware and for the compiled Python module."""

from __future__ import annotations

from typing import TYPE_CHECKING

from kinegen.emit.language import Language, refuses_nothing
from kinegen.emit.reals import Real
from kinegen.naming import C_WORDS, CPP_WORDS

if TYPE_CHECKING:
    from kinegen.emit.kernels import Kernels
    from kinegen.emit.printing import Syntax
    from kinegen.ir.program import Operator


def _syntax(real: str) -> Syntax[Operator]:
    from kinegen.emit.c.syntax import c_syntax

    return c_syntax(Real(real), "robot_sincos", "robot")


def _files(kernels: Kernels, real: str) -> dict[str, str]:
    # Here, so that the list of languages is quick to read.
    from kinegen.emit.c.batch import emit_batch
    from kinegen.emit.c.complete_inverse import emit_complete_inverse
    from kinegen.emit.c.inverse_tracker import emit_inverse_tracker
    from kinegen.emit.c.kernel import emit_kernel
    from kinegen.emit.c.numeric_inverse import emit_numeric_inverse
    from kinegen.emit.c.numeric_inverse_batch import emit_numeric_inverse_batch
    from kinegen.emit.c.redundancy_range import emit_redundancy_range

    files = emit_kernel(kernels, Real(real)) | emit_batch(kernels, Real(real))
    if kernels.numeric_inverse:
        files |= emit_numeric_inverse(kernels, Real(real)) | emit_numeric_inverse_batch(kernels, Real(real))
    if kernels.redundancy_range:
        files |= emit_redundancy_range(kernels, Real(real))
    if kernels.inverse_tracker:
        files |= emit_inverse_tracker(kernels, Real(real))
    has_complete = kernels.complete_inverse and Real(real) is Real.DOUBLE
    return files | (emit_complete_inverse(kernels) if has_complete else {})


C = Language(
    name="c",
    title="C",
    reals=tuple(Real),
    syntax=_syntax,
    files=_files,
    refuses=refuses_nothing,
    tools=("gcc", "clang", "cc"),
    install="a C compiler",
    reserved=C_WORDS | CPP_WORDS,
    is_extra=False,
)
