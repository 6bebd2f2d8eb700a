"""What a build has where nothing is asked for: the pose, the Jacobian, and an inverse where there is one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import kinegen
from kinegen.derive.inverse.classification import has_closed_inverse, with_usual_inverse
from kinegen.io.load import load, loads
from kinegen.model.outputs import DEFAULT, USUAL
from kinegen.ui.api.options import build_options
from kinegen.ui.cli import main
from tests.builds.workshop import ARM, ROBOTS, TREE, write_robot

QUICK: dict[str, Any] = {"real": "double", "compile": False}

PLANAR = """\
kinegen: 1
name: arm
convention: standard
units: {length: m, angle: deg}
joints:
  - {name: shoulder, theta: q, d: 0, a: 0.5, alpha: 0}
  - {name: elbow, theta: q, d: 0, a: 0.25, alpha: 0}
"""

NEARLY = """\
kinegen: 1
name: arm
convention: standard
units: {length: m, angle: deg}
joints:
  - {name: J1, theta: q, d: 0.0892, a: 0, alpha: 90}
  - {name: J2, theta: q, d: 0, a: -0.425, alpha: 0.01}
  - {name: J3, theta: q, d: 0, a: -0.392, alpha: 0}
  - {name: J4, theta: q, d: 0.1093, a: 0, alpha: 90}
  - {name: J5, theta: q, d: 0.09475, a: 0, alpha: -90}
  - {name: J6, theta: q, d: 0.0825, a: 0, alpha: 0}
"""
"""Nearly of the UR type; the kernel of its inverse has thousands of statements."""


@pytest.mark.parametrize(
    ("text", "functions"),
    [(PLANAR, ["fk", "jacobian", "inverse"]), (TREE, ["fk", "jacobian"]), (ARM, ["fk", "jacobian"])],
    ids=["planar", "tree", "no family"],
)
def test_a_build_has_an_inverse_where_there_is_one(text: str, functions: list[str], tmp_path: Path) -> None:
    result = kinegen.build(text, tmp_path, **QUICK)

    assert [quantity.function for quantity in result.counts] == functions
    assert result.notes == kinegen.build(text, tmp_path, outputs="pose,jacobian", **QUICK).notes


def test_an_inverse_that_is_asked_for_and_does_not_exist_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(kinegen.KinegenError, match="arm has no closed-form inverse: it has 2 tips"):
        kinegen.build(TREE, tmp_path, outputs="pose,jacobian,inverse", **QUICK)
    assert not (tmp_path / "arm").exists()


def test_the_command_has_the_same_defaults(tmp_path: Path) -> None:
    path = write_robot(tmp_path, TREE)

    assert main(["build", str(path), "--no-compile", "--real", "double", "-o", str(tmp_path / "out")]) == 0
    header = (tmp_path / "out" / "arm" / "arm.h").read_text(encoding="utf-8")
    assert "kinegen build arm.yaml --outputs pose,jacobian\n" in header


@pytest.mark.parametrize("name", ["ur5", "puma560", "scara", "planar_3r", "iiwa14_arm_angle", "cartesian"])
def test_arms_of_a_family_have_their_inverse(name: str) -> None:
    assert with_usual_inverse(load(ROBOTS / f"{name}.yaml"), DEFAULT) == DEFAULT


@pytest.mark.parametrize("name", ["hand", "blocks", "iiwa14", "screw"])
def test_others_have_none(name: str) -> None:
    assert with_usual_inverse(load(ROBOTS / f"{name}.yaml"), DEFAULT) == DEFAULT[:2]


def test_an_inverse_that_takes_minutes_to_build_is_not_usual() -> None:
    assert not has_closed_inverse(loads(NEARLY, "arm.yaml"))
    assert has_closed_inverse(loads(NEARLY.replace("0.01}", "0}"), "arm.yaml"))


def test_kernels_in_integers_keep_what_they_can_compute() -> None:
    assert build_options(None, outputs=None, real="q30").quantities == USUAL
    assert build_options(None, outputs=None, real="both").quantities == DEFAULT
    assert not build_options(None, outputs="inverse", real="both").usual_inverse
