"""The stack that a call takes: what its header states, against what is written to and what compilers reserve."""

from __future__ import annotations

import re
import shutil
import subprocess
from functools import cache
from pathlib import Path

import pytest

from kinegen.backends.c.complete_inverse import STACK, emit_complete_inverse
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import lower_file
from kinegen.model.outputs import COMPLETE_INVERSE
from tests.builds.workshop import ROBOTS
from tests.emit.emitted import COMPILERS

LEVELS = ("-O1", "-O2", "-O3", "-Os")
RESERVING = tuple(name for name in ("gcc", "arm-none-eabi-gcc") if shutil.which(name))

PAINTED = r"""
#define _GNU_SOURCE
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "jaco2_complete_inverse.h"

enum { SIZE = 1 << 18 };
static double q[6], pose[16], jacobian[36], solutions[16][6];
static int found;

static void *solve(void *unused)
{
    for (int k = 0; k < 60; k++) {
        for (int i = 0; i < 6; i++) {
            q[i] = (k % 5) ? 6.0 * rand() / RAND_MAX - 3.0 : rand() % 8 * 0.78539816339744828;
        }
        jaco2_fk_jacobian(q, pose, jacobian);
        found += jaco2_complete_inverse(pose, solutions);
    }
    return unused;
}

static void *nothing(void *unused)
{
    return unused;
}

static long used(void *(*call)(void *))
{
    unsigned char *room = aligned_alloc(4096, SIZE);
    pthread_attr_t attributes;
    pthread_t thread;
    long first = 0;
    memset(room, 0x5A, SIZE);
    pthread_attr_init(&attributes);
    pthread_attr_setstack(&attributes, room, SIZE);
    pthread_create(&thread, &attributes, call, NULL);
    pthread_join(thread, NULL);
    while (room[first] == 0x5A) {
        first++;
    }
    return SIZE - first;
}

int main(void)
{
    const long idle = used(nothing);
    const long taken = used(solve) - idle;
    printf("%ld %d\n", taken, found);
    return 0;
}
"""


@cache
def c_files() -> dict[str, str]:
    """The C files of an arm."""
    kernels = lower_file(ROBOTS / "jaco2.yaml", (COMPLETE_INVERSE,))
    return {**emit_kernel(kernels, ScalarType.DOUBLE), **emit_complete_inverse(kernels)}


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("compiler", COMPILERS)
def test_no_call_writes_to_more_stack_than_is_stated(compiler: str, level: str, tmp_path: Path) -> None:
    (tmp_path / "painted.c").write_text(PAINTED, encoding="utf-8")
    names = ["painted.c", *sources(tmp_path)]
    flags = ["-std=gnu99", level, "-ffp-contract=off", "-pthread"]
    subprocess.run([compiler, *flags, *names, "-o", "painted"], cwd=tmp_path, check=True)
    done = subprocess.run(["./painted"], cwd=tmp_path, check=True, capture_output=True, text=True)
    taken, found = map(int, done.stdout.split())

    assert found > 60
    assert 0.8 * STACK < taken <= STACK


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("compiler", RESERVING)
def test_no_call_reserves_more_stack_than_is_stated(compiler: str, level: str, tmp_path: Path) -> None:
    """The frames of all functions along the deepest path of calls, as the compiler lists them."""
    frames: dict[str, int] = {}
    calls: dict[str, set[str]] = {}
    for name in sources(tmp_path):
        flags = ["-std=c99", level, "-ffp-contract=off", "-ffreestanding", "-fcallgraph-info=su"]
        subprocess.run([compiler, *flags, "-c", name, "-o", name.replace(".c", ".o")], cwd=tmp_path, check=True)
        text = (tmp_path / name.replace(".c", ".ci")).read_text(encoding="utf-8")
        # A static function has its file before its name.
        for title, taken in re.findall(r'node: \{ title: "(?:[^":]*:)?(\w+)" label: "[^"]*?(\d+) bytes', text):
            frames[title] = int(taken)
        for caller, called in re.findall(r'source\w+: "(?:[^":]*:)?(\w+)" targetname: "(?:[^":]*:)?(\w+)"', text):
            calls.setdefault(caller, set()).add(called)

    @cache
    def depth(function: str) -> int:
        return frames.get(function, 0) + max(map(depth, calls.get(function, ())), default=0)

    assert 0.8 * STACK < depth("jaco2_complete_inverse") <= STACK


def test_the_header_states_it() -> None:
    text = " ".join(c_files()["jaco2_complete_inverse.h"].replace("\n *", " ").split())

    assert f"a call takes at most {STACK} bytes of stack, with all that it calls" in text


def sources(folder: Path) -> list[str]:
    """The C files that a call takes, in a folder with their headers."""
    wanted = ("jaco2_complete_inverse.c", "jaco2.c")
    for name, text in c_files().items():
        if name.endswith(".h") or name in wanted:
            (folder / name).write_text(text, encoding="utf-8")
    return list(wanted)
