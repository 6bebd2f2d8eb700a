"""The named forms: what they do to a reading, where they are impossible, and the way back."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from kinegen.errors import KinegenError
from kinegen.io.load import load
from kinegen.model.joint_bounds import reach
from kinegen.model.outputs import Kind
from kinegen.model.robot import Robot
from kinegen.verify.reference import Actuation
from tests.actuators.machines import computed, joints, machine, one, readings_of, samples

ROBOTS = Path(__file__).resolve().parents[2] / "robots"

WIRE = "form: linear_actuator, actuator: m, sides: [0.3, 0.5]"


# Gears and couplings --------------------------------------------------------------------------------------------------


def test_a_gear_divides_turns_and_adds_its_offset() -> None:
    robot = one("form: gear, actuator: m, ratio: 100, sign: -1, offset: 10")

    assert joints(robot, math.radians(250))[0] == pytest.approx(math.radians(-2.5 + 10), abs=1e-15)
    assert readings_of(robot, math.radians(7.5))[0] == pytest.approx(math.radians(250), abs=1e-13)


def test_counts_of_an_encoder_are_divided_down_to_degrees() -> None:
    robot = one("form: gear, actuator: m, ratio: 131072/360", "number")

    assert joints(robot, 131072 / 4)[0] == pytest.approx(math.pi / 2, abs=1e-15)


def test_a_rack_drives_a_slide() -> None:
    row = "{name: lift, a: 0, alpha: 0, d: q, theta: 0}"
    robot = machine("{m: length}", "{joint: lift, form: gear, actuator: m, ratio: 2, offset: 0.1}", rows=(row,))

    assert joints(robot, 0.5)[0] == pytest.approx(0.35, abs=1e-16)


def test_a_spindle_is_a_formula() -> None:
    """In the length of a slide an angle counts in radians, as in the rows of the table."""
    row = "{name: lift, a: 0, alpha: 0, d: q, theta: 0}"
    robot = machine("{m: angle}", "{joint: lift, value: 0.005*m/(2*pi)}", rows=(row,))

    assert joints(robot, 3 * math.tau)[0] == pytest.approx(0.015, abs=1e-16)
    assert readings_of(robot, 0.015)[0] == pytest.approx(3 * math.tau, abs=1e-13)


def test_a_differential_bends_by_the_mean_and_rolls_by_half_the_difference() -> None:
    coupling = "{joints: [shoulder, elbow], form: coupling, actuators: [m2, m3], matrix: [[1/2, 1/2], [1/2, -1/2]]}"
    robot = machine("{m1: angle, m2: angle, m3: angle}", "{joint: waist, form: gear, actuator: m1, ratio: 1}", coupling)

    np.testing.assert_allclose(joints(robot, 0.1, 0.8, 0.2), [0.1, 0.5, 0.3], atol=1e-16)
    np.testing.assert_allclose(readings_of(robot, 0.1, 0.5, 0.3), [0.1, 0.8, 0.2], atol=1e-16)


entries = st.fractions(min_value=-3, max_value=3, max_denominator=6)


@given(
    st.lists(st.lists(entries, min_size=3, max_size=3), min_size=3, max_size=3),
    st.lists(entries, min_size=3, max_size=3),
)
@settings(max_examples=15)
def test_any_coupling_is_its_matrix_and_has_the_exact_inverse(
    matrix: list[list[object]], offsets: list[object]
) -> None:
    numbers = np.array([[float(entry) for entry in row] for row in matrix])  # type: ignore[arg-type]
    assume(abs(np.linalg.det(numbers)) > 1e-2)
    rows = ", ".join(f"[{', '.join(map(str, row))}]" for row in matrix)
    robot = machine(
        "{m1: angle, m2: angle, m3: angle}",
        f"{{joints: [waist, shoulder, elbow], form: coupling, actuators: [m1, m2, m3], matrix: [{rows}], "
        f"offsets: [{', '.join(map(str, offsets))}]}}",
    )
    readings = np.random.default_rng(1).uniform(-3, 3, (5, 3))
    shifts = np.radians([float(offset) for offset in offsets])  # type: ignore[arg-type]
    found = computed(robot, Kind.ACTUATORS_TO_JOINTS, readings)

    np.testing.assert_allclose(found, readings @ numbers.T + shifts, atol=1e-13)
    np.testing.assert_allclose(computed(robot, Kind.JOINTS_TO_ACTUATORS, found), readings, atol=1e-9)


# Triangles ------------------------------------------------------------------------------------------------------------


def wire() -> Robot:
    """The wire of the lecture notes: its reading is the change of its length."""
    return one(f"{WIRE}, length: m + sqrt(0.3**2 + 0.5**2), offset: -90", "length")


@pytest.mark.parametrize("angle", [0.0, 0.7, -1.1, 1.57, -1.57])
def test_the_wire_of_the_lecture_notes(angle: float) -> None:
    reading = math.sqrt(0.34 - 0.3 * math.cos(math.pi / 2 + angle)) - math.sqrt(0.34)

    assert joints(wire(), reading)[0] == pytest.approx(angle, abs=1e-12)
    assert readings_of(wire(), angle)[0] == pytest.approx(reading, abs=1e-15)


@pytest.mark.parametrize("length", [0.1999, 0.8001, -0.5, math.nan])
def test_lengths_that_close_no_triangle_give_nan(length: float) -> None:
    robot = one(WIRE, "length")

    assert math.isnan(joints(robot, length)[0])
    assert np.isnan(computed(robot, Kind.FK_ACTUATORS, np.array([length]))[0][:2]).all()
    assert np.isnan(computed(robot, Kind.JACOBIAN_ACTUATORS, np.array([length]))[0][:2]).all()


def test_a_stretched_and_a_folded_triangle_have_their_angles() -> None:
    robot = one("form: linear_actuator, actuator: m, sides: [0.5, 0.25]", "length")

    assert joints(robot, 0.75)[0] == math.pi
    assert joints(robot, 0.25)[0] == 0
    np.testing.assert_allclose(readings_of(robot, 0), [0.25])
    np.testing.assert_allclose(readings_of(robot, math.pi), [0.75])


@pytest.mark.parametrize("angle", [-0.1, 3.3, -3.1 + math.tau])
def test_a_linkage_past_its_dead_centre_has_no_reading(angle: float) -> None:
    """The length would be right, but the actuator gives the other angle for it."""
    assert math.isnan(readings_of(one(WIRE, "length"), angle)[0])


def test_whole_turns_of_a_joint_have_the_same_reading() -> None:
    np.testing.assert_allclose(readings_of(one(WIRE, "length"), 1.0 - math.tau), readings_of(one(WIRE, "length"), 1.0))


def test_a_mirrored_linkage_turns_the_other_way() -> None:
    there, mirrored = (joints(one(f"{WIRE}, sign: {sign}, offset: 15", "length"), 0.4)[0] for sign in (1, -1))

    assert there + mirrored == pytest.approx(math.radians(30), abs=1e-15)


def test_close_to_a_dead_centre_nothing_is_lost_to_rounding() -> None:
    """At 1e-9 m from stretched an arc cosine has half its digits; the angle here has all that the reading allows."""
    robot = one("form: linear_actuator, actuator: m, sides: [0.5, 0.25]", "length")
    length = 0.75 - 2.0**-30
    short = 2.0**-30
    exact = math.pi - math.sqrt(2 * short * 0.75 / (0.5 * 0.25)) * (1 + short / 24 * (1 / 0.125 - 8 / 0.75) * 0.75)

    assert joints(robot, length)[0] == pytest.approx(exact, abs=1e-12)


# Four-bar linkages ----------------------------------------------------------------------------------------------------

LINKAGES = {
    "crank and rocker": (0.4, 0.1, 0.3, 0.25, "open", (40, 200)),
    "crank and rocker behind": (0.4, 0.1, 0.3, 0.25, "open", (220, 380)),
    "crossed": (0.4, 0.1, 0.3, 0.25, "crossed", (-15, 140)),
    "two cranks": (0.1, 0.3, 0.25, 0.35, "open", (-350, 350)),
    "two cranks crossed": (0.1, 0.3, 0.25, 0.35, "crossed", (-350, 350)),
    "two rockers": (0.5, 0.3, 0.25, 0.2, "open", (25, 60)),
    "crossed parallelogram": (0.3, 0.2, 0.3, 0.2, "crossed", (20, 150)),
    "parallelogram": (0.3, 0.2, 0.3, 0.2, "open", (-400, 400)),
}


def linkage(name: str, more: str = "") -> Robot:
    """A four-bar linkage on one joint."""
    ground, crank, coupler, rocker, branch, limits = LINKAGES[name]
    entry = f"form: four_bar, actuator: m, ground: {ground}, crank: {crank}, coupler: {coupler}, rocker: {rocker}"
    return one(f"{entry}, branch: {branch}{more}", f"{{dimension: angle, limits: [{limits[0]}, {limits[1]}]}}")


@pytest.mark.parametrize("name", LINKAGES)
def test_the_coupler_keeps_its_length(name: str) -> None:
    ground, crank, coupler, rocker, *_ = LINKAGES[name]
    angles = samples(linkage(name), 200)
    turned = computed(linkage(name), Kind.ACTUATORS_TO_JOINTS, angles)
    x = ground + rocker * np.cos(turned) - crank * np.cos(angles)
    y = rocker * np.sin(turned) - crank * np.sin(angles)

    np.testing.assert_allclose(np.hypot(x, y), coupler, atol=1e-14)


@pytest.mark.parametrize("name", LINKAGES)
def test_a_linkage_moves_without_a_jump_and_comes_back(name: str) -> None:
    robot = linkage(name, ", sign: -1, offset: 20")
    ends = samples(robot, 0)
    angles = np.linspace(*ends, 2001)
    turned = computed(robot, Kind.ACTUATORS_TO_JOINTS, angles)
    steps = np.diff(turned[:, 0])

    assert np.abs(steps).max() < 60 * np.ptp(angles) / 2000
    assert abs(-turned[1000, 0] + math.radians(20)) <= math.pi
    np.testing.assert_allclose(computed(robot, Kind.JOINTS_TO_ACTUATORS, turned), angles, atol=1e-12)


@pytest.mark.parametrize("name", LINKAGES)
def test_the_derivative_is_the_slope(name: str) -> None:
    robot = linkage(name, ", offset: 20")
    angles = samples(robot, 20)[:20]
    step = 1e-6
    ahead, behind = (computed(robot, Kind.ACTUATORS_TO_JOINTS, angles + way) for way in (step, -step))
    slopes = computed(robot, Kind.JACOBIAN_ACTUATORS, angles)[:, -1]

    np.testing.assert_allclose(slopes, (ahead - behind)[:, 0] / (2 * step), rtol=1e-6)


def test_an_open_linkage_stands_as_a_parallelogram_does() -> None:
    """Open and crossed are the two ways to put the same bars together; the parallelogram is the open one."""
    near, crossed = (joints(linkage(name), 1.2)[0] for name in ("parallelogram", "crossed parallelogram"))

    assert near == 1.2
    assert crossed < 0


def test_a_parallelogram_carries_the_angle_of_its_crank_past_the_shoulder() -> None:
    """A motor beside the shoulder holds the forearm's direction: it moves alone, and the shoulder moves alone."""
    robot = machine(
        "{m1: angle, m2: angle, m3: angle}",
        "{joint: waist, form: gear, actuator: m1, ratio: 1}",
        "{joint: shoulder, form: gear, actuator: m2, ratio: 1}",
        "{joint: elbow, form: four_bar, actuator: m3, ground: 0.5, crank: 0.1, coupler: 0.5, rocker: 0.1, "
        "offset: -shoulder}",
    )
    readings = np.array([[0.3, 0.9, -0.2], [0.3, 0.4, -0.2]])
    poses = computed(robot, Kind.FK_ACTUATORS, readings).reshape(2, 3, 4)
    jacobian = computed(robot, Kind.JACOBIAN_ACTUATORS, readings).reshape(2, 6, 3)

    np.testing.assert_array_equal(poses[0, :, :3], poses[1, :, :3])
    np.testing.assert_array_equal(jacobian[:, 3:, 1], 0)
    np.testing.assert_allclose(readings_of(robot, *joints(robot, *readings[0])), readings[0], atol=1e-16)


