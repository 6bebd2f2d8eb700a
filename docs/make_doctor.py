"""Runs the commands that docs/doctor.md shows, and puts what they print below them.

python docs/make_doctor.py           rewrites the page
python docs/make_doctor.py --check   compares, and fails with a diff if the page is not current
"""

from __future__ import annotations

import difflib
import sys

from make_readme import ROOT, SCRATCH, fresh_folder, refreshed

PAGE = ROOT / "docs" / "doctor.md"


def main(arguments: list[str]) -> int:
    """Rewrites or checks the page; returns the exit status."""
    before = PAGE.read_text(encoding="utf-8")
    after = refreshed(before, fresh_folder(SCRATCH / PAGE.stem))
    if before == after:
        return 0
    name = str(PAGE.relative_to(ROOT))
    if arguments == ["--check"]:
        sys.stdout.writelines(difflib.unified_diff(before.splitlines(True), after.splitlines(True), name, "now"))
        print("The page is not current: run 'make docs' and commit what it changes")
        return 1
    PAGE.write_text(after, encoding="utf-8", newline="\n")
    print(name)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
