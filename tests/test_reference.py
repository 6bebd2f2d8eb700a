"""The reference is right: published poses, the laws of rigid motion, and two precisions that agree."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import mpmath
import numpy as np
import pytest

from kinegen.io.load import load, loads
from kinegen.model.joint_bounds import SMALLEST_REACH, joint_box, reach, screw_leads
from kinegen.model.robot import JointType, Robot
from kinegen.verify import reference
from kinegen.verify.reference.exact_numbers import digits
from kinegen.verify.reference.number_types import digit_arrays
from kinegen.verify.reference.series import Series, in_series
from tests.textbook.catalog import Example, System, systems
from tests.textbook.catalog import robot as textbook_robot
from tests.textbook.notation import read

ROBOTS = sorted((Path(__file__).resolve().parent.parent / "robots").glob("*.yaml"))
SEED = 560
POSES = 200
ROUNDING = 1e-14
"""Bound on the rounding of a chain product in float64, relative to the reach: dozens of operations of 1e-16 each."""

EXAMPLES = [
    pytest.param(system, name, example, id=f"{name}-{example.name}")
    for system in systems()
    for name in system.robots
    for example in system.examples
]
HEAD = "kinegen: 1\nname: arm\nconvention: standard\nunits: {length: m, angle: rad}\n"


@cache
def robot(path: Path) -> Robot:
    return load(path)


@pytest.fixture(params=ROBOTS, ids=lambda path: path.stem)
def arm(request: pytest.FixtureRequest) -> Robot:
    """Every robot of the folder."""
    return robot(request.param)


def random_poses(arm: Robot, count: int = POSES) -> np.ndarray:
    box = np.array(joint_box(arm)).reshape(arm.dof, 2)
    return np.random.default_rng(SEED).uniform(box[:, 0], box[:, 1], (count, arm.dof))


def to_floats(matrix: mpmath.matrix) -> np.ndarray:
    return np.array([[float(matrix[i, j]) for j in range(4)] for i in range(4)])


def frame(arm: Robot, found: dict[str, np.ndarray], name: str | int) -> np.ndarray:
    """A frame by name or row number; 0 is the base, in robots whose base transform is the identity."""
    if isinstance(name, str):
        return found[name]
    assert name or not arm.base
    return found[arm.rows[name - 1].name if name else "base"]


@pytest.mark.parametrize(("system", "name", "example"), EXAMPLES)
def test_published_numbers(system: System, name: str, example: Example) -> None:
    """Poses computed elsewhere with 60 digits, in the lengths of each example."""
    arm = textbook_robot(name)
    values = {key: float(read(text, {}, [])) for key, text in example.values.items()}
    params = {parameter.name: values[parameter.name] for parameter in arm.parameters if parameter.name in values}
    found = reference.frames(arm, [values[variable] for variable in system.variables], params)
    start, end = frame(arm, found, example.start)[0], frame(arm, found, example.end)[0]

    scale = max([1.0, *(abs(entry) for row in example.matrix for entry in row)])
    np.testing.assert_allclose((np.linalg.inv(start) @ end)[:3], example.matrix, rtol=0, atol=ROUNDING * scale)


# Poses of real arms known from elsewhere: joint values in degrees, position of the tip, bound on the difference.
# jaco2: home joint and Cartesian values in Kinova's own drivers, which are rounded and measured. panda: ready pose of
# Franka's examples, flange. ur5, xarm6: zero poses of their tables. The others stand upright; the fanuc, as mastered.
REAL_POSES = [
    ("jaco2", [275.0, 167.1, 57.4, 240.9, 82.7, 75.4], [0.2123, -0.2572, 0.5096], 5e-3),
    ("panda", [0, -45, 0, -135, 0, 90, 45], [0.3069, 0, 0.5903], 5e-5),
    ("ur5", [0, 0, 0, 0, 0, 0], [-0.81725, -0.19145, -0.005491], 1e-12),
    ("ur3", [0, -90, 0, -90, 0, 0], [0, -0.19425, 0.69415], 1e-12),
    ("ur16e", [0, -90, 0, -90, 0, 0], [0, -0.2907, 1.13895], 1e-12),
    ("iiwa14", [0, 0, 0, 0, 0, 0, 0], [0, 0, 1.306], 1e-12),
    ("tx60", [0, 0, 0, 0, 0, 0], [0, 20, 1045], 1e-9),
    ("kr5", [0, -90, 0, 0, 0, 0], [0.915, 0, 1.12], 1e-12),
    ("xarm6", [0, 0, 0, 0, 0, 0], [207, 0, 112], 1e-12),
    ("fanuc_10l", [0, -90, 0, 0, 0, 0], [1.21, 0, 0.87], 1e-12),
]


@pytest.mark.parametrize(("name", "degrees", "position", "bound"), REAL_POSES, ids=[pose[0] for pose in REAL_POSES])
def test_real_arms_stand_where_they_should(
    name: str, degrees: list[float], position: list[float], bound: float
) -> None:
    found = reference.pose(textbook_robot(name), np.deg2rad(degrees))[0, 0]

    np.testing.assert_allclose(found[:3, 3], position, rtol=0, atol=bound)


def test_jaco_home_has_its_published_orientation() -> None:
    """The same drivers give the home orientation as XYZ Euler angles."""
    x, y, z = 1.63771402836, 1.11316478252, 0.134094119072
    euler = loads(HEAD + f"joints:\n  - {{name: j, ets: [Rx({x}), Ry({y}), Rz({z})]}}\n", "x")
    found = reference.pose(textbook_robot("jaco2"), np.deg2rad(REAL_POSES[0][1]))[0, 0]

    np.testing.assert_allclose(found[:3, :3], reference.pose(euler, [])[0, 0, :3, :3], atol=0.02)


def test_roll_pitch_yaw_are_about_fixed_axes() -> None:
    """The pose (0.7, 0.1, 0.5), roll 10, pitch -45, yaw 5 degrees, computed elsewhere with 60 digits."""
    tool = "tool: {xyz: [0.7, 0.1, 0.5], rpy: [10, -45, 5]}\njoints: []\n"
    arm = loads(HEAD.replace("rad", "deg") + tool, "x")
    expected = [
        [0.70441602640275868, -0.20815221048165063, -0.67857992824615038, 0.7],
        [0.061628416716219354, 0.97035859993513723, -0.23367953651308945, 0.1],
        [0.70710678118654752, 0.12278780396897285, 0.69636424032001894, 0.5],
    ]

    np.testing.assert_allclose(reference.pose(arm, [])[0, 0, :3], expected, rtol=0, atol=ROUNDING)


def test_every_frame_is_a_rigid_displacement(arm: Robot) -> None:
    for matrices in reference.frames(arm, random_poses(arm)).values():
        turns = matrices[:, :3, :3]
        np.testing.assert_allclose(turns @ turns.swapaxes(1, 2), np.broadcast_to(np.eye(3), turns.shape), atol=ROUNDING)
        np.testing.assert_allclose(np.linalg.det(turns), 1.0, atol=ROUNDING)
        assert np.array_equal(matrices[:, 3], np.broadcast_to([0, 0, 0, 1], (len(matrices), 4)))


def test_both_precisions_agree(arm: Robot) -> None:
    q = random_poses(arm, 3)
    floats = reference.frames(arm, q)
    scale = max(1.0, reach(arm, floats))
    for row, vector in enumerate(q):
        for name, matrix in reference.frames_mp(arm, vector).items():
            np.testing.assert_allclose(floats[name][row], to_floats(matrix), rtol=0, atol=ROUNDING * scale)


def test_a_full_turn_changes_nothing(arm: Robot) -> None:
    """Of a revolute joint that no other joint follows by a fraction."""
    followed = any(row.type is JointType.FOLLOWER for row in arm.rows)
    turning = [0.0 if followed or entry.type is not JointType.REVOLUTE else 2 * np.pi for entry in arm.variables]
    q = random_poses(arm)

    np.testing.assert_allclose(
        reference.pose(arm, q), reference.pose(arm, q + np.array(turning)), atol=4 * ROUNDING * max(1.0, reach(arm))
    )


def test_no_tip_gets_beyond_the_reach(arm: Robot) -> None:
    far = np.linalg.norm(reference.pose(arm, random_poses(arm, 2000))[..., :3, 3], axis=-1).max()

    assert far <= reach(arm) * (1 + ROUNDING)


def test_frames_have_the_names_of_the_model(arm: Robot) -> None:
    names = set(reference.frames(arm, random_poses(arm, 1)))

    assert names == {"base", *arm.frame_names} | (set() if arm.is_tree else {"wrist"})
    assert reference.pose(arm, random_poses(arm, 5)).shape == (5, len(arm.tips), 4, 4)
    assert len(reference.pose_mp(arm, random_poses(arm, 1)[0])) == len(arm.tips)


def test_fifty_digits_are_fifty_digits() -> None:
    """cos(0.5) of a planar arm with one link of length 1, against mpmath's own value."""
    arm = loads(HEAD + "joints:\n  - {name: only, theta: q, d: 0, a: 1, alpha: 0}\n", "arm.yaml")
    matrix = reference.pose_mp(arm, [0.5])[0]

    with mpmath.workdps(reference.DIGITS):
        assert abs(matrix[0, 3] - mpmath.cos(mpmath.mpf("0.5"))) < mpmath.mpf(10) ** -49


