"""Runs the commands that README.md and the pages of docs/ show, and puts what they print below them.

    python docs/make_readme.py           rewrites the pages
    python docs/make_readme.py --check   compares, and fails with a diff where a page is not current
    python docs/make_readme.py --run PAGE ...   runs the commands of these pages, and fails where one of them does

Nothing runs that a reader does not see. A page shows a command and its output like this; what stands below the command
is replaced:

    ```console
    $ kinegen fk robots/puma560.yaml 0 0 0 0 0 0
    ```

A block of `pycon` is a session of Python: the lines after `>>>` and `...` run, and what they print stands below them.
A block of `sh` holds commands without output; they run too, but for those that install things. A file is shown by

    <!-- file: docs/examples/batch.py -->
    ```python
    ```

The commands of a page run in order, in a folder of its own under build/pages/ with nothing in it but copies of robots/,
examples/ and docs/, with this environment's programs first on the path. Times, rates, rounding errors and where the
largest of them was differ between machines and runs: a block that differs in nothing else counts as current and is left
alone.
"""

from __future__ import annotations

import difflib
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SCRATCH = ROOT / "build" / "pages"
COPIED = ("robots", "examples", "docs")

PAGES = tuple(
    ROOT / name
    for name in (
        "README.md",
        "docs/tour.md",
        "docs/actuators.md",
        "docs/calibration.md",
        "docs/compare.md",
        "docs/cpp.md",
        "docs/import.md",
        "docs/inverse.md",
        "docs/javascript.md",
        "docs/matlab.md",
        "docs/orientation.md",
        "docs/pictures.md",
        "docs/python.md",
        "docs/rust.md",
        "docs/scale.md",
        "docs/tables.md",
        "docs/velocities.md",
        "docs/generated-c.md",
        "docs/tutorials/book.md",
        "docs/tutorials/commissioning.md",
        "docs/tutorials/data.md",
        "docs/tutorials/firmware.md",
        "docs/tutorials/urdf.md",
    )
)
"""The pages whose commands run. Those of docs/firmware.md take cross compilers, and have a script of their own."""

BLOCK = re.compile(
    r"^(?P<head>(<!-- file: (?P<path>\S+)(, lines (?P<first>\d+) to (?P<last>\d+))? -->\n)?```(?P<kind>\w+)\n)"
    r"(?P<body>.*?)(?P<tail>^```$)",
    re.M | re.S,
)
COMMAND = re.compile(r"^\$ (?P<text>(?:.*\\\n)*.*)\n(?P<output>(?:(?!\$ ).*\n)*)", re.M)

INSTALLS = ("make", "pip")
"""Commands that change the environment of who runs them."""

# What a clock, a cache or the last bits of a float decide, and what it becomes in a comparison.
MEASURED = (
    (re.compile(r" *\b\d[\d.,]* ?(s|ms|us|ns|million|x)\b"), ""),  # 0.41 s, 12 ms, 3.1 million
    (re.compile(r" *\b\d(\.\d+)?e-\d\d\b"), ""),  # 4.4e-16
    (re.compile(r"^(    compile) .*$", re.M), r"\1"),  # compiled, or from the cache
    (re.compile(r"^(    (C|NumPy) .*?) +\d+ % +\w+ +pass$", re.M), r"\1"),  # the worst share and its output
    (re.compile(r"^(  errors    within tolerance); .*$", re.M), r"\1"),  # likewise
    (re.compile(r"^  flash     .*\n", re.M), ""),  # a cross compiler and its emulator may be missing
    (re.compile(r"^  worst (double|float): .*\n(    .*\n)*", re.M), ""),  # and its place
    (re.compile(r"^    measure .*\n", re.M), ""),
    (re.compile(r"^  float on .*\n(    .*\n)*", re.M), ""),
    # Samples on the edge of a voxel fall to one side or the other by their last bit.
    (re.compile(r"^  (half of the samples|all samples|and searched at the rim|the same, finer|volume) .*\n", re.M), ""),
    (re.compile(r"(?<=\S) +"), " "),  # the widths of columns of all these
)


