"""What is written does not depend on how a library rounds: libraries for matrices differ between processors."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

PRINT = """
import sys
from pathlib import Path
from kinegen.io.load import load
from kinegen.verify.vectors import inverse_targets
for name in sys.argv[1:]:
    print(inverse_targets(load(Path(name)))[1].tobytes().hex())
"""


def printed(core: str) -> str:
    """The joint vectors of the targets of some robots, with the matrix products of one kind of processor."""
    # Three arms whose poses come in pairs that are equally far from every singular one.
    robots = [str(ROOT / "robots" / f"{name}.yaml") for name in ("wire_arm", "puma560", "spherical_wrist")]
    environment = {**os.environ, "OPENBLAS_CORETYPE": core, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", PRINT, *robots]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout


@pytest.mark.parametrize("core", ["Sandybridge", "Haswell"])
def test_targets_of_an_inverse_are_the_same_on_every_processor(core: str) -> None:
    assert printed(core) == printed("Nehalem")
