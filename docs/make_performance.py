"""Puts measured numbers into docs/performance.md and README.md, and draws the plot.

    python docs/make_performance.py                                   rewrites page and plot from docs/performance.json
    python docs/make_performance.py benchmarks/results/speed.json     takes over a new measurement first
    python docs/make_performance.py --check                           compares, and fails with a diff

A measurement is written by `make bench`, and differs between machines and days; the one that the page quotes is kept
beside it. A page marks a block like this, and whatever stands between the marks is replaced:

    <!-- measured: kernels -->
    <!-- end -->
"""

from __future__ import annotations

import difflib
import re
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

from benchmarks.speed.roofline import draw
from benchmarks.speed.rows import TIME, Results, Row, load_results

DOCS = Path(__file__).resolve().parent
PAGE, PLOT, DATA = DOCS / "performance.md", DOCS / "performance.svg", DOCS / "performance.json"
README = DOCS.parent / "README.md"

BLOCK = re.compile(r"(?P<head><!-- measured: (?P<name>[a-z-]+) -->\n).*?(?P<tail><!-- end -->)", re.S)


def main(arguments: list[str]) -> int:
    """Rewrites or checks the page and the plot; returns the exit status."""
    check = arguments == ["--check"]
    if arguments and not check:
        shutil.copyfile(arguments[0], DATA)
    results = load_results(DATA)
    stale = False
    pages = [(path, page(path.read_text(encoding="utf-8"), results)) for path in (PAGE, README)]
    for path, text in (*pages, (PLOT, draw(results))):
        before = path.read_text(encoding="utf-8") if path.exists() else ""
        if before == text:
            continue
        if check:
            stale = True
            lines = before.splitlines(True), text.splitlines(True)
            sys.stdout.writelines(difflib.unified_diff(*lines, path.name, "now"))
        else:
            path.write_text(text, encoding="utf-8", newline="\n")
            print(path.relative_to(DOCS.parent))
    if stale:
        print("The page is not what its measurement says: run 'make docs' and commit what it changes")
    return int(stale)


def page(text: str, results: Results) -> str:
    """The page with all its blocks filled."""

    def fill(block: re.Match[str]) -> str:
        lines = BLOCKS[block["name"]](results)
        return block["head"] + "".join(f"{line}\n" for line in lines) + block["tail"]

    return BLOCK.sub(fill, text)


# The blocks -----------------------------------------------------------------------------------------------------------


def machine(results: Results) -> Iterator[str]:
    """What it was measured on."""
    yield "| | |"
    yield "| --- | --- |"
    builds = dict.fromkeys((row.compiler, row.flags) for row in results.rows if row.compiler and row.threads == 1)
    kernel = next(iter(builds), ("", ""))
    words = {**results.machine, "compiler": kernel[0], "flags": f"`{kernel[1]}`"}
    yield from (f"| {name.replace('_', ' ')} | {text} |" for name, text in words.items())
    yield f"| load | {results.load[0]:.1f} before, {results.load[1]:.1f} after |"


def kernels(results: Results) -> Iterator[str]:
    """Rates, also as fractions of the sincos rate, a column for each robot."""
    robots = _robots(results)
    yield f"| million poses per second | type | {' | '.join(robots)} |"
    yield f"| --- | --- |{' ---: |' * len(robots)}"
    rows = [row for row in results.rows if not row.against.startswith("times") and row.poses == _batch(results)]
    kinds = dict.fromkeys((row.what, row.layout, row.real) for row in rows if row.what in _KERNEL_ROWS)
    for what, layout, real in kinds:
        cells = []
        for robot in robots:
            found = [row for row in rows if (row.robot, row.what, row.layout, row.real) == (robot, what, layout, real)]
            cells.append(_rate(found[0]) if found else "")
        name = f"{what}, {layout}" if what == _KERNEL else what
        yield f"| {name} | {real} | {' | '.join(cells)} |"


def builds(results: Results) -> Iterator[str]:
    """Other compilers and flags."""
    yield "| built | type | sincos only | 4x4 | of its sincos rate | joint-major | of its sincos rate |"
    yield "| --- | --- | ---: | ---: | ---: | ---: | ---: |"
    rows = [row for row in results.rows if row.against == "of its sincos rate"]
    floors = {(row.what, row.real): row for row in results.rows if row.layout == "sum"}
    for row in rows:
        if row.layout != "4x4" or row.real != "double":
            continue
        key = row.flags, row.compiler, row.real
        other = next(each for each in rows if (each.flags, each.compiler, each.real) == key and each is not row)
        name = row.what.partition(", from C, ")[2]
        floor = f"{floors[f'{_KERNEL_ROWS[0]}, {name}', row.real].value:.0f}"
        shares = f"{row.value:.1f} | {row.ratio:.2f} | {other.value:.1f} | {other.ratio:.2f}"
        yield f"| {name} | {row.real} | {floor} | {shares} |"


