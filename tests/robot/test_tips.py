"""Named tips: frames of a tree that are tips, in the order of the links that they are on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from kinegen.derive.dispatch import derive
from kinegen.io.load import loads
from kinegen.ir.lower import lower
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import Robot
from kinegen.ui.cli import main
from kinegen.verify import reference
from tests.evaluation import run

TREE = """kinegen: 1
name: gripper
convention: standard
units: {length: mm, angle: deg}
joints:
  - {name: palm, theta: q, d: 0, a: 10, alpha: 90}
  - {name: index_1, parent: palm, theta: q, d: 0, a: 40, alpha: 0}
  - {name: index_2, theta: q, d: 0, a: 30, alpha: 0}
  - {name: thumb, parent: palm, theta: q, d: 5, a: 35, alpha: 0}
"""
FRAMES = """frames:
  index_nail: {parent: index_pad, xyz: [0, 8.5, 0], tip: true}
  index_pad: {parent: index_2, xyz: [-2, -4, 0], rpy: [0, 0, 90], tip: true}
  camera: {parent: palm, xyz: [0, 0, 20], tip: false}
  knuckle: {parent: index_1, xyz: [0, 3, 0], tip: true}
"""
TIPS = ("knuckle", "index_pad", "index_nail", "thumb")


def gripper(frames: str = FRAMES) -> Robot:
    """The gripper with some frames."""
    return loads(TREE + frames, "gripper.yaml")


def test_a_named_tip_takes_the_place_of_the_leaf_that_it_is_on() -> None:
    """One on an inner link is a tip beside the leaves, and a leaf without one stays a tip."""
    assert gripper("").tips == ("index_2", "thumb")
    assert gripper("frames: {pad: {parent: index_2, tip: true}}").tips == ("pad", "thumb")
    assert gripper("frames: {knuckle: {parent: index_1, tip: true}}").tips == ("knuckle", "index_2", "thumb")
    assert gripper("frames: {pad: {parent: thumb, tip: true}}").tips == ("index_2", "pad")


def test_tips_come_in_the_order_of_their_links() -> None:
    assert gripper().tips == TIPS


def test_tips_may_hang_on_frames_that_are_none() -> None:
    frames = "frames: {mount: {parent: thumb, xyz: [1, 0, 0]}, pad: {parent: mount, xyz: [0, 1, 0], tip: true}}"

    assert gripper(frames).tips == ("index_2", "pad")
    assert gripper(frames).frame_links == {"mount": "thumb", "pad": "thumb"}


def test_a_frame_that_is_no_tip_leaves_the_model_as_it_was() -> None:
    """The hash of a file with `tip: false` is that of a file without the key; a tip is another model."""
    plain, said, tip = (
        gripper(f"frames: {{pad: {{parent: thumb{more}}}}}") for more in ("", ", tip: false", ", tip: true")
    )

    assert plain.digest == said.digest != tip.digest
    assert plain.digest == "9c0b913ff1314cab"


@pytest.mark.parametrize("kind", [Kind.POSE, Kind.POSITION, Kind.JACOBIAN, Kind.TWIST])
def test_results_of_tips_are_those_of_their_frames(kind: Kind) -> None:
    """Kernels of all tips against kernels of each frame alone."""
    robot = gripper()
    together = lower(derive(robot, Quantity(kind)))
    generator = np.random.default_rng(3)
    q, *further = (generator.uniform(-1, 1, (5, *array.shape)) for array in together.signature.inputs)
    found = run(robot, together, q, further=tuple(further)).reshape(5, len(TIPS), -1)

    for place, tip in enumerate(TIPS):
        alone = lower(derive(robot, Quantity(kind, frame=tip)))
        expected = run(robot, alone, q, further=tuple(further))
        np.testing.assert_allclose(found[:, place], expected, rtol=0, atol=1e-12)


def test_the_reference_has_tips_where_their_frames_are() -> None:
    robot = gripper()
    q = np.random.default_rng(4).uniform(-2, 2, (6, 4))
    frames = reference.frames(robot, q)
    poses = reference.pose(robot, q)

    for place, tip in enumerate(TIPS):
        assert (poses[:, place] == frames[tip]).all()
    turned = np.array([[0, -1, 0, -2], [1, 0, 0, -4], [0, 0, 1, 0], [0, 0, 0, 1]])
    np.testing.assert_allclose(frames["index_pad"], frames["index_2"] @ turned, atol=1e-12)


def test_commands_call_tips_by_their_names(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "gripper.yaml"
    path.write_text(TREE + FRAMES, encoding="utf-8")

    assert main(["fk", str(path), "0", "0", "0", "0"]) == 0
    assert [line for line in capsys.readouterr().out.splitlines() if "base_T" in line] == [
        f"base_T_{tip}" for tip in TIPS
    ]
    assert main(["inspect", str(path)]) == 0
    assert f"it has 4 tips, not one: {', '.join(TIPS)}" in capsys.readouterr().out
    assert main(["show", str(path)]) == 0
    shown = capsys.readouterr().out
    assert all(f"base_T_{tip}" in shown for tip in TIPS)
