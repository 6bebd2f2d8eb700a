"""What becomes of results when a joint is NaN, infinite or beyond all turns: asked for exactly, and no more."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from kinegen.errors import ProofError
from kinegen.io.load import loads
from kinegen.ir.lower import program_of
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import Robot
from kinegen.verify.dependence import NOT, PERHAPS, SURELY, dependence, dependence_by_sine
from kinegen.verify.invocations import KernelCall
from kinegen.verify.nan_propagation import (
    ANY,
    INFINITE,
    KEEPS,
    MAY,
    NAN,
    SpoiltRows,
    inject_nan,
    require_spoilt,
    spoil_params,
)
from kinegen.verify.records import Invocation
from kinegen.verify.tolerances import shaped
from tests.evaluation import run

HEAD = "kinegen: 1\nname: arm\nconvention: standard\nunits: {length: m, angle: rad}\njoints:\n"
TURN = "  - {name: j1, theta: q, d: 0, a: 0.5, alpha: 0}\n"
SLIDE = "  - {name: j2, theta: 0, d: q, a: 0, alpha: 0, limits: [-0.2, 0.7]}\n"
SCREW = "  - {name: j2, theta: q, d: 0.01*q, a: 0.25, alpha: 0}\n"
FOLLOWER = "  - {name: j2, theta: 0, d: 0.5*j1, a: 0.25, alpha: 0}\n"
TILTED = "  - {name: j0, theta: 0, d: 0, a: 0, alpha: 1e-7}\n"

RIGHT = {
    "a turn": TURN,
    "a slide": TURN + SLIDE,
    "a screw": TURN + SCREW,
    "a follower": TURN + FOLLOWER,
    "a follower that is tilted a little": TILTED + TURN + FOLLOWER,
    "two turns about nearly one axis": "  - {name: j0, theta: q, d: 0, a: 0, alpha: 1e-9}\n" + TURN,
}

Change = Callable[[Any, Any], Any]


def robot_of(rows: str) -> Robot:
    return loads(HEAD + rows, "arm.yaml")


def way_of(robot: Robot, quantity: Quantity, change: Change = lambda _, results: results) -> KernelCall:
    """The kernel as NumPy computes it, and after that a change of its results."""
    program = program_of(robot, quantity)

    def call(inputs: tuple[Any, ...]) -> tuple[Any, ...]:
        return tuple(change(inputs[0], each) for each in shaped(program, run(robot, program, inputs[0])))

    return KernelCall(Invocation("NumPy", "double"), call, program.signature, is_plain=True)


def require(robot: Robot, kind: Kind = Kind.POSE, change: Change = lambda _, results: results) -> None:
    quantity = Quantity(kind)
    signature = program_of(robot, quantity).signature
    spoilt = inject_nan(robot, quantity, signature.inputs, signature.results)
    require_spoilt(robot, quantity, way_of(robot, quantity, change), spoilt, "float64")


@pytest.mark.parametrize("kind", [Kind.POSE, Kind.FRAMES, Kind.JACOBIAN, Kind.HESSIAN])
@pytest.mark.parametrize("rows", RIGHT.values(), ids=RIGHT)
def test_right_kernels_are_taken_whatever_joints_move(rows: str, kind: Kind) -> None:
    require(robot_of(rows), kind)


@pytest.mark.parametrize("kind", [Kind.EULER_ZYZ, Kind.QUATERNION_WXYZ, Kind.AXIS_ANGLE, Kind.RPY_ZYX])
@pytest.mark.parametrize("turned", ["0, pi, 0.2", "0, pi/2, 0.2"])
def test_numbers_that_jump_everywhere_may_depend_on_a_joint_or_not(turned: str, kind: Kind) -> None:
    """Of two angles about one axis, rounding decides which has the joint: the kernel may do so in another way."""
    require(robot_of(f"{TURN}base: {{xyz: [0, 0, 0], rpy: [{turned}]}}\n"), kind)


@pytest.mark.parametrize("kind", [Kind.POSE, Kind.JACOBIAN, Kind.HESSIAN])
def test_robots_without_joints_have_nothing_to_lose(kind: Kind) -> None:
    require(robot_of("  - {name: j1, theta: 0.3, d: 0, a: 1, alpha: 0}\n"), kind)


def becoming(robot: Robot, word: str, kind: Kind = Kind.POSE) -> Any:
    """What must become of a result after a word is put into an input."""
    signature = program_of(robot, Quantity(kind)).signature
    spoilt = inject_nan(robot, Quantity(kind), signature.inputs, signature.results)
    return spoilt.becomes[0][spoilt.names.index(word)]


def test_an_infinite_slide_is_infinite_or_nan_and_nothing_else_changes() -> None:
    pose = becoming(robot_of(TURN + SLIDE), "a negative infinity in q[1]")

    assert pose[2, 3] == INFINITE
    assert (np.delete(pose.ravel(), 11) == KEEPS).all()


def test_an_infinite_screw_is_nan_but_for_its_own_shift() -> None:
    """The height of a screw goes to infinity, and what its sine is in has no value."""
    robot = robot_of(TURN + SCREW)
    infinite, far = becoming(robot, "a positive infinity in q[1]"), becoming(robot, "a far angle in q[1]")

    assert infinite[2, 3] == INFINITE
    assert far[2, 3] == ANY
    assert (infinite[:2, 3] == NAN).all()
    assert (far[:2, :2] == NAN).all()
    assert becoming(robot, "NaN in q[1]")[2, 3] == NAN


def test_a_length_that_follows_an_angle_is_asked_for_as_one() -> None:
    pose = becoming(robot_of(TURN + FOLLOWER), "a positive infinity in q[0]")

    assert pose[2, 3] == INFINITE
    assert (pose[:2, 3] == NAN).all()


def test_a_number_that_hardly_depends_on_a_joint_may_stay_or_be_lost() -> None:
    """The arm rises by 1e-10 of what it moves across, too little to tell from rounding."""
    robot = robot_of(TILTED.replace("1e-7", "1e-10") + TURN + FOLLOWER)

    assert becoming(robot, "a positive infinity in q[0]")[0, 3] == NAN
    assert becoming(robot, "a positive infinity in q[0]")[1, 3] == NAN
    assert becoming(robot_of(TILTED.replace("1e-7", "1e-10") + TURN), "NaN in q[0]")[2, 3] == MAY


def lost(inputs: Any, results: Any) -> Any:
    """Zero for what is no number."""
    return np.where(np.isfinite(results), results, 0.0)


def clamped(inputs: Any, results: Any) -> Any:
    """The largest number for an infinity."""
    return np.where(np.isinf(results), 1e30, results)


def opened(inputs: Any, results: Any) -> Any:
    """An infinity for NaN."""
    return np.where(np.isnan(results), np.inf, results)


def spread(inputs: Any, results: Any) -> Any:
    """Another number wherever the last joint is no number."""
    beyond = ~np.isfinite(inputs[:, -1])
    return np.where(beyond.reshape(-1, *[1] * (results.ndim - 1)) & np.isfinite(results), results + 1, results)


@pytest.mark.parametrize(
    ("rows", "change", "word"),
    [
        (TURN + SLIDE, lost, "is neither infinite nor NaN|is not NaN"),
        (TURN + SLIDE, clamped, "is neither infinite nor NaN"),
        (TURN + SCREW, clamped, "is neither infinite nor NaN"),
        (TURN + FOLLOWER, clamped, "is neither infinite nor NaN"),
        (TURN + SCREW, opened, "is not NaN"),
        (TURN + FOLLOWER, opened, "is not NaN"),
        (TURN + SLIDE, spread, "changes, which does not depend on it"),
        (TURN + SCREW, spread, "changes, which does not depend on it|becomes another number"),
    ],
)
def test_kernels_that_lose_or_spread_one_are_refused(rows: str, change: Change, word: str) -> None:
    with pytest.raises(ProofError, match=word):
        require(robot_of(rows), Kind.POSE, change)


def test_what_depends_by_a_sine_is_found_beside_what_depends_by_a_length() -> None:
    robot, quantity = robot_of(TURN + SCREW), Quantity(Kind.POSE)
    results, values = program_of(robot, quantity).signature.results, {"q": np.array([[0.25, 0.5], [1.0, -0.75]])}
    entries = [("q", (0,)), ("q", (1,))]
    whole = dependence(robot, quantity, results, values, entries)[1][0]
    by_sine = dependence_by_sine(robot, quantity, results, values, 1)

    assert by_sine is not None
    assert whole[2, 3] > by_sine[0][2, 3] == 0
    assert (whole[:2, 3] == by_sine[0][:2, 3]).all()
    assert dependence_by_sine(robot, quantity, results, values, 0) is None


HIDDEN = """
kinegen: 1
name: arm
convention: modified
units: {length: m, angle: deg}
parameters: {d: {value: 0, runtime: true}, alpha: {value: 90, runtime: true}}
joints:
  - {name: j1, theta: q, d: 0, a: 0, alpha: 0}
  - {name: j2, theta: q, d: d, a: 2, alpha: alpha}
  - {name: j3, theta: 0, d: 0, a: d, alpha: 0}
