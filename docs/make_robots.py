"""Writes robots/README.md: every robot file with what it describes.

python docs/make_robots.py           rewrites the page
python docs/make_robots.py --check   compares, and fails with a diff if the page is not current
"""

from __future__ import annotations

import difflib
import sys
from pathlib import Path

from kinegen.io.load import load
from kinegen.model.robot import JointType, Robot

FOLDER = Path(__file__).resolve().parent.parent / "robots"
PAGE = FOLDER / "README.md"
LETTERS = {JointType.REVOLUTE: "R", JointType.PRISMATIC: "P", JointType.SCREW: "H"}
HEAD = """\
# Robots

<!-- Written by docs/make_robots.py; change the files and run `make docs`. -->

The comments at the top of each file give the source of each number, and the numbers that we chose. Joints are revolute
(R), prismatic (P) or helical (H, a screw); those that follow others are not counted.

| file | description | joints | convention | unit |
| --- | --- | --- | --- | --- |
"""


def main(arguments: list[str]) -> int:
    """Rewrites or checks the page; returns the exit status."""
    before = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    after = HEAD + "".join(line(path) for path in sorted(FOLDER.glob("*.yaml")))
    if before == after:
        return 0
    if arguments == ["--check"]:
        sys.stdout.writelines(difflib.unified_diff(before.splitlines(True), after.splitlines(True), str(PAGE), "now"))
        print("The page is not current: run 'make docs' and commit what it changes")
        return 1
    PAGE.write_text(after, encoding="utf-8", newline="\n")
    print(PAGE.relative_to(FOLDER.parent))
    return 0


def line(path: Path) -> str:
    """One line of the table."""
    robot = load(path)
    used = dict.fromkeys(row.convention.value for row in robot.rows)
    cells = [f"[{path.name}]({path.name})", robot.description, joints(robot), ", ".join(used), robot.units.length]
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |\n"


def joints(robot: Robot) -> str:
    """The joints as kinematics books write them: `6R`, `2R P 3R`, and how many tips a tree has."""
    runs: list[tuple[str, int]] = []
    for variable in robot.variables:
        letter = LETTERS[variable.type]
        count = runs.pop()[1] if runs and runs[-1][0] == letter else 0
        runs.append((letter, count + 1))
    text = " ".join(letter if count == 1 else f"{count}{letter}" for letter, count in runs) or "none"
    return f"{text}, {len(robot.tips)} tips" if robot.is_tree else text


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
