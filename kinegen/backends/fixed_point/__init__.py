"""C99 in integers, for processors without an FPU: the kernels of `ir.fixed`, their test vectors and self-test."""

from __future__ import annotations

from typing import TYPE_CHECKING

from kinegen.backends.language import Language
from kinegen.model.outputs import Quantity
from kinegen.support.naming import C_WORDS, CPP_WORDS, Q30

if TYPE_CHECKING:
    from kinegen.backends.bundle import RobotPrograms
    from kinegen.backends.printing import Syntax
    from kinegen.ir.fixed_point.program import Operation


def _syntax(_real: str) -> Syntax[Operation]:
    from kinegen.backends.fixed_point.syntax import fixed_syntax

    return fixed_syntax("robot_q30", "robot_q30_sincos")


def _files(kernels: RobotPrograms, _real: str) -> dict[str, str]:
    # Here, so that the list of languages is quick to read.
    from kinegen.backends.fixed_point.files import emit_fixed
    from kinegen.backends.fixed_point.kernels import fixed_kernels

    return emit_fixed(fixed_kernels(kernels))


def _refuses(quantity: Quantity) -> str:
    from kinegen.ir.fixed_point.value_classes import refusal

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
