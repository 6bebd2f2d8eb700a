"""A whole build with an inverse: C, batch and NumPy, double and float, with runtime lengths, proved there and back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from kinegen.backends.scalar_types import ScalarType
from kinegen.model.outputs import Kind, Quantity
from kinegen.runtime.extension import load_package
from kinegen.verify import closed_form_inverse
from tests.builds.workshop import make, set_machine, write_robot

SCARA = """\
kinegen: 1
name: scara_4
description: SCARA with four joints
convention: standard
units: {length: mm, angle: deg}
parameters:
  a1: {value: 225, runtime: true}
  a2: {value: 175, runtime: true}
joints:
  - {name: shoulder, theta: q, d: 150, a: a1, alpha: 0, limits: [-132, 132]}
  - {name: elbow, theta: q, d: 0, a: a2, alpha: 180, limits: [-141, 141]}
  - {name: stroke, theta: 0, d: q, a: 0, alpha: 0, limits: [0, 150]}
  - {name: roll, theta: q, d: 0, a: 0, alpha: 0, limits: [-360, 360]}
"""


def test_a_build_with_an_inverse(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    set_machine(monkeypatch, tmp_path / "cache")
    monkeypatch.setattr(closed_form_inverse, "TARGETS", 2000)
    monkeypatch.setattr(closed_form_inverse, "FEWER", 500)
    quantities = (Quantity.POSE, Quantity(Kind.INVERSE))
    result = make(write_robot(tmp_path, SCARA, "scara_4.yaml"), tmp_path, quantities=quantities)
    targets = {each.target for each in result.proof.comparisons if each.quantity.kind is Kind.INVERSE}
    header = (tmp_path / "scara_4" / "scara_4.h").read_text(encoding="utf-8")
    package = load_package(tmp_path / "scara_4")
    q = np.array([0.3, -0.8, 40.0, 5.0])
    moved = package.Params(250.0, 160.0)
    found, exists = package.inverse(package.fk(q, params=moved), nearest=q + 0.1, params=moved)

    assert result.proof.holds
    assert targets == {
        f"{way}, there and back{parameters}"
        for real in ("double", "float")
        for way in (f"C {real}", f"C {real}, batch", f"C {real}, batch joint_major", f"NumPy {real}")
        for parameters in ("", ", other parameters")
    }
    assert any(line.startswith("inverse: 2,000 random targets") for line in result.proof.counts)
    assert " *   0  elbow up\n *   1  elbow down\n" in header
    assert "#define SCARA_4_BRANCHES 2\n" in header
    assert exists
    np.testing.assert_allclose(found, q, atol=1e-9)


MILLIMETRES = "kinegen: 1\nname: arm\nconvention: standard\nunits: {length: mm, angle: deg}\n"

ALLOWANCES = {
    # Its room outside the limits is that of the file's lengths, also where it is called with others.
    "runtime lengths": """\
parameters:
  upper: {value: 250, runtime: true}
  extra: {value: 20, runtime: true}
joints:
  - {name: x, a: 0, alpha: 90, d: 300, theta: q, limits: [-170, 170]}
  - {name: y, a: upper, alpha: 0, d: 0, theta: q, limits: [-90, 90]}
  - {name: z, a: 200 + extra, alpha: 0, d: 0, theta: q, limits: [-150, 150]}
""",
    # A self-test is to fail where joints are wrong by more than rounding, which goes by the size of the arm.
    "long slides": """\
joints:
  - {name: x, ets: [Tx(q)], limits: [0, 3000]}
  - {name: y, ets: [Ty(q)], limits: [0, 2500]}
  - {name: z, ets: [Tz(q)], limits: [0, 1000]}
""",
}


@pytest.mark.parametrize("text", ALLOWANCES.values(), ids=ALLOWANCES)
def test_arms_in_millimetres_are_verified_in_single_precision(
    text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    set_machine(monkeypatch, tmp_path / "cache")
    path = write_robot(tmp_path, MILLIMETRES + text)
    result = make(path, tmp_path / "out", quantities=(Quantity(Kind.INVERSE),), reals=(ScalarType.FLOAT,))

    assert result.proof.holds
