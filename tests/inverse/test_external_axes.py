"""Tracks and turntables: several joints given, and a tool in the frame of a workpiece that moves too."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import kinegen
from kinegen.derive.dispatch import derive
from kinegen.derive.inverse.classification import NotClosedForm, recognise
from kinegen.derive.inverse.derive import family_of
from kinegen.driver.pipeline import lower_file
from kinegen.errors import KinegenError, ProofError
from kinegen.io.load import load, loads
from kinegen.io.robot_file.write import write
from kinegen.ir.lower import lower
from kinegen.model.dh_conversion.elementary_transforms import chain_of, seen_chain
from kinegen.model.outputs import Quantity, parse_quantity
from kinegen.model.robot import Robot
from kinegen.model.variants import with_redundancy
from kinegen.runtime.extension import load_package
from kinegen.ui.cli import main
from kinegen.verify import closed_form_inverse, reference
from kinegen.verify import closed_form_inverse as proof
from kinegen.verify.branches import require_names
from tests.builds.workshop import ROBOTS, make, set_machine
from tests.inverse.arms import Arm, distances, errors, evaluate, joint_vectors

CELL = load(ROBOTS / "ur5_track_table.yaml")
HANGING = load(ROBOTS / "hanging_arm.yaml")
SEEN = parse_quantity("inverse@tool_tip/workpiece")


def arm_of(robot: Robot, quantity: Quantity) -> Arm:
    """The chain of an inverse, and its kernel."""
    chain = chain_of(robot, quantity)
    return Arm(chain, family_of(chain), lower(derive(robot, quantity)), ())


@pytest.mark.parametrize(
    ("name", "frame", "other"),
    [
        ("ur5_track_table", "tool_tip", "workpiece"),
        ("ur5_track_table", "workpiece", "tool_tip"),
        ("ur5_track_table", "elbow", ""),
        ("ur5_track_table", "base", "table"),
        ("trunnion_mill", "cutter", "workpiece"),
        ("trunnion_mill", "workpiece", "cutter"),
        ("hand", "thumb_tip", "index_tip"),
        ("nutating_mill", "workpiece", ""),
        ("puma560", "tool", "elbow"),
        ("standard_frames", "tool", "wrist"),
    ],
)
def test_a_way_is_a_chain_of_its_own(name: str, frame: str, other: str) -> None:
    robot = load(ROBOTS / f"{name}.yaml")
    if other == "wrist" and other not in robot.frame_names:
        other = robot.rows[0].name
    chain, q = seen_chain(robot, frame, other), joint_vectors(robot, 20, 1)
    way = reference.Kinematics(robot, q).pose(f"{frame}/{other}" if other else frame)

    assert not chain.is_tree
    assert [each.name for each in chain.variables] == [each.name for each in robot.variables]
    np.testing.assert_allclose(reference.pose(chain, q)[:, 0], way, atol=1e-9 * max(1, np.abs(way).max()))


def test_a_wrong_chain_is_not_proven(monkeypatch: pytest.MonkeyPatch) -> None:
    closed_form_inverse.require_same_way(CELL, SEEN)
    monkeypatch.setattr(closed_form_inverse, "chain_of", lambda robot, _: seen_chain(robot, "tool_tip", "table"))
    with pytest.raises(ProofError, match=r"the chain of inverse@tool_tip/workpiece has other poses than the robot"):
        closed_form_inverse.require_same_way(CELL, SEEN)


@pytest.mark.parametrize("output", ["inverse@tool_tip/workpiece", "inverse@workpiece/tool_tip", "inverse@tool_tip"])
def test_every_solution_leads_back_and_none_is_missed(output: str) -> None:
    arm = arm_of(CELL, parse_quantity(output))
    q = joint_vectors(CELL, 300, 2)
    poses, given = reference.pose(arm.robot, q)[:, 0], reference.redundancy(CELL, q)
    solutions, valid = evaluate(arm, poses, given)
    solved = valid != 0

    np.testing.assert_array_equal(given, q[:, [0, 7]])
    assert errors(arm, solutions, poses)[solved].max() < 1e-9
    assert np.where(solved, distances(arm, solutions, q), np.inf).min(axis=1).max() < 1e-6
    np.testing.assert_array_equal(solutions[..., [0, 7]], np.broadcast_to(given[:, None], (300, 8, 2)))
    require_names(arm.robot, arm.family.branches, arm.family, "the formula", solutions, solved)


@pytest.mark.parametrize("output", ["inverse@tool_tip/workpiece", "inverse@tool_tip"])
@pytest.mark.parametrize("place", [0, 1])
def test_values_outside_limits_and_no_numbers_are_not_solved(output: str, place: int) -> None:
    arm = arm_of(CELL, parse_quantity(output))
    q = joint_vectors(CELL, 50, 3)
    poses, given = reference.pose(arm.robot, q)[:, 0], reference.redundancy(CELL, q)
    limit = (1.5, 4 * np.pi)[place]
    for value in (np.nan, np.inf, -np.inf, 1e9, limit + 1e-6, -limit - 1e-6):
        spoilt = given.copy()
        spoilt[:, place] = value
        assert not evaluate(arm, poses, spoilt)[1].any(), value
    q[:, [0, 7][place]] = limit
    assert evaluate(arm, reference.pose(arm.robot, q)[:, 0], reference.redundancy(CELL, q))[1].any(axis=1).all()


def test_a_joint_beside_the_way_without_limits_has_to_be_a_number() -> None:
    free = replace(CELL, variables=tuple(replace(each, limits=None) for each in CELL.variables))
    arm = arm_of(free, parse_quantity("inverse@tool_tip"))
    q = joint_vectors(CELL, 20, 4)
    poses, given = reference.pose(arm.robot, q)[:, 0], reference.redundancy(CELL, q)

    assert evaluate(arm, poses, given)[1].any(axis=1).all()
    for value in (np.nan, np.inf, -np.inf):
        given[:, 1] = value
        assert not evaluate(arm, poses, given)[1].any()


def test_the_order_of_the_values_is_that_of_the_list() -> None:
    q = joint_vectors(HANGING, 30, 5)
    poses = reference.pose(HANGING, q)[:, 0]
    there, back = HANGING, with_redundancy(HANGING, ["rail", "lift"])
    results = [
        evaluate(arm_of(robot, parse_quantity("inverse")), poses, q[:, own])
        for robot, own in ((there, [1, 0]), (back, [0, 1]))
    ]

    for one, other in zip(*results, strict=True):
        np.testing.assert_array_equal(one, other)
    assert results[0][1].any(axis=1).all()
    wrong = evaluate(arm_of(there, parse_quantity("inverse")), poses, q[:, [0, 1]])
    assert not (np.abs(wrong[0] - q[:, None]).max(axis=2)[wrong[1] != 0] < 1e-3).any()


def test_words_say_which_number_is_which() -> None:
    signature = derive(CELL, SEEN).signature

    assert [array.name for array in signature.inputs] == ["workpiece_T_tool_tip", "redundancy"]
    assert signature.inputs[1].shape == (2,)
    assert signature.inputs[1].words == "values of the joints that are given: [0] track in m, [1] table in rad"
    assert signature.branches is not None
    assert signature.branches.redundancy == "track,table"
    assert signature.branches.conditions[-1] == (
        "redundancy has the values of track (m) and table (rad), in this order, which must be within their limits"
    )


REFUSED = {
    "track": "joint 8 (table) moves nothing",
    "table,elbow": "redundancy: elbow is in the middle of the chain, only track or wrist_3 can be given beside table",
    "elbow": "redundancy: elbow is in the middle of the chain, only table or wrist_3 can be given",
}


@pytest.mark.parametrize("names", REFUSED)
def test_what_cannot_be_given_is_named(names: str) -> None:
    quantity = parse_quantity("inverse@tool_tip") if names == "track" else SEEN
    with pytest.raises(KinegenError) as caught:
        derive(with_redundancy(CELL, names), quantity)

    assert REFUSED[names] in caught.value.message


def test_a_joint_behind_a_position_cannot_be_given() -> None:
    puma = load(ROBOTS / "puma560.yaml")
    found = recognise(with_redundancy(puma, [variable.name for variable in puma.variables[3:]]))

    assert isinstance(found, NotClosedForm)
    (reason,) = found.reasons
    assert (
        f"the arm before {', '.join(each.name for each in puma.variables[3:])} is solved for a position, which does not"
        in reason
    )


def test_outputs_that_do_not_exist_are_refused() -> None:
    with pytest.raises(
        KinegenError,
        match=r"2 tips, not one: tool_tip, workpiece; numeric_inverse takes targets of all tips",
    ):
        derive(CELL, parse_quantity("inverse"))
    with pytest.raises(KinegenError, match="inverse@elbow: puma560 has one tip, whose inverse is called inverse"):
        derive(load(ROBOTS / "puma560.yaml"), parse_quantity("inverse@elbow"))
    with pytest.raises(KinegenError, match="unknown frame 'tip'"):
        derive(CELL, parse_quantity("inverse@tip/workpiece"))
    with pytest.raises(KinegenError, match="a build has one inverse; build them separately"):
        lower_file(ROBOTS / "ur5_track_table.yaml", (SEEN, parse_quantity("inverse@workpiece/tool_tip")))


def test_lists_are_read_and_written(capsys: pytest.CaptureFixture[str]) -> None:
    one = load(ROBOTS / "panda_joint_7.yaml")
    text = (ROBOTS / "panda_joint_7.yaml").read_text().replace("redundancy: joint_7", "redundancy: [joint_7]")

    assert loads(text, "panda_joint_7.yaml") == one
    assert loads(write(HANGING), "hanging_arm.yaml").redundancy == "lift,rail"
    assert kinegen.load(ROBOTS / "hanging_arm.yaml", redundancy=["rail", "lift"]).redundancy == "rail,lift"
    assert kinegen.load(ROBOTS / "hanging_arm.yaml", redundancy="rail, lift").given == ("rail", "lift")
    assert main(["inspect", str(ROBOTS / "hanging_arm.yaml"), "--redundancy", "rail,lift"]) == 0
    assert "anthropomorphic arm, rail and lift given\n" in capsys.readouterr().out
    assert main(["inspect", str(ROBOTS / "ur5_track_table.yaml")]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "tool_tip in the frame of workpiece: UR type: parallel axes 3, 4, 5, track and table given" in out
    assert "kinegen build --outputs inverse@tool_tip/workpiece" in out
    assert main(["inspect", str(ROBOTS / "ur5_track_table.yaml"), "--redundancy", "elbow"]) == 0
    assert "tool_tip in the frame of workpiece: redundancy: elbow is in the middle" in capsys.readouterr().out


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ModuleType]:
    folder = tmp_path_factory.mktemp("packages")
    with pytest.MonkeyPatch.context() as patch:
        set_machine(patch, folder / "cache")
        patch.setattr(proof, "TARGETS", 200)
        patch.setattr(proof, "FEWER", 200)
        quantities = (parse_quantity("pose@tool_tip/workpiece"), SEEN)
        yield load_package(make(ROBOTS / "ur5_track_table.yaml", folder, quantities=quantities).folder)


@pytest.mark.parametrize("real", [np.float64, np.float32])
def test_one_target_is_solved_as_in_a_batch(cell: ModuleType, real: type) -> None:
    q = joint_vectors(CELL, 12, 6).astype(real)
    targets, given = cell.fk_tool_tip_in_workpiece(q), q[:, [0, 7]]
    inverse = cell.inverse_tool_tip_in_workpiece
    solutions, valid = inverse(targets, given)
    found, exists = inverse(targets, given, nearest=q)

    assert inverse.backend == "c"
    assert valid.any(axis=1).all()
    assert exists.all()
    np.testing.assert_allclose(found, q, atol=2e-2 if real is np.float32 else 1e-6)
    for place in range(len(q)):
        one, holds = inverse(targets[place], given[place])
        np.testing.assert_array_equal(one, solutions[place])
        np.testing.assert_array_equal(holds, valid[place])
        np.testing.assert_array_equal(inverse(targets[place], redundancy=given[place].tolist())[1], holds)
        chosen, is_there = inverse(targets[place], given[place], nearest=q[place])
        assert chosen.shape == (8,)
        assert is_there
        np.testing.assert_array_equal(chosen, found[place])


def test_values_broadcast_with_the_targets(cell: ModuleType) -> None:
    q = joint_vectors(CELL, 6, 7)
    targets, given = cell.fk_tool_tip_in_workpiece(q), q[:, [0, 7]]
    inverse = cell.inverse_tool_tip_in_workpiece

    assert inverse(targets[0], given)[0].shape == (6, 8, 8)
    assert inverse(targets, given[0])[1].shape == (6, 8)
    assert inverse(targets.reshape(2, 3, 4, 4), given.reshape(2, 3, 2), nearest=q[0])[0].shape == (2, 3, 8)
    assert inverse(targets[0], given, nearest=q[0])[0].shape == (6, 8)


def test_values_of_another_shape_are_refused(cell: ModuleType) -> None:
    target = cell.fk_tool_tip_in_workpiece(np.zeros(8))
    inverse = cell.inverse_tool_tip_in_workpiece
    for wrong in (0.0, np.zeros(1), np.zeros(3), np.array(0.0)):
        for nearest in (None, np.zeros(8)):
            with pytest.raises(ValueError, match=r"redundancy has shape \(.*\), expected \(..., 2\)"):
                inverse(target, wrong, nearest=nearest)
    with pytest.raises(TypeError, match=r"takes 2 arrays \(workpiece_T_tool_tip, redundancy\), 1 given"):
        inverse(target)
    assert not inverse(target, [np.nan, 0.0])[1].any()
    assert np.isnan(inverse(target, [0.0, np.inf], nearest=np.zeros(8))[0]).all()


def test_the_header_names_the_values(cell: ModuleType) -> None:
    header = (Path(str(cell.__file__)).parent / "ur5_track_table.h").read_text()

    assert "[0] track in m, [1] table in rad" in header
    assert "const double redundancy[2]" in header
    assert "int ur5_track_table_inverse_nearest(const double workpiece_T_tool_tip[16], const double redundancy[2]" in (
        " ".join(header.split())
    )
