"""The C loops that ratios are taken against: the floor, closed forms with libm, the plain product, bare memory.

Each is a complete C file with one function `loop(n, q, out)`; q is row-major (n, dof), and joint-major (dof, n) for the
floor. The floor and the memory loop say what the machine allows; the others are what people write by hand, the closed
form also as it is written for compilers that vectorise.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import count

import sympy as sp

from benchmarks.speed.arm import Arm
from kinegen.backends.c.batch import emit_batch
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.c.syntax import c_printer
from kinegen.backends.printing import CODE, Printer
from kinegen.backends.routines import SINCOS
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.templates import environment
from kinegen.ir.program import Operand, Operator, Program, Statement, Temporary

_CALL = re.compile(r"unused\(.*, &(?P<sine>\w+), &(?P<cosine>\w+)\);")


def kernel_text(arm: Arm, real: ScalarType) -> dict[str, str]:
    """The emitted scalar and batch kernels by file name."""
    return emit_kernel(arm.kernels, real) | emit_batch(arm.kernels, real)


def sincos_text(real: ScalarType) -> str:
    """The emitted sine-cosine pair, as `own_sincos`."""
    template = environment().get_template(SINCOS[real].template)
    return template.render(prefix="own", qualifier="static inline")


def sincos_operations(real: ScalarType) -> int:
    """Additions, subtractions and multiplications of one sine-cosine pair."""
    return len(CODE[real][Operator.SINCOS].statements)


def floor_text(arm: Arm, real: ScalarType) -> str:
    """The sine-cosine pairs that the pose needs, and their sum: the least that any kernel with this routine does."""
    printer = _printer(arm, real, "own_sincos", "q[{} * n + i]")
    before, angles = _angles(arm.program)
    lines = [f"const {real} {each.name} = {_operation(printer, each)};" for each in before]
    terms = []
    for number, angle in enumerate(angles):
        lines += [f"{real} s{number}_, c{number}_;", f"own_sincos({printer.operand(angle)}, &s{number}_, &c{number}_);"]
        terms += [f"s{number}_", f"c{number}_"]
    return _sum_loop(real, lines, terms)


def arithmetic_text(arm: Arm, real: ScalarType) -> str:
    """The whole computation of the pose, and the sum of its entries: the kernel without its transposes and stores."""
    printer = _printer(arm, real, "own_sincos", "q[{} * n + i]")
    lines = printer.lines(arm.program, [None] * len(arm.program.outputs))
    return _sum_loop(real, lines, [printer.operand(each) for each in arm.program.outputs])


def _printer(arm: Arm, real: ScalarType, sincos: str, variable: str) -> Printer[Operator]:
    variables = tuple(variable.format(index) for index in range(arm.program.signature.dof))
    return c_printer(real, sincos, variables, "own")


def _sum_loop(real: ScalarType, lines: Sequence[str], terms: Sequence[str]) -> str:
    body = "\n        ".join([*lines, f"out[i] = {' + '.join(terms)};"])
    return f"""#include <stddef.h>

{sincos_text(real)}
void loop(size_t n, const {real} *restrict q, {real} *restrict out)
{{
    for (size_t i = 0; i < n; i++) {{
        {body}
    }}
}}
"""


def closed_form_text(arm: Arm, real: ScalarType) -> str:
    """The same closed form as the kernels, one configuration after the other, with the sine and cosine of libm."""
    suffix = "f" if real is ScalarType.FLOAT else ""
    places = [f"t[{row}]" for row in range(12)]
    body = "\n    ".join(_printer(arm, real, "libm_sincos", "q[{}]").lines(arm.program, places))
    return f"""#include <math.h>
#include <stddef.h>

/* Written as people write it; gcc makes one call of the two. */
static inline void libm_sincos({real} x, {real} *s, {real} *c)
{{
    *s = sin{suffix}(x);
    *c = cos{suffix}(x);
}}