def peers(results: Results) -> Iterator[str]:
    """Batches from Python, a column for each robot."""
    robots = _robots(results)
    yield f"| million poses per second | type | {' | '.join(robots)} |"
    yield f"| --- | --- |{' ---: |' * len(robots)}"
    rows = [row for row in results.rows if _is_peer(row) or row.against.startswith("times the fastest peer")]
    for what, real in sorted(dict.fromkeys((row.what, row.real) for row in rows), key=lambda kind: kind[1]):
        cells = []
        for robot in robots:
            found = [row for row in rows if (row.robot, row.what, row.real) == (robot, what, real)]
            cells.append(_number(found[0].value) if found else "")
        own = not any(_is_peer(row) for row in rows if row.what == what)
        name = f"**kinegen: {what}**" if own else what
        yield f"| {name} | {real} | {' | '.join(cells)} |"
    for real in ("double", "float"):
        shares = {row.robot: row.ratio or 0 for row in rows if row.against and row.real == real}
        cells = [f"{shares[robot]:.1f}" if robot in shares else "" for robot in robots]
        yield f"| times the fastest peer | {real} | {' | '.join(cells)} |"
    if results.absent:
        yield ""
        for robot, name, reason in results.absent:
            yield f"{name} is omitted for {robot}: {reason.removeprefix('left out: ')}."


def speed(results: Results) -> Iterator[str]:
    """Poses of the PUMA 560 in batches from Python, in doubles: the fastest first."""
    found = [row for row in results.rows if row.robot == "puma560" and row.real == "double"]
    (own,) = (row for row in found if row.against.startswith("times the fastest peer"))
    rows = sorted((row for row in found if _is_peer(row)), key=lambda row: -row.value)
    shown = [row for row in rows if any(row.what.startswith(name) for name in _SHOWN)]
    yield f"| batches of poses, PUMA 560 | kinegen | {' | '.join(row.what.replace(', ', ' ') for row in shown)} |"
    yield f"| --- |{' ---: |' * (1 + len(shown))}"
    cells = " | ".join(_number(row.value) for row in shown)
    yield f"| million a second, [one thread](docs/performance.md) | **{_number(own.value)}** | {cells} |"


def single(results: Results) -> Iterator[str]:
    """One configuration from Python."""
    robots = _robots(results)
    yield f"| microseconds | {' | '.join(robots)} |"
    yield f"| --- |{' ---: |' * len(robots)}"
    rows = [row for row in results.rows if row.unit == TIME]
    for what in dict.fromkeys(row.what for row in rows):
        found = {row.robot: row.value for row in rows if row.what == what}
        cells = [_number(found[robot]) if robot in found else "" for robot in robots]
        name = what.removeprefix("one call: ")
        own = any(mark in name for mark in ("fk(", "bind("))
        yield f"| {f'**kinegen: {name}**' if own else name} | {' | '.join(cells)} |"


def instructions(results: Results) -> Iterator[str]:
    """Counts by callgrind."""
    robots = _robots(results)
    yield f"| instructions per pose | flags | type | {' | '.join(robots)} |"
    yield f"| --- | --- | --- |{' ---: |' * len(robots)}"
    found = {(each["what"], each["flags"], each["real"], each["robot"]): each for each in results.instructions}
    for what, flags, real in dict.fromkeys(key[:3] for key in found):
        counts = [found[what, flags, real, robot]["instructions"] for robot in robots]
        yield f"| {what} | `{flags}` | {real} | {' | '.join(f'{count:,.0f}' for count in counts)} |"


def threads(results: Results) -> Iterator[str]:
    """Two threads against one."""
    yield "| poses | type | one thread | two threads | times one |"
    yield "| ---: | --- | ---: | ---: | ---: |"
    for row in results.rows:
        if row.threads == 2 and row.ratio is not None:
            yield f"| {row.poses:,} | {row.real} | {row.value / row.ratio:.1f} | {row.value:.1f} | {row.ratio:.2f} |"


BLOCKS: dict[str, Callable[[Results], Iterator[str]]] = {
    each.__name__: each for each in (machine, kernels, builds, threads, peers, speed, single, instructions)
}

_SHOWN = ("Numba", "SymPy", "Pinocchio", "Robotics Toolbox")
"""The peers that the first page names."""

_KERNEL_ROWS = (
    "sines and cosines alone",
    "sines, cosines and the arithmetic, no stores",
    "batch kernel, from C",
    "fk(q, out=T), from Python",
    "fk(q), from Python",
    "closed form with libm, C loop",
    "4x4 product with libm, C loop",
    "closed form vectorised by hand, libmvec, C loop",
    "reading and writing alone",
)
_KERNEL = _KERNEL_ROWS[2]


def _robots(results: Results) -> tuple[str, ...]:
    """The robots of the columns: the first of those measured, and the last, which is the longest chain."""
    robots = tuple(results.operations)
    return tuple(dict.fromkeys((robots[0], robots[-1])))


def _batch(results: Results) -> int:
    return next((row.poses for row in results.rows), 0)


def _is_peer(row: Row) -> bool:
    return not row.compiler and row.unit != TIME


def _rate(row: Row) -> str:
    share = "" if row.ratio is None else f" ({row.ratio:.2f})"
    return f"{_number(row.value)}{share}"


def _number(value: float) -> str:
    return f"{value:.1f}" if value >= 10 else f"{value:.2f}"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
