"""What a build computes once, although several stages need it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from kinegen.backends.c import kernel
from kinegen.backends.fixed_point import kernels as fixed
from kinegen.backends.scalar_types import ScalarType
from kinegen.derive.inverse import derive as inverse
from kinegen.model.outputs import Kind, Quantity
from tests.builds.workshop import make, write_robot

ARM = """\
kinegen: 1
name: arm
convention: standard
units: {length: m, angle: deg}
joints:
  - {name: near, theta: q, d: 0, a: 0.41, alpha: 0}
  - {name: far, theta: q, d: 0, a: 0.29, alpha: 0}
"""


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    """How often each of the functions runs."""
    found: Counter[str] = Counter()

    def counting(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            found[name] += 1
            return function(*arguments)

        return call

    for module, name in ((inverse, "recognise"), (kernel, "_promises"), (fixed, "plan_fixed")):
        monkeypatch.setattr(module, name, counting(name, getattr(module, name)))
    return found


def test_the_family_and_the_manual_of_a_file_are_found_once(tmp_path: Path, counted: Counter[str]) -> None:
    """Of a build with an inverse: emitters and the proof read what the derive stage found."""
    make(write_robot(tmp_path, ARM), tmp_path / "out", quantities=(Quantity.POSE, Quantity(Kind.INVERSE)))

    assert counted == {"recognise": 1, "_promises": len(ScalarType)}


def test_integer_kernels_are_planned_once(tmp_path: Path, counted: Counter[str]) -> None:
    make(write_robot(tmp_path, ARM), tmp_path / "out", reals=(ScalarType.DOUBLE,), integers=True)

    assert counted == {"plan_fixed": 1, "_promises": 1}