@pytest.mark.parametrize("last", [(1, 1), (0, 1), (1, 0), (0, 0)])
def test_transforms_and_their_derivatives_are_multiplied_by_blocks(last: tuple[int, int]) -> None:
    """Last rows are (0, 0, 0, 1) or, of a derivative, nothing but zeros."""
    with mpmath.workdps(50):
        multiply, numbers = digit_arrays().multiply, np.random.default_rng(SEED).uniform(-1, 1, (2, 5, 4, 4))
        left, right = np.frompyfunc(mpmath.mpf, 1, 1)(numbers)
        for matrices, entry in zip((left, right), last, strict=True):
            matrices[:, 3] = (0, 0, 0, entry)

        assert (abs(multiply(left, right) - left @ right) < 1e-48).all()
        assert (abs(multiply(left[0], right) - left[0] @ right) < 1e-48).all()


def test_hayati_is_its_product_of_elementary_transforms() -> None:
    steps = "[Rz(q), Tx(0.7), Rx(0.3), Ry(-0.2)]"
    table = loads(HEAD + "joints:\n  - {name: j, convention: hayati, theta: q, a: 0.7, alpha: 0.3, beta: -0.2}\n", "x")
    written = loads(HEAD + f"joints:\n  - {{name: j, ets: {steps}}}\n", "x")
    q = np.linspace(-3, 3, 7)[:, None]

    np.testing.assert_allclose(reference.pose(table, q), reference.pose(written, q), atol=ROUNDING)