def main(arguments: list[str]) -> int:
    """Rewrites or checks every page; returns the exit status."""
    check = arguments == ["--check"]
    if arguments[:1] == ["--run"]:
        for name in arguments[1:]:
            page = ROOT / name
            refreshed(page.read_text(encoding="utf-8"), fresh_folder(SCRATCH / page.stem))
            print(f"{name}: all commands ran")
        return 0
    stale = False
    befores = [page.read_text(encoding="utf-8") for page in PAGES]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        # Pages share no folder and no cache; the threads wait for what the commands print.
        afters = pool.map(lambda page, text: refreshed(text, fresh_folder(SCRATCH / page.stem)), PAGES, befores)
    for page, before, after in zip(PAGES, befores, afters, strict=True):
        name = str(page.relative_to(ROOT))
        if before == after:
            continue
        if check:
            stale = True
            sys.stdout.writelines(difflib.unified_diff(before.splitlines(True), after.splitlines(True), name, "now"))
        else:
            page.write_text(after, encoding="utf-8", newline="\n")
            print(name)
    if stale:
        print("The pages are not current: run 'make docs' and commit what it changes")
    return int(stale)


def fresh_folder(folder: Path) -> Path:
    """An empty folder with copies of what pages read; links would keep their targets out of a source distribution."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name in COPIED:
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    return folder


def refreshed(text: str, folder: Path) -> str:
    """A page after its commands ran in a folder, in order."""
    return BLOCK.sub(lambda block: refresh(block, folder), text)


def refresh(block: re.Match[str], folder: Path) -> str:
    """One block after its commands ran, or with the file that it shows."""
    body = block["body"]
    if block["path"]:
        body = shown(block)
    elif block["kind"] == "sh":
        for command in commands(body):
            output(command, folder)
    elif block["kind"] == "pycon":
        body = session(body, folder)
    elif block["kind"] == "console":
        body = COMMAND.sub(lambda match: renewed(match, folder), body)
    return block["head"] + body + block["tail"]


SESSION = """\
import code, sys
console = code.InteractiveConsole()
for line in sys.argv[1].splitlines():
    print(line, flush=True)
    console.push(line[4:])
"""
"""A program that runs the lines of a session, prompts included, and prints what the interpreter prints."""


def session(body: str, folder: Path) -> str:
    """A session of Python with what it prints now, or as it was where that says the same.

    Raises:
        SystemExit: A line failed.
    """
    lines = "".join(line for line in body.splitlines(keepends=True) if line.startswith((">>> ", "... ")))
    printed = output(shlex.join(["python", "-c", SESSION, lines]), folder)
    if "Traceback (most recent call last)" in printed:
        sys.exit(f"a session failed:\n{printed}")
    return body if comparable(body) == comparable(printed) else printed


def shown(block: re.Match[str]) -> str:
    """The file that a block shows, or some of its lines; the comments at the head of a robot file are left out."""
    lines = (ROOT / block["path"]).read_text(encoding="utf-8").splitlines(keepends=True)
    if block["first"]:
        return "".join(lines[int(block["first"]) - 1 : int(block["last"])])
    return "".join(line for line in lines if not (block["kind"] == "yaml" and line.startswith("#")))


def commands(body: str) -> Iterator[str]:
    """The commands of a block without output, but for those that install things."""
    for line in body.replace("\\\n", "").splitlines():
        command = re.sub(r"\s+#.*", "", line).strip()
        if command and command.split()[0] not in INSTALLS:
            yield command


def renewed(match: re.Match[str], folder: Path) -> str:
    """A command with what it prints now, or with what it printed where that says the same."""
    old, new = match["output"], output(match["text"], folder)
    return f"$ {match['text']}\n{old if comparable(old) == comparable(new) else new}"


def comparable(text: str) -> str:
    """A block without what differs between machines and runs."""
    for pattern, replacement in MEASURED:
        text = pattern.sub(replacement, text)
    return text


def output(command: str, folder: Path) -> str:
    """What a command prints on both streams, as a person sees it in a terminal without colours.

    Args:
        command: Shell text.
        folder: Where it runs. What builds remember is kept there, so that a page shows a first build.

    Returns:
        The lines.

    Raises:
        SystemExit: The command failed; a page must not show that by accident, but may show an error message.
    """
    programs = str(Path(sys.executable).parent)
    terminal = {"COLUMNS": "100", "NO_COLOR": "1", "LC_ALL": "C.UTF-8", "XDG_CACHE_HOME": str(folder / ".cache")}
    environment = {**os.environ, **terminal, "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(
        ["bash", "-o", "pipefail", "-c", command],
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    if done.returncode != 0 and not (done.returncode == 1 and done.stdout.startswith("error: ")):
        sys.exit(f"{command}: exit status {done.returncode}\n{done.stdout}")
    lines = [line.rstrip() for line in done.stdout.splitlines()]
    return "".join(f"{line}\n" for line in lines)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
