"""C99 in integers, for processors without an FPU: the kernels of `ir.fixed`, their test vectors and self-test."""

from __future__ import annotations

from typing import TYPE_CHECKING

from kinegen.emit.language import Language
from kinegen.naming import C_WORDS, CPP_WORDS, Q30
from kinegen.outputs import Quantity

if TYPE_CHECKING:
    from kinegen.emit.kernels import Kernels
    from kinegen.emit.printing import Syntax
    from kinegen.ir.fixed.program import Operation


def _syntax(_real: str) -> Syntax[Operation]:
    from kinegen.emit.fixed.syntax import fixed_syntax

    return fixed_syntax("robot_q30", "robot_q30_sincos")


def _files(kernels: Kernels, _real: str) -> dict[str, str]:
    # Here, so that the list of languages is quick to read.
    from kinegen.emit.fixed.kernel import emit_fixed
    from kinegen.emit.fixed.kernels import fixed_kernels

    return emit_fixed(fixed_kernels(kernels))


def _refuses(quantity: Quantity) -> str:
    from kinegen.ir.fixed.kinds import refusal

    return refusal(quantity)


INTEGERS = Language(
    name=Q30,
    title="C in integers",
    reals=(Q30,),
    syntax=_syntax,
    files=_files,
    refuses=_refuses,
    tools=("gcc", "clang", "cc"),
    install="a C compiler",
    reserved=C_WORDS | CPP_WORDS,
    is_extra=False,
)
