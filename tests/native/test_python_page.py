"""docs/python.md names every argument of a call and every rule of the names of functions."""

from __future__ import annotations

import ast
import inspect
from pathlib import Path

from kinegen.model.outputs import every_quantity, parse_quantity
from kinegen.runtime.vendored import _kernel

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
EXAMPLES = sorted((ROOT / "docs" / "examples").glob("*.py"))


def test_it_names_every_argument() -> None:
    for call in (_kernel.Kernel.__call__, _kernel.Kernel.bind):
        for name in inspect.signature(call).parameters:
            assert name in ("self", "others", "arrays", "named") or f"`{name}`" in PAGE, name
    for layout in ("4x4", "3x4", "joint_major"):
        assert f'`"{layout}"`' in PAGE


def test_the_rules_of_names_hold_for_every_output() -> None:
    """`pose` is called fk, and @FRAME becomes _FRAME; nothing else is renamed."""
    for quantity in every_quantity():
        assert quantity.function == ("fk" if str(quantity) == "pose" else str(quantity))
    assert parse_quantity("pose@camera").function == "fk_camera"
    assert parse_quantity("jacobian_local@camera").function == "jacobian_local_camera"


def test_shown_programs_are_those_of_the_examples() -> None:
    for name in ("package", "runtime_parameters"):
        text = (ROOT / "docs" / "examples" / f"{name}.py").read_text(encoding="utf-8")
        ast.parse(text)
        assert f"<!-- file: docs/examples/{name}.py -->\n```python\n{text}```" in PAGE
