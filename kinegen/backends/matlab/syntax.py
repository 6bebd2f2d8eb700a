"""Says how the body of a function is written in MATLAB, element by element: a column is a configuration.

Its element-wise operators round each result once and nothing is contracted: the same bits as C without contraction.
Arrays have columns first and configurations last: a matrix keeps its rows and columns; frames, tips and branches come
after them, so that `T(:, :, k, i)` is a matrix.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import partial
from types import MappingProxyType

from kinegen.backends.c.syntax import c_like, line_heading
from kinegen.backends.printing import Syntax
from kinegen.backends.scalar_types import ScalarType
from kinegen.ir.program import Constant, Operator
from kinegen.model.outputs import Array

CLASS = MappingProxyType({ScalarType.DOUBLE: "double", ScalarType.FLOAT: "single"})
"""The number types as MATLAB names them."""

WIDTH = 112
"""Characters of a line of a comment, without its mark."""


def number(real: ScalarType, text: str) -> str:
    """Returns a number of a type, from its literal in C; a plain literal is a double."""
    return text if real is ScalarType.DOUBLE else f"single({text.removesuffix('F')})"


def matlab_syntax(real: ScalarType) -> Syntax[Operator]:
    """Returns the syntax of MATLAB for one number type."""
    return c_like(
        "MATLAB",
        {
            Operator.MUL: "{0} .* {1}",
            Operator.DIV: "{0} ./ {1}",
            Operator.SQRT: "square_root({0})",
            Operator.ATAN2: f"arc_tangent_{CLASS[real]}({{0}}, {{1}})",
            Operator.SELECT_LT: "choose({0}, {1}, {2}, {3})",
        },
        literal=partial(_literal, real),
        define="{name} = {value};",
        sincos=partial(_pair, real),
        parameter=f"{CLASS[real]}(params.{{name}})",
        unused="~",
        heading=line_heading("%", WIDTH, matlab_text),
    )


def percent_comment(text: str) -> tuple[str, ...]:
    """Returns a comment of several lines."""
    return tuple(f"% {line}" for line in matlab_text(text).split("\n"))


def matlab_text(text: str) -> str:
    """Words about arrays as MATLAB writes these: indices in parentheses, from 1; columns of branches."""
    found = re.sub(r"\b(q|q0|actuators|joints)\[(\d+)\]", lambda place: f"{place[1]}({int(place[2]) + 1})", text)
    found = re.sub(r"\bq\[k\]", "q(k)", found).replace(", row by row", "")
    return found.replace("then its row is arbitrary. Valid rows", "then its column is arbitrary. Valid columns")


def _literal(real: ScalarType, constant: Constant) -> str:
    text = number(real, real.literal(constant.of(real is ScalarType.FLOAT)))
    return f"-{text.replace('(-', '(')}" if text.startswith("single(-") else text  # signs are in front


def _pair(real: ScalarType, sine: str, cosine: str, angle: str) -> tuple[str, ...]:
    return (f"[{sine}, {cosine}] = sincos_{CLASS[real]}({angle});",)


def axes(array: Array) -> tuple[int, ...]:
    """Returns the axes of an array of one configuration in the order that they have in MATLAB."""
    every = tuple(range(len(array.shape)))
    block, inner = (every[:1], every[1:]) if array.in_blocks else ((), every)
    return (*inner[-2:], *reversed(inner[:-2]), *block)


def extents(array: Array) -> tuple[int, ...]:
    """Its shape there, at least one number long; without configurations."""
    return tuple(array.shape[axis] for axis in axes(array)) or (1,)


def size(array: Array) -> int:
    """Returns numbers of one configuration, last rows of matrices among them."""
    return math.prod(extents(array))


def places(array: Array) -> tuple[int, ...]:
    """Returns the place of each number that is computed or read, in the order of a program; places count from 0."""
    return _laid_out(array, range(3))


def in_columns(array: Array, numbers: Sequence[Fraction]) -> tuple[Fraction, ...]:
    """Returns the numbers of one configuration in the order of memory in MATLAB, from the order of C."""
    in_memory = dict(zip(map(partial(_place, array), _indices(array)), numbers, strict=True))
    return tuple(in_memory[place] for place in range(len(in_memory)))


def last_rows(array: Array) -> tuple[tuple[int, int], ...]:
    """Returns the places of the last rows of matrices, and what they hold."""
    if not array.is_pose:
        return ()
    return tuple(zip(_laid_out(array, range(3, 4)), _cycle(array), strict=True))


def _cycle(array: Array) -> tuple[int, ...]:
    return (0, 0, 0, 1) * (math.prod(array.shape) // 16)


def _laid_out(array: Array, rows: range) -> tuple[int, ...]:
    """Returns places in the order of C, of matrices some rows alone."""
    wanted = (indices for indices in _indices(array) if not array.is_pose or indices[-2] in rows)
    return tuple(_place(array, indices) for indices in wanted)


def _indices(array: Array) -> Iterator[tuple[int, ...]]:
    """Yields the indices of one configuration in the order of C."""
    return itertools.product(*map(range, array.shape))


def _place(array: Array, indices: tuple[int, ...]) -> int:
    """Returns where a number lies there, the first axis running fastest."""
    place = 0
    for axis in reversed(axes(array)):
        place = place * array.shape[axis] + indices[axis]
    return place