def test_a_crank_out_of_reach_gives_nan() -> None:
    assert math.isnan(joints(linkage("two rockers"), math.radians(80))[0])


# Free expressions -----------------------------------------------------------------------------------------------------


def test_a_free_expression_counts_in_degrees() -> None:
    """As the table does: sine and cosine take degrees, arc functions give degrees, and the value is in degrees."""
    text = '"90 + 2*m + acos(0.5*sin(m + 30)) - asin(cos(60))/2 + atan2(k*m2, 1) + pi/6"'
    rows = ("{name: turn, a: 0.3, alpha: 0, d: 0, theta: q}",)
    robot = machine("{m: angle, m2: number}", f"{{joint: turn, value: {text}}}", rows=rows, parameters="{k: 0.25}")
    m = math.radians(20)
    inner = math.acos(0.5 * math.sin(m + math.radians(30)))
    expected = math.pi / 2 + 2 * m + inner - math.asin(0.5) / 2 + math.atan2(0.25 * 3, 1) + math.pi / 6

    assert joints(robot, m, 3)[0] == pytest.approx(expected, abs=1e-15)


def test_degrees_and_radians_are_one_machine() -> None:
    degrees = one('value: "2*m - 45 + 0.5*acos(m2/2)"'.replace("m2", "0.3*sin(m)"), angle="deg")
    radians = one('value: "2*m - pi/4 + 0.5*acos(m2/2)"'.replace("m2", "0.3*sin(m)"), angle="rad")
    readings = np.linspace(-3, 3, 7)[:, None]

    for kind in (Kind.ACTUATORS_TO_JOINTS, Kind.FK_ACTUATORS, Kind.JACOBIAN_ACTUATORS):
        np.testing.assert_allclose(computed(degrees, kind, readings), computed(radians, kind, readings), atol=1e-15)


