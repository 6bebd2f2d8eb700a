"""Short robot files for the tests, so that each test shows only the entries that it is about."""

from __future__ import annotations

from kinegen.io.load import loads
from kinegen.model.expression_parser import Expression, parse
from kinegen.model.robot import Robot, Row

HEAD = """kinegen: 1
name: arm
convention: {convention}
units: {{length: m, angle: {angle}}}
"""


def robot(*rows: str, convention: str = "standard", angle: str = "deg", more: str = "") -> Robot:
    """Load a file.

    Args:
        rows: The rows of the table, such as `{name: waist, ...}`.
        convention: Convention of the file.
        angle: Angle unit.
        more: Further top-level entries, as YAML.
    """
    table = "joints:\n" + "".join(f"  - {row}\n" for row in rows) if rows else "joints: []\n"
    return loads(HEAD.format(convention=convention, angle=angle) + more + "\n" + table, "arm.yaml")


def row_of(entries: str, **options: str) -> Row:
    """The last row of a table of two revolute joints, `one` and `two`, and a slide, `slide`, before it."""
    found = robot(
        "{name: one, a: 0.1, alpha: 0, d: 0, theta: q}",
        "{name: two, a: 0.1, alpha: 0, d: 0, theta: q}",
        "{name: slide, a: 0, alpha: 0, d: q, theta: 0}",
        f"{{name: last, {entries}}}",
        **options,
    )
    return found.rows[-1]


def entry(key: str, text: str, **options: str) -> Expression:
    """One entry of a table row in kernel units."""
    entries = {"a": "0", "alpha": "0", "d": "0", "theta": "0"} | {key: text}
    row = row_of(", ".join(f"{name}: {value}" for name, value in entries.items()), **options)
    value = {"a": row.a, "alpha": row.alpha, "d": row.d, "theta": row.theta}[key]
    assert value is not None
    return value


def exact(text: str) -> Expression:
    """An expression in kernel units, as the tests write it."""
    return parse(text)
