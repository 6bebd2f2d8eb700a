"""Builds and proves the robots of robots/, each as a user does.

    python scripts/robots.py            all; where they were proven with these sources before, one in seven
    python scripts/robots.py --every    all

`proven.txt` holds the digest of the sources with which all of them were proven: of what builds and proves, and of the
libraries. A run over all of them writes it.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

sys.path.append(str(Path(__file__).parent))
import sources

ROOT = Path(__file__).resolve().parent.parent

PROVEN = ROOT / "scripts" / "proven.txt"
OUTPUT = ROOT / "build" / "robots"
TOGETHER = 5
"""Robots that one process builds, so that it starts seldom and the last one to end is not waited for long."""


def build(paths: list[Path]) -> str:
    """Build some robots; what went wrong, or nothing."""
    command = [sys.executable, "-m", "kinegen", "build", *map(str, paths), "-o", str(OUTPUT)]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    (OUTPUT.parent / f"robots.{paths[0].stem}.log").write_text(done.stdout, encoding="utf-8")
    return done.stdout if done.returncode else ""


def main() -> int:
    """Run it; the exit code."""
    parser = argparse.ArgumentParser(description="Builds and proves the robots of robots/.")
    parser.add_argument("--every", action="store_true", help="all, also where no source has changed")
    parser.add_argument("--jobs", type=int, default=2, help="processes at a time")
    options = parser.parse_args()
    now = sources.digest(["scripts/robots.py"], ["kinegen.cli.build"])

    # All of them, or a sample that another change of the sources makes another one.
    robots = sorted((ROOT / "robots").glob("*.yaml"))
    is_sample = sources.is_recorded(PROVEN, now) and not options.every
    paths = [path for path in robots if not is_sample or sources.is_in_sample(path.stem, now)]
    OUTPUT.parent.mkdir(exist_ok=True)
    for log in OUTPUT.parent.glob("robots.*.log"):
        log.unlink()
    shares = [paths[first : first + TOGETHER] for first in range(0, len(paths), TOGETHER)]
    with ThreadPoolExecutor(options.jobs) as pool:
        failures = [told for told in pool.map(build, shares) if told]

    # What went wrong, or what was done.
    if failures:
        print(*failures, sep="\n")
        return 1
    if not is_sample:
        PROVEN.write_text(f"{now}\n", encoding="utf-8")
    told = " (a sample: all were with these sources before)" if is_sample else ""
    print(f"{len(paths)} robots are built and proven{told}; build/robots.*.log have the reports")
    return 0


if __name__ == "__main__":
    sys.exit(main())
