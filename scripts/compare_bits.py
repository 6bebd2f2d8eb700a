"""Compares every output of ten robots in other languages with C without contraction, word by word.

    python scripts/compare_bits.py [--languages rust,javascript] [--configurations 1000000] [ROBOT...]

The configurations are shared among the robots: joint vectors within the limits and far beyond them, every eighth with
NaN, infinity or a number out of range. Exits with 1 if a word differs.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from generated import programs  # noqa: E402
from kinegen.backends.languages import LANGUAGES, emit_language  # noqa: E402
from kinegen.io.load import load  # noqa: E402
from kinegen.model.outputs import every_quantity  # noqa: E402
from kinegen.verify.language_build import compare_bits  # noqa: E402

EXTRA = tuple(name for name, language in LANGUAGES.items() if language.is_extra)

ROBOTS = ("calibrated_2r", "hand", "iiwa14", "motoman_l3", "palletiser", "puma560", "scara", "stanford", "tx60", "ur5")
"""Runtime parameters, a tree, seven joints, actuators, a linkage, and arms of all usual families."""


def main() -> int:
    """Print a line for each robot and language."""
    parser = argparse.ArgumentParser(description="Compares other languages with C, word by word.")
    parser.add_argument("robots", nargs="*", default=ROBOTS, metavar="ROBOT", help="names of files in robots/")
    parser.add_argument("--languages", default=",".join(EXTRA), help=f"of {', '.join(EXTRA)}")
    parser.add_argument("--configurations", type=int, default=1_000_000, help="of all robots together")
    given = parser.parse_args()
    share = max(1, given.configurations // len(given.robots))
    differing = 0
    for name in given.robots:
        kernels = programs(load(ROOT / "robots" / f"{name}.yaml"), every_quantity())
        for language in (LANGUAGES[each] for each in given.languages.split(",")):
            start = time.perf_counter()
            found = compare_bits(kernels, language, emit_language(kernels, language), share)
            differing += found.differing
            seconds = time.perf_counter() - start
            first = f", first in {found.worst}" if found.worst else ""
            print(
                f"{name:14} {language.title:12} {share:8,} configurations  {len(kernels.programs):2} outputs  "
                f"{found.words:14,} words  {found.differing} differ{first}  {seconds:.0f} s",
                flush=True,
            )
    return bool(differing)


if __name__ == "__main__":
    sys.exit(main())
