"""The kernels touch the memory they are given and nothing else: a driver under the address and undefined sanitizers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from kinegen.emit.reals import Real
from kinegen.naming import prefix
from kinegen.outputs import Quantity
from tests.emit.emitted import COMPILERS, kernels, run, tile

FLAGS = (
    "-std=c99 -Wall -Wextra -Werror -O0 -g -ffp-contract=off -fsanitize=address,undefined,float-cast-overflow "
    "-fno-sanitize-recover=all"
).split()
CASES = [(arm, real) for arm in ("puma560", "calibrated_2r", "blocks", "cartesian") for real in Real]
CASES.append(("hand", Real.DOUBLE))  # several tips; it compiles long

HEAD = """
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const int counts[] = {{0, 1, {tile} - 1, {tile}, 2 * {tile} + 1}};
"""

CHECK = """
static void check_{name}(int n, ptrdiff_t gap, int joint_major, int backwards, int layout)
{{
    /* Arrays of exactly the length that is needed; nothing is read of no joints. */
    const ptrdiff_t pose = joint_major ? 1 : {dof} + gap;
    const ptrdiff_t joint = joint_major ? n + gap : 1;
    const size_t inputs = ({dof} == 0 || n == 0) ? 0 : (size_t)((n - 1) * pose + ({dof} - 1) * joint + 1);
    const int entries = (layout == 0) ? {numbers} * {stored} / {entries} : {numbers};
    const ptrdiff_t stride = ((layout == 2) ? n : entries) + gap;
    const size_t outputs = (n == 0) ? 0 : (size_t)(((layout == 2) ? entries - 1 : n - 1) * stride
        + ((layout == 2) ? n : entries));
    {real} *const q = ({dof} == 0) ? NULL : malloc(inputs * sizeof(*q) + (inputs == 0));
    {real} *const out = malloc(outputs * sizeof(*out) + (outputs == 0));
    {real} single[{dof} + 1];
    {real} expected{extents};
    for (size_t i = 0; i < inputs; i++) {{
        q[i] = ({real})((int)(i * 37u % 101u) - 50) / 16;
    }}
    const {real} *const first = (backwards && inputs > 0) ? q + (n - 1) * pose : q;
    {function}_batch((size_t)n, first, backwards ? -pose : pose, joint, {params}out, stride, layout);
    for (int i = 0; i < n; i++) {{
        for (int j = 0; j < {dof}; j++) {{
            single[j] = first[i * (backwards ? -pose : pose) + j * joint];
        }}
        (void)single;
        {function}({q}{params}expected);
        for (int number = 0; number < {numbers}; number++) {{
            const int frame = number / {entries};
            const int entry = number % {entries};
            const {real} want = (({real} *)expected)[frame * {stored} + entry];
            const ptrdiff_t place = (layout == 2) ? number * stride + i
                : i * stride + frame * (entries / {frames}) + entry;
            if (memcmp(&want, &out[place], sizeof(want)) != 0) {{
                (void)printf("{function} n=%d layout=%d gap=%d: number %d of configuration %d\\n", n, layout, (int)gap,
                    number, i);
                exit(1);
            }}
        }}
    }}
    free(q);
    free(out);
}}
"""

MAIN = """
int main(void)
{{
    for (size_t c = 0; c < sizeof(counts) / sizeof(counts[0]); c++) {{
        for (int layout = 0; layout < 3; layout++) {{
            for (int way = 0; way < 8; way++) {{
{calls}
            }}
        }}
    }}
    (void)printf("clean\\n");
    return 0;
}}
"""


def driver(name: str, real: Real) -> str:
    """A program that calls every kernel of a robot in every way."""
    stem, dof = prefix(name, real), kernels(name).robot.dof
    parts, calls = [f'#include "{stem}_batch.h"\n', HEAD.format(tile=tile(name, real))], []
    for program in kernels(name).programs:
        quantity, frames = program.quantity, len(program.frames)
        several = quantity == Quantity.FRAMES or kernels(name).robot.is_tree
        stored = 16 if quantity.is_pose else 3
        parts.append(
            CHECK.format(
                name=quantity.function,
                function=f"{stem}_{quantity.function}",
                real=real,
                dof=dof,
                frames=frames,
                numbers=len(program.outputs),
                entries=len(program.outputs) // frames,
                stored=stored,
                extents=f"[{frames}][{stored}]" if several else f"[{stored}]",
                q="single, " if dof else "",
                params=f"&{stem}_default_params, " if program.parameters else "",
            )
        )
        check = f"check_{quantity.function}(counts[c], (way & 1) * 3, (way & 2) != 0, (way & 4) != 0, layout);"
        # Points have no last row to leave out.
        calls.append(f"                {check}" if quantity.is_pose else f"                if (layout != 1) {check}")
    return "".join([*parts, MAIN.format(calls="\n".join(calls))])


@pytest.mark.skipif("gcc" not in COMPILERS, reason="needs gcc")
@pytest.mark.parametrize(("arm", "real"), CASES)
def test_no_kernel_touches_what_it_was_not_given(
    arm: str, real: Real, folder_of: Callable[[str], Path], tmp_path: Path
) -> None:
    """No configuration, one, and around a whole tile; gaps, any order of the joint values, every layout."""
    folder, stem = folder_of(arm), prefix(arm, real)
    (tmp_path / "driver.c").write_text(driver(arm, real), encoding="utf-8")
    files = [tmp_path / "driver.c", folder / f"{stem}.c", folder / f"{stem}_batch.c"]
    run(["gcc", *FLAGS, f"-I{folder}", *files, "-o", tmp_path / "driver"])

    assert run([tmp_path / "driver"]) == "clean\n"
