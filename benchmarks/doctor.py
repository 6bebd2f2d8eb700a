"""How often `kinegen doctor` names the mistake that was planted, and how long it takes.

    python -m benchmarks.doctor              500 tables
    python -m benchmarks.doctor 50 --seed 7  fewer, or other ones

Each table is random, with 6 or 7 joints. One or two mistakes are planted in it, or in how the poses are written, by the
code below and not by that of the doctor. It gets six poses of the right table, with positions rounded to 0.1 mm and
angles to 0.01 degrees, joint values too. Counted is how often the first explanation is the right robot, and how
often the right one is among several that the doctor cannot tell apart.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from decimal import Decimal

import numpy as np

from kinegen.io.load import loads
from kinegen.tools.doctor.diagnosis import Diagnosis, Verdict, examine
from kinegen.tools.doctor.findings import Finding
from kinegen.tools.doctor.observed_poses import Line, Observations, Said, numbers_of, observations
from kinegen.verify import reference

TABLES = 500
POSES = 6
METRES = {"m": 1.0, "mm": 0.001}


@dataclass(frozen=True)
class Row:
    """One row; lengths in metres, angles in degrees."""

    alpha: float
    a: float
    d: float
    offset: float
    sign: int = 1
    prismatic: bool = False


@dataclass(frozen=True)
class Arm:
    """A table, and how it and its poses are written."""

    convention: str
    rows: tuple[Row, ...]
    unit: str
    base: tuple[str, ...] = ()
    tool: tuple[str, ...] = ()
    angle: str = "deg"
    length: str = ""
    joint_angle: str = "deg"
    form: str = "rpy"
    planted: tuple[str, ...] = field(default=())

    def text(self) -> str:
        """The robot file; `length` and `angle` are what it says, the numbers are in `unit` and degrees."""
        size = 1 / METRES[self.unit]
        lines = ["kinegen: 1", "name: arm", f"convention: {self.convention}"]
        lines += [f"units: {{length: {self.length or self.unit}, angle: {self.angle}}}", "joints:"]
        for index, row in enumerate(self.rows, start=1):
            d, q = _number(row.d * size), "-q" if row.sign < 0 else "q"
            theta = f"{q} + {_number(row.offset)}" if row.offset else q
            if row.prismatic:
                theta, d = _number(row.offset), f"{q} + {d}"
            entries = f"alpha: {_number(row.alpha)}, a: {_number(row.a * size)}, d: {d}, theta: {theta}"
            lines.append(f"  - {{name: j{index}, {entries}}}")
        lines += [f"{name}: {{ets: [{', '.join(self._steps(steps))}]}}" for name, steps in self._ends()]
        return "\n".join([*lines, ""])

    def _ends(self) -> Iterator[tuple[str, tuple[str, ...]]]:
        yield from ((name, steps) for name, steps in (("base", self.base), ("tool", self.tool)) if steps)

    def _steps(self, steps: tuple[str, ...]) -> Iterator[str]:
        for step in steps:
            kind, value = step.split()
            yield f"{kind}({_number(float(value) / METRES[self.unit] if kind[0] == 'T' else float(value))})"


def _number(value: float) -> str:
    return f"{value:.10g}"


def random_arm(rng: np.random.Generator) -> Arm:
    """A right table."""
    rows = tuple(_random_row(rng, index) for index in range(int(rng.integers(6, 8))))
    ends = [_random_steps(rng) if rng.random() < 0.4 else () for _ in range(2)]
    form = str(rng.choice(["rpy", "wxyz"]))
    return Arm(
        str(rng.choice(["standard", "modified"])), rows, str(rng.choice(["m", "mm"])), ends[0], ends[1], form=form
    )


def _random_row(rng: np.random.Generator, index: int) -> Row:
    special = rng.random() < 0.9
    alpha = float(rng.choice([0, 90, -90, 90, -90, 180])) if special else float(rng.integers(-170, 170))
    a, d = (float(rng.integers(-60, 60)) / 100 * (rng.random() < 0.6) for _ in range(2))
    return Row(alpha, a, d, float(rng.choice([0, 0, 90, -90, 180])), 1, bool(index and rng.random() < 0.08))


def _random_steps(rng: np.random.Generator) -> tuple[str, ...]:
    lengths = [f"T{axis} {int(rng.integers(-30, 30)) / 100}" for axis in "xyz"]
    return (*lengths, f"R{rng.choice(list('xyz'))} {int(rng.choice([90, -90, 30, 180]))}")


def _in_row(change: Callable[[Row], Row]) -> Callable[[Arm, np.random.Generator], Arm]:
    def planted(arm: Arm, rng: np.random.Generator) -> Arm:
        at = int(rng.integers(len(arm.rows)))
        return replace(arm, rows=(*arm.rows[:at], change(arm.rows[at]), *arm.rows[at + 1 :]))

    return planted


def _quarter(arm: Arm, rng: np.random.Generator) -> Arm:
    amount = float(rng.choice([90, -90, 180]))
    return _in_row(lambda row: replace(row, offset=row.offset + amount))(arm, rng)


def _shift(arm: Arm, rng: np.random.Generator) -> Arm:
    way, which = int(rng.choice([1, -1])), int(rng.integers(3))
    moved = [arm.rows[(index - way) % len(arm.rows)] for index in range(len(arm.rows))]
    columns = [("a", "alpha"), ("a",), ("alpha",)][which]
    rows = (
        replace(row, **{name: getattr(other, name) for name in columns})
        for row, other in zip(arm.rows, moved, strict=True)
    )
    return replace(arm, rows=tuple(rows))


def _convention(arm: Arm, rng: np.random.Generator) -> Arm:
    others = [name for name in ("standard", "modified", "modified_prev_d") if name != arm.convention]
    return replace(arm, convention=str(rng.choice(others)))


def _reversed(steps: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(f"{kind} {-float(value)}" for kind, value in (step.split() for step in reversed(steps)))


MISTAKES: dict[str, Callable[[Arm, np.random.Generator], Arm]] = {
    "convention": _convention,
    "degrees or radians in the file": lambda arm, _: replace(arm, angle="rad"),
    "millimetres or metres": lambda arm, _: replace(arm, length="mm" if arm.unit == "m" else "m"),
    "joint values in radians": lambda arm, _: replace(arm, joint_angle="rad"),
    "order of the orientation": lambda arm, _: replace(arm, form="ypr" if arm.form == "rpy" else "xyzw"),
    "direction of a joint": _in_row(lambda row: replace(row, sign=-row.sign)),
    "zero of a joint": _quarter,
    "sign of alpha": _in_row(lambda row: replace(row, alpha=-row.alpha)),
    "sign of a": _in_row(lambda row: replace(row, a=-row.a)),
    "sign of d": _in_row(lambda row: replace(row, d=-row.d)),
    "shifted rows": _shift,
    "base missing": lambda arm, _: replace(arm, base=()),
    "base reversed": lambda arm, _: replace(arm, base=_reversed(arm.base)),
    "tool missing": lambda arm, _: replace(arm, tool=()),
    "tool reversed": lambda arm, _: replace(arm, tool=_reversed(arm.tool)),
}
"""Everything that is planted: the right arm in, a wrong one out."""


def written_poses(arm: Arm, rng: np.random.Generator, as_arm: Arm) -> tuple[Line, ...]:
    """Rounded poses of the right arm, written as the wrong one says."""
    robot = loads(arm.text(), "arm.yaml")
    moves = np.array([row.prismatic for row in arm.rows])
    size = 1 / METRES[arm.unit]
    q = np.where(moves, rng.uniform(0.05, 0.5, (POSES, len(moves))) * size, rng.uniform(-150, 150, (POSES, len(moves))))
    poses = reference.pose(robot, np.where(moves, q, np.radians(q)))[:, 0]
    shown = np.where(moves, q, np.radians(q)) if as_arm.joint_angle == "rad" else q
    angle_places = 4 if as_arm.joint_angle == "rad" else 2
    length_places = 4 if arm.unit == "m" else 1
    places = [length_places if prismatic else angle_places for prismatic in moves]
    numbers = numbers_of(as_arm.form, poses[:, :3, :3])
    numbers = np.degrees(numbers) if numbers.shape[1] == 3 else numbers
    turn_places = 2 if numbers.shape[1] == 3 else 4
    return tuple(
        Line(
            tuple(Decimal(f"{value:.{place}f}") for value, place in zip(joints, places, strict=True)),
            tuple(Decimal(f"{value:.{length_places}f}") for value in pose[:3, 3]),
            tuple(Decimal(f"{value:.{turn_places}f}") for value in turned),
            index,
        )
        for index, (joints, pose, turned) in enumerate(zip(shown, poses, numbers, strict=True), start=1)
    )


def planted(rng: np.random.Generator, count: int) -> tuple[Arm, Arm]:
    """A right arm, and the same with mistakes."""
    arm = random_arm(rng)
    wrong = arm
    names = list(rng.choice(list(MISTAKES), size=count, replace=False))
    for name in names:
        wrong = MISTAKES[name](wrong, rng)
    return arm, replace(wrong, planted=tuple(map(str, names)))


def observed_by(arm: Arm, wrong: Arm, rng: np.random.Generator) -> Observations:
    """What the doctor gets; units are stated where the mistake is that the file says another one."""
    said = Said(
        angle="deg" if wrong.angle != "deg" and wrong.joint_angle == "deg" else None,
        length=arm.unit if wrong.length else None,
    )
    lines = written_poses(arm, rng, wrong)
    return observations(loads(wrong.text(), "arm.yaml"), lines, said, arm.form)


def is_right(finding: Finding, arm: Arm, wrong: Arm) -> bool:
    """Whether an explanation is the right robot, and the poses are read as they were written."""
    text = finding.text if finding.text is not None else wrong.text()
    setting = finding.candidate.setting
    if setting.joint_angle != wrong.joint_angle or setting.form != wrong.form:
        return False
    right, found = loads(arm.text(), "arm.yaml"), loads(text, "arm.yaml")
    moves = np.array([row.prismatic for row in arm.rows])
    q = np.random.default_rng(0).uniform(-1, 1, (16, right.dof))
    sizes = [METRES[robot.units.length] for robot in (right, found)]
    ours, theirs = (
        reference.pose(robot, np.where(moves, q / size, q))[:, 0] * np.array([1, 1, 1, size])
        for robot, size in zip((right, found), sizes, strict=True)
    )
    # A base or tool that was solved for is as exact as the poses.
    solved = finding.candidate.base is not None or finding.candidate.tail is not None
    return bool(np.abs(ours - theirs)[:, :3].max() < (2e-3 if solved else 1e-8))


def cases(tables: int, seed: int) -> Iterator[tuple[Arm, Diagnosis, bool, bool, float]]:
    """Each wrong arm with what is said of it, whether the first and whether any explanation is right, and the time."""
    rng = np.random.default_rng(seed)
    done = 0
    while done < tables:
        arm, wrong = planted(rng, 1 + done % 2)
        observed = observed_by(arm, wrong, rng)
        begin = time.process_time()
        found = examine(wrong.text(), "arm.yaml", observed, "tool")
        seconds = time.process_time() - begin
        if found.start.fits:
            continue  # what was planted changes nothing, such as the sign of a zero
        done += 1
        right = [is_right(finding, arm, wrong) for finding in found.findings]
        yield wrong, found, bool(right and right[0] and found.findings[0].candidate.fits), any(right), seconds


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("tables", nargs="?", type=int, default=TABLES)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--verbose", action="store_true", help="print each miss")
    options = parser.parse_args()
    counts: Counter[str] = Counter()
    times = []
    for number, (wrong, found, first, among, seconds) in enumerate(cases(options.tables, options.seed), start=1):
        times.append(seconds)
        several = found.verdict is Verdict.AMBIGUOUS
        kind = "first" if first else "among several" if among and several else "missed"
        counts[kind] += 1
        counts["first and alone"] += first and not several
        if options.verbose and kind != "first":
            print(number, kind, found.verdict, wrong.planted, [each.words for each in found.findings][:3], flush=True)
    total = len(times)
    print(f"{total} tables, one or two mistakes, {POSES} rounded poses")
    for kind in ("first", "first and alone", "among several", "missed"):
        print(f"  {kind:<16} {counts[kind]:>5}  {counts[kind] / total:.1%}")
    print(f"  seconds of one processor: median {statistics.median(times):.2f}, worst {max(times):.2f}")


if __name__ == "__main__":
    main()
