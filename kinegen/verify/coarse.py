"""A sine and cosine of a board for the integer kernels, as coarse as one chooses, in the macro that boards use."""

from __future__ import annotations

from pathlib import Path

from kinegen.naming import Q30, sincos_macro
from kinegen.robot.model import Robot

BOARD = "board_trig.h"

EXACT_BITS = 31
"""With so many bits both are rounded to nearest."""

WORST = """
#include <math.h>
#include <stdint.h>

/* As far off as is allowed, to one side or the other by a hash of the angle. */
static inline int32_t board_off(double exact, uint32_t angle, uint32_t bit)
{
    const uint32_t mixed = (angle ^ (angle >> 15)) * 2654435761u;
    const double step = ldexp(1.0, 30 - BITS);
    return (int32_t)floor(ldexp(exact, 30) + ((((mixed >> bit) & 1u) != 0u) ? step - 0.5 : 0.5 - step) + 0.5);
}

static inline void board_sincos(uint32_t angle, int32_t *s, int32_t *c)
{
    const double radians = (double)angle * 1.4629180792671596e-9;
    *s = board_off(sin(radians), angle, 31u);
    *c = board_off(cos(radians), angle, 30u);
}
"""
"""Sine and cosine that are off by 2^-BITS."""


def board_text(robot: Robot) -> str:
    """The header of a board with the pair above."""
    return f"{WORST}#define {sincos_macro(robot.name, Q30)}(angle, s, c) board_sincos((angle), (s), (c))\n"


def board_flags(folder: Path, bits: int) -> tuple[str, ...]:
    """Flags that put the pair in the place of the emitted one.

    Args:
        folder: Where the header is.
        bits: Sines and cosines are off by 2^-bits.
    """
    return "-include", str(folder / BOARD), f"-DBITS={bits}", "-lm"
