"""The judge is tested as hard as what it judges: every part of a verdict, of a limit, and of what rounding does."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kinegen.backends.accuracy import NUMBER_TYPES, bound_over, fraction_box
from kinegen.backends.scalar_types import ScalarType
from kinegen.errors import ProofError
from kinegen.io.load import load
from kinegen.ir.error_analysis import Ranges
from kinegen.ir.lower import program_of
from kinegen.ir.program import Constant, Operand, Operator, Program, Statement, Temporary, Variable
from kinegen.model.joint_bounds import reach
from kinegen.model.outputs import Array, Kind, Quantity, Reference, parse_quantity
from kinegen.model.robot import Robot
from kinegen.verify import tolerances
from kinegen.verify.compare import Judge, Store
from kinegen.verify.expectations import Expectation, Limits, by_adjoint, expect
from kinegen.verify.invocations import DTYPES
from kinegen.verify.proof import with_parameters
from kinegen.verify.records import BEYOND_LIMITS, Comparison, Invocation, Proof
from kinegen.verify.reference_cache import ReferenceResults
from kinegen.verify.rounding import apart, rounded_trials
from kinegen.verify.samples import beyond_limits, input_samples, proof_samples
from kinegen.verify.tolerances import accepted, accepted_error, number_type, shaped

ROBOTS = Path(__file__).parents[2] / "robots"
PUMA, HAND, PUMA_MM, PLANAR = (load(ROBOTS / f"{name}.yaml") for name in ("puma560", "hand", "puma560_mm", "planar_3r"))
C = Invocation("C", "double")
HELD = Comparison(C, Quantity.POSE, 3, 1e-15, 1e-16, 1e-13, 1e-13, (0.5, -1.25), "tool")
UNIT = 2.0**-53


def at(robot: Robot, name: str, step: int = 1000, *, exact: bool = False) -> Expectation:
    """What an output must be at some of the samples."""
    points = proof_samples(robot)[::step]
    quantity = parse_quantity(name)
    arrays = [Array("q", (robot.dof,)), *program_of(robot, quantity).signature.inputs]
    return expect(ReferenceResults(robot, input_samples(robot, arrays, points), exact=exact), quantity)


def right(expectation: Expectation) -> np.ndarray:
    """The poses that the reference gives, (N, 4, 4) or (N, tips, 4, 4)."""
    known, robot = expectation.known, expectation.known.robot
    poses = np.stack([known.motion.pose(tip) for tip in robot.tips], axis=1).astype(np.float64)
    return poses if robot.is_tree else poses[:, 0]


def limits_of(expectation: Expectation, *limits: tuple[float, float]) -> Limits:
    """The same limit for all lengths, and for all other entries, of each frame of a single result."""
    return (
        tuple(
            (np.full((1, lengths.shape[1]), length), np.full((1, numbers.shape[1]), number))
            for (lengths, numbers), (length, number) in zip(expectation.wanted[0], limits, strict=True)
        ),
    )


# The verdict ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("place", [(0, 3), (1, 1), (2, 3), (3, 3)])
@pytest.mark.parametrize("sign", [1, -1])
def test_an_error_in_any_entry_counts_on_either_side(place: tuple[int, int], sign: int) -> None:
    expectation = at(PUMA, "pose")
    poses = right(expectation)
    poses[1][place] += sign * 3e-6
    verdict = expectation.judge((poses,), limits_of(expectation, (1e-6, 1e-6)))

    assert verdict.share == pytest.approx(3)
    assert verdict.row == 1


@pytest.mark.parametrize("tips", [(0, 2), (2, 0)])
def test_a_nan_is_the_largest_error_whatever_stands_before_or_after_it(tips: tuple[int, int]) -> None:
    expectation = at(HAND, "pose", 2000)
    poses = right(expectation)
    poses[0, tips[0], 0, 3], poses[0, tips[1], 1, 3] = np.nan, 5.0
    verdict = expectation.judge((poses,), limits_of(expectation, *[(1e-6, 1e-6)] * len(HAND.tips)))

    assert math.isnan(verdict.position_error)
    assert verdict.share == math.inf
    assert verdict.frame == HAND.tips[tips[0]]


@pytest.mark.parametrize("tip", [0, 3, 4])
def test_the_frame_and_the_joint_vector_of_the_worst_entry_are_named(tip: int) -> None:
    expectation = at(HAND, "pose", 2000)
    poses = right(expectation)
    poses[2, tip, 1, 3] += 1e-3
    verdict = expectation.judge((poses,), limits_of(expectation, *[(1e-6, 1e-6)] * len(HAND.tips)))

    assert (verdict.row, verdict.frame) == (2, HAND.tips[tip])
    program = program_of(HAND, Quantity.POSE)
    compared = Judge(expectation, program, "double").compare(C, (poses,))
    assert compared.worst == tuple(map(float, expectation.known.joints[2]))
    assert not compared.holds


def test_of_equal_errors_the_one_of_which_less_is_accepted_is_shown() -> None:
    expectation = at(HAND, "pose", 2000)
    several = [(1e-3, 1e-3), (1e-6, 1e-5), *[(1e-3, 1e-3)] * (len(HAND.tips) - 2)]
    wanted = replace(expectation, wanted=(tuple((a.astype(float), b.astype(float)) for a, b in expectation.wanted[0]),))
    verdict = wanted.judge((right(expectation),), limits_of(expectation, *several))

    assert (verdict.position_error, verdict.rotation_error) == (0, 0)
    assert (verdict.position_limit, verdict.rotation_limit) == (1e-6, 1e-5)


def test_an_entry_without_a_limit_is_counted_and_hides_no_other() -> None:
    expectation = at(PUMA, "pose")
    poses, count = right(expectation), expectation.known.count
    poses[:, 0, 3] += 1e3
    poses[0, 0, 3] = np.nan
    poses[:, 1, 3] += 1e-7
    limits: Limits = (((np.array([[np.inf, 1e-6, 1e-6]]), np.full((1, 13), 1e-6)),),)
    verdict = expectation.judge((poses,), limits)

    assert verdict.position_error == pytest.approx(1e-7)
    assert verdict.share == pytest.approx(0.1)
    assert (verdict.compared, verdict.uncompared) == (15 * count, count)


def test_where_nothing_has_a_limit_no_error_is_shown() -> None:
    expectation = at(PUMA, "position")
    verdict = expectation.judge((right(expectation)[:, :3, 3] + 1,), limits_of(expectation, (math.inf, math.inf)))

    assert (verdict.position_error, verdict.position_limit, verdict.share, verdict.compared) == (0, 0, 0, 0)


def test_scales_are_the_reach_and_the_largest_number() -> None:
    """The lengths of a table in millimetres are larger, and its rotations are not."""
    for robot in (PUMA, PUMA_MM):
        pose, twist = at(robot, "pose"), at(robot, "twist")
        assert pose.number_scale == pytest.approx(1)
        assert pose.length_scale == pytest.approx(reach(robot))
        turning = max(float(np.abs(numbers.astype(float)).max()) for _, numbers in twist.wanted[0])
        assert twist.number_scale == pytest.approx(turning)
        assert twist.length_scale == pytest.approx(reach(robot) * turning)


# Comparisons ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "change",
    [
        {"worst_share": 1.5},
        {"worst_share": math.nan},
        {"position_error": 2e-13, "worst_share": 0.5},
        {"rotation_error": 2e-13, "worst_share": 0.5},
        {"position_error": math.nan},
    ],
)
def test_one_comparison_that_does_not_hold_refuses_all(change: dict[str, float]) -> None:
    wrong = replace(HELD, **change)
    proof = Proof(1.0, (HELD, wrong, HELD))

    assert not wrong.holds
    assert not proof.holds
    with pytest.raises(ProofError, match="C double pose differs from the reference"):
        proof.require(PUMA)
    assert Proof(1.0, (HELD, HELD)).holds


def test_a_nan_is_an_infinite_share() -> None:
    assert replace(HELD, position_error=math.nan).share == math.inf
    assert replace(HELD, worst_share=math.nan).share == math.inf
    assert HELD.share == pytest.approx(0.01)


def test_rows_of_a_report_follow_from_the_fields_of_a_call() -> None:
    batch = Invocation("C", "float", "batch", "3x4", "avx2")
    beyond = replace(batch, case=BEYOND_LIMITS)
    moved = with_parameters(replace(HELD, invocation=batch))
    solved = replace(batch, case="there and back")

    assert (str(batch), str(batch.row)) == ("C float, batch avx2 3x4", "C float, batch")
    assert (str(beyond), str(beyond.row)) == ("C float, batch avx2 3x4, beyond limits", "C float, beyond limits")
    assert (moved.target, moved.row) == ("C float, batch avx2 3x4, other parameters", "C float, other parameters")
    assert str(solved.row) == str(solved) == "C float, batch avx2 3x4, there and back"
    assert str(Invocation("NumPy")) == "NumPy"


def test_the_reference_is_asked_at_the_numbers_that_a_kernel_gets() -> None:
    store = Store(PUMA, DTYPES["float"], exact=False)
    (given,), expectation = store.expect(Quantity.POSE, [Array("q", (6,))], proof_samples(PUMA)[::1000])

    assert given.dtype == np.float32
    assert np.array_equal(expectation.known.inputs["q"], given)


def test_the_reference_is_asked_once_for_kernels_of_the_same_inputs_and_anew_for_others() -> None:
    store, points = Store(PUMA, DTYPES["double"], exact=False), proof_samples(PUMA)[::1000]
    q, qd = Array("q", (6,)), Array("qd", (6,))
    _, pose = store.expect(Quantity.POSE, [q], points)
    _, jacobian = store.expect(Quantity(Kind.JACOBIAN), [q], points)
    (_, rates), twist = store.expect(Quantity(Kind.TWIST), [q, qd], points)
    _, fewer = store.expect(Quantity.POSE, [q], points[1:])

    assert jacobian.known is pose.known
    assert twist.known is not pose.known
    assert rates.shape == points.shape
    assert fewer.known.count == len(points) - 1


# Limits ---------------------------------------------------------------------------------------------------------------


def entries(limits: Limits) -> tuple[np.ndarray, np.ndarray]:
    """All limits of lengths, and of all other entries."""
    splits = [split for frames in limits for split in frames]
    return tuple(np.concatenate([np.ravel(split[part]) for split in splits]) for part in (0, 1))  # type: ignore[return-value]


@pytest.mark.parametrize(("name", "last"), [("pose", 3), ("jacobian", None)])
def test_a_limit_without_a_bound_is_eight_spreads_of_the_input_or_of_the_usual_one(name: str, last: int | None) -> None:
    """Worked out once more, from sixteen trials; what the reference may lose is next to nothing in double."""
    expectation, program = at(PUMA, name), program_of(PUMA, parse_quantity(name))
    real = number_type("float")
    found = accepted(expectation, program, real, within=False)
    q = expectation.known.joints.astype(float)
    plain, *others = [shaped(program, each)[0] for each in rounded_trials(program, q, {}, real, 20240229)]
    root = np.sqrt(sum((other - plain) ** 2 for other in others) / 16)
    rows = [root[:, :3, 3], root[:, :3, :3].reshape(len(q), -1)] if last else [root[:, :3], root[:, 3:]]
    for limit, each in zip(found[0][0], rows, strict=True):
        flat = each.reshape(len(q), -1)
        usual = np.maximum(flat, np.median(flat.max(axis=1)))
        own = limit[:, :9] if last and limit.shape[1] == 13 else limit
        np.testing.assert_allclose(own, 8 * usual, rtol=1e-6, atol=1e-12)


def test_a_sharp_bound_is_taken_with_next_to_nothing_added() -> None:
    expectation, program = at(PLANAR, "pose"), program_of(PLANAR, Quantity.POSE)
    lengths, numbers = entries(accepted(expectation, program, number_type("double")))
    bound = bound_over(program, Ranges(fraction_box(PLANAR), ()), number_type("double"))

    assert max(bound.entries) < 64 * UNIT
    assert numbers.max() <= (bound.rotation or 0) + 4 * UNIT
    assert lengths.max() <= max(bound.position) + 4 * UNIT * reach(PLANAR)
    # The last row of a matrix is constant, and only what the reference may lose is left of its limit.
    assert numbers.min() < 4 * UNIT


def test_a_constant_entry_must_be_right_to_the_last_digits() -> None:
    expectation, program = at(PUMA, "pose"), program_of(PUMA, Quantity.POSE)
    for within in (True, False):
        poses = right(expectation)
        poses[0, 3, 3] += 1e-9
        assert not Judge(expectation, program, "double", within=within).compare(C, (poses,)).holds


def test_what_50_digits_lose_is_less_than_what_floats_lose() -> None:
    program = program_of(PUMA, Quantity.POSE)
    wide, exact = (
        accepted(at(PUMA, "pose", 2000, exact=exact), program, number_type("double")) for exact in (False, True)
    )
    for one, other in zip(entries(wide), entries(exact), strict=True):
        assert (other <= one).all()
    assert entries(exact)[1].min() < 1e-24


def test_orientations_in_50_digits_are_read_with_a_few_units() -> None:
    """A rotation made of a quaternion in float64 loses some units, and no more is accepted for that."""
    expectation, program = (
        at(PUMA, "quaternion_wxyz", 2000, exact=True),
        program_of(PUMA, parse_quantity("quaternion_wxyz")),
    )
    judge = Judge(expectation, program, "double")
    numbers = entries(judge.limits())[1]

    assert numbers[np.isfinite(numbers)].max() < 64 * (16 + 8) * UNIT
    assert numbers.max() > 0


def test_the_bound_of_numbers_says_nothing_of_the_rotation_that_they_give() -> None:
    expectation, program = at(PUMA, "quaternion_wxyz", 2000), program_of(PUMA, parse_quantity("quaternion_wxyz"))
    inside, outside = (accepted(expectation, program, number_type("double"), within=each) for each in (True, False))
    (one, two) = entries(inside)[1], entries(outside)[1]

    np.testing.assert_allclose(one, two, rtol=0.1, atol=4 * UNIT)


def test_beyond_the_limits_the_bound_of_the_joint_box_is_no_limit() -> None:
    points = beyond_limits(PUMA, "float").astype(np.float32).astype(float)
    expectation = expect(ReferenceResults(PUMA, {"q": points}), Quantity.POSE)
    program, real = program_of(PUMA, Quantity.POSE), number_type("float")
    inside, outside = (entries(accepted(expectation, program, real, within=each)) for each in (True, False))
    judged = entries(Judge(expectation, program, "float", within=False).limits())

    assert inside[1].max() < outside[1][np.isfinite(outside[1])].max() / 2
    assert all(np.array_equal(one, other) for one, other in zip(judged, outside, strict=True))


@pytest.mark.parametrize("robot", [PUMA, PUMA_MM], ids=["m", "mm"])
def test_points_within_reach_are_what_the_bound_of_a_transform_holds_for(robot: Robot) -> None:
    expectation = at(robot, "transform_point")
    program = program_of(robot, Quantity(Kind.TRANSFORM_POINT))
    lengths, numbers = entries(accepted(expectation, program, number_type("float")))
    unit = float(NUMBER_TYPES[ScalarType.FLOAT].unit)

    assert not numbers.size
    # Three products of a number up to 1 and a length up to the reach, and three sums: between two and sixteen units.
    assert 2 * unit * reach(robot) < lengths.max() < 16 * unit * reach(robot)


def test_lengths_and_rotations_have_no_digit_left_at_scales_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """In millimetres the limit of a length is a large number long before no digit of it is left."""
    expectation, program = at(PUMA_MM, "pose"), program_of(PUMA_MM, Quantity.POSE)
    usual = entries(accepted(expectation, program, number_type("float"), within=False))
    scales = expectation.length_scale, expectation.number_scale
    share = float(np.median(np.concatenate([part / scale for part, scale in zip(usual, scales, strict=True)])))
    monkeypatch.setattr(tolerances, "LOST", share)
    found = entries(accepted(expectation, program, number_type("float"), within=False))

    for part, before, scale in zip(found, usual, scales, strict=True):
        clear = np.abs(before / (share * scale) - 1) > 1e-6
        assert np.array_equal(np.isinf(part)[clear], (before > share * scale)[clear])


def test_the_error_of_poses_is_the_bound_of_the_arm_but_not_less_than_34_units() -> None:
    for robot, real in itertools.product((PLANAR, PUMA, PUMA_MM), ("double", "float")):
        kind = number_type(real)
        bound = bound_over(program_of(robot, Quantity.POSE), Ranges(fraction_box(robot), ()), kind)
        least, own = 34 * float(kind.unit), max(bound.rotation or 0, max(bound.position) / reach(robot))
        assert accepted_error(robot, real) == pytest.approx(max(least, own), rel=1e-9)
    assert accepted_error(PLANAR, "double") == 34 * UNIT < accepted_error(PUMA, "double")


def test_jacobians_in_other_axes_have_the_limits_of_both_and_not_more() -> None:
    quantities = [Quantity(Kind.JACOBIAN, each) for each in (Reference.LOCAL_WORLD_ALIGNED, Reference.LOCAL)]
    known = ReferenceResults(PUMA, {"q": proof_samples(PUMA)[::2000]})
    results = {each: (known.motion.jacobian("tool", each.reference).astype(float),) for each in quantities}
    limits: dict[Quantity, Any] = {}
    for each in quantities:
        limits[each] = (((np.full((1, 18), 1e-9), np.full((1, 18), 2e-9)),),)
    ((quantity, expectation, found, allowed),) = by_adjoint(known, results, limits)
    verdict = expectation.judge(found, allowed)
    (lengths, numbers) = allowed[0][0]

    assert quantity is quantities[1]
    assert verdict.share < 1e-3
    assert numbers.max() == pytest.approx(2 * 4e-9)
    assert lengths.max() == pytest.approx(2 * (2e-9 + reach(PUMA) * 4e-9))
    wrong = {**results, quantities[1]: (results[quantities[1]][0] + 1e-7,)}
    ((_, expectation, found, allowed),) = by_adjoint(known, wrong, limits)
    assert expectation.judge(found, allowed).share > 1


# Rounding -------------------------------------------------------------------------------------------------------------


def program_with(statements: Sequence[Statement], outputs: tuple[Operand, ...]) -> Program:
    """Statements on two numbers, as if they were a position."""
    signature = program_of(PLANAR, Quantity.POSITION).signature
    return Program(signature, (), (), tuple(statements), outputs)


ONE, TWO = Variable(0), Variable(1)
OPERATIONS: list[tuple[Operator, tuple[Operand, ...], float]] = [
    (Operator.ADD, (ONE, TWO), 1),
    (Operator.MUL, (ONE, TWO), 1),
    (Operator.DIV, (ONE, TWO), 1),
    (Operator.SQRT, (ONE,), 1),
    (Operator.ATAN2, (ONE, TWO), 4),
    (Operator.NEG, (ONE,), 0),
]


@pytest.mark.parametrize(("operator", "operands", "units"), OPERATIONS, ids=[str(each[0]) for each in OPERATIONS])
def test_an_operation_is_off_by_its_units_in_either_direction(
    operator: Operator, operands: tuple[Operand, ...], units: float
) -> None:
    real = number_type("float")
    program = program_with([Statement(("a",), operator, operands)], (Temporary("a"),) * 3)
    inputs = np.full((40, 3), 0.75)
    plain, *others = rounded_trials(program, inputs, {}, real, 1)
    off = np.array([each[:, 0] / plain[:, 0] - 1 for each in others])

    assert len(others) == 16
    np.testing.assert_allclose(np.abs(off), units * float(real.unit), rtol=1e-6, atol=1e-15)
    if units:
        assert {*np.unique(np.sign(off)).tolist()} == {-1, 1}


def test_a_sine_is_off_by_what_is_promised_of_it_and_nothing_beyond_the_largest_angle() -> None:
    real = number_type("float", library=True)
    program = program_with([Statement(("s", "c"), Operator.SINCOS, (ONE,))], (Temporary("s"), Temporary("c"), ONE))
    inputs = np.array([[0.75, 0, 0], [real.angle_limit * 1.01, 0, 0]])
    plain, *others = rounded_trials(program, inputs, {}, real, 1)

    np.testing.assert_allclose([abs(each[0, 0] - plain[0, 0]) for each in others], real.sine_error, rtol=1e-6)
    assert real.sine_error == pytest.approx(4 * float(real.unit))
    assert np.isnan(plain[1, :2]).all()


def test_a_constant_that_the_type_does_not_hold_is_off_too() -> None:
    real = number_type("float")
    constants = [Constant(Fraction(1, 3)), Constant(Fraction(1, 4))]
    plain, *others = rounded_trials(program_with([], (*constants, ONE)), np.zeros((3, 3)), {}, real, 1)

    assert all(abs(each[0, 0] / plain[0, 0] - 1) == pytest.approx(float(real.unit), rel=1e-6) for each in others)
    assert all((each[:, 1] == 0.25).all() for each in others)


def test_two_operations_are_not_rounded_alike() -> None:
    statements = [Statement((name,), Operator.MUL, (ONE, TWO)) for name in "ab"]
    program = program_with(statements, (Temporary("a"), Temporary("b"), ONE))
    _, *others = rounded_trials(program, np.full((64, 3), 0.75), {}, number_type("float"), 1)

    assert any((each[:, 0] != each[:, 1]).any() for each in others)


def test_a_number_is_infinitely_far_from_none() -> None:
    one, two = np.array([1.0, np.nan, np.nan, np.inf, 1.0]), np.array([1.0, np.nan, 1.0, np.inf, 3.0])

    assert apart(one, two).tolist() == [0, 0, math.inf, 0, 2]
    assert apart(two, one).tolist() == [0, 0, math.inf, 0, 2]
