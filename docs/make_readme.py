"""Puts the real output of real commands into README.md and the pages of docs/.

    python docs/make_readme.py           rewrites the pages
    python docs/make_readme.py --check   compares, and fails with a diff where a page is not current

A page marks a block like this; whatever stands between the fences is replaced:

    <!-- output: kinegen fk robots/puma560.yaml 0 0 0 0 0 0 -->
    ```text
    ```

Commands run in the checkout with this environment's programs first on the path. Times, rates, rounding errors and
where the largest of them was differ between machines and runs: a block that differs in nothing else counts as current
and is left alone.
"""

from __future__ import annotations

import difflib
import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

BLOCK = re.compile(r"(?P<head><!-- output: (?P<command>.+?) -->\n```\w*\n)(?P<body>.*?)(?P<tail>^```$)", re.M | re.S)

# What a clock, a cache or the last bits of a float decide, and what it becomes in a comparison.
MEASURED = (
    (re.compile(r" *\b\d[\d.,]* ?(s|ms|us|ns|million|x)\b"), ""),  # 0.41 s, 12 ms, 3.1 million
    (re.compile(r" *\b\d(\.\d+)?e-\d\d\b"), ""),  # 4.4e-16
    (re.compile(r"^(  compile) .*$", re.M), r"\1"),  # compiled, or from the cache
    (re.compile(r"^(    (C|NumPy) [^\n]*?)  +\w+ (.* holds)$", re.M), r"\1 \3"),  # the output with the worst error
    (re.compile(r"^  worst (double|float): .*\n(    .*\n)*", re.M), ""),  # and its place
    (re.compile(r"^  measure .*\n", re.M), ""),  # a cross compiler and its emulator may be missing
    (re.compile(r"^  float on .*\n(    .*\n)*", re.M), ""),
    # Samples on the edge of a voxel fall to one side or the other by their last bit.
    (re.compile(r"^  (half of the samples|all samples|and searched at the rim|the same, finer|volume) .*\n", re.M), ""),
    (re.compile(r"(?<=\S) +"), " "),  # the widths of columns of all these
)


def main(arguments: list[str]) -> int:
    """Rewrites or checks every page; returns the exit status."""
    check = arguments == ["--check"]
    stale = False
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]:
        before = page.read_text(encoding="utf-8")
        after = BLOCK.sub(refresh, before)
        if before == after:
            continue
        name = str(page.relative_to(ROOT))
        if check:
            stale = True
            sys.stdout.writelines(difflib.unified_diff(before.splitlines(True), after.splitlines(True), name, "now"))
        else:
            page.write_text(after, encoding="utf-8", newline="\n")
            print(name)
    if stale:
        print("The pages are not current: run 'make docs' and commit what it changes")
    return int(stale)


def refresh(block: re.Match[str]) -> str:
    """Runs the command of a block and returns the block with its output."""
    old, new = block["body"], output(block["command"])
    body = old if comparable(old) == comparable(new) else new
    return block["head"] + body + block["tail"]


def comparable(text: str) -> str:
    """A block without what differs between machines and runs."""
    for pattern, replacement in MEASURED:
        text = pattern.sub(replacement, text)
    return text


def output(command: str) -> str:
    """What a command prints on both streams, as a person sees it in a terminal without colours.

    Raises:
        SystemExit: The command failed; a page must not show that by accident.
    """
    programs = str(Path(sys.executable).parent)
    terminal = {"COLUMNS": "100", "NO_COLOR": "1", "LC_ALL": "C.UTF-8"}
    environment = {**os.environ, **terminal, "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(
        ["bash", "-o", "pipefail", "-c", command],
        cwd=ROOT,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        sys.exit(f"{command}: exit status {done.returncode}\n{done.stdout}")
    lines = [line.rstrip() for line in done.stdout.splitlines()]
    return "".join(f"{line}\n" for line in lines)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
