"""Measures kernels on emulated boards and writes the tables of docs/firmware.md.

    python docs/make_firmware.py --check   compares the targets and the figures of one of them; a few seconds
    python docs/make_firmware.py           the same, and where something differs, measures everything; a minute or two
    python docs/make_firmware.py --all     measures everything and rewrites the tables

A table stands between `<!-- table: NAME -->` and `<!-- end -->`. Without the cross compilers and emulators the page is
left alone, and with other compilers than it names nothing is compared.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import lower_file
from kinegen.model.outputs import Quantity, parse_quantity
from kinegen.verify.boards.cost import better, measure, measure_targets
from kinegen.verify.boards.targets import TARGETS, Target, find_cross_compiler, missing
from kinegen.verify.records import Cost

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "firmware.md"
TABLE = re.compile(r"(?P<head><!-- table: (?P<name>\w+) -->\n).*?(?P<tail><!-- end -->)", re.DOTALL)

ROBOTS = ("puma560", "scara", "panda")
"""The robots that run on every board."""

EXAMPLE = "cortex-m4f"
"""The target of most tables, and the one that is measured again for a check."""


OTHERS = tuple(map(parse_quantity, ("pose", "fk_jacobian", "twist", "quaternion_wxyz", "inverse", "numeric_inverse")))
"""The kernels of which the first robot shows the costs, on the targets of `SMALL`."""

SMALL = ("cortex-m0", EXAMPLE)

INVERSES = ("inverse", "numeric_inverse")
SEARCHES = ("inverse_nearest", "numeric_inverse")
KINDS = ("near a solution", "far from one", "out of reach", "not a rotation")
"""Of the first robot, what targets of different kinds cost on the example target."""

GEOMETRY = {"all constant": "", "its lengths at run time": "a2,a3,d3,d4", "all entries at run time": "dh"}
"""Of the first robot, what is an argument of the pose, as `kinegen size --wrt` takes it."""


@dataclass(frozen=True, slots=True)
class Case:
    """One kernel on one target."""

    robot: str
    real: ScalarType
    target: str
    quantity: Quantity = Quantity.POSE
    wrt: str = ""


def main(arguments: list[str]) -> int:
    """Rewrites or checks the page; returns the exit status."""
    before = PAGE.read_text(encoding="utf-8")
    lacking = {name for target in TARGETS.values() for name in missing(target)}
    if lacking:
        print(f"docs/firmware.md is left as it is; measuring needs {', '.join(sorted(lacking))}")
        return 0
    if arguments != ["--all"]:
        stale = stale_lines(before)
        if arguments == ["--check"] and stale:
            print("\n".join(f"+ {line}" for line in stale))
            print("docs/firmware.md is not current: run 'make docs-firmware' and commit what it changes")
        if arguments == ["--check"] or not stale:
            return int(bool(stale))
    tables = {"targets": targets_table(), **measured_tables(Figures(all_cases()))}
    after = TABLE.sub(lambda match: f"{match['head']}\n{tables[match['name']]}\n{match['tail']}", before)
    if after != before:
        PAGE.write_text(after, encoding="utf-8", newline="\n")
        print(PAGE.relative_to(ROOT))
    return 0


def stale_lines(page: str) -> list[str]:
    """Lines that the page should have and has not, of those that are quick to find out."""
    if versions() not in page:
        print(f"docs/firmware.md names other compilers than these: {versions()}")
        return []
    figures = Figures([*(Case(robot, ScalarType.FLOAT, EXAMPLE) for robot in ROBOTS), *geometry_cases()])
    rows = [cells(row) for row in (robot_row(figures, robot) for robot in ROBOTS)]
    wanted = (*targets_table().splitlines(), *rows, *geometry_table(figures).splitlines())
    return [line for line in wanted if line not in page.splitlines()]


class Figures:
    """Costs of kernels, each the better of the optimisation levels."""

    def __init__(self, cases: Iterable[Case]) -> None:
        wanted = list(dict.fromkeys(cases))
        with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
            self._costs = dict(zip(wanted, pool.map(best, wanted), strict=True))

    def __call__(
        self, robot: str, real: ScalarType, target: str, quantity: Quantity = Quantity.POSE, wrt: str = ""
    ) -> Cost:
        """One of them."""
        return self._costs[Case(robot, real, target, quantity, wrt)]


def all_cases() -> list[Case]:
    """Everything that the page shows."""
    return [
        *(Case(robot, ScalarType.FLOAT, target) for target in TARGETS for robot in ROBOTS),
        *(
            Case(ROBOTS[0], ScalarType.DOUBLE, target.name)
            for target in TARGETS.values()
            if ScalarType.DOUBLE in target.reals
        ),
        *(Case(ROBOTS[0], ScalarType.FLOAT, target, quantity) for target in SMALL for quantity in OTHERS),
        *geometry_cases(),
    ]


def geometry_cases() -> list[Case]:
    """The pose of the first robot with constants and with arguments."""
    return [Case(ROBOTS[0], ScalarType.FLOAT, EXAMPLE, wrt=wrt) for wrt in GEOMETRY.values()]


@cache
def kernels(robot: str, quantity: Quantity, wrt: str) -> RobotPrograms:
    """A robot with one quantity."""
    return lower_file(ROOT / "robots" / f"{robot}.yaml", (quantity,), tuple(filter(None, wrt.split(","))))


def best(case: Case) -> Cost:
    """The better of the optimisation levels."""
    costs = measure(kernels(case.robot, case.quantity, case.wrt), case.real, TARGETS[case.target])
    return better([cost for cost in costs if cost.name == str(case.quantity)])


def measured_tables(figures: Figures) -> dict[str, str]:
    """The tables with figures, by name."""
    costs = costs_by_kind()
    doubles = [target for target in TARGETS.values() if ScalarType.DOUBLE in target.reals]
    return {
        "instructions": by_target(figures, lambda cost: f"{cost.calls}"),
        "flash": by_target(figures, lambda cost: f"{cost.flash}"),
        "stack": by_target(figures, lambda cost: f"{cost.stack}"),
        "doubles": table(
            ("target", "flags", "instructions", "flash", "stack"),
            [double_row(figures(ROBOTS[0], ScalarType.DOUBLE, target.name)) for target in doubles],
        ),
        "robots": table(
            ("robot", "flags", "instructions", "function", "flash", "stack", "operations"),
            [robot_row(figures, robot) for robot in ROBOTS],
        ),
        "kernels": table(
            ("target", "kernel", "flags", "instructions", "function", "flash", "stack"),
            [kernel_row(figures, target, quantity) for target in SMALL for quantity in OTHERS],
        ),
        "geometry": geometry_table(figures),
        "targets_of_inverses": table(
            ("function", *KINDS), [(f"`{name}`", *(costs[name, kind] for kind in KINDS)) for name in SEARCHES]
        ),
        "versions": f"Compilers: {versions()}.\n",
    }


def geometry_table(figures: Figures) -> str:
    """The pose of the first robot with constants and with arguments."""
    return table(
        ("geometry", "`--wrt`", "instructions", "function", "flash", "stack"),
        [
            geometry_row(name, figures(ROBOTS[0], ScalarType.FLOAT, EXAMPLE, wrt=wrt), wrt)
            for name, wrt in GEOMETRY.items()
        ],
    )


def geometry_row(name: str, cost: Cost, wrt: str) -> tuple[str, ...]:
    """The figures of one choice of arguments."""
    sizes = (cost.function_flash, cost.flash, cost.stack)
    return name, f"`{wrt}`" if wrt else "", f"{cost.calls}", *(f"{size}" for size in sizes)


def costs_by_kind() -> dict[tuple[str, str], str]:
    """Instructions of the inverses of the first robot for each kind of target."""
    given = lower_file(ROOT / "robots" / f"{ROBOTS[0]}.yaml", tuple(map(parse_quantity, INVERSES)))
    return {key: f"{cost.calls}" for key, cost in measure_targets(given, ScalarType.FLOAT, TARGETS[EXAMPLE]).items()}


def targets_table() -> str:
    """The targets, and what they need."""
    return table(
        ("`--target`", "processor", "flags", "emulated board", "Debian packages"),
        [
            (target.name, target.title, f"`{' '.join(target.flags)}`", board(target), packages(target))
            for target in TARGETS.values()
        ],
    )


def board(target: Target) -> str:
    """The board and what emulates it."""
    return f"{target.board} in {target.emulator.command[0]}"


def packages(target: Target) -> str:
    """The packages that a target needs."""
    return ", ".join(package for group in target.packages().values() for package in group)


def versions() -> str:
    """The compilers with their versions, each once."""
    compilers = [find_cross_compiler(target) for target in TARGETS.values()]
    return ", ".join(dict.fromkeys(f"{compiler.command[0]} {compiler.version}" for compiler in compilers))


def by_target(figures: Figures, show: Callable[[Cost], str]) -> str:
    """One figure of every robot on every target."""
    rows = [(name, *(show(figures(robot, ScalarType.FLOAT, name)) for robot in ROBOTS)) for name in TARGETS]
    return table(("target", *ROBOTS), rows)


def double_row(cost: Cost) -> tuple[str, ...]:
    """The figures of one target."""
    return cost.target, f"`{cost.optimisation}`", f"{cost.calls}", f"{cost.flash}", f"{cost.stack}"


def kernel_row(figures: Figures, target: str, quantity: Quantity) -> tuple[str, ...]:
    """The figures of one kernel."""
    cost = figures(ROBOTS[0], ScalarType.FLOAT, target, quantity)
    sizes = (cost.function_flash, cost.flash, cost.stack)
    return target, f"`{quantity}`", f"`{cost.optimisation}`", f"{cost.calls}", *(f"{size}" for size in sizes)


def robot_row(figures: Figures, robot: str) -> tuple[str, ...]:
    """The figures of one robot."""
    cost = figures(robot, ScalarType.FLOAT, EXAMPLE)
    sizes = (cost.function_flash, cost.flash, cost.stack)
    return robot, f"`{cost.optimisation}`", f"{cost.calls}", *(f"{size}" for size in sizes), f"{cost.operations}"


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table; numbers stand to the right."""
    body = list(rows)
    right = [all(re.fullmatch(r"\d+( to \d+)?", row[column]) for row in body) for column in range(len(head))]
    rule = [" ---: " if each else " --- " for each in right]
    return "".join(f"{line}\n" for line in (cells(head), f"|{'|'.join(rule)}|", *map(cells, body)))


def cells(row: Sequence[str]) -> str:
    """One row."""
    return f"| {' | '.join(row)} |"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
