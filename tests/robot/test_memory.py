"""How much memory reading a robot file takes: the figure in docs/robot-file.md."""

import tracemalloc

import pytest

from benchmarks.rows import arm
from kinegen.errors import RobotFileError
from kinegen.io.load import loads
from kinegen.io.robot_file.tree import MAX_BYTES

HEAD = "kinegen: 1\nname: arm\nconvention: modified\nunits: {length: m, angle: deg}\n"
FILLED = HEAD + "joints:\n" + "- \n" * 87_000
"""Of several ways to fill a file with entries, the one that takes most: 6 MB."""

PROMISED = 16 * 2**20


def test_a_file_of_the_largest_size_is_refused_within_the_stated_memory() -> None:
    """A file that a stranger fills with as many entries as fit."""
    assert 0.99 * MAX_BYTES < len(FILLED) <= MAX_BYTES
    tracemalloc.start()
    try:
        with pytest.raises(RobotFileError):
            loads(FILLED, "arm.yaml")
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()

    assert peak < PROMISED


def test_the_largest_table_is_read_within_the_stated_memory() -> None:
    """All the rows that a file may have."""
    tracemalloc.start()
    try:
        robot = loads(arm(256), "arm.yaml")
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()

    assert robot.dof == 256
    assert peak < PROMISED