def test_a_follower_moves_with_its_joint() -> None:
    first, second = "name: j, theta: q, d: 0, a: 1, alpha: 0", "name: k, theta: 0.5*j + 1, d: 0, a: 1, alpha: 0"
    arm = loads(HEAD + f"joints:\n  - {{{first}}}\n  - {{{second}}}\n", "x")
    found = reference.pose(arm, [[0.4]])[0, 0]

    np.testing.assert_allclose(found[:2, 3], [np.cos(0.4) + np.cos(1.6), np.sin(0.4) + np.sin(1.6)], atol=ROUNDING)


def test_parameters_can_be_given() -> None:
    arm = loads(HEAD + "parameters: {L: 2}\njoints:\n  - {name: j, theta: q, d: 0, a: L, alpha: 0}\n", "x")

    assert reference.pose(arm, [0.0])[0, 0, 0, 3] == 2.0
    assert reference.pose(arm, [0.0], {"L": 3.0})[0, 0, 0, 3] == 3.0
    assert reference.pose_mp(arm, [0.0], {"L": 3.0})[0][0, 3] == 3


def test_what_does_not_fit_is_refused() -> None:
    arm = robot(next(path for path in ROBOTS if path.stem == "puma560"))

    with pytest.raises(ValueError, match="6 joint variables, not 5"):
        reference.pose(arm, np.zeros((3, 5)))
    with pytest.raises(ValueError, match=r"no parameter \['a9'\]"):
        reference.pose(arm, np.zeros(6), {"a9": 1.0})


def test_the_tool_stands_on_the_goal() -> None:
    """The relation of the frames with standard names, in the pose that its file states."""
    arm = robot(next(path for path in ROBOTS if path.stem == "standard_frames"))
    found = reference.frames(arm, [1, 3, 2])

    np.testing.assert_allclose(found["tool"], found["goal"], atol=ROUNDING)
    wrist_T_tool = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0.5], [0, 0, 0, 1]])
    station_T_goal = np.linalg.inv(found["station"]) @ found["goal"]
    np.testing.assert_allclose(
        np.linalg.inv(found["station"]) @ found["wrist"] @ wrist_T_tool, station_T_goal, atol=ROUNDING
    )


