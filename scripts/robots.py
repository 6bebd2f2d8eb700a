"""Builds and verifies the robots of robots/, each as a user does.

python scripts/robots.py            one in seven, drawn by the commit
python scripts/robots.py --every    all
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

sys.path.append(str(Path(__file__).parent))
import sampling

ROOT = Path(__file__).resolve().parent.parent

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
    parser = argparse.ArgumentParser(description="Builds and verifies robots of robots/.")
    parser.add_argument("--every", action="store_true", help="all, instead of one in seven")
    parser.add_argument("--jobs", type=int, default=2, help="processes at a time")
    options = parser.parse_args()
    robots, commit = sorted((ROOT / "robots").glob("*.yaml")), sampling.commit()
    paths = [path for path in robots if options.every or sampling.is_in_sample(path.stem, commit)]

    # The reports of an earlier run would be taken for those of this one.
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
    print(f"{len(paths)} of {len(robots)} robots are built and verified; build/robots.*.log have the reports")
    return 0


if __name__ == "__main__":
    sys.exit(main())
