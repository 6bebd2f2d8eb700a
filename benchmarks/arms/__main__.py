"""Which real arms get all their solutions, in which way, and whether a planted solution is missed.

    python -m benchmarks.arms [--targets 20] [--source ssik] [--name ur]

Arms are those of ssik, Robotics Toolbox and pybotics where they are installed (`pip install ssik==8.2.0
roboticstoolbox-python pybotics`), and of the packages that `python scripts/get_descriptions.py build/descriptions`
downloads. With `--targets 0` nothing is solved; 20 take some seconds for an arm, a minute where it is
nearly of a family and one joint is given.
"""

from __future__ import annotations

import argparse
from collections import Counter

from benchmarks.arms.planted import missed
from benchmarks.arms.sources import all_arms
from benchmarks.arms.ways import GIVEN, NONE, way_of


def main() -> None:
    """Print a line for each arm, and how many there are of each kind."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.arms")
    parser.add_argument("--targets", type=int, default=20, help="random targets for each arm and redundancy")
    parser.add_argument("--source", default="", help="only packages whose name has this in it")
    parser.add_argument("--name", default="", help="only arms whose name has this in it")
    options = parser.parse_args()
    totals: Counter[tuple[str, int, str]] = Counter()
    print(f"{'package':<19}{'arm':<36}{'joints':<7}{'spherical':<16}{'way':<20}missed")
    for arm in all_arms(options.source, options.name):
        way = way_of(arm.robot)
        found = "-"
        if options.targets and way.robots:
            lost, beside = missed(way, options.targets)
            found = (
                f"{lost} of {options.targets * len(way.robots)}{f' ({beside} beside singular poses)' * bool(beside)}"
            )
        spherical = ", ".join(way.spherical) or "-"
        head = f"{arm.source:<19}{arm.name[-34:]:<36}{arm.robot.dof:<7}{spherical:<16}{way.kind:<20}"
        print(f"{head}{found}  {way.detail}", flush=True)
        kind = way.kind if way.kind != NONE or not way.spherical else f"{NONE}, but {spherical} spherical"
        totals[arm.source, arm.robot.dof, f"{kind}: {way.detail}" if way.kind == GIVEN else kind] += 1
    for (source, joints, kind), count in sorted(totals.items()):
        print(f"{source}, {joints} joints: {count} {kind}")


if __name__ == "__main__":
    main()
