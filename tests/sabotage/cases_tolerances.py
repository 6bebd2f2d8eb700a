"""Errors a few times what is proven of a kernel, which only accepted errors that follow the bound see."""

from __future__ import annotations

from tests.sabotage.case import Sabotage

_CASES = (
    ("a length 5e-14 off", "puma560.c", r"PUMA560_A2_D4 ", "0.43180000000005 ", "void puma560_fk(", "double"),
    ("a length 5e-14 off in the batch", "puma560_batch.c", r"0\.4318 ", "0.43180000000005 ", "puma560_fk_tile(", "double"),
    ("a length 1e-6 off, float", "puma560_f32.c", r"PUMA560_F32_A2_D4", "0.431801F", "void puma560_f32_fk(", "float"),
    ("a length 1e-6 off in the batch, float", "puma560_f32_batch.c", r"0\.4318F", "0.431801F", "puma560_f32_fk_tile(", "float"),
    ("a length 5e-7 off, float", "puma560_f32.c", r"PUMA560_F32_A2_D4", "0.4318005F", "void puma560_f32_fk(", "float"),
)  # fmt: skip

CASES = tuple(
    Sabotage(f"tolerances: {name}", "puma560", "pose", file, old, new, real=real, after=after)
    for name, file, old, new, after, real in _CASES
)
