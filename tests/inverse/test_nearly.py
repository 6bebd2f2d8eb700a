"""Arms that are only nearly of a family: which geometry is found, and where the solutions lead."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from kinegen.backends.scalar_types import ScalarType
from kinegen.derive.inverse import derive, newton_refinement
from kinegen.derive.inverse.classification import NotClosedForm, recognise
from kinegen.derive.inverse.compact_chain import own_chain, tip_apart
from kinegen.derive.inverse.family import Family
from kinegen.derive.inverse.nearest_family import Defect
from kinegen.driver.pipeline import build
from kinegen.driver.results import BuildOptions
from kinegen.io.load import load, loads
from kinegen.ir.lower import lower
from kinegen.model.joint_bounds import joint_box
from kinegen.model.outputs import COMPLETE_INVERSE, Kind, Quantity
from kinegen.model.robot import TOOL, Robot
from kinegen.runtime.extension import load_package
from kinegen.ui.cli import main
from kinegen.verify import complete_inverse, reference
from kinegen.verify.branches import require_names, signs
from kinegen.verify.closed_form_inverse import Trial, counts_line
from kinegen.verify.inverse_targets import targets_of
from kinegen.verify.merging_samples import BESIDE_WAIST, MERGING
from kinegen.verify.singular_samples import may_merge
from tests.inverse.arms import Arm, Floats, distances, errors, evaluate, joint_vectors

FOLDER = Path(__file__).parent / "robots"
ROBOTS = Path(__file__).parents[2] / "robots"
UR = load(FOLDER / "ur5_calibrated.yaml")
MAKER = load(Path(__file__).parents[1] / "bounds" / "ur5_calibrated.yaml")
WRIST = load(FOLDER / "wrist_calibrated.yaml")
SHOULDER = loads(
    """
kinegen: 1
name: shoulder_calibrated
convention: standard
units: {length: m, angle: deg}
joints:
  - {name: j1, theta: q, d: 0.3, a: 0.0003, alpha: -90.02}
  - {name: j2, theta: 0.03 - q, d: 0.0002, a: -0.0004, alpha: 89.97}
  - {name: j3, theta: q, d: 0.4, a: 0.0002, alpha: 90.03}
  - {name: j4, theta: q, d: 0.0001, a: 0.35, alpha: 0.05}
  - {name: j5, theta: 2*q, d: 0.1, a: 0.25, alpha: 60}
  - {name: j6, theta: q, d: 0.12, a: 0.01, alpha: 0}