def test_the_box_has_limits_or_defaults() -> None:
    text = (
        "parameters: {L: 2}\njoints:\n"
        "  - {name: a, theta: q, d: -L, a: 1, alpha: 0, limits: [-1, pi/2]}\n"
        "  - {name: b, theta: q, d: 0, a: 0, alpha: 0}\n"
        "  - {name: c, theta: 0, d: q - 0.5, a: 0, alpha: 0}\n"
        "  - {name: e, theta: q, d: 0.1*q, a: 0, alpha: 0}\n"
    )
    arm = loads(HEAD + text, "x")

    assert joint_box(arm) == ((-1.0, np.pi / 2), (-np.pi, np.pi), (-3.5, 3.5), (-np.pi, np.pi))
    assert reach(arm) == pytest.approx(1 + 2 + (0.5 + 3.5) + 0.1 * np.pi)


@pytest.mark.parametrize("limits", ["[-2, 0.5]", "[-0.5, 2]"])
def test_the_longer_side_of_a_stroke_counts_for_the_reach(limits: str) -> None:
    text = f"joints:\n  - {{name: a, theta: 0, d: q, a: 1, alpha: 0, limits: {limits}}}\n"

    assert reach(loads(HEAD + text, "x")) == 3.0


@pytest.mark.parametrize(("theta", "d", "lead"), [("q", "0.25*q", 0.5), ("2*q", "0.25*q", 0.25), ("-q", "0.5*q", -1)])
def test_the_lead_of_a_screw_is_its_shift_in_a_whole_turn(theta: str, d: str, lead: float) -> None:
    arm = loads(HEAD + f"joints:\n  - {{name: a, theta: {theta}, d: {d}, a: 1, alpha: 0}}\n", "x")

    assert screw_leads(arm) == {"a": pytest.approx(lead * np.pi)}


def test_a_robot_without_lengths_has_a_box_and_a_reach() -> None:
    slide = loads(HEAD + "joints:\n  - {name: a, theta: 0, d: q, a: 0, alpha: 0}\n", "x")
    turn = loads(HEAD + "joints:\n  - {name: a, theta: q, d: 0, a: 0, alpha: 0}\n", "x")

    assert joint_box(slide) == ((-1.0, 1.0),)
    assert reach(turn) == SMALLEST_REACH


def test_the_reach_of_named_frames_can_be_asked_for() -> None:
    text = "joints:\n  - {name: a, theta: q, d: 0, a: 1, alpha: 0}\nframes:\n  far: {xyz: [0, 0, 7], parent: a}\n"
    arm = loads(HEAD + text, "x")

    assert reach(arm) == 1.0
    assert reach(arm, ["far"]) == 8.0


@pytest.mark.parametrize("name", ["asin", "acos", "atan"])
def test_series_of_arcs_are_taylors(name: str) -> None:
    with mpmath.workdps(40):
        kind = in_series(digits(), 2)
        function = getattr(mpmath, name)
        small = Series({(): mpmath.mpf("0.3"), (0,): mpmath.mpf(2)}, 2)
        parts = kind.arithmetic.functions[name](small).parts

        expected = mpmath.taylor(lambda t: function(mpmath.mpf("0.3") + 2 * t), 0, 2)
        for monomial, coefficient in zip(((), (0,), (0, 0)), expected, strict=True):
            assert abs(parts[monomial] - coefficient) < 1e-15


@pytest.mark.parametrize("power", [1, 2, 3])
def test_series_of_reciprocals_are_taylors(power: int) -> None:
    """In one variable and in two: the slope of 1/x^n, and how it changes."""
    with mpmath.workdps(40):
        small = Series({(): mpmath.mpf("0.3"), (0,): mpmath.mpf(2), (1,): mpmath.mpf(-3)}, 2)
        parts = (7 / small**power).parts
        value, slope, bend = mpmath.taylor(lambda t: 7 / t**power, mpmath.mpf("0.3"), 2)

        wanted = {(): value, (0,): 2 * slope, (1,): -3 * slope, (0, 0): 4 * bend, (0, 1): -12 * bend, (1, 1): 9 * bend}
        assert parts.keys() == wanted.keys()
        assert all(abs(parts[monomial] - entry) < 1e-15 * abs(entry) for monomial, entry in wanted.items())