def test_an_expression_that_is_linear_in_one_new_reading_is_inverted() -> None:
    robot = machine(
        "{m1: angle, m2: angle, m3: number}",
        "{joint: waist, value: m1/50 + 10}",
        "{joint: shoulder, value: m2/40 - 0.3*m1 - waist}",
        "{joint: elbow, value: 0.01*m3 + sin(shoulder)}",
    )
    readings = np.array([0.5, -0.8, 12.0])

    np.testing.assert_allclose(readings_of(robot, *joints(robot, *readings)), readings, atol=1e-12)


def test_an_inverse_that_the_tool_cannot_derive_is_asked_for() -> None:
    robot = one('value: "m + 0.1*sin(m)"')

    with pytest.raises(KinegenError, match=r"how 'm' follows from the joints .* inverse: \{m: \.\.\.\}"):
        readings_of(robot, 0.3)


def test_an_inverse_that_the_file_gives_is_used() -> None:
    robot = one("value: 30*m**2", "number", inverse='{m: "sqrt(turn/30)"}')

    assert joints(robot, 1.5)[0] == pytest.approx(math.radians(67.5))
    assert readings_of(robot, math.radians(67.5))[0] == pytest.approx(1.5)


@pytest.mark.parametrize(
    "text", ["0.5*sqrt(m**2)", "m*sqrt(1 + m**2)", "atan2(m, 2 + m)", "asin(m/9)", "(1 + m**2)**2/9"]
)
def test_the_derivative_of_any_expression_is_its_slope(text: str) -> None:
    robot = one(f'value: "{text}"', "number", angle="rad")
    readings, step = np.array([[-1.3], [0.4], [1.7]]), 1e-6
    ahead, behind = (computed(robot, Kind.ACTUATORS_TO_JOINTS, readings + way) for way in (step, -step))
    slopes = computed(robot, Kind.JACOBIAN_ACTUATORS, readings)[:, -1]

    np.testing.assert_allclose(slopes, (ahead - behind)[:, 0] / (2 * step), rtol=1e-8)


