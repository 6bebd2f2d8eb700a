"""Draws the pictures that docs/pictures.md shows, with the commands that it shows.

    python docs/make_pictures.py           rewrites docs/pictures/
    python docs/make_pictures.py --check   compares, and fails if a picture is not current

A picture is named by the command above it, as in

    ```sh
    kinegen view robots/scara.yaml -o docs/pictures/scara.svg --frames
    ```

Outlines of letters and last digits differ between releases of matplotlib. The check compares the texts, the names of
the marks, and their places to a tenth of a point.
"""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "pictures.md"
COMMAND = re.compile(r"^kinegen view (?:.*\\\n)*.*", re.M)
NEAR = 0.1
"""What two places may differ by, in points."""

MARKS = re.compile(r'<!-- (.*?) -->|<g id="([a-z]+-[\w-]+)">\s*(?:<path d="M (-?[\d.]+) (-?[\d.]+))?')
Mark = tuple[str, tuple[float, ...]]


def main(arguments: list[str]) -> int:
    """Rewrites or checks every picture; returns the exit status."""
    stale = False
    with tempfile.TemporaryDirectory() as folder:
        for words in commands(PAGE.read_text(encoding="utf-8")):
            path = ROOT / words[words.index("-o") + 1]
            fresh = drawn(words, Path(folder) / path.name)
            if path.exists() and same(path.read_text(encoding="utf-8"), fresh):
                continue
            name = path.relative_to(ROOT)
            if arguments == ["--check"]:
                stale = True
                print(f"{name} is not current")
            else:
                path.parent.mkdir(exist_ok=True)
                path.write_text(fresh, encoding="utf-8", newline="\n")
                print(name)
    if stale:
        print("The pictures are not current: run 'make docs' and commit what it changes")
    return int(stale)


def commands(text: str) -> list[list[str]]:
    """The words of every command of the page that draws."""
    found = (shlex.split(match[0].replace("\\\n", "")) for match in COMMAND.finditer(text))
    return [words for words in found if "-o" in words]


def drawn(words: list[str], path: Path) -> str:
    """What a command draws, written somewhere else."""
    changed = [*words[1:]]
    changed[changed.index("-o") + 1] = str(path)
    done = subprocess.run(
        [sys.executable, "-m", "kinegen", *changed], cwd=ROOT, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        sys.exit(f"{shlex.join(words)}: exit status {done.returncode}\n{done.stderr}")
    return path.read_text(encoding="utf-8")


def same(before: str, after: str) -> bool:
    """Whether two pictures have the same texts and marks at the same places."""
    old, new = marks(before), marks(after)
    return [name for name, _ in old] == [name for name, _ in new] and all(
        len(a) == len(b) and all(abs(x - y) <= NEAR for x, y in zip(a, b, strict=True))
        for (_, a), (_, b) in zip(old, new, strict=True)
    )


def marks(svg: str) -> list[Mark]:
    """The texts and the named marks of a picture, each with its place where it has one."""
    return [
        (match[1] or match[2], tuple(float(each) for each in match.groups()[2:] if each))
        for match in MARKS.finditer(svg)
    ]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
