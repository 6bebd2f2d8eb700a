"""Built packages of trees and of robots with runtime parameters, used as their owners use them."""

from __future__ import annotations

import ctypes
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from kinegen.io.load import load
from kinegen.model.expression_parser import number
from kinegen.model.outputs import USUAL, Quantity
from kinegen.model.robot import Robot
from kinegen.verify import reference
from tests.builds.workshop import ROBOTS, assemble, make, set_machine

REAL = [(np.float64, 1e-13), (np.float32, 2e-6)]


@pytest.fixture(scope="module", params=["c", "numpy"])
def backend(request: pytest.FixtureRequest) -> str:
    """Both ways to compute."""
    return str(request.param)


@pytest.fixture(scope="module")
def package_of(backend: str, tmp_path_factory: pytest.TempPathFactory, cache_home: Path) -> Callable[[str], ModuleType]:
    """Makes the package of a robot for a backend."""

    def get(name: str) -> ModuleType:
        with pytest.MonkeyPatch.context() as patch:
            set_machine(patch, cache_home)
            package = assemble(name, tmp_path_factory.mktemp(backend), compiled=backend == "c")

        assert package.backend == backend
        return package

    return get


@pytest.fixture(scope="module")
def hand(package_of: Callable[[str], ModuleType]) -> ModuleType:
    """The hand with its five tips."""
    return package_of("hand")


@pytest.fixture(scope="module")
def calibrated(package_of: Callable[[str], ModuleType]) -> ModuleType:
    """The calibrated arm with its five runtime parameters."""
    return package_of("calibrated_2r")


def poses(robot: Robot, frames: tuple[str, ...], q: np.ndarray) -> np.ndarray:
    """Reference poses (N, frames, 4, 4)."""
    known = reference.frames(robot, q.astype(float))
    return np.stack([known[frame] for frame in frames], axis=1)


def test_the_tips_of_a_hand_come_in_the_order_of_its_table(hand: ModuleType) -> None:
    assert hand.TIPS == ("thumb_tip", "index_tip", "middle_tip", "ring_tip", "little_tip")


@pytest.mark.parametrize(("dtype", "tolerance"), REAL)
def test_each_tip_of_a_hand_is_where_the_reference_has_it(
    hand: ModuleType, dtype: type[np.floating], tolerance: float
) -> None:
    robot = load(ROBOTS / "hand.yaml")
    q = np.random.default_rng(2).uniform(-0.2, 1, (40, hand.DOF)).astype(dtype)
    expected = poses(robot, hand.TIPS, q)

    for found in (hand.fk(q), np.stack([hand.fk(row) for row in q])):
        assert found.shape == (40, 5, 4, 4)
        assert found.dtype == dtype
        np.testing.assert_allclose(found, expected, rtol=0, atol=250 * tolerance)
    np.testing.assert_allclose(hand.position(q), expected[:, :, :3, 3], rtol=0, atol=250 * tolerance)


def test_a_finger_moves_no_other_tip(hand: ModuleType) -> None:
    still = hand.fk(np.zeros(hand.DOF))
    for index, joint in enumerate(hand.JOINTS):
        q = np.zeros(hand.DOF)
        q[index] = 0.5
        moved = [tip for tip, same in zip(hand.TIPS, (hand.fk(q) == still).all(axis=(1, 2)), strict=True) if not same]

        assert [tip.partition("_")[0] for tip in moved] == [joint.partition("_")[0]]


def test_the_frames_of_a_hand_are_named_in_their_order(hand: ModuleType) -> None:
    robot = load(ROBOTS / "hand.yaml")
    q = np.random.default_rng(3).uniform(-0.2, 1, (5, hand.DOF))
    found = hand.frames(q)

    assert robot.frame_names == hand.FRAMES
    assert found.shape == (5, len(hand.FRAMES), 4, 4)
    np.testing.assert_allclose(found, poses(robot, hand.FRAMES, q), rtol=0, atol=1e-10)
    for tip in hand.TIPS:
        np.testing.assert_allclose(found[:, hand.FRAMES.index(tip)], hand.fk(q)[:, hand.TIPS.index(tip)], atol=1e-11)


def with_parameters(robot: Robot, values: dict[str, Fraction]) -> Robot:
    """The same robot with other numbers in its file."""
    changed = [
        replace(parameter, value=number(values[parameter.name])) if parameter.name in values else parameter
        for parameter in robot.parameters
    ]
    return replace(robot, parameters=tuple(changed))


VALUES = {"L1": Fraction(1, 2), "L2": Fraction(3, 8), "tilt": Fraction(1, 64), "skew": Fraction(1, 8)}