def test_a_robot_without_actuators_says_so() -> None:
    with pytest.raises(KinegenError, match="planar_3r has no actuators"):
        computed(load(ROBOTS / "planar_3r.yaml"), Kind.FK_ACTUATORS, np.zeros(3))


# The robots of the house ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["motoman_l3", "wire_arm", "palletiser", "differential_wrist"])
def test_the_robots_of_the_house(name: str) -> None:
    """Poses and derivatives by the reference, and the way back over all limits."""
    robot = load(ROBOTS / f"{name}.yaml")
    readings = samples(robot, 200)
    judge = Actuation(robot, readings)
    angles = computed(robot, Kind.ACTUATORS_TO_JOINTS, readings)
    poses = computed(robot, Kind.FK_ACTUATORS, readings).reshape(-1, 3, 4)
    slopes = computed(robot, Kind.JACOBIAN_ACTUATORS, readings).reshape(len(readings), 6, -1)
    expected = judge.jacobian("tool")

    np.testing.assert_allclose(angles, judge.joints, atol=1e-14)
    np.testing.assert_allclose(poses, judge.motion.pose("tool")[:, :3], atol=1e-14 * reach(robot))
    np.testing.assert_allclose(slopes, expected, atol=1e-14 * np.abs(expected).max())
    back = computed(robot, Kind.JOINTS_TO_ACTUATORS, angles)
    np.testing.assert_allclose(back, readings, atol=1e-12 * np.abs(readings).max())


def test_a_palletiser_lifts_without_tilting() -> None:
    """Motor 2 and motor 3 move the flange, and do not turn it."""
    robot = load(ROBOTS / "palletiser.yaml")
    slopes = computed(robot, Kind.JACOBIAN_ACTUATORS, samples(robot, 20)).reshape(-1, 6, 4)

    np.testing.assert_array_equal(slopes[:, 3:, 1:3], 0)
    assert np.abs(slopes[:, :3, 1:3]).max(axis=1).min() > 100
