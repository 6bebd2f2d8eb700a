"""Clock ticks of a pose and its inverse inside LinuxCNC, beside those of genserkins, in one process.

    python -m benchmarks.controllers

Needs LinuxCNC (Debian: linuxcnc-uspace, linuxcnc-uspace-dev) and root, which installs the modules for the run.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from tests.controllers.genserkins import Pair, compare
from tests.controllers.halrun import installed, write_probe


def main() -> int:
    """Print the table of docs/controllers.md."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        with installed(write_probe(place)):
            anywhere, straight = compare(place / "anywhere", straight=False), compare(place / "straight", straight=True)
    print(f"{'PUMA 560, 2,000 joint vectors':<34} {'puma560_kins':>12} {'genserkins':>12}")
    for words, pair in (
        ("clock ticks, median", anywhere.ticks),
        ("failures", anywhere.failures),
        ("failures with joint 5 at 0", straight.failures),
    ):
        print(f"{words:<34} {pair.ours:>12,.0f} {pair.theirs:>12,.0f}")
    print(f"ratio of the ticks: {_ratio(anywhere.ticks):.3f}")
    return 0


def _ratio(pair: Pair) -> float:
    return pair.ours / pair.theirs


if __name__ == "__main__":
    sys.exit(main())