static inline void pose(const {real} *restrict q, {real} *restrict t)
{{
    {body}
}}
{_LOOP.format(real=real, dof=arm.dof)}"""


def tiled_text(arm: Arm, real: ScalarType) -> str:
    """The closed form as one vectorises it by hand: tiles of 64, with a loop for each thing that is done.

    Sines and cosines have a loop each, since gcc makes one call of both where they are in the same loop, and that call
    has no vector form; alone they become calls of libmvec.
    """
    suffix = "f" if real is ScalarType.FLOAT else ""
    before, angles = _angles(arm.program)
    gather = _printer(arm, real, "unused", f"q[{arm.dof} * j + {{}}]")
    sums = [f"const {real} {each.name} = {_operation(gather, each)};" for each in before]
    sums += [f"angle[{number}][j] = {gather.operand(angle)};" for number, angle in enumerate(angles)]
    lines = gather.lines(arm.program, [f"entry[{row}][j]" for row in range(12)])
    numbers = count()
    loaded = [_CALL.sub(lambda pair: _loaded(pair, next(numbers)), line) for line in lines]
    return _TILED.format(
        real=real,
        f=suffix,
        dof=arm.dof,
        count=len(angles),
        gather="\n        ".join(sums),
        arithmetic="\n        ".join(loaded),
        stores="\n        ".join(f"t[{row}] = entry[{row}][j];" for row in range(12)),
    )


def _loaded(pair: re.Match[str], number: int) -> str:
    """In place of a call for a sine and a cosine what was computed before."""
    return f"{pair['sine']} = sine[{number}][j];\n        {pair['cosine']} = cosine[{number}][j];"


def plain_text(arm: Arm, real: ScalarType) -> str:
    """Link matrices from a table, multiplied one after the other, as every first program does it."""
    suffix = "f" if real is ScalarType.FLOAT else ""
    rows = []
    for link in arm.links:
        numbers = (link.theta, sp.cos(link.alpha), sp.sin(link.alpha), link.a, link.d)
        rows.append("{" + ", ".join(f"{float(number)!r}{suffix}" for number in numbers) + f", {_joint(link.joint)}}}")
    form = _STANDARD if arm.links[0].standard else _MODIFIED
    return _PLAIN.format(real=real, f=suffix, count=len(rows), table=",\n    ".join(rows), form=form) + _LOOP.format(
        real=real, dof=arm.dof
    )


def memory_text(arm: Arm, real: ScalarType) -> str:
    """Reads every joint vector and writes every matrix, and computes nothing."""
    copies = "\n    ".join(f"t[{row}] = q[{row % arm.dof}];" for row in range(12))
    return f"""#include <stddef.h>

static inline void pose(const {real} *restrict q, {real} *restrict t)
{{
    {copies}
}}
{_LOOP.format(real=real, dof=arm.dof)}"""


def peak_text(real: ScalarType) -> str:
    """Products with additions in registers alone: 16 independent chains of 64 bytes, n rounds."""
    chains = range(16)
    start = "\n    ".join(f"vector v{k} = one * ({real}){k} + out[0];" for k in chains)
    step = "\n        ".join(f"v{k} = v{k} * a + b;" for k in chains)
    return f"""#include <stddef.h>

typedef {real} vector __attribute__((vector_size(64)));

void loop(size_t n, const {real} *restrict q, {real} *restrict out)
{{
    const vector one = (vector){{0}} + ({real})1;
    const vector a = one * q[0], b = one * q[1];
    {start}
    for (size_t i = 0; i < n; i++) {{
        {step}
    }}
    const vector sum = {" + ".join(f"v{k}" for k in chains)};
    out[0] = sum[0];
}}
"""


PEAK_OPERATIONS = {ScalarType.DOUBLE: 16 * 8 * 2, ScalarType.FLOAT: 16 * 16 * 2}
"""Operations of one round of the peak loop; a product with an addition counts as two."""


def operations(program: Program, real: ScalarType) -> int:
    """Additions and multiplications of one pose, those in the sines and cosines included."""
    _, angles = _angles(program)
    plain = (Operator.ADD, Operator.SUB, Operator.MUL)
    return sum(each.operator in plain for each in program.statements) + len(angles) * sincos_operations(real)


def floor_operations(program: Program, real: ScalarType) -> int:
    """The same of the sincos rate."""
    before, angles = _angles(program)
    return len(before) + len(angles) * (sincos_operations(real) + 2) - 1


def _angles(program: Program) -> tuple[list[Statement], list[Operand]]:
    """The angles whose sines and cosines are taken, and the statements that compute them."""
    angles = [each.operands[0] for each in program.statements if each.operator is Operator.SINCOS]
    needed = {angle.name for angle in angles if isinstance(angle, Temporary)}
    before: list[Statement] = []
    for each in reversed(program.statements):
        if not needed.isdisjoint(each.results):
            before.insert(0, each)
            needed |= {operand.name for operand in each.operands if isinstance(operand, Temporary)}
    return before, angles


def _operation(printer: Printer[Operator], statement: Statement) -> str:
    signs = {Operator.ADD: " + ", Operator.SUB: " - ", Operator.MUL: " * ", Operator.NEG: "-"}
    operands = [printer.operand(operand) for operand in statement.operands]
    sign = signs[statement.operator]
    return f"-{operands[0]}" if statement.operator is Operator.NEG else sign.join(operands)


def _joint(joint: int | None) -> str:
    return "-1" if joint is None else str(joint)


_LOOP = """
void loop(size_t n, const {real} *restrict q, {real} *restrict out)
{{
    for (size_t i = 0; i < n; i++) {{
        pose(q + {dof} * i, out + 16 * i);
        out[16 * i + 12] = 0;
        out[16 * i + 13] = 0;
        out[16 * i + 14] = 0;
        out[16 * i + 15] = 1;
    }}
}}
"""

_TILED = """#include <math.h>
#include <stddef.h>

