"""How errors of velocities, orientations and derivatives are measured."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from kinegen.derive.dispatch import derive
from kinegen.errors import KinegenError
from kinegen.io.load import load, loads
from kinegen.model.joint_bounds import reach
from kinegen.model.outputs import Array, Kind, parse_quantity
from kinegen.model.robot import Robot
from kinegen.verify.expectations import Expectation, expect
from kinegen.verify.expected_results import CLOSEST
from kinegen.verify.reference import Orientation
from kinegen.verify.reference_cache import ReferenceResults
from kinegen.verify.samples import EVERY, input_samples, proof_samples, singular_samples

ROBOTS = Path(__file__).resolve().parents[2] / "robots"
PUMA = load(ROBOTS / "puma560.yaml")
HAND = load(ROBOTS / "hand.yaml")


def of(robot: Robot, name: str, q: np.ndarray | None = None) -> Expectation:
    points = proof_samples(robot)[::500] if q is None else q
    arrays = [Array("q", (robot.dof,)), Array("qd", (robot.dof,)), Array("qdd", (robot.dof,))]
    return expect(ReferenceResults(robot, input_samples(robot, arrays, points)), parse_quantity(name))


def test_lengths_are_measured_by_the_reach_and_all_else_by_one() -> None:
    for name in ("pose", "jacobian", "jacobian_local", "hessian"):
        assert of(PUMA, name).length_scale == pytest.approx(reach(PUMA))
        assert of(PUMA, name).number_scale == pytest.approx(1)


def test_products_with_rates_are_measured_by_how_fast_the_frame_turns() -> None:
    """Six joints at up to one radian a second turn the tool by more than one, and points at the reach move with it."""
    expectation = of(PUMA, "twist")

    assert 1 < expectation.number_scale < 6
    assert expectation.length_scale == pytest.approx(reach(PUMA) * expectation.number_scale)


def test_errors_are_found_in_the_frame_and_configuration_where_they_are() -> None:
    expectation = of(HAND, "jacobian")
    known = expectation.known
    right = np.stack([known.motion.jacobian(tip) for tip in HAND.tips], axis=1)
    wrong = right.copy()
    wrong[3, 2, 1, 0] += 0.5
    wrong[4, 1, 5, 0] += 0.25
    lengths, numbers = expectation.errors((wrong,))

    assert lengths.shape == numbers.shape == (known.count, 5)
    assert lengths[3, 2] == pytest.approx(0.5)
    assert numbers[4, 1] == pytest.approx(0.25)
    assert np.count_nonzero(lengths) == np.count_nonzero(numbers) == 1


def test_what_a_kernel_does_not_write_may_be_any_number() -> None:
    """Memory may hold the largest numbers; the error is then infinite, and no warning says so."""
    expectation = of(PUMA, "pose")
    found = expectation.known.motion.pose("tool").astype(np.float64)
    found[5, 0, 0] = 1.7e308
    verdict = expectation.judge((found,), (((np.full((1, 3), 1e-9), np.full((1, 13), 1e-9)),),))

    assert verdict.row == 5
    assert verdict.rotation_error == 1.7e308


def test_no_number_is_an_error_that_nothing_accepts() -> None:
    expectation = of(PUMA, "jacobian")
    wrong = expectation.known.motion.jacobian("tool")
    wrong[0, 4, 2] = np.nan

    assert np.isnan(expectation.errors((wrong,))[1]).any()


@pytest.mark.parametrize("form", ["rpy_zyx", "rpy_xyz", "euler_zyz"])
def test_angles_beside_a_singularity_may_be_any_that_give_the_rotation(form: str) -> None:
    """All of the turn may be in the first angle or in the last one."""
    arm = loads(
        "kinegen: 1\nname: arm\nconvention: standard\nunits: {length: m, angle: deg}\njoints:\n"
        "  - {name: a, ets: [Rz(q)]}\n",
        "x",
    )
    expectation = of(arm, form, np.array([[0.4]]))
    if form != "euler_zyz":
        (expected,) = Orientation(expectation.known.motion.pose("tool")[:, :3, :3]).numbers(Kind(form))

        assert expectation.errors((expected[None],))[1].max() < 1e-15
        return
    for angles in ([0.4, 0, 0], [0, 0, 0.4], [0.1, 0, 0.3], [1.4, 0, -1.0]):
        assert expectation.errors((np.array([angles], dtype=float),))[1].max() < 1e-15
    assert expectation.errors((np.array([[0.5, 0, 0]]),))[1].max() > 0.09


def test_rates_too_close_to_a_singularity_are_not_compared_and_others_are() -> None:
    robot = load(ROBOTS / "spherical_wrist.yaml")
    q = np.array([[0.3, CLOSEST * 2.0**-53 / 10, 0.2], [0.3, 0.5, 0.2]])
    expectation = of(robot, "euler_zyz_jacobian", q)
    right = Orientation(expectation.known.motion.pose("tool")[:, :3, :3]).jacobian(
        Kind.EULER_ZYZ, expectation.known.motion.jacobian("tool")[:, 3:]
    )
    errors = expectation.errors((right + 1,))[1][:, 0]

    assert expectation.errors((right,))[1].max() == 0
    assert errors[0] == 0
    assert errors[1] == pytest.approx(np.sin(0.5) ** 2)


def test_inputs_are_special_now_and_then() -> None:
    arrays = [Array("q", (6,)), Array("qd", (6,)), Array("a_T_b", (4, 4), is_pose=True), Array("b_p", (3,))]
    found = input_samples(PUMA, arrays, np.zeros((200, 6)))
    turns = found["a_T_b"][:, :3, :3]

    assert not found["qd"][:: 2 * EVERY].any()
    assert set(np.unique(found["qd"][EVERY])) <= {-1, 0, 1}
    assert np.abs(found["qd"]).max() <= 1
    np.testing.assert_allclose(turns @ turns.swapaxes(1, 2), np.broadcast_to(np.eye(3), turns.shape), atol=1e-14)
    assert (np.abs(found["b_p"]) <= reach(PUMA)).all()
    assert (found["a_T_b"][:, 3] == (0, 0, 0, 1)).all()


def test_singular_samples_are_singular() -> None:
    """At most of them some joints of the arm line up, and the Jacobian loses a rank."""
    jacobians = ReferenceResults(PUMA, {"q": singular_samples(PUMA)}).motion.jacobian("tool")

    assert (np.abs(np.linalg.det(jacobians.astype(np.float64))) < 1e-12).sum() >= len(jacobians) / 2
    assert singular_samples(load(ROBOTS / "blocks.yaml")).shape == (0, 0)


def test_a_frame_is_named_not_numbered() -> None:
    """The function is called after it."""
    with pytest.raises(KinegenError, match=r"jacobian@3: .* \(expected base, waist, shoulder, elbow, "):
        derive(PUMA, parse_quantity("jacobian@3"))


def test_fixed_frames_are_proven_too() -> None:
    expectation = of(PUMA, "jacobian@base")

    assert expectation.errors((np.zeros((expectation.known.count, 6, 6)),))[0].max() == 0