""",
    "shoulder_calibrated.yaml",
)
"""Seen from the tool, it has a spherical wrist; one of its joints goes backwards, and one at twice its rate."""


PANDA = load(FOLDER / "panda_calibrated.yaml")
"""Seven joints, the last of which is given; the six others are looked at from the tool."""


def _given(robot: Robot, q: Floats) -> Floats | None:
    return reference.redundancy(robot, q) if robot.redundancy else None


def _nearly(robot: Robot) -> tuple[Family, Defect]:
    family = recognise(robot)
    assert isinstance(family, Family)
    assert family.defect is not None
    return family, family.defect


@pytest.mark.parametrize(
    ("robot", "name", "failing"),
    [
        (UR, "nearly UR type: parallel axes 2, 3, 4", ["axes 2, 3 and 4 are parallel", "axes 5 and 6 meet"]),
        (MAKER, "nearly UR type: parallel axes 2, 3, 4", ["axes 2, 3 and 4 are parallel", "axes 5 and 6 meet"]),
        (
            WRIST,
            "nearly arm with parallel axes 2, 3 and spherical wrist",
            ["axes 2 and 3 are parallel", "axes 4, 5 and 6 meet"],
        ),
        (
            PANDA,
            "nearly arm whose axes 5, 6 meet, with spherical shoulder, joint_7 given",
            ["axes 5 and 6 meet", "axes 1, 2 and 3 meet"],
        ),
    ],
    ids=["UR", "maker's", "wrist", "panda"],
)
def test_the_nearest_geometry_is_found_from_the_lines(robot: Robot, name: str, failing: list[str]) -> None:
    family, defect = _nearly(robot)

    assert family.name == name
    assert set(failing) < {each.text for each in defect.failing}
    assert defect.size(derive.size_of(robot, family)) < 0.003
    assert 0 < tip_apart(robot, family).length < 0.004 * derive.size_of(robot, family)


def test_huge_lengths_that_cancel_are_no_part_of_the_reach() -> None:
    family, defect = _nearly(MAKER)

    assert 1.0 < derive.size_of(MAKER, family) < 1.2
    numbers = [abs(float(each)) for link in own_chain(defect.axes).links for each in (link.shift, link.across)]
    assert max(numbers) < 0.5


def test_roots_are_taken_of_numbers_that_are_doubles(monkeypatch: pytest.MonkeyPatch) -> None:
    """With gmpy2, sympy has no roots of fractions with longer parts: it takes the logarithms of these as doubles."""
    _, defect = _nearly(PANDA)
    asked: list[sp.Expr] = []
    root = sp.sqrt

    def noted(number: sp.Expr) -> sp.Expr:
        asked.append(number)
        return root(number)

    monkeypatch.setattr(sp, "sqrt", noted)
    own_chain.__wrapped__(defect.axes)

    assert asked
    assert all(max(abs(each.p), each.q) < 2**1023 for each in asked)


@pytest.mark.parametrize("robot", [UR, MAKER, SHOULDER], ids=["UR", "maker's", "shoulder"])
def test_the_own_chain_is_the_arm(robot: Robot) -> None:
    _, defect = _nearly(robot)
    chain, low_high = own_chain(defect.axes), np.array(joint_box(robot)).T
    q = np.random.default_rng(1).uniform(*low_high)
    pose = _matrix(chain.rotation, chain.origin)
    for place, value in enumerate(q):
        rate = float(defect.axes.joints[place].rate)
        link = chain.links[place] if place < 5 else None
        pose = pose @ _turn(2, rate * value + (float(link.lead) if link else 0.0))
        if link:
            pose = pose @ _matrix(np.eye(3), (link.across, 0, link.shift))
            pose = pose @ _turn(0, _angle(link.tilt)) @ _turn(1, _angle(link.lean))
    pose = pose @ _matrix(chain.hand_rotation, chain.hand_origin)

    np.testing.assert_allclose(
        pose, reference.pose(robot, q[None])[0, 0], atol=2e-12 * max(1.0, float(np.abs(pose).max()))
    )


def _matrix(rotation: object, origin: object) -> Floats:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.array(rotation, float), np.array(origin, float)
    return pose


def _turn(axis: int, angle: float) -> Floats:
    pose, i, j = np.eye(4), (axis + 1) % 3, (axis + 2) % 3
    pose[[i, j], [i, j]], pose[i, j], pose[j, i] = np.cos(angle), -np.sin(angle), np.sin(angle)
    return pose


def _angle(pair: object) -> float:
    cosine, sine = np.array(pair, float)
    return float(np.arctan2(sine, cosine))


@pytest.fixture(scope="module", params=[UR, SHOULDER, PANDA], ids=["UR", "shoulder", "panda"])
def one_branch(request: pytest.FixtureRequest) -> Arm:
    """The first branch of an arm by itself: all of them take eight times as long to derive."""
    robot: Robot = request.param
    whole, _ = _nearly(robot)
    family = replace(whole, branches=whole.branches[:1])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(derive, "family_of", lambda _: family)
        patch.setattr(derive, "nearly_solved", lambda *given: islice(newton_refinement.nearly_solved(*given), 1))
        program = lower(derive.derive_inverse(robot, Quantity(Kind.INVERSE)))
    return Arm(robot, family, program, ())


def test_a_branch_leads_to_the_target_and_is_not_missed(one_branch: Arm) -> None:
    robot, family = one_branch.robot, one_branch.family
    size = derive.size_of(robot, family)
    q = joint_vectors(robot, 4000, 3)
    start, valid = evaluate(one_branch, reference.pose(robot, q)[:, 0], _given(robot, q))
    there = start[valid[:, 0] != 0, 0]
    assert len(there) > 700
    q = there + np.random.default_rng(4).uniform(-0.02, 0.02, there.shape)
    q = q[(np.array(joint_box(robot)).T[0] < q).all(axis=1) & (q < np.array(joint_box(robot)).T[1]).all(axis=1)]
    poses = reference.pose(robot, q)[:, 0]

    solutions, valid = evaluate(one_branch, poses, _given(robot, q))

    solved = valid[:, 0] != 0
    assert (errors(one_branch, np.where(valid[..., None], solutions, 0), poses)[solved, 0] < 3e-12 * size).all()
    weights = np.array([1 / size] * 3 + [1.0] * 3)[:, None]
    jacobians = reference.Kinematics(robot, q).jacobian(TOOL)[..., :6] * weights
    least = np.linalg.svd(jacobians, compute_uv=False).min(axis=1)
    found = solved & (distances(one_branch, solutions, q)[:, 0] < 1e-8)
    # A step of 0.02 rad may lead through a singular pose into another branch, but not beyond such poses.
    clear = least > derive.singular_below(robot, family)
    assert clear.mean() > 0.5
    assert found[clear].mean() > 0.998


def _offset_wrist(offset: float) -> Robot:
    """A KR16 whose wrist has an offset, in metres."""
    return loads(_offset_text(offset), "offset_wrist.yaml")


def _offset_text(offset: float) -> str:
    return f"""
