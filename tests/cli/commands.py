"""What the tests of the command line share: calling it, and small robot files."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
ROBOTS = ROOT / "robots"

TWO = """\
kinegen: 1
name: two
description: Two joints
convention: standard
units: {length: m, angle: deg}
parameters:
  L1: 0.5
joints:
  - {name: turn, alpha: 0, a: L1, d: 0, theta: q, limits: [-90, 90]}
  - {name: slide, alpha: 90, a: 0, d: q, theta: 0, limits: [0, 2]}
"""

BAD = TWO.replace("alpha: 90", "alhpa: 90")


def start(*arguments: str | Path, cwd: Path = ROOT, **environment: str) -> subprocess.Popen[str]:
    """Starts the command line as a process of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "kinegen", *map(str, arguments)],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        encoding=environment.get("PYTHONIOENCODING"),
    )
