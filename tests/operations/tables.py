"""Tables of arms: those of textbooks and papers, odd ones, and random ones, some with mounts between their joints.

A line is `name: convention: row; row; ...`. A row is `R theta d a alpha` or `P theta d a alpha`, a turning or a sliding
joint with its fixed angles in degrees and its fixed lengths in metres. The joint variable is added to theta or to d, or
subtracted if the letter has a minus sign. A row `F x y z roll pitch yaw` is a fixed mount: a translation, then
turns about z, y and x. After `@` is the tool, as x, y and z.
"""

from __future__ import annotations

import random
from dataclasses import dataclass
from pathlib import Path

from kinegen.io.load import loads
from kinegen.model.robot import Robot


@dataclass(frozen=True)
class Row:
    """One row: angles in degrees, lengths in metres."""

    is_turning: bool
    sign: int
    theta: str
    d: str
    a: str
    alpha: str


@dataclass(frozen=True)
class Mount:
    """A fixed transform: a translation in metres, then turns by yaw, pitch and roll in degrees."""

    xyz: tuple[str, str, str]
    rpy: tuple[str, str, str]

    @property
    def turns(self) -> tuple[tuple[int, str], ...]:
        """Axis and angle of each turn that is none by zero, the first one first."""
        roll, pitch, yaw = self.rpy
        return tuple((axis, angle) for axis, angle in ((2, yaw), (1, pitch), (0, roll)) if float(angle))


@dataclass(frozen=True)
class Table:
    """One arm."""

    name: str
    convention: str
    rows: tuple[Row | Mount, ...]
    tool: tuple[str, str, str]

    @property
    def joints(self) -> int:
        """How many joints there are."""
        return sum(isinstance(row, Row) for row in self.rows)

    def robot(self) -> Robot:
        """The arm as kinegen reads it."""
        lines = ["kinegen: 1", f"name: arm_{self.name}", f"convention: {self.convention}"]
        lines += ["units: {length: m, angle: deg}", "joints:"]
        for number, row in enumerate(self.rows, 1):
            if isinstance(row, Mount):
                steps = [f"T{axis}({size})" for axis, size in zip("xyz", row.xyz, strict=True) if float(size)]
                steps += [f"R{'xyz'[axis]}({angle})" for axis, angle in row.turns]
                lines.append(f"  - {{name: j{number}, ets: [{', '.join(steps)}]}}")
                continue
            variable = " + q" if row.sign > 0 else " - q"
            theta, d = row.theta + variable * row.is_turning, row.d + variable * (not row.is_turning)
            lines.append(f"  - {{name: j{number}, theta: {theta}, d: {d}, a: {row.a}, alpha: {row.alpha}}}")
        if any(float(each) for each in self.tool):
            lines.append(f"tool: {{xyz: [{', '.join(self.tool)}]}}")
        return loads("\n".join(lines), f"{self.name}.yaml")


def _table(line: str) -> Table:
    name, convention, text = (part.strip() for part in line.split(":"))
    text, _, tool = text.partition("@")
    rows: list[Row | Mount] = []
    for row in text.split(";"):
        letter, *numbers = row.split()
        if letter == "F":
            dx, dy, dz, roll, pitch, yaw = numbers
            rows.append(Mount((dx, dy, dz), (roll, pitch, yaw)))
            continue
        theta, d, a, alpha = numbers
        rows.append(Row(letter[-1] == "R", -1 if letter[0] == "-" else 1, theta, d, a, alpha))
    x, y, z = tool.split() or ("0", "0", "0")
    return Table(name, convention, tuple(rows), (x, y, z))


def _random_table(seed: int) -> Table:
    """Three to six joints; quarter turns mostly, lengths that are often zero and sometimes equal."""
    draw = random.Random(f"table {seed}")
    lengths = ["0", "0", *(f"{draw.uniform(0.05, 0.9):.3f}" for _ in range(3))]
    rows = tuple(
        Row(
            draw.random() < 0.8,
            draw.choice((1, 1, 1, -1)),
            draw.choice(("0", "0", "90", "-90", "180")),
            draw.choice(lengths),
            draw.choice(lengths),
            draw.choice(("0", "0", "90", "-90", "180", "90", "-90", draw.choice(("45", "30", "-60")))),
        )
        for _ in range(draw.randint(3, 6))
    )
    return Table(f"random_{seed}", draw.choice(("standard", "modified")), rows, ("0", "0", draw.choice(lengths)))


def _mounted_table(seed: int) -> Table:
    """Two to five joints with mounts between them that are turned by roll, pitch and yaw."""
    draw = random.Random(f"mounted table {seed}")
    angles = draw.choice(
        (("0", "0", "45", "90"), ("0", "30", "-60", "90"), ("0", "0", "0", "17.3", "-40"), ("12", "0"))
    )
    lengths = ("0", "0", *(f"{draw.uniform(0.05, 0.9):.3f}" for _ in range(2)))
    turns = ("0", "0", "0", "90", "-90", "180")
    rows: list[Row | Mount] = []
    for place in range(joints := draw.randint(2, 5)):
        rows.append(
            Row(
                draw.random() < 0.75,
                draw.choice((1, 1, -1)),
                draw.choice(turns),
                draw.choice(lengths),
                draw.choice(lengths),
                draw.choice(("0", "0", "90", "-90", draw.choice(angles))),
            )
        )
        if draw.random() < (0.8 if place == joints - 1 else 0.45):
            roll, pitch, yaw = (draw.choice(angles) for _ in range(3))
            x, y, z = (draw.choice(lengths) for _ in range(3))
            rows.append(Mount((x, y, z), (roll, pitch, yaw)))
    return Table(f"mounted_{seed}", draw.choice(("standard", "modified")), tuple(rows), ("0", "0", "0"))


NAMED = tuple(map(_table, (Path(__file__).with_name("tables.txt")).read_text(encoding="utf-8").splitlines()))
RANDOM = tuple(_random_table(seed) for seed in range(120 - len(NAMED)))
MOUNTED = tuple(_mounted_table(seed) for seed in (*range(0, 60, 3), 5, 58))
TABLES = (*NAMED, *RANDOM, *MOUNTED)
