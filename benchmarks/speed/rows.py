"""One line of the table of results, and the file of all of them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

RATE = "million poses/s"
TIME = "us"


@dataclass(frozen=True, slots=True)
class Row:
    """One measurement.

    Attributes:
        robot: Name of the robot.
        what: What was measured.
        layout: Layout of the result.
        real: Number type.
        threads: Number of threads.
        poses: Configurations in one call.
        flags: Flags of the compiler, or the version of a peer.
        compiler: The compiler; empty where none of ours was used.
        value: The rate, or the time of one call; the median of the turns.
        best: The same in the best turn.
        spread: Distance between the quartiles, as a part of the median.
        unit: `RATE` or `TIME`.
        ratio: A rate as a multiple of another one.
        against: What that other one is.
        asked: The figure to reach, by the ratio or else by the value.
        processor: The processor.
    """

    robot: str
    what: str
    layout: str
    real: str
    threads: int
    poses: int
    flags: str
    compiler: str
    value: float
    best: float
    spread: float
    unit: str = RATE
    ratio: float | None = None
    against: str = ""
    asked: float | None = None
    processor: str = ""

    @property
    def met(self) -> bool | None:
        """Whether the figure was reached; None where none was asked. Times must be shorter, all else larger."""
        if self.asked is None:
            return None
        if self.ratio is not None:
            return self.ratio >= self.asked
        return self.value < self.asked if self.unit == TIME else self.value >= self.asked


@dataclass(frozen=True, slots=True)
class Results:
    """Everything that a run found.

    Attributes:
        machine: The machine in words.
        load: Load average before and after.
        calm: Part of the turns in which no other work took the core away.
        rows: The measurements.
        absent: Peers that took no part, with the reason.
        operations: Additions and multiplications of one pose, by robot, then by number type, kernel and floor.
        peak: Billion operations a second in registers, by number type.
        instructions: Instructions of one pose, by robot and kernel.
    """

    machine: dict[str, str]
    load: tuple[float, float] = (0.0, 0.0)
    calm: float = 1.0
    rows: tuple[Row, ...] = ()
    absent: tuple[tuple[str, str, str], ...] = ()
    operations: dict[str, dict[str, float]] = field(default_factory=dict)
    peak: dict[str, float] = field(default_factory=dict)
    instructions: tuple[dict[str, Any], ...] = ()

    def save(self, path: Path) -> None:
        """Write the file: numbers with four digits, a row on a line, without what a row does not have."""
        path.parent.mkdir(parents=True, exist_ok=True)
        content: dict[str, Any] = _rounded(asdict(self))
        rows = [asdict(row) | {"met": row.met} for row in self.rows]
        content["rows"] = [
            {name: _rounded(value) for name, value in row.items() if value not in (None, "")} for row in rows
        ]
        parts = [f"{json.dumps(name)}: {_lines(value)}" for name, value in content.items()]
        path.write_text("{\n" + ",\n".join(parts) + "\n}\n", encoding="utf-8")


def load_results(path: Path) -> Results:
    """Read a file that `Results.save` wrote."""
    content = json.loads(path.read_text(encoding="utf-8"))
    for row in content["rows"]:
        row.pop("met", None)
    rows = tuple(Row(**{"compiler": "", "flags": "", **row}) for row in content["rows"])
    lists = {name: tuple(map(_frozen, content[name])) for name in ("load", "absent", "instructions")}
    return Results(**{**content, **lists, "rows": rows})


def find(rows: Sequence[Row], **wanted: object) -> Row:
    """The first row with these attributes.

    Raises:
        LookupError: If there is none.
    """
    for row in rows:
        if all(getattr(row, name) == value for name, value in wanted.items()):
            return row
    raise LookupError(f"no row with {wanted}")


def on_processor(rows: Sequence[Row], processor: str) -> tuple[Row, ...]:
    """The rows, each naming the processor."""
    return tuple(replace(row, processor=processor) for row in rows)


def _lines(value: Any) -> str:
    """JSON with each entry of a list on a line of its own."""
    if isinstance(value, list) and value and isinstance(value[0], dict | list):
        return "[\n" + ",\n".join(json.dumps(entry) for entry in value) + "\n]"
    return json.dumps(value)


def _frozen(entry: Any) -> Any:
    return tuple(entry) if isinstance(entry, list) else entry


def _rounded(value: Any) -> Any:
    if isinstance(value, float):
        return float(f"{value:.4g}")
    if isinstance(value, dict):
        return {key: _rounded(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(entry) for entry in value]
    return value