@pytest.mark.parametrize(("dtype", "tolerance"), REAL)
@pytest.mark.parametrize("changed", [(), ("L1",), ("tilt",), ("L2", "skew"), tuple(VALUES)])
def test_parameters_given_at_run_time_are_as_if_they_stood_in_the_file(
    calibrated: ModuleType, changed: tuple[str, ...], dtype: type[np.floating], tolerance: float
) -> None:
    values = {name: VALUES[name] for name in changed}
    robot = with_parameters(load(ROBOTS / "calibrated_2r.yaml"), values)
    params = calibrated.Params(**{name: float(value) for name, value in values.items()})
    q = np.random.default_rng(4).uniform(-2, 2, (30, 2)).astype(dtype)
    expected = poses(robot, ("tool",), q)[:, 0]

    np.testing.assert_allclose(calibrated.fk(q, params=params), expected, rtol=0, atol=tolerance)
    np.testing.assert_allclose(calibrated.fk(q[0], params=params), expected[0], rtol=0, atol=tolerance)
    np.testing.assert_allclose(calibrated.position(q, params=params), expected[:, :3, 3], rtol=0, atol=tolerance)


def test_parameters_of_one_call_do_not_stay_for_the_next(calibrated: ModuleType) -> None:
    q = np.array([0.3, -0.4])
    before = calibrated.fk(q)
    other = calibrated.fk(q, params=calibrated.Params(L1=2.0))

    assert not np.array_equal(before, other)
    np.testing.assert_array_equal(calibrated.fk(q), before)
    np.testing.assert_array_equal(calibrated.fk(q, params=calibrated.Params()), before)


def test_the_defaults_of_the_parameters_are_the_files(calibrated: ModuleType) -> None:
    assert calibrated.Params()._asdict() == pytest.approx(
        {
            "L1": 0.4002,
            "L2": 0.2997,
            "tilt": 0.03 * np.pi / 180,
            "skew": -0.02 * np.pi / 180,
            "zero_2": 0.11 * np.pi / 180,
        }
    )


def test_c_takes_other_parameters_through_its_struct(tmp_path: Path) -> None:
    """As firmware does: a copy of the defaults with one member changed."""
    result = make(ROBOTS / "calibrated_2r.yaml", tmp_path, compile=False)
    source = tmp_path / "user.c"
    source.write_text(
        """
#include "calibrated_2r.h"

void user(const double *q, double length, double *out);

void user(const double *q, double length, double *out)
{
    calibrated_2r_params params = calibrated_2r_default_params;
    params.L2 = length;
    calibrated_2r_fk(q, &params, out);
}
""",
        encoding="utf-8",
    )
    command = ["cc", "-std=c99", "-shared", "-fPIC", f"-I{result.folder}", source, result.folder / "calibrated_2r.c"]
    try:
        subprocess.run([*command, "-o", tmp_path / "user.so"], check=True)
    except FileNotFoundError:
        pytest.skip("needs a C compiler")
    q, out = (ctypes.c_double * 2)(0.25, -0.5), (ctypes.c_double * 16)()
    ctypes.CDLL(str(tmp_path / "user.so")).user(q, ctypes.c_double(0.75), out)
    robot = with_parameters(load(ROBOTS / "calibrated_2r.yaml"), {"L2": Fraction(3, 4)})

    np.testing.assert_allclose(
        np.reshape(list(out), (4, 4)), reference.pose(robot, np.array([[0.25, -0.5]]))[0, 0], rtol=0, atol=1e-14
    )


def test_a_robot_without_joints_gives_its_pose_for_no_joint_values(package_of: Callable[[str], ModuleType]) -> None:
    blocks = package_of("blocks")
    robot = load(ROBOTS / "blocks.yaml")

    assert blocks.DOF == 0
    assert blocks.JOINTS == blocks.LIMITS == ()
    assert blocks.fk(np.zeros((7, 0))).shape == (7, 4, 4)
    np.testing.assert_allclose(
        blocks.fk(np.zeros(0)), reference.pose(robot, np.zeros((1, 0)))[0, 0], rtol=0, atol=1e-15
    )


def test_a_compiled_package_without_cffi_evaluates_in_c(built: Path) -> None:
    """A copy of the folder may not find cffi elsewhere; ctypes then calls the same functions."""
    code = """
import sys, warnings
sys.modules["_cffi_backend"] = sys.modules["cffi"] = None
sys.path.insert(0, sys.argv[1])
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    import arm
print(arm.backend, [str(warning.message) for warning in caught])
"""
    done = subprocess.run([sys.executable, "-c", code, built], capture_output=True, text=True, check=True)

    assert done.stdout == "c []\n"


def test_what_a_build_reports_is_what_it_did(tmp_path: Path) -> None:
    result = make(ROBOTS / "puma560.yaml", tmp_path, compile=False, quantities=USUAL)

    names = ["load", "derive", "lower", "vectors", "emit", "compile", "prove", "write"]
    assert [stage.name for stage in result.stages] == names
    assert all(stage.seconds >= 0 for stage in result.stages)
    assert list(result.counts) == list(USUAL)
    assert [angle.text for angle in result.angles if angle.is_sum] == ["q2 + q3"]
    assert result.plain.multiplications > result.counts[Quantity.POSE].multiplications
    assert result.folder == tmp_path / "puma560"
    assert {entry.path for entry in result.written} == {path for path in result.folder.rglob("*") if path.is_file()}
    assert result.backend == "numpy"
    assert result.proof.holds
