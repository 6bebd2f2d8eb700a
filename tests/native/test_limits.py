"""At the limits: angles out of range, data larger than memory, the interpreter lock, forks, the end of a process."""

from __future__ import annotations

import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from tests.native.arrays import Array, bits

Loader = Callable[[str, str], ModuleType]

BAD = {17: (0, np.nan), 1_234: (2, np.inf), 4_096: (2, -np.inf), 4_999: (1, 1.001e5)}
"""The configuration, a joint that moves the tip, and its value: out of the range of doubles, and so of floats."""


def spoilt(dtype: str) -> tuple[Array, Array]:
    """Configurations, and the same with a few bad ones among them."""
    q = np.random.default_rng(11).uniform(-4, 4, (5_000, 6)).astype(dtype)
    changed = q.copy()
    for pose, (joint, value) in BAD.items():
        changed[pose, joint] = value
    return q, changed


@pytest.mark.parametrize("dtype", ["f8", "f4"])
@pytest.mark.parametrize("output", ["fk", "frames", "position"])
@pytest.mark.parametrize("flags", ["default", "reproducible", "numpy"])
def test_what_is_no_angle_gives_nan_in_its_own_pose(robot: Loader, flags: str, output: str, dtype: str) -> None:
    """The same entries are NaN in every target; an entry that does not depend on the angle stays as it is."""
    kernel = getattr(robot("puma560", flags), output)
    numpy_form = getattr(robot("puma560", "numpy"), output)
    q, changed = spoilt(dtype)
    good = np.delete(np.arange(len(q)), list(BAD))

    clean, found, expected = kernel(q), kernel(changed), numpy_form(changed)

    np.testing.assert_array_equal(bits(found[good]), bits(clean[good]))
    np.testing.assert_array_equal(np.isnan(found), np.isnan(expected))
    assert not np.isinf(found).any()
    for pose in BAD:
        stays = ~np.isnan(found[pose])
        assert not stays.all()
        np.testing.assert_array_equal(found[pose][stays], clean[pose][stays])
        np.testing.assert_array_equal(np.isnan(kernel(changed[pose])), ~stays)
    joint_major = kernel(np.ascontiguousarray(changed.T), layout="joint_major")
    assert np.flatnonzero(np.isnan(joint_major).any(axis=0)).tolist() == list(BAD)


@pytest.mark.parametrize("value", [1.0, np.nan, 1e300, -1e300])
def test_a_bad_angle_raises_no_warning(robot: Loader, value: float) -> None:
    """Neither here nor in a thread, whatever the user has set."""
    for flags in ("default", "numpy"):
        kernel = robot("puma560", flags).fk
        q = np.full((20_000, 6), value)
        with np.errstate(all="raise"):
            result = kernel(q, threads=2)
            kernel(q[0])

            assert np.geterr()["invalid"] == "raise"
        assert np.isnan(result).any() == (value != 1.0)


# Memory ---------------------------------------------------------------------------------------------------------------

STREAM = """
import resource, sys
import numpy as np
sys.path.insert(0, sys.argv[1])
import puma560
count, dtype, layout, threads = 700_000, sys.argv[3], sys.argv[4], 2
shape, result = ((count, 6), (count, 4, 4)) if layout == "4x4" else ((6, count), (12, count))
q = np.memmap(sys.argv[2] + "/q", dtype, "w+", shape=shape)
q[..., ::1000] = 1
out = np.memmap(sys.argv[2] + "/out", "f8", "w+", shape=result)
puma560.fk(np.zeros((20_000, 6)), threads=threads)  # the threads are there from now on
used = int(open("/proc/self/statm").read().split()[5]) * resource.getpagesize()
limit = used + (24 << 20)
resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))
try:
    np.ones(4 << 20)
except MemoryError:
    print("limited")
puma560.fk(q, out=out, threads=threads, layout=layout)
last = puma560.fk(np.asarray(q[-1] if layout == "4x4" else q[:, -1], "f8"))
found = out[-1, :3].ravel() if layout == "4x4" else out[:, -1]
print(np.allclose(last[:3].ravel(), found, rtol=0, atol=1e-12), puma560.backend)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="needs Linux to limit memory")
@pytest.mark.parametrize(("dtype", "layout"), [("f8", "4x4"), ("f8", "joint_major"), ("i2", "4x4")])
@pytest.mark.parametrize("flags", ["default", "numpy"])
def test_files_larger_than_memory_stream_through(
    robot: Loader, flags: str, tmp_path: Path, dtype: str, layout: str
) -> None:
    """A process that may hold 24 MB reads and writes more than 100 MB."""
    folder = Path(str(robot("puma560", flags).__file__)).parents[1]

    done = subprocess.run(
        [sys.executable, "-B", "-c", STREAM, folder, tmp_path, dtype, layout],
        capture_output=True, text=True, check=False,
    )  # fmt: skip

    assert done.stdout == f"limited\nTrue {'numpy' if flags == 'numpy' else 'c'}\n", done.stderr


# Threads and processes ------------------------------------------------------------------------------------------------


def test_the_interpreter_runs_on_while_c_does(robot: Loader) -> None:
    module = robot("puma560", "default")
    native = sys.modules[module.__name__]._native
    q, out = (native.ffi.from_buffer("double[]", np.zeros(size)) for size in (6, 16))
    # One configuration again and again: a single call that takes a tenth of a second or so.
    call = threading.Thread(target=native.lib.puma560_fk_batch, args=(5_000_000, q, 0, 1, out, 0, 0))
    steps = 0
    call.start()
    while call.is_alive():
        steps += 1

    assert steps > 1_000


FORK = """
import os, sys, threading
import numpy as np
sys.path.insert(0, sys.argv[1])
import puma560
q = np.random.default_rng(1).uniform(-3, 3, (20_000, 6))
expected = puma560.fk(q)
busy = threading.Thread(target=lambda: [puma560.fk(q, threads=2) for _ in range(20)])
busy.start()
for _ in range(3):
    process = os.fork()
    if not process:
        same = all(np.array_equal(expected, puma560.fk(q, threads=threads)) for threads in (2, 3))
        sys.exit(3 if same else 4)
    print(os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]))
busy.join()
"""


@pytest.mark.skipif(sys.platform != "linux", reason="needs fork")
@pytest.mark.parametrize("flags", ["default", "numpy"])
def test_children_that_are_forked_amid_work_have_threads_of_their_own(robot: Loader, flags: str) -> None:
    folder = Path(str(robot("puma560", flags).__file__)).parents[1]

    done = subprocess.run(
        [sys.executable, "-B", "-W", "ignore", "-c", FORK, folder],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip

    assert (done.stdout, done.stderr, done.returncode) == ("3\n" * 3, "", 0)
