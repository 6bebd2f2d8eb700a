"""The MoveIt plug-in against stand-ins of the headers: solutions of models whose frames are not those of the file."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
import yaml

from tests.controllers.elementary import Model, pose_line, shift
from tests.controllers.moveit_programs import (
    CALLS,
    EMPTY,
    MULTIPLE_TIPS,
    NO_IK_SOLUTION,
    NO_SOLUTION,
    NOT_ACTIVE,
    OK,
    SUCCESS,
    TIMED_OUT,
    UNSUPPORTED,
    Arm,
    altered,
    ask,
    compiled,
    files_of,
)
from tests.controllers.packages import file_of

NAMES = ("ur5", "puma560_mm", "panda_joint_7", "iiwa14_arm_angle", "scara4", "al5d", "arm3")
"""Six joints without and with offsets, seven with a joint and with the arm angle given, four, five, and three."""

POSITION_ONLY = "parameter bool robot_description_kinematics.arm.position_only_ik true"


@pytest.fixture(scope="module")
def programs(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, Path]:
    """A program for each robot, compiled once; what calls the plug-ins is the same for all."""
    first = compiled(tmp_path_factory.mktemp(NAMES[0]), NAMES[0])
    calls = first.parent / f"{CALLS.stem}_cpp.o"
    others = {name: compiled(tmp_path_factory.mktemp(name), name, others=[calls]) for name in NAMES[1:]}
    # Beside the other objects, for programs that are altered.
    for program in others.values():
        (program.parent / calls.name).write_bytes(calls.read_bytes())
    return {NAMES[0]: first, **others}


def arm_of(programs: Mapping[str, Path], name: str, **how: object) -> Arm:
    return Arm(programs[name], Model(file_of(name)), **how)  # type: ignore[arg-type]


@pytest.mark.controllers
@pytest.mark.parametrize("name", NAMES)
def test_links_and_solutions_agree_with_a_product_of_elementary_transforms(
    name: str, programs: Mapping[str, Path]
) -> None:
    """The base and the tip of the group, and the frames of all links, are others than those of the robot file."""
    arm, rng = arm_of(programs, name), np.random.default_rng(2)
    links = " ".join(arm.model.poses(arm.model.random(rng)))
    for q, other in ((arm.model.random(rng), arm.model.random(rng)) for _ in range(12)):
        fk, same, away, branches = arm.ask(
            arm.seed(q), f"fk {links}", arm.target(q), "ik", arm.seed(other), "ik", arm.seed(q), "all"
        )
        arm.require_links(fk, q)
        np.testing.assert_allclose(arm.require_reached(same, arm.tip(q))[0], q, atol=1e-9)
        arm.require_reached(away, arm.tip(q))
        found = arm.require_reached(branches, arm.tip(q))
        np.testing.assert_allclose(found[0], q, atol=1e-9)
        assert same.code == away.code == SUCCESS
        assert branches.code == OK


@pytest.mark.controllers
@pytest.mark.parametrize("order", [(5, 4, 3, 2, 1, 0), (2, 0, 5, 1, 4, 3)])
def test_vectors_are_in_the_order_of_the_group(order: tuple[int, ...], programs: Mapping[str, Path]) -> None:
    arm, rng = arm_of(programs, "puma560_mm", order=order), np.random.default_rng(3)
    q = arm.model.random(rng)
    limits = arm.seed(np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6]), "limits")
    fk, ik, near = arm.ask(arm.seed(q), "fk gripper", arm.target(q), "ik", arm.seed(q + 0.05), limits, "search 1 1")[:3]

    assert fk.good
    assert ik.good
    assert near.good
    np.testing.assert_allclose(fk.rows(7)[0][:3], arm.tip(q)[:3, 3], atol=1e-12)
    np.testing.assert_allclose(arm.joints(ik)[0], q, atol=1e-9)
    np.testing.assert_allclose(arm.joints(near)[0], q, atol=1e-9)


@pytest.mark.controllers
@pytest.mark.parametrize("name", ["ur5", "puma560_mm", "al5d", "panda_joint_7"])
def test_the_branch_of_the_seed_is_kept_along_a_path(name: str, programs: Mapping[str, Path]) -> None:
    """Each seed is the solution before; limits of 0.02 would refuse another branch."""
    arm, rng = arm_of(programs, name), np.random.default_rng(6)
    begin, end = arm.model.random(rng), arm.model.random(rng)
    path = [begin + part * (end - begin) for part in np.linspace(0, 1, 120)]
    lines = [word for before, q in itertools.pairwise(path) for word in (arm.seed(before), arm.target(q), "ik")]

    answers = arm.ask(*lines)
    largest = max(np.abs(arm.joints(each)[0] - before).max() for each, before in zip(answers, path, strict=False))
    assert largest < 0.2
    for answer, q in zip(answers, path[1:], strict=True):
        arm.require_reached(answer, arm.tip(q))


@pytest.mark.controllers
@pytest.mark.parametrize("name", ["ur5", "panda_joint_7", "iiwa14_arm_angle"])
def test_solutions_are_within_the_consistency_limits(name: str, programs: Mapping[str, Path]) -> None:
    arm, rng = arm_of(programs, name), np.random.default_rng(7)
    wide, tight = np.full(arm.dof, 0.3), np.full(arm.dof, 1e-4)
    for _ in range(8):
        q = arm.model.random(rng)
        seed = np.array([np.clip(v + rng.uniform(-0.1, 0.1), *(j.limits or (-9, 9)))
                         for v, j in zip(q, arm.model.joints, strict=True)])  # fmt: skip
        lines = (arm.seed(seed), arm.target(q), arm.seed(wide, "limits"), "search 1 1", "search 3 1 0", "search 4 1 0")
        found = [each for each in arm.ask(*lines) if each.word == "search"]
        for each in found:
            assert np.abs(arm.require_reached(each, arm.tip(q))[0] - seed).max() <= 0.3
        refused = arm.ask(arm.seed(seed), arm.target(q), arm.seed(tight, "limits"), "search 1 1", "search 3 1 0")
        assert [(each.good, each.code) for each in refused if each.word == "search"] == [(False, NO_IK_SOLUTION)] * 2


@pytest.mark.controllers
@pytest.mark.parametrize("name", ["ur5", "panda_joint_7", "al5d"])
def test_a_target_out_of_reach_has_no_solution(name: str, programs: Mapping[str, Path]) -> None:
    arm = arm_of(programs, name)
    q = arm.model.random(np.random.default_rng(8))
    forms = [f"search {form} 1 0" for form in range(7)]
    answers = arm.ask(arm.seed(q), pose_line(shift(20, 0, 0) @ arm.tip(q)), "ik", *forms, "all")

    called = [each for each in answers if each.word in ("ik", "search")]
    assert len(called) == 8
    assert all(not each.good and each.code == NO_IK_SOLUTION for each in called)
    assert (answers[-1].good, answers[-1].code, answers[-1].numbers.size) == (False, NO_SOLUTION, 0)


@pytest.mark.controllers
@pytest.mark.parametrize("name", ["ur5", "iiwa14_arm_angle"])
def test_what_cannot_be_asked_is_refused_with_a_code_and_a_message(name: str, programs: Mapping[str, Path]) -> None:
    arm = arm_of(programs, name)
    q, bad = arm.model.random(np.random.default_rng(9)), np.full(arm.dof, math.nan)
    for wrong in (
        [arm.seed(q) + " 0"], ["seed 1 2"], ["seed"], [arm.seed(bad)], [arm.seed(q * math.inf)], [arm.seed(q + 1e9)],
        ["pose 0 0 nan 0 0 0 1"], ["pose 0 0 0 0 0 0 0"], ["pose 0 inf 0 0 0 0 1"], ["pose 0 0 0 nan 0 0 1"],
        ["limits 1 2"],
    ):  # fmt: skip
        lines = (arm.seed(q), arm.target(q), *wrong)
        *answers, every = arm.ask(*lines, "search 1 1", "search 3 1", "search 5 1", "search 7 1", "all", silent=False)
        searched = [each for each in answers if each.word == "search"]
        assert all((each.good, each.code) == (False, NO_IK_SOLUTION) for each in searched)
        assert every.good == wrong[0].startswith("limits")
    (nan,), errors = ask(arm.program, *arm.begin[:-1], arm.seed(q), arm.target(q), "ik")
    assert (nan.good, nan.code) == (False, NO_IK_SOLUTION)
    assert errors.count("\n") == 1
    many, none, fk = arm.ask(arm.seed(q), arm.target(q), "all 2", "all 0", "fk elsewhere", silent=False)
    assert (many.code, none.code, fk.good) == (MULTIPLE_TIPS, EMPTY, False)
    assert ask(arm.program, arm.seed(q), "all")[0][0].code == NOT_ACTIVE


@pytest.mark.controllers
@pytest.mark.parametrize("name", ["ur5", "puma560_mm", "panda_joint_7"])
def test_a_rejected_solution_is_followed_by_the_next_one(name: str, programs: Mapping[str, Path]) -> None:
    arm = arm_of(programs, name)
    q = np.array([0.2, -0.6, 0.4, -1.2, 0.5, 1.2, 0.3])[: arm.dof] if arm.dof == 7 else np.full(6, 0.4)
    for form in (2, 3, 4):
        found, offered, _ = arm.ask(arm.seed(q), arm.target(q), f"search {form} 1 3")
        rows = arm.require_reached(offered, arm.tip(q))
        assert offered.code == len(rows) == 4
        np.testing.assert_allclose(arm.joints(found)[0], rows[3])
        np.testing.assert_allclose(rows[0], q, atol=1e-9)
        assert all(np.abs(a - b).max() > 1e-9 for k, a in enumerate(rows) for b in rows[:k])
    refused, offered, _ = arm.ask(arm.seed(q), arm.target(q), "search 2 60 1000000")
    assert (refused.good, refused.code) == (False, NO_IK_SOLUTION)
    assert offered.code > 3
    arm.require_reached(offered, arm.tip(q))


@pytest.mark.controllers
def test_turns_of_joints_are_offered_after_the_branches(programs: Mapping[str, Path]) -> None:
    """A UR has limits of a whole turn either way: eight branches, then the same with 63 choices of other turns."""
    arm, q = arm_of(programs, "ur5"), np.array([0.4, -1.1, 1.3, -0.5, 0.9, 0.3])
    _, offered, _ = arm.ask(arm.seed(q), arm.target(q), "search 2 60 1000000")

    rows = arm.require_reached(offered, arm.tip(q))
    assert len(rows) == 8 * 64
    away = ((rows - q) ** 2).sum(axis=1)
    assert (np.diff(away[:8]) >= 0).all()
    assert (np.diff(away[8:]) >= 0).all()
    assert np.abs(rows[:8] - q).max() <= math.pi


@pytest.mark.controllers
def test_a_search_ends_when_its_time_is_over(programs: Mapping[str, Path]) -> None:
    """The callback takes 30 ms and rejects everything."""
    for name in ("ur5", "panda_joint_7"):
        arm = arm_of(programs, name)
        q = arm.model.random(np.random.default_rng(10))
        for timeout, least in ((0.0, 1), (-1.0, 1), (math.nan, 1), (0.1, 2)):
            found, offered, seconds = arm.ask(arm.seed(q), arm.target(q), f"search 2 {timeout} 1000000 0.03")
            assert (found.good, found.code) == (False, TIMED_OUT)
            assert least <= offered.code <= 4
            assert seconds.numbers[0] < 0.6
    found, _, _ = arm.ask(arm.seed(q), arm.target(q), "search 2 0 0")
    assert found.good


@pytest.mark.controllers
@pytest.mark.parametrize("form", [5, 6])
def test_with_a_cost_the_cheapest_solution_is_found(form: int, programs: Mapping[str, Path]) -> None:
    """The cost is the depth of a link: the highest elbow of all branches wins, with and without a callback."""
    arm, q = arm_of(programs, "ur5"), np.array([0.4, -1.1, 1.3, -0.5, 0.9, 0.3])
    found, offered, _ = arm.ask(arm.seed(q), arm.target(q), f"search {form} 60 0")
    _, every, _ = arm.ask(arm.seed(q), arm.target(q), "search 2 60 1000000")

    def height(joints: np.ndarray) -> float:  # type: ignore[type-arg]
        return float((arm.model.mount @ arm.model.poses(joints)["link3"])[2, 3])

    best = max(map(height, arm.joints(every)))
    assert height(arm.require_reached(found, arm.tip(q))[0]) == pytest.approx(best, abs=1e-9)
    assert best > height(q) + 0.01 or best == pytest.approx(height(q))
    assert offered.code == (len(arm.joints(every)) if form == 5 else 0)


@pytest.mark.controllers
def test_the_call_for_several_solutions_gives_every_branch(programs: Mapping[str, Path]) -> None:
    """Newton steps from many places, on the product of elementary transforms, find no other solution."""
    arm, rng = arm_of(programs, "puma560_mm"), np.random.default_rng(12)
    q = np.array([0.3, -0.8, 1.4, 0.5, 0.7, -0.4])
    (every,) = arm.ask(arm.seed(q), arm.target(q), "all")
    known = arm.require_reached(every, arm.tip(q))

    found = {tuple(np.round(each, 5)) for each in newton(arm, arm.tip(q), rng)}
    assert len(found) == len(known) > 3
    for each in found:
        assert min(np.abs(np.remainder(known - each + math.pi, 2 * math.pi) - math.pi).max(axis=1)) < 1e-4


def newton(arm: Arm, target: np.ndarray, rng: np.random.Generator) -> list[np.ndarray]:  # type: ignore[type-arg]
    """Solutions within the limits that steps from 150 random joint vectors lead to."""
    found = []
    for _ in range(150):
        q = arm.model.random(rng)
        for _ in range(25):
            off = (arm.tip(q) - target)[:3].ravel()
            columns = [(arm.tip(q + 1e-7 * unit) - target)[:3].ravel() - off for unit in np.eye(arm.dof)]
            q = q - np.clip(np.linalg.lstsq(np.array(columns).T / 1e-7, off, rcond=None)[0], -0.5, 0.5)
        limits = [joint.limits or (-math.pi, math.pi) for joint in arm.model.joints]
        q = np.array([low + np.remainder(each - low, 2 * math.pi) for each, (low, _) in zip(q, limits, strict=True)])
        if np.abs(off).max() < 1e-9 and all(each <= high for each, (_, high) in zip(q, limits, strict=True)):
            found.append(q)
    return found


@pytest.mark.controllers
def test_a_redundant_joint_is_kept_or_searched(programs: Mapping[str, Path]) -> None:
    arm, q = arm_of(programs, "panda_joint_7"), np.array([0.2, -0.4, 0.3, -1.8, 0.4, 1.9, 0.6])
    seed = q + np.array([0, 0, 0, 0, 0, 0, 0.05])
    locked, fixed, stepped = arm.ask(
        arm.seed(seed), arm.target(q), "options 1 1", "ik", "options 0 1", "all", "options 0 2", "all"
    )
    for each in (locked, fixed):
        np.testing.assert_allclose(arm.require_reached(each, arm.tip(q))[:, 6], seed[6])
    values = np.unique(np.round(arm.require_reached(stepped, arm.tip(q))[:, 6], 6))
    assert len(values) > 5
    assert np.diff(values).max() < 0.101 or np.ptp(values) > 1
    bad, other = arm.ask(arm.seed(seed), arm.target(q), "options 0 4", "all", "options 0 3", "all")
    assert (bad.code, other.code) == (UNSUPPORTED, UNSUPPORTED)
    limits = arm.seed(np.array([9, 9, 9, 9, 9, 9, 0.02]), "limits")
    near, _, _ = arm.ask(arm.seed(seed), arm.target(q), limits, "search 1 1")
    assert abs(arm.require_reached(near, arm.tip(q))[0][6] - seed[6]) <= 0.02
    first, second, third = arm.ask("redundant 6", "redundant", "redundant 2", silent=False)
    assert (first.good, second.good, third.good) == (True, True, False)


@pytest.mark.controllers
def test_the_arm_angle_can_be_kept(programs: Mapping[str, Path]) -> None:
    """With the angle of the seed, the seed itself is among the solutions for its own pose, and not for others."""
    arm, rng = arm_of(programs, "iiwa14_arm_angle"), np.random.default_rng(4)
    for _ in range(6):
        q = 0.8 * arm.model.random(rng)
        (locked,) = arm.ask(arm.seed(q), arm.target(q), "options 1 1", "ik")
        np.testing.assert_allclose(arm.require_reached(locked, arm.tip(q))[0], q, atol=1e-7)
    assert not arm.ask("redundant 2", silent=False)[0].good


@pytest.mark.controllers
def test_an_arm_that_is_solved_for_the_position_reads_the_parameter(programs: Mapping[str, Path]) -> None:
    model = Model(file_of("arm3"), gripper=False)
    free, strict = (Arm(programs["arm3"], model, before=before) for before in ([POSITION_ONLY], []))
    q = model.random(np.random.default_rng(3))
    other = free.tip(q) @ Model._any(np.random.default_rng(1), 0.0)
    (found,) = free.ask(free.seed(q), pose_line(other), "ik")
    (refused,) = strict.ask(free.seed(q), pose_line(other), "ik")

    np.testing.assert_allclose(free.joints(found)[0], q, atol=1e-9)
    assert not refused.good
    gripper = Arm(programs["arm3"], Model(file_of("arm3")), before=[POSITION_ONLY])
    (answer,), errors = ask(gripper.program, *gripper.begin)
    assert not answer.good
    assert "from the point that the inverse is solved for" in errors


@pytest.mark.controllers
def test_a_seed_that_is_a_solution_comes_first_where_an_arm_is_stretched(programs: Mapping[str, Path]) -> None:
    """Three axes coincide there, so that the inverse has no reason to take these joint values."""
    arm, rng = arm_of(programs, "iiwa14_arm_angle"), np.random.default_rng(9)
    for _ in range(8):
        q = arm.model.random(rng) * np.array([1, 0, 1, 0, 1, 0, 1])
        ik, search, *_, branches = arm.ask(arm.seed(q), arm.target(q), "ik", "search 0 1 0", "all")
        for answer in (ik, search, branches):
            np.testing.assert_allclose(arm.joints(answer)[0], q, atol=1e-12)
            arm.require_reached(answer, arm.tip(q))
    away = arm.ask(arm.seed(q + 1e-6), arm.target(q), "ik")[0]
    arm.require_reached(away, arm.tip(q), atol=1e-8)


@pytest.mark.controllers
def test_limits_of_the_model_hold_too(programs: Mapping[str, Path]) -> None:
    arm = arm_of(programs, "ur5")
    lines = [re.sub(r"( -?6\.28\d+){2}$", " -1.5 1.5", line) for line in arm.begin]
    q = np.array([0.4, -1.1, 1.3, -0.5, 0.9, 0.3])
    (_, every), errors = ask(arm.program, *lines[:-1], lines[-1], arm.seed(q), arm.target(q), "all")

    assert errors == ""
    assert 0 < len(arm.joints(every)) < 8
    assert np.abs(arm.joints(every)).max() <= 1.5


@pytest.mark.controllers
@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (" chain ", " tree ", "group 'arm': it is not a chain"),
        (" chain ", " mimic ", "it has joints that mimic others"),
        (" elbow ", " ", "it has the joints base-turn, shoulder, wrist-1, wrist-2, wrist-3; the robot file has"),
        ("arm 0.1", "leg 0.1", "group 'leg': the model has no such group"),
        ("pedestal gripper", "pedestal hand", "the model has no link 'hand'"),
        ("pedestal gripper", "pedestal gripper link2", "2 tips instead of one"),
        ("pedestal gripper", "pedestal", "0 tips instead of one"),
        ("wrist-2 revolute", "wrist-2 prismatic", "joint 'wrist-2' is not revolute in the model"),
        ("initialize", POSITION_ONLY + "\ninitialize", "the inverse of ur5 is solved for the pose"),
    ],
)
def test_a_group_that_the_arm_is_not_in_is_refused_in_one_line(
    old: str, new: str, message: str, programs: Mapping[str, Path]
) -> None:
    arm = arm_of(programs, "ur5")
    last = [
        line.replace(old, new) if line.startswith(("group", "init", "joint wrist-2")) else line for line in arm.begin
    ]
    (answer, ik), errors = ask(arm.program, *last, arm.seed(np.zeros(6)), "ik")

    assert not answer.good
    assert not ik.good
    assert message in errors.splitlines()[0]
    assert errors.count("\n") == 2


@pytest.mark.controllers
@pytest.mark.parametrize("place", [0, 3, 5])
def test_a_model_of_another_arm_is_refused_with_the_difference(place: int, programs: Mapping[str, Path]) -> None:
    """A link 5 mm longer, across its joint."""
    arm = arm_of(programs, "puma560_mm")
    across = np.cross(arm.model.axes[place], [0.3, 0.4, 0.5])
    arm.model.origins[place] = arm.model.origins[place] @ shift(*(0.005 * across / np.linalg.norm(across)))
    (answer,), errors = ask(arm.program, *arm.model.lines(), arm.begin[-1])

    assert answer.good == (place in (0,))  # where the first axis is does not matter: it is part of the base
    assert answer.good or "different arms: 'gripper' in 'pedestal' is up to" in errors


@pytest.mark.controllers
@pytest.mark.parametrize(
    "change",
    [
        ("plugin", "base_.inverse() * target * tool_.inverse()", "base_.inverse() * target * tool_"),
        ("plugin", "values[order_[k]] = q[k];", "values[static_cast<std::size_t>(k)] = q[k];"),
        ("arm", "pose.matrix()(row, column) / (", "pose.matrix()(row, column) / 1.001 / ("),
    ],
)
def test_an_altered_plug_in_is_noticed(change: tuple[str, str, str], programs: Mapping[str, Path]) -> None:
    program = {"puma560_mm": altered(programs["puma560_mm"], "puma560_mm", *change)}
    with pytest.raises(AssertionError):
        test_vectors_are_in_the_order_of_the_group((2, 0, 5, 1, 4, 3), program)


@pytest.mark.parametrize("name", ["puma560_mm", "panda_joint_7", "arm3"])
def test_the_manifests_name_each_other(name: str) -> None:
    files = files_of(name)
    library, package = ET.fromstring(files["plugin.xml"]), ET.fromstring(files["package.xml"])  # noqa: S314 - our text
    (plugin,) = library.findall("class")

    assert package.findtext("name") == library.get("path") == f"{name}_moveit_kinematics"
    assert re.search(rf"project\({name}_moveit_kinematics ", files["CMakeLists.txt"])
    assert plugin.get("type") == f"{name}_moveit_kinematics::Plugin"
    assert f"PLUGINLIB_EXPORT_CLASS({plugin.get('type')}, {plugin.get('base_class_type')})" in files["src/plugin.cpp"]
    (group,) = yaml.safe_load(files["config/kinematics.yaml"]).values()
    assert group["kinematics_solver"] == plugin.get("name")
    assert group.get("position_only_ik", False) == (name == "arm3")
    sources = re.findall(r"^  src/(\S+)$", files["CMakeLists.txt"], re.M)
    assert {f"src/{each}" for each in sources} == {path for path in files if re.fullmatch(r"src/\S+\.c(pp)?", path)}
