"""What a proof compares, where it looks, and what it says."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import lower_file
from kinegen.errors import ProofError
from kinegen.io.load import load, loads
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.outputs import Quantity
from kinegen.runtime.extension import load_package
from kinegen.verify import reference
from kinegen.verify.proof import prove
from kinegen.verify.records import Comparison, Invocation, Proof
from kinegen.verify.samples import (
    BESIDE,
    CORNERS,
    DECADES,
    RANDOM,
    SPECIAL,
    move_parameters,
    proof_samples,
    vector_samples,
)
from kinegen.verify.vectors import compute_vectors
from tests.builds.workshop import ARM, ROBOTS, make, write_robot


@pytest.fixture(scope="module")
def package(built: Path) -> ModuleType:
    """The small arm, compiled."""
    return load_package(built / "arm")


def test_every_way_to_call_a_kernel_is_compared(package: ModuleType) -> None:
    robot = loads(ARM, "arm.yaml")
    proof = prove(robot, package, (Quantity.POSE,), ("double", "float"))
    ways = [f"{way}{rest}" for rest in ("", ", other parameters") for way in WAYS]
    beyond = [f"{way}, beyond limits" for real in ("double", "float") for way in BEYOND.format(real).split("; ")]

    assert [comparison.target for comparison in proof.comparisons] == [*ways, *beyond, "C double, 50 digits"]
    assert proof.holds
    assert proof.reach == reach(robot)


FORMS = ("C {}", "C {}, batch", "C {}, batch 3x4", "C {}, batch joint_major", "NumPy {}")
BEYOND = "C {0}; C {0}, batch; NumPy {0}"
WAYS = [form.format(real) for real in ("double", "float") for form in FORMS]


def test_a_package_without_a_compiler_is_compared_in_numpy(tmp_path: Path) -> None:
    result = make(write_robot(tmp_path), tmp_path / "out", compile=False, reals=(ScalarType.DOUBLE,))
    targets = dict.fromkeys(comparison.target for comparison in result.proof.comparisons)

    kinds = ("", ", other parameters", ", beyond limits", ", 50 digits")
    assert list(targets) == [f"NumPy double{kind}" for kind in kinds]
    assert result.backend == "numpy"


def test_frames_beyond_the_tip_are_measured_by_their_own_distance(tmp_path: Path) -> None:
    """A station a kilometre away cannot be as exact as a tip of half a metre."""
    text = (
        ARM
        + "frames:\n  station: {parent: base, xyz: [1000, 1/3, 1/7]}\n  far_off: {parent: tool, xyz: [900, 1/3, 0]}\n"
    )
    result = make(write_robot(tmp_path, text), tmp_path / "out", quantities=(Quantity.FRAMES,), compile=False)

    assert result.proof.holds


@pytest.mark.parametrize("name", sorted(path.stem for path in ROBOTS.glob("*.yaml")))
def test_samples_hold_zero_corners_special_angles_and_random_points(name: str) -> None:
    robot = load(ROBOTS / f"{name}.yaml")
    samples, box = proof_samples(robot), np.array(joint_box(robot)).reshape(-1, 2)
    corners = min(2**robot.dof, CORNERS)
    if robot.dof == 0:
        assert samples.shape == (1, 0)
        return
    at_corners = np.isin(samples, box).all(axis=1)

    assert samples.shape == (1 + corners + SPECIAL + BESIDE * DECADES + RANDOM, robot.dof)
    assert (samples >= box[:, 0]).all()
    assert (samples <= box[:, 1]).all()
    assert (samples[0] == np.clip(0, box[:, 0], box[:, 1])).all()
    assert at_corners[1 : 1 + corners].all()
    assert len(np.unique(samples[-RANDOM:], axis=0)) == RANDOM
    if 2**robot.dof <= CORNERS:
        assert len(np.unique(samples[1 : 1 + corners], axis=0)) == corners


def test_samples_are_the_same_every_time() -> None:
    robot = load(ROBOTS / "panda.yaml")

    np.testing.assert_array_equal(proof_samples(robot), proof_samples(robot))
    np.testing.assert_array_equal(vector_samples(robot), vector_samples(robot))


@pytest.mark.parametrize("name", ["puma560", "cartesian", "panda", "screw", "blocks"])
def test_vectors_are_held_exactly_by_floats_and_inside_the_limits(name: str) -> None:
    robot = load(ROBOTS / f"{name}.yaml")
    samples, box = vector_samples(robot), np.array(joint_box(robot)).reshape(-1, 2)

    assert (samples.astype(np.float32) == samples).all()
    assert (samples >= box[:, 0]).all()
    assert (samples <= box[:, 1]).all()


@pytest.mark.parametrize("name", ["puma560", "hand", "calibrated_2r", "screw", "standard_frames"])
def test_vectors_are_the_reference_in_fifty_digits(name: str) -> None:
    """And the plain reference agrees as far as its own digits go."""
    kernels = lower_file(ROBOTS / f"{name}.yaml", (Quantity.FRAMES,))
    vectors = compute_vectors(kernels)
    known = reference.frames(kernels.robot, np.array(vectors.inputs["q"], dtype=float))
    (expected,) = vectors.expected[Quantity.FRAMES]
    for index, frame in enumerate(kernels.robot.frame_names):
        found = np.array([row[12 * index : 12 * index + 12] for row in expected.rows], dtype=float)

        np.testing.assert_allclose(found.reshape(-1, 3, 4), known[frame][:, :3], rtol=0, atol=1e-12)


def test_other_parameters_differ_from_the_files_and_from_each_other() -> None:
    robot = load(ROBOTS / "calibrated_2r.yaml")
    moved, values = move_parameters(robot)

    assert len(set(values)) == len(values) == len(robot.runtime_parameters)
    assert all(np.float32(value) == value for value in values)
    q = np.array([[0.3, 0.4]])
    assert np.abs(reference.pose(moved, q) - reference.pose(robot, q)).max() > 0.01
    assert move_parameters(loads(ARM, "arm.yaml"))[1] == (0.5625, 0.59375)


HELD = Comparison(
    invocation=Invocation("C", "double"),
    quantity=Quantity.POSE,
    poses=3,
    position_error=1e-15,
    rotation_error=1e-16,
    position_tolerance=1e-13,
    rotation_tolerance=1e-13,
    worst=(0.5, -1.25),
    frame="tool",
)


@pytest.mark.parametrize(
    ("change", "holds"),
    [
        ({}, True),
        ({"position_error": 1e-13}, True),
        ({"position_error": 1.01e-13}, False),
        ({"rotation_error": 2e-13}, False),
        ({"position_error": float("nan")}, False),
        ({"rotation_error": float("inf")}, False),
    ],
)
def test_a_comparison_holds_within_its_tolerances(change: dict[str, float], holds: bool) -> None:
    comparison = replace(HELD, **change)  # type: ignore[arg-type]

    assert comparison.holds is holds
    assert Proof(1.0, (HELD, comparison)).holds is holds


def test_a_failed_proof_says_what_where_and_by_how_much() -> None:
    robot = loads(ARM, "arm.yaml")
    proof = Proof(1.0, (HELD, replace(HELD, invocation=Invocation("C", "float"), position_error=0.25)))

    with pytest.raises(ProofError) as caught:
        proof.require(robot)

    assert str(caught.value) == (
        "arm: C float pose differs from the reference at q = (0.5, -1.25), frame tool: 0.25 m (tolerance 1e-13), "
        "rotation 1e-16 (tolerance 1e-13); nothing was written; --real double builds without float"
    )