kinegen: 1
name: offset_wrist
convention: standard
units: {{length: m, angle: deg}}
joints:
  - {{name: j1, theta: q, d: 0.675, a: 0.26, alpha: -90}}
  - {{name: j2, theta: q, d: 0, a: 0.68, alpha: 0}}
  - {{name: j3, theta: q, d: 0, a: -0.035, alpha: 90}}
  - {{name: j4, theta: q, d: -0.67, a: 0, alpha: -90}}
  - {{name: j5, theta: q, d: 0, a: {offset:.1e}, alpha: 90}}
  - {{name: j6, theta: q, d: -0.158, a: 0, alpha: 180}}
"""


@pytest.mark.parametrize("offset", [1e-6, *(pytest.param(each, marks=pytest.mark.long) for each in (1e-9, 1e-4, 1e-3))])
def test_branches_are_missing_only_in_the_band_that_is_stated(offset: float) -> None:
    """Beside the straight elbow, where the arm of the family does not reach all that the arm itself does."""
    robot = _offset_wrist(offset)
    whole, defect = _nearly(robot)
    family = replace(whole, branches=whole.branches[:4])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(derive, "family_of", lambda _: family)
        patch.setattr(derive, "nearly_solved", lambda *given: islice(newton_refinement.nearly_solved(*given), 4))
        program = lower(derive.derive_inverse(robot, Quantity(Kind.INVERSE)))
    arm, random, size = Arm(robot, family, program, ()), np.random.default_rng(7), derive.size_of(robot, family)
    q = random.uniform(-np.pi, np.pi, (6000, 6))
    straight = np.arctan2(-0.67, -0.035)
    q[:, 2] = straight + random.choice([-1, 1], 6000) * 10 ** random.uniform(-7, -0.5, 6000)
    q[:1500, 2] = straight
    # All four branches of the left shoulder: the wrist's centre is in front of the waist, far from its axis.
    poses = reference.pose(robot, q)[:, 0]
    centre = poses[:, :3, 3] - 0.158 * poses[:, :3, 2] * np.sign(-0.158)
    ahead = np.cos(q[:, 0]) * centre[:, 0] + np.sin(q[:, 0]) * centre[:, 1]
    q, poses = q[ahead > 0.3], poses[ahead > 0.3]
    solutions, valid = evaluate(arm, poses)
    least = np.linalg.svd(_scaled_jacobians(robot, q, size), compute_uv=False).min(axis=1)
    # What is accepted of a pose moves joints by so much.
    same = 1e-5 + 3e-12 / np.maximum(least, 1e-13)
    missed = np.where(valid != 0, distances(arm, solutions, q), np.inf).min(axis=1) > same

    assert defect.size(size) < derive.singular_below(robot, family)
    assert not missed[least > defect.size(size) / 2].any()
    # Not only the joint vector of the target was missing beside the straight elbow, but every one.
    assert valid.any(axis=1).all()


@pytest.fixture(scope="module")
def offset_wrist() -> Arm:
    robot = _offset_wrist(1e-5)
    return Arm(robot, _nearly(robot)[0], lower(derive.derive_inverse(robot, Quantity(Kind.INVERSE))), ())


@pytest.mark.long
def test_targets_beside_axis_1_and_with_the_wrist_in_line_have_solutions(offset_wrist: Arm) -> None:
    """There the closed form says nothing about two joints, and only the arm's own pose does."""
    arm, robot = offset_wrist, offset_wrist.robot
    family, defect = _nearly(robot)
    size, random = derive.size_of(robot, family), np.random.default_rng(8)
    for index in (1, 4):
        q = _singular(robot, random.uniform(-np.pi, np.pi, (2000, 6)), index)
        q[len(q) // 4 :, index] += 10 ** random.uniform(-7, -0.5, len(q) - len(q) // 4)
        solutions, valid = evaluate(arm, reference.pose(robot, q)[:, 0])
        least = np.linalg.svd(_scaled_jacobians(robot, q, size), compute_uv=False).min(axis=1)
        missed = np.where(valid != 0, distances(arm, solutions, q), np.inf).min(axis=1) > 1e-5

        assert len(q) > 500
        assert (~valid.any(axis=1)).mean() < 0.009
        assert not missed[least > 4 * defect.size(size)].any()
        # Steps that go far led into branches of other names, more than a hundred defects from where they meet.
        require_names(robot, family.branches, family, "the formula", solutions, valid != 0)


@pytest.mark.long
def test_targets_within_a_defect_of_axis_1_are_solved(offset_wrist: Arm) -> None:
    """The closed form says nothing about joint 1 there, so that the steps begin anywhere: three of them were too few.

    Their least singular values are 0.005 to 0.4 defects.
    """
    q = np.array(
        [
            [-2.9439372000551, -2.4266900394126, -0.3796335692821, -0.5109582075304, 2.8913416559135, 1.5041683467414],
            [1.715354734786, 0.9433908118495, 0.7624821423363, -2.5564508246309, 2.1054875931951, -0.462327847895],
            [-1.2154876689914, 0.9372463399317, 0.7391730572828, -2.6303109010057, -0.932408660898, 1.5222022829385],
            [1.0053341018114, 1.2446255248974, 1.0519969332696, 3.1108462517338, -0.9910269295096, -2.2493360426533],
            [2.0544438821375, -2.9092619218485, 0.3574700976138, 0.0205661702693, -0.7569607227377, -0.3641186524279],
            [-1.2820448210459, -2.8314373970996, 0.2535201099719, -2.5676699569521, -2.738089073269, -1.0901724901544],
            [-1.594386848427, -2.1716805811379, -0.8355063539004, -0.4203492793421, -0.1327565871264, -1.5999152407993],
            [-1.2879546843289, -1.3187706906141, -2.5698508191817, -0.0674423003597, 0.7559948890035, 0.482641042214],
            [0.9467619105485, -2.7136839672446, 2.097410728531, -3.0375556697406, -0.6718195139758, 1.3034460326268],
        ]
    )

    _, valid = evaluate(offset_wrist, reference.pose(offset_wrist.robot, q)[:, 0])

    assert valid.any(axis=1).all()


@pytest.mark.long
def test_the_complete_inverse_finds_branches_that_are_missing(
    offset_wrist: Arm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where branches merge, an arm may have more solutions than its family has branches."""
    monkeypatch.setattr(complete_inverse, "TARGETS", 100)
    monkeypatch.setattr(complete_inverse, "SPECIAL", 60)
    path = tmp_path / "offset_wrist.yaml"
    path.write_text(_offset_text(1e-5), encoding="utf-8")
    quantities = (Quantity.POSE, COMPLETE_INVERSE)
    options = BuildOptions(output=tmp_path / "out", reals=(ScalarType.DOUBLE,), quantities=quantities)
    package = load_package(build(path, options, lambda _: None).folder)
    robot, family = offset_wrist.robot, offset_wrist.family
    q = np.concatenate([targets_of(robot, family, 10, 1000).special[name] for name in MERGING])
    poses = reference.pose(robot, q)[:, 0]
    solutions, valid = evaluate(offset_wrist, poses)
    missed = np.where(valid != 0, distances(offset_wrist, solutions, q), np.inf).min(axis=1) > 1e-4
    size = derive.size_of(robot, family)
    least = np.linalg.svd(_scaled_jacobians(robot, q, size), compute_uv=False).min(axis=1)
    # Nearer to where two solutions are one, rounding decides what is there.
    rows = np.flatnonzero(missed & (least > 0.75 * _nearly(robot)[1].size(size)))[:200]
    others, there = package.complete_inverse(poses[rows])

    assert len(rows) >= 150
    assert there.any(axis=1).all()
    assert np.where(there, distances(offset_wrist, others, q[rows]), np.inf).min(axis=1).max() < 1e-4


def _singular(robot: Robot, q: Floats, index: int) -> Floats:
    """Joint vectors with one joint where the Jacobian has no inverse; those are left out that have no such place."""
    places = np.linspace(-np.pi, np.pi, 60)
    tried = np.repeat(q[:, None], len(places), axis=1)
    tried[..., index] = places
    signs = np.sign(np.linalg.det(_scaled_jacobians(robot, tried.reshape(-1, 6), 1.0))).reshape(len(q), -1)
    changes = signs[:, 1:] != signs[:, :-1]
    rows = np.flatnonzero(changes.any(axis=1))
    first = changes[rows].argmax(axis=1)
    low, high = tried[rows, first], tried[rows, first + 1]
    for _ in range(60):
        middle = (low + high) / 2
        is_low = np.sign(np.linalg.det(_scaled_jacobians(robot, middle, 1.0))) == signs[rows, first]
        low[is_low], high[~is_low] = middle[is_low], middle[~is_low]
    return low


def _scaled_jacobians(robot: Robot, q: Floats, size: float) -> Floats:
    """Jacobians of the tool, lengths by a size."""
    jacobians: Floats = reference.Kinematics(robot, q).jacobian(TOOL) * np.array([1 / size] * 3 + [1.0] * 3)[:, None]
    return jacobians


def test_a_build_says_how_many_branches_are_missing_and_calls_it_no_rounding() -> None:
    at_limits = ("at a limit", 100, 99)
    trial = Trial(
        "C", 1100, 4000, 0.0, 0.0, 1e-9, (), 42, (at_limits,), may_vanish=True, missing=((BESIDE_WAIST, 1000, 213),)
    )

    assert "1,000 random targets, 958 of them solved by the joint vector that they came from" in counts_line(trial)
    assert "the branch of the other 42 is missing near singular poses" in counts_line(trial)
    assert "joint vectors whose branch is missing: 213 of 1,000 beside the axis of the waist" in counts_line(trial)
    assert "rounding" not in counts_line(trial)


@pytest.mark.parametrize("robot", [UR, WRIST, SHOULDER, PANDA], ids=["UR", "wrist", "shoulder", "panda"])
def test_a_branch_knows_how_its_elbow_and_its_wrist_are_bent(robot: Robot) -> None:
    """Compared with signs that the axes have at random joint vectors, far from where branches meet."""
    family, defect = _nearly(robot)
    chain = own_chain(defect.axes)
    refiner = newton_refinement._Refiner(None, family, defect, chain, chain, None)  # type: ignore[arg-type]
    q = joint_vectors(robot, 500, 6)
    found = signs(robot, family, q)
    for branch, name in enumerate(family.branches):
        wanted = [1 if word.split()[-1] in {"left", "up", "no-flip"} else -1 for word in name.split(", ")]
        sides = zip(found, wanted, strict=True)
        # Nothing says on which side the shoulder of a Panda is.
        own = np.all([~(found[choice] * sign < 0.02) for choice, sign in sides], axis=0)
        assert own.sum() > 10
        for joint, straight, is_ahead in refiner._bends(branch):
            bent = np.sin(float(joint.rate) * (q[own, joint.number - 1] - straight))
            assert (np.sign(bent) == (1 if is_ahead else -1)).all()


def test_targets_are_planted_beside_every_set_on_which_branches_merge() -> None:
    robot = _offset_wrist(1e-5)
    family, _ = _nearly(robot)
    planted = targets_of(robot, family, 10, 60).special

    assert [len(planted[name]) > 30 for name in MERGING] == [True] * 3
    for name in MERGING:
        assert may_merge(robot, family, planted[name]).mean() > 0.3


def test_what_is_not_finite_or_far_away_is_not_solved(one_branch: Arm) -> None:
    poses = np.repeat(np.eye(4)[None], 27, axis=0)
    for place in range(12):
        poses[place].flat[place] = np.nan
        poses[12 + place].flat[place] = (-1) ** place * np.inf
    poses[24, :3, 3] = 1e9
    poses[25, :3, :3] *= 2
    poses[26, 0, 0] = -1

    given = np.zeros(27) if one_branch.robot.redundancy else None
    _, valid = evaluate(one_branch, poses, given)

    assert not valid.any()


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 2.9, -2.9])
@pytest.mark.parametrize("one_branch", [PANDA], indirect=True, ids=["panda"])
def test_a_given_joint_that_is_no_number_or_outside_its_limits_is_not_solved(one_branch: Arm, value: float) -> None:
    q = joint_vectors(one_branch.robot, 200, 5)
    poses = reference.pose(one_branch.robot, q)[:, 0]

    assert evaluate(one_branch, poses, _given(one_branch.robot, q))[1].any()
    assert not evaluate(one_branch, poses, np.full(200, value))[1].any()


@pytest.mark.parametrize("change", ["a: 600.57, alpha: 0.4", "a: 600.57, alpha: -0.4"])
def test_what_is_too_far_off_is_refused_with_its_conditions(change: str) -> None:
    text = (FOLDER / "wrist_calibrated.yaml").read_text(encoding="utf-8")
    far = recognise(loads(text.replace("a: 600.57, alpha: 0.047", change).replace("d: 0.24", "d: 40"), "arm.yaml"))

    assert isinstance(far, NotClosedForm)
    assert any("axes 2 and 3 are not parallel" in reason for reason in far.reasons)


def test_inspect_says_how_far_each_condition_fails(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["inspect", str(FOLDER / "ur5_calibrated.yaml")]) == 0

    text = " ".join(capsys.readouterr().out.split())
    assert "ur5_calibrated.yaml: nearly UR type: parallel axes 2, 3, 4" in text
    assert "axes 2, 3 and 4 are parallel but for 0.0017 rad" in text
    assert "axes 5 and 6 meet but for 5.2e-05 m" in text
    assert "the target is corrected twice, then 5 steps of second order" in text


def test_a_smaller_defect_takes_fewer_steps() -> None:
    _, defect = _nearly(UR)

    assert newton_refinement.newton_steps(defect, 1.0) == 5
    assert newton_refinement.newton_steps(replace(defect, angle=1e-5, length=1e-5), 1.0) == 4


@pytest.mark.long
def test_seven_joints_are_proven(tmp_path: Path) -> None:
    options = BuildOptions(output=tmp_path, reals=(ScalarType.DOUBLE,), quantities=(Quantity(Kind.INVERSE),))
    (line,) = (
        each
        for each in build(FOLDER / "panda_calibrated.yaml", options, lambda _: None).proof.counts
        if each.startswith("inverse")
    )

    found, missing = (int(each.replace(",", "")) for each in re.findall(r"[\d,]+(?= of them| is missing)", line))
    assert found + missing == 100_000
    assert missing > 0
    assert "rounding" not in line


@pytest.mark.long
@pytest.mark.parametrize("robot", ["ur5_calibrated", "wrist_calibrated"])
def test_a_million_targets(robot: str, tmp_path: Path) -> None:
    """Takes about three minutes an arm, most of it to compile and prove the kernel."""
    options = BuildOptions(output=tmp_path, reals=(ScalarType.DOUBLE,), quantities=(Quantity(Kind.INVERSE),))
    package = load_package(build(FOLDER / f"{robot}.yaml", options, lambda _: None).folder)
    arm, missed = load(FOLDER / f"{robot}.yaml"), 0
    family, _ = _nearly(arm)
    size = derive.size_of(arm, family)
    for seed in range(20):
        q = joint_vectors(arm, 50_000, seed)
        poses = reference.pose(arm, q)[:, 0]
        solutions, valid = package.inverse(poses)
        apart = np.abs((solutions - q[:, None] + np.pi) % (2 * np.pi) - np.pi).max(axis=2)
        far = q[np.where(valid, apart, np.inf).min(axis=1) > 1e-6]
        jacobians = reference.Kinematics(arm, far).jacobian(TOOL) * np.array([1 / size] * 3 + [1.0] * 3)[:, None]
        least = np.linalg.svd(jacobians, compute_uv=False).min(axis=1, initial=np.inf)
        missed += int((least > derive.singular_below(arm, family)).sum())
        for branch in range(8):
            reached = reference.pose(arm, solutions[valid[:, branch], branch])[:, 0]
            away = np.abs(reached - poses[valid[:, branch]])
            assert away[:, :3, :3].max() < 3e-12
            assert away[:, :3, 3].max() < 1e-11 * size
    assert missed == 0
