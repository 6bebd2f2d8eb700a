"""Builds with actuators: the proof of their kernels, C beside NumPy, and modules that say what is out of range."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kinegen.backends.scalar_types import ScalarType
from kinegen.errors import KinegenError, ProofError
from kinegen.model.outputs import Kind, Quantity, parse_quantity
from kinegen.runtime.extension import load_package
from tests.builds.workshop import TREE, assemble, make, set_machine, write_robot

OUTPUTS = tuple(
    parse_quantity(name)
    for name in (
        "actuators_to_joints",
        "joints_to_actuators",
        "fk_actuators",
        "fk_actuators@elbow",
        "jacobian_actuators",
        "jacobian_actuators_local@elbow",
    )
)

ARM = """\
kinegen: 1
name: arm
convention: standard
units: {length: m, angle: deg}
parameters:
  near: {value: 0.3, runtime: true}
  far: 0.5
  pitch: {value: 0.02, runtime: true}
joints:
  - {name: lift, a: 0, alpha: 0, d: q, theta: 0}
  - {name: shoulder, a: far, alpha: 90, d: 0, theta: q}
  - {name: elbow, a: 0.25, alpha: 30, d: 0, theta: q}
  - {name: finger, a: 0.125, alpha: 0, d: 0, theta: q}
actuators:
  readings:
    spindle: {dimension: angle, limits: [-7200, 7200]}
    ram: {dimension: length, limits: [0.3, 0.7]}
    servo: {dimension: angle, limits: [45, 150]}
  joints:
    - {joint: lift, value: pitch*spindle/(2*pi)}
    - {joint: shoulder, form: linear_actuator, actuator: ram, sides: [near, far], offset: -90}
    - {joint: elbow, form: four_bar, actuator: servo, ground: 0.4, crank: 0.1, coupler: 0.3, rocker: 0.25,
       offset: -0.5*shoulder}
    - {joint: finger, value: 0.5*elbow + acos(cos(servo)/2)}
"""
"""Three actuators for four joints, a slide among them, and two runtime parameters."""

CUBE = """\
kinegen: 1
name: arm
convention: standard
units: {length: m, angle: rad}
joints:
  - {name: turn, a: 0.3, alpha: 0, d: 0, theta: q}
actuators:
  readings: {m: {dimension: number, limits: [0.5, 2]}}
  joints: [{joint: turn, value: m**2}]
  inverse: {m: INVERSE}
"""


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The arm, compiled and proven."""
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("actuators")
        set_machine(patch, folder / "cache")
        result = make(write_robot(folder, ARM), folder / "out", quantities=OUTPUTS)
        return result, load_package(folder / "out" / "arm")


def test_the_proof_holds_in_every_way_to_call(built: Any) -> None:
    result, package = built
    targets = {comparison.target for comparison in result.proof.comparisons}

    assert result.proof.holds
    assert package.backend == "c"
    assert {str(comparison.quantity) for comparison in result.proof.comparisons} == {str(each) for each in OUTPUTS}
    assert {"C double", "C float", "NumPy double", "C double, 50 digits", "C double, other parameters"} <= targets


def test_there_and_back_in_c(built: Any) -> None:
    _, package = built
    low, high = np.array(package.ACTUATOR_RANGES).T
    readings = np.random.default_rng(2).uniform(low, high, (2000, 3))
    joints = package.actuators_to_joints(readings)

    assert joints.shape == (2000, 4)
    np.testing.assert_allclose(package.joints_to_actuators(joints), readings, atol=1e-11)
    assert package.jacobian_actuators(readings).shape == (2000, 6, 3)


def test_what_is_impossible_is_nan_and_named(built: Any) -> None:
    _, package = built
    readings = np.array([[0.0, 0.5, 1.0], [0.0, 0.9, 1.0]])
    poses = package.fk_actuators(readings)

    assert np.isfinite(poses[0]).all()
    assert np.isnan(poses[1, :3, :3]).any(axis=1).all()
    assert np.isnan(package.actuators_to_joints(readings)[1, 1:]).all()
    with pytest.raises(
        ValueError, match=r"actuator 'ram' reads 0\.9 m at \[1\], 0\.2 m beyond; its range is 0\.3 to 0\.7 m"
    ):
        package.fk_actuators(package.check_actuators(readings))


def test_headers_and_modules_name_the_actuators(built: Any) -> None:
    _, package = built
    header = (Path(package.__file__).parent / "arm.h").read_text(encoding="utf-8")

    assert package.ACTUATORS == ("spindle", "ram", "servo")
    assert "actuators[1]  ram      m    0.3 to 0.7" in package.__doc__
    assert " *   actuators[2]  servo    rad  0.785398 to 2.61799\n" in header
    assert "#define ARM_ACTUATORS 3\n" in header
    assert re.search(
        r"arm_actuators_to_joints\(const double actuators\[ARM_ACTUATORS\], .* double joints\[4\]\)", header
    )


