"""C99 for firmware and for the compiled Python module."""

from __future__ import annotations

from typing import TYPE_CHECKING

from kinegen.backends.language import Language, refuses_nothing
from kinegen.backends.scalar_types import ScalarType
from kinegen.support.naming import C_WORDS, CPP_WORDS

if TYPE_CHECKING:
    from kinegen.backends.bundle import RobotPrograms
    from kinegen.backends.printing import Syntax
    from kinegen.ir.program import Operator


def _syntax(real: str) -> Syntax[Operator]:
    from kinegen.backends.c.syntax import c_syntax

    return c_syntax(ScalarType(real), "robot_sincos", "robot")


def _files(kernels: RobotPrograms, real: str) -> dict[str, str]:
    # Here, so that the list of languages is quick to read.
    from kinegen.backends.c.batch import emit_batch
    from kinegen.backends.c.complete_inverse import emit_complete_inverse
    from kinegen.backends.c.inverse_tracker import emit_inverse_tracker
    from kinegen.backends.c.kernel import emit_kernel
    from kinegen.backends.c.numeric_inverse import emit_numeric_inverse
    from kinegen.backends.c.numeric_inverse_batch import emit_numeric_inverse_batch
    from kinegen.backends.c.redundancy_range import emit_redundancy_range

    files = emit_kernel(kernels, ScalarType(real)) | emit_batch(kernels, ScalarType(real))
    if kernels.numeric_inverse:
        files |= emit_numeric_inverse(kernels, ScalarType(real)) | emit_numeric_inverse_batch(kernels, ScalarType(real))
    if kernels.redundancy_range:
        files |= emit_redundancy_range(kernels, ScalarType(real))
    if kernels.inverse_tracker:
        files |= emit_inverse_tracker(kernels, ScalarType(real))
    has_complete = kernels.complete_inverse and ScalarType(real) is ScalarType.DOUBLE
    return files | (emit_complete_inverse(kernels) if has_complete else {})


C = Language(
    name="c",
    title="C",
    reals=tuple(ScalarType),
    syntax=_syntax,
    files=_files,
    refuses=refuses_nothing,
    tools=("gcc", "clang", "cc"),
    install="a C compiler",
    reserved=C_WORDS | CPP_WORDS,
    is_extra=False,
)