"""
"""The point is at 2*c1 + d*(s1*sin(alpha) + c1*c2 - s1*s2*cos(alpha)), ..., with d as 0."""


def test_what_a_length_of_zero_hides_may_stop_being_a_number() -> None:
    robot, quantity = loads(HIDDEN, "arm.yaml"), Quantity(Kind.POSITION)
    program = program_of(robot, quantity)
    inputs, results = program.signature.inputs, program.signature.results
    spoilt = spoil_params(robot, program, inputs, results)
    becomes = dict(zip(spoilt.names, spoilt.becomes[0].tolist(), strict=True))
    values = {"q": np.array([[0.25, 0.5], [1.0, -0.75]])}
    ((by_first,), (by_second,)) = dependence(robot, quantity, results, values, [("q", (0,)), ("q", (1,))])

    assert becomes["NaN in params.alpha"] == [MAY, MAY, MAY]
    assert becomes["NaN in params.d"] == [NAN, NAN, NAN]
    assert by_first.tolist() == [SURELY, SURELY, NOT]
    assert by_second.tolist() == [PERHAPS, PERHAPS, PERHAPS]


def test_rows_of_a_batch_alternate_with_rows_as_they_were() -> None:
    signature = program_of(robot_of(TURN), Quantity.POSE).signature
    rows = SpoiltRows(signature.inputs, signature.results, {"q": np.array([[1.0], [2.0]])})
    rows.add("NaN", "q[0]", {"q": np.full((2, 1), np.nan)}, [np.full((4, 4), NAN)])
    spoilt = rows.spoilt()

    assert np.array_equal(spoilt.inputs[0], [[np.nan], [1.0], [np.nan], [2.0]], equal_nan=True)
    assert spoilt.plain[0].ravel().tolist() == [1, 1, 2, 2]
    assert spoilt.becomes[0][:, 0, 0].tolist() == [NAN, KEEPS] * 2
    assert spoilt.names[1] == "NaN in q[0] of another configuration"