enum {{ TILE = 64 }};

static inline void tile(size_t n, const {real} *restrict q, {real} *restrict out)
{{
    {real} angle[{count}][TILE], sine[{count}][TILE], cosine[{count}][TILE], entry[12][TILE];
    for (size_t j = 0; j < n; j++) {{
        {gather}
    }}
    for (int k = 0; k < {count}; k++) {{
        for (size_t j = 0; j < n; j++) {{
            sine[k][j] = sin{f}(angle[k][j]);
        }}
    }}
    for (int k = 0; k < {count}; k++) {{
        for (size_t j = 0; j < n; j++) {{
            cosine[k][j] = cos{f}(angle[k][j]);
        }}
    }}
    for (size_t j = 0; j < n; j++) {{
        {arithmetic}
    }}
    for (size_t j = 0; j < n; j++) {{
        {real} *const t = out + 16 * j;
        {stores}
        t[12] = 0;
        t[13] = 0;
        t[14] = 0;
        t[15] = 1;
    }}
}}

void loop(size_t n, const {real} *restrict q, {real} *restrict out)
{{
    size_t i = 0;
    for (; i + TILE <= n; i += TILE) {{
        tile(TILE, q + {dof} * i, out + 16 * i);
    }}
    tile(n - i, q + {dof} * i, out + 16 * i);
}}
"""

_STANDARD = """{{c, -s * r->ca, s * r->sa, r->a * c},
                             {s, c * r->ca, -c * r->sa, r->a * s},
                             {0, r->sa, r->ca, r->d},
                             {0, 0, 0, 1}}"""

_MODIFIED = """{{c, -s, 0, r->a},
                             {s * r->ca, c * r->ca, -r->sa, -r->sa * r->d},
                             {s * r->sa, c * r->sa, r->ca, r->ca * r->d},
                             {0, 0, 0, 1}}"""

_PLAIN = """#include <math.h>
#include <stddef.h>
#include <string.h>

typedef struct {{ {real} theta, ca, sa, a, d; int joint; }} row;

static const row table[{count}] = {{
    {table}
}};

static inline void multiply(const {real} left[4][4], const {real} right[4][4], {real} product[4][4])
{{
    for (int i = 0; i < 4; i++) {{
        for (int j = 0; j < 4; j++) {{
            {real} sum = 0;
            for (int k = 0; k < 4; k++) {{
                sum += left[i][k] * right[k][j];
            }}
            product[i][j] = sum;
        }}
    }}
}}

static inline void pose(const {real} *restrict q, {real} *restrict t)
{{
    {real} pose[4][4] = {{{{1, 0, 0, 0}}, {{0, 1, 0, 0}}, {{0, 0, 1, 0}}, {{0, 0, 0, 1}}}};
    for (int link = 0; link < {count}; link++) {{
        const row *const r = &table[link];
        const {real} theta = r->theta + ((r->joint < 0) ? 0 : q[r->joint]);
        const {real} c = cos{f}(theta), s = sin{f}(theta);
        const {real} matrix[4][4] = {form};
        {real} product[4][4];
        multiply(pose, matrix, product);
        memcpy(pose, product, sizeof pose);
    }}
    memcpy(t, pose, sizeof pose);
}}
"""