def test_a_right_inverse_is_proven(tmp_path: Path) -> None:
    path = write_robot(tmp_path, CUBE.replace("INVERSE", "sqrt(turn)"))

    assert make(path, tmp_path, quantities=OUTPUTS[:2], compile=False, reals=(ScalarType.DOUBLE,)).proof.holds


def test_a_wrong_inverse_is_refused(tmp_path: Path) -> None:
    path = write_robot(tmp_path, CUBE.replace("INVERSE", "sqrt(turn) + 0.001"))

    with pytest.raises(ProofError, match="inverse does not undo the values of the joints: for turn = "):
        make(path, tmp_path, quantities=OUTPUTS[:2], compile=False, reals=(ScalarType.DOUBLE,))


def test_a_build_without_actuators_in_the_file_says_so(tmp_path: Path) -> None:
    text = CUBE.partition("actuators:")[0]

    with pytest.raises(KinegenError, match="arm has no actuators; its file says under 'actuators' what drives"):
        make(write_robot(tmp_path, text), tmp_path, quantities=OUTPUTS[2:3], compile=False)


@pytest.mark.parametrize("robot", ["wire_arm", "motoman_l3", "palletiser"])
@pytest.mark.parametrize("kind", [kind for kind in Kind if "actuators" in kind])
def test_the_example_of_a_module_has_a_value(robot: str, kind: Kind, tmp_path: Path) -> None:
    """Linkages do not close at readings of zero, and joints of zero may be beyond them."""
    module = assemble(robot, tmp_path, compiled=False, quantities=(Quantity(kind),))
    lines = [line.removeprefix("    >>> ") for line in (module.__doc__ or "").splitlines() if ">>>" in line]
    names: dict[str, Any] = {}

    text = "\n".join(lines).replace(f"import {robot}\n", "")
    exec(text, {"np": np, robot: module}, names)  # noqa: S102 - our own output

    (result,) = (value for name, value in names.items() if name != "np")
    assert np.isfinite(result).all()


def test_angle_sums_of_readings_have_their_names(tmp_path: Path) -> None:
    """Joints are q1, q2; what a motor reads is not one of them."""
    text = ARM.replace("{joint: elbow, form: four_bar", "{joint: elbow, value: servo/50 + 0.02*spindle}\n#")
    text = re.sub(r"#.*\n.*offset: -0.5\*shoulder}\n", "", text)
    result = make(write_robot(tmp_path, text), tmp_path / "out", compile=False, quantities=OUTPUTS[2:3])

    sums = [angle.text for angle in result.angles if angle.is_sum]
    assert sums
    assert all("spindle" in text and "servo" in text for text in sums)
    assert not any(re.search(r"\bq\d|actuators", text) for text in sums)


def test_a_tree_has_one_joint_vector_for_all_its_tips(tmp_path: Path) -> None:
    outputs = tuple(parse_quantity(name) for name in ("actuators_to_joints", "joints_to_actuators", "fk_actuators"))
    gears = "actuators:\n  readings: {m1: angle, m2: angle, m3: angle}\n  joints:\n" + "".join(
        f"    - {{joint: {joint}, form: gear, actuator: m{index}, ratio: {50 * index}}}\n"
        for index, joint in enumerate(("body", "left", "right"), start=1)
    )
    path = write_robot(tmp_path, TREE + gears)
    result = make(path, tmp_path, quantities=outputs, compile=False, reals=(ScalarType.DOUBLE,))

    assert {str(each.quantity) for each in result.proof.comparisons} == {str(each) for each in outputs}
    package = load_package(tmp_path / "arm")
    readings = np.array([10.0, -20.0, 30.0])
    np.testing.assert_allclose(package.actuators_to_joints(readings), readings / [50, 100, 150], rtol=1e-15)
    np.testing.assert_allclose(package.joints_to_actuators(readings), readings * [50, 100, 150], rtol=1e-15)
    assert package.fk_actuators(readings).shape == (2, 4, 4)


@pytest.mark.parametrize("value", ["m*sqrt(m)", "atan2(m, m)"])
def test_a_reading_without_a_derivative_is_told_with_its_line(value: str, tmp_path: Path) -> None:
    head = "kinegen: 1\nname: arm\nconvention: standard\nunits: {length: m, angle: rad}\njoints:\n"
    row = "  - {name: turn, a: 0.1, alpha: 0, d: 0, theta: q, limits: [0, 1]}\n"
    drives = f'  joints:\n    - {{joint: turn, value: "{value}"}}\n  inverse: {{m: turn}}\n'
    path = write_robot(
        tmp_path, f"{head}{row}actuators:\n  readings: {{m: {{dimension: number, limits: [0, 1]}}}}\n{drives}"
    )

    with pytest.raises(KinegenError, match=r"arm.yaml:10: actuators: joint 'turn' has no value or no derivative"):
        make(path, tmp_path, quantities=(parse_quantity("jacobian_actuators"),), compile=False)
