"""Joints called base or wrist, as on Universal Robots: allowed where no frame needs the name for itself."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kinegen.derive.dispatch import derive
from kinegen.errors import RobotFileError
from kinegen.io.load import load, loads
from kinegen.ir.lower import lower
from kinegen.model.joint_bounds import reach
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import BASE, ROOT, Robot
from kinegen.ui.cli import main
from kinegen.verify import reference
from tests.evaluation import run

ARM = """kinegen: 1
name: arm
convention: standard
units: {length: m, angle: deg}
base: {rpy: [0, 0, 180], xyz: [0, 0, 0.5]}
joints:
  - {name: base, a: 0, alpha: 90, d: 0.18, theta: q}
  - {name: shoulder, a: -0.61, alpha: 0, d: 0, theta: q}
  - {name: wrist, a: 0.2, alpha: 90, d: 0.17, theta: q}
  - {name: last, a: 0, alpha: -90, d: 0.12, theta: q}
frames:
  camera: {parent: shoulder, xyz: [0.1, 0, 0]}
"""
OTHER = ARM.replace("name: base", "name: waist").replace("name: wrist", "name: bend")
NAMES = {"base": "waist", "wrist": "bend"}


def loaded(text: str) -> Robot:
    """A robot."""
    return loads(text, "arm.yaml")


def test_the_same_arm_with_other_names_has_the_same_poses() -> None:
    q = np.random.default_rng(1).uniform(-3, 3, (5, 4))
    one, other = reference.frames(loaded(ARM), q), reference.frames(loaded(OTHER), q)

    assert set(loaded(ARM).frame_names) == {"base", "shoulder", "wrist", "last", "tool", "camera"}
    for name in loaded(ARM).frame_names:
        assert (one[name] == other[NAMES.get(name, name)]).all()
    assert (one[ROOT] == np.eye(4)).all()
    assert reach(loaded(ARM), ["base", "tool"]) == reach(loaded(OTHER), ["waist", "tool"])


@pytest.mark.parametrize("kind", [Kind.POSE, Kind.FRAMES, Kind.JACOBIAN, Kind.POSITION, Kind.HESSIAN])
def test_kernels_are_those_of_the_other_names(kind: Kind) -> None:
    one, other = (lower(derive(loaded(text), Quantity(kind))) for text in (ARM, OTHER))

    assert one.statements == other.statements
    assert one.outputs == other.outputs


@pytest.mark.parametrize("frame", ["base", "wrist"])
def test_a_function_for_the_frame_of_such_a_joint(frame: str) -> None:
    q = np.array([[0.3, -0.4, 0.5, 0.6]])
    robot = loaded(ARM)

    found = run(robot, lower(derive(robot, Quantity(Kind.POSE, frame=frame))), q)
    assert found[0] == pytest.approx(reference.frames(robot, q)[frame][0, :3].ravel(), abs=1e-14)


def test_other_robots_keep_the_name_of_their_root() -> None:
    assert loaded(OTHER).root == BASE
    assert loaded(ARM).root == ROOT
    assert replace(loaded(ARM), rows=loaded(OTHER).rows).root == BASE


def test_printouts_call_the_root_base(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "arm.yaml"
    path.write_text(ARM, encoding="utf-8")
    for arguments in (["show"], ["show", "--output", "jacobian"], ["show", "--steps"], ["inspect"], ["check"]):
        assert main([arguments[0], str(path), *arguments[1:]]) == 0
        assert ROOT not in capsys.readouterr().out
    assert main(["show", str(path), "--from", "base"]) == 1
    assert "'base' is a joint of this robot as well as its root frame" in capsys.readouterr().err
    assert main(["fk", str(path), "0", "0", "0", "0", "--frame", "nothing"]) == 1
    assert "(expected base, shoulder, wrist, last, tool, camera, or" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("parent: shoulder", "parent: base"), "frame 'camera': 'base' is a joint here (line 7) as well as the root"),
        (("parent: shoulder", "parent: wrist"), "frame 'camera': 'wrist' is a joint here (line 9), and elsewhere the"),
        (("{name: last,", "{name: last, parent: base,"), "joint 4 (last): parent: 'base' is a joint here (line 7)"),
        (("name: last", "name: tool"), "joint name 'tool' is a word of the robot file itself"),
        (("camera:", "base:"), "frame name 'base' is a word of the robot file itself"),
    ],
)
def test_what_such_a_joint_makes_ambiguous_is_refused(change: tuple[str, str], message: str) -> None:
    with pytest.raises(RobotFileError, match=re.escape(message)):
        loaded(ARM.replace(*change))


def test_the_last_joint_may_be_called_wrist_and_carry_frames() -> None:
    text = ARM.replace("name: wrist", "name: bend").replace("name: last", "name: wrist")
    robot = loaded(text.replace("parent: shoulder", "parent: wrist"))

    found = reference.frames(robot, np.zeros(4))
    assert found["camera"][0] == pytest.approx(found["wrist"][0] @ shifted(0.1))


def shifted(length: float) -> np.ndarray:
    """A shift along x."""
    matrix = np.eye(4)
    matrix[0, 3] = length
    return matrix


def test_a_file_on_disk_is_read_likewise(tmp_path: Path) -> None:
    path = tmp_path / "arm.yaml"
    path.write_text(ARM, encoding="utf-8")

    assert load(path).digest == loaded(ARM).digest
