"""What a proof accepts follows the robot and the inputs: no right kernel is refused, and a wrong one is."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from kinegen.driver.pipeline import build
from kinegen.driver.results import BuildOptions, BuildResult
from kinegen.errors import RobotFileError
from kinegen.io.load import load, loads
from kinegen.ir.lower import program_of
from kinegen.model.joint_bounds import reach
from kinegen.model.outputs import Array, Kind, Quantity, parse_quantity
from kinegen.model.robot import Robot
from kinegen.verify import reference
from kinegen.verify.compare import Judge
from kinegen.verify.expectations import Expectation, expect
from kinegen.verify.records import Invocation
from kinegen.verify.reference_cache import ReferenceResults
from kinegen.verify.rounding import rounded_trials
from kinegen.verify.samples import beyond_limits, input_samples, proof_samples
from kinegen.verify.tolerances import accepted, accepted_error, number_type, shaped
from tests.evaluation import run

ROBOTS = Path(__file__).parents[2] / "robots"
PUMA = load(ROBOTS / "puma560.yaml")

HEAD = "kinegen: 1\nname: {}\nconvention: standard\nunits: {{length: {}, angle: deg}}\njoints:\n"

SCARA = HEAD.format("scara4", "m") + (
    "  - {name: j1, theta: q, d: 0.3, a: 0.4, alpha: 0, limits: [-170, 170]}\n"
    "  - {name: j2, theta: q, d: 0, a: 0.3, alpha: 180, limits: [-150, 150]}\n"
    "  - {name: j3, theta: 0, d: q, a: 0, alpha: 0, limits: [0, 0.2]}\n"
    "  - {name: j4, theta: q, d: 0, a: 0, alpha: 0, limits: [-3600, 3600]}\n"
)


def chain(joints: int, limit: str, length: str, unit: str) -> str:
    """Parallel joints, of which all angles are summed."""
    limits = f", limits: [-{limit}, {limit}]" if limit else ""
    rows = [f"  - {{name: j{i}, theta: q, d: 0, a: {length}, alpha: 0{limits}}}\n" for i in range(1, joints + 1)]
    return HEAD.format("chain", unit) + "".join(rows)


def built(tmp_path: Path, text: str, *outputs: str) -> BuildResult:
    path = tmp_path / "robot.yaml"
    path.write_text(text, encoding="utf-8")
    quantities = tuple(map(parse_quantity, outputs or ("pose", "position")))
    return build(path, BuildOptions(output=tmp_path, quantities=quantities, compile=False), lambda _: None)


CHAINS = [
    (1, "", "0.1", "m"),
    (5, "", "0.000001", "m"),
    (6, "360", "0.1", "m"),
    (9, "", "100", "mm"),
    (12, "120", "0.1", "m"),
    (12, "720", "1000", "m"),
    (16, "36000", "0.001", "mm"),
    pytest.param(32, "", "1000000", "mm", marks=pytest.mark.long),
    pytest.param(64, "", "0.1", "m", marks=pytest.mark.long),
    pytest.param(64, "36000", "0.1", "m", marks=pytest.mark.long),
]


@pytest.mark.parametrize(("joints", "limit", "length", "unit"), CHAINS)
def test_sums_of_any_size_are_accepted_in_both_number_types(
    joints: int, limit: str, length: str, unit: str, tmp_path: Path
) -> None:
    result = built(tmp_path, chain(joints, limit, length, unit))

    assert result.proof.holds
    assert {"NumPy double", "NumPy float"} <= {comparison.target for comparison in result.proof.comparisons}


def test_a_joint_of_many_turns_parallel_to_others_builds(tmp_path: Path) -> None:
    assert built(tmp_path, SCARA, "pose", "jacobian").proof.holds


def test_angles_beyond_what_float_takes_the_sine_of_are_one_note(tmp_path: Path) -> None:
    """64 joints of a hundred turns add up to 40,000 rad, and the float kernels return NaN from 12,000 rad on."""
    notes = [note for note in built(tmp_path, chain(64, "36000", "0.1", "m")).notes if "12000 rad" in note]

    assert len(notes) == 1
    assert "use the double kernels" in notes[0]


def limits_of(robot: Robot, name: str, real: str) -> tuple[Expectation, float, float]:
    """An expectation, and the largest limits of lengths and of all other entries beside their scales."""
    quantity = parse_quantity(name)
    arrays = [Array("q", (robot.dof,)), Array("qd", (robot.dof,)), Array("qdd", (robot.dof,))]
    expectation = expect(ReferenceResults(robot, input_samples(robot, arrays, proof_samples(robot)[::50])), quantity)
    limits = accepted(expectation, program_of(robot, quantity), number_type(real))
    worst = [max(float(split[part].max(initial=0)) for frames in limits for split in frames) for part in (0, 1)]
    return expectation, worst[0] / expectation.length_scale, worst[1] / expectation.number_scale


@pytest.mark.parametrize("name", ["pose", "jacobian", "hessian", "twist", "acceleration", "quaternion_wxyz", "rpy_zyx"])
@pytest.mark.parametrize(("real", "unit"), [("double", 2.0**-53), ("float", 2.0**-24)])
def test_an_arm_is_held_to_some_hundred_units_at_most(name: str, real: str, unit: float) -> None:
    _, length, number = limits_of(PUMA, name, real)

    assert length < 50 * unit
    assert number < 300 * unit


def test_the_limit_of_a_pose_is_what_is_proven_of_it() -> None:
    """The header of the PUMA 560 states 3.9e-7 m at most; per unit of its reach that is less."""
    expectation, length, _ = limits_of(PUMA, "pose", "float")

    assert length * expectation.length_scale <= 3.9e-7


def test_a_wrong_program_does_not_widen_its_own_limit() -> None:
    """The spread is measured from the program itself, and not from the reference."""
    expectation, *_ = limits_of(PUMA, "rpy_zyx", "double")
    wrong = program_of(PUMA, parse_quantity("rpy_xyz"))
    limits = accepted(expectation, wrong, number_type("double"))
    (_, numbers), *_ = limits[0]

    assert np.median(numbers) < 1e-13


def test_trials_differ_by_rounding_and_no_more() -> None:
    q = proof_samples(PUMA)[-100:]
    plain, *others = rounded_trials(program_of(PUMA, Quantity.POSE), q, {}, number_type("float"), 1)
    apart = np.abs(np.array(others) - plain).max(axis=0)

    assert 1e-8 < np.median(apart[apart > 0]) < 1e-6
    assert apart.max() < 3e-6


def test_trials_round_constants_that_the_type_does_not_hold() -> None:
    arm = loads(chain(1, "", "0.1", "m"), "chain")
    plain, *others = rounded_trials(program_of(arm, Quantity.POSITION), np.zeros((1, 1)), {}, number_type("float"), 1)
    moved = {abs(float(Fraction(float(other[0, 0])) - Fraction(float(plain[0, 0])))) for other in others}

    assert max(moved) > 0.1 * 2.0**-24 / 2


@pytest.mark.parametrize("path", sorted(ROBOTS.glob("*.yaml")), ids=lambda path: path.stem)
def test_poses_are_accepted_as_far_as_is_proven(path: Path) -> None:
    robot = load(path)

    assert 3e-15 < accepted_error(robot, "double") < 2e-13
    assert 2e-6 < accepted_error(robot, "float") < 1e-4


def test_ten_turns_beside_other_joints_widen_it() -> None:
    robot = loads(SCARA, "scara4.yaml")

    assert accepted_error(robot, "float") > 2.0**-24 * 20 * math.pi
    assert reach(robot) == pytest.approx(1.2)


def test_the_root_of_zero_has_no_slope_and_needs_none(tmp_path: Path) -> None:
    text = HEAD.format("roots", "m").replace("joints:", "parameters: {p: 0.5}\njoints:") + (
        "  - {name: a, theta: q, d: sqrt(p - 0.5), a: 0.2, alpha: 90}\n"
        "  - {name: b, theta: q, d: sqrt(0), a: 0.2, alpha: 0}\n"
    )

    assert built(tmp_path, text, "pose", "jacobian", "hessian").proof.holds


LINKAGE = (
    HEAD
    + "  - {{name: j, theta: q, d: 0.4, a: 0.3, alpha: 90}}\nactuators:\n  readings:\n"
    + "    m: {{dimension: angle, limits: [{}, {}]}}\n  joints:\n    - {{joint: j, form: four_bar, actuator: m, "
    + "ground: {}, crank: {}, coupler: {}, rocker: {}, branch: {}}}\n"
)


def linkages(count: int) -> Iterator[Robot]:
    """Random four-bars that close over random limits, some of them up to their dead centres."""
    draw = random.Random(20240229)
    while count:
        bars = [round(draw.uniform(0.1, 0.6), 3) for _ in range(4)]
        low = draw.uniform(-180, 300)
        high = low + draw.uniform(20, 160)
        text = LINKAGE.format("bars", "m", f"{low:.2f}", f"{high:.2f}", *bars, draw.choice(("open", "crossed")))
        try:
            robot = loads(text, "bars")
        except RobotFileError:
            continue
        count -= 1
        yield robot


@pytest.mark.parametrize("count", [10, pytest.param(200, marks=pytest.mark.long)])
def test_no_right_linkage_is_refused_however_near_its_dead_centres_it_works(count: int) -> None:
    kinds = (Kind.ACTUATORS_TO_JOINTS, Kind.FK_ACTUATORS, Kind.JACOBIAN_ACTUATORS, Kind.JOINTS_TO_ACTUATORS)
    for robot in linkages(count):
        for kind in kinds:
            quantity = Quantity(kind)
            program = program_of(robot, quantity)
            given = program.signature.inputs
            for real, dtype in (("double", np.float64), ("float", np.float32)):
                values = input_samples(robot, given, np.zeros((300, robot.dof)))
                rounded = {name: value.astype(dtype).astype(np.float64) for name, value in values.items()}
                expectation = expect(ReferenceResults(robot, rounded, unit=float(np.finfo(dtype).eps) / 2), quantity)
                trial = run(robot, program, rounded[given[0].name].astype(dtype))
                limits = accepted(expectation, program, number_type(real, library=True))
                verdict = expectation.judge(shaped(program, trial), limits)

                assert verdict.position_error <= verdict.position_limit, (robot, kind, real)
                assert verdict.rotation_error <= verdict.rotation_limit, (robot, kind, real)


@pytest.mark.parametrize("kind", [Kind.BIAS_ACCELERATION, Kind.ACCELERATION, Kind.TWIST, Kind.POSE])
def test_far_beyond_limits_the_reference_may_lose_of_lengths_what_they_measure(kind: Kind) -> None:
    """A row that is shifted by an angle of 1e4 turns is far away, and what moves there with it may be little."""
    text = HEAD.format("far", "mm") + (
        "  - {name: j0, convention: modified_prev_d, theta: 2*q, d: 0.31, a: 0.48, alpha: acos(1/3), limits: [-9, 9]}\n"
        "  - {name: j1, ets: [Tx(2*j0), Rx(acos(1/3)), Tx(-0.34), Ry(89.9999)]}\n"
    )
    robot, quantity = loads(text, "far.yaml"), parse_quantity(f"{kind}_local" if kind != Kind.POSE else "pose")
    program, points = program_of(robot, quantity), beyond_limits(robot, "double")
    inputs = input_samples(robot, program.signature.inputs, points)
    expectation = expect(ReferenceResults(robot, inputs), quantity)
    judge = Judge(expectation, program, "double", within=False)
    further = tuple(inputs[array.name] for array in program.signature.inputs[1:])
    found = shaped(program, run(robot, program, points, (), further))

    assert judge.compare(Invocation("NumPy", "double"), found).holds


def test_the_same_bits_have_the_same_verdict_and_others_one_of_their_own() -> None:
    """A kernel called in many ways is judged once for each different result."""
    points = proof_samples(PUMA)[::400]
    wanted = expect(ReferenceResults(PUMA, {"q": points}), Quantity.POSE)
    judge = Judge(wanted, program_of(PUMA, Quantity.POSE), "double")
    poses = reference.fk(PUMA, points)
    off, negative = poses.copy(), np.where(poses == 0, -0.0, poses)
    off[3, 0, 3] += 1e-3

    first = judge.compare(Invocation("C", "double"), (poses,))
    again = judge.compare(Invocation("C", "double", "batch"), (poses.copy(),))
    wrong = judge.compare(Invocation("C", "double", "batch", "3x4"), (off,))
    zeros = judge.compare(Invocation("C", "double", "batch"), (negative,))
    library = judge.compare(Invocation("NumPy", "double"), (poses,))

    assert replace(again, invocation=first.invocation) == first
    assert (again.target, again.row) == ("C double, batch", "C double, batch")
    assert first.holds
    assert zeros.holds
    assert not wrong.holds
    assert wrong.position_error == pytest.approx(1e-3)
    assert library == replace(first, invocation=Invocation("NumPy", "double"))


def test_numpy_has_wider_limits_only_where_it_does_not_keep_those_of_c() -> None:
    points = proof_samples(PUMA)[::400]
    judge = Judge(
        expect(ReferenceResults(PUMA, {"q": points}), Quantity.POSE), program_of(PUMA, Quantity.POSE), "float"
    )
    poses = reference.fk(PUMA, points)
    narrow, wide = (float(judge.limits(library=library)[0][0][0][0, 0]) for library in (False, True))
    assert narrow < wide

    for off, holds in ((narrow / 2, (True, True)), ((narrow + wide) / 2, (False, True)), (2 * wide, (False, False))):
        moved = poses.copy()
        moved[3, 0, 3] += off
        c, numpy = (judge.compare(Invocation(language, "float"), (moved,)) for language in ("C", "NumPy"))
        assert (c.holds, numpy.holds) == holds
        assert (numpy.position_tolerance == c.position_tolerance) == c.holds
