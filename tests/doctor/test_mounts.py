"""A base and a tool that are solved for: right for exact poses, near for noisy ones, refused where they cannot be."""

from __future__ import annotations

import numpy as np
import pytest

from kinegen.tools.doctor.base_tool_fit import fit, mounted, plausible, round_mount, turn_about_one_axis
from kinegen.tools.doctor.observed_poses import FORMS, THREE, numbers_of, rotations
from kinegen.tools.doctor.residual import Allowed, Targets

LIMITS = Allowed(1e-4, 1e-4, 2e-4, 2e-4)


def random_transforms(rng: np.random.Generator, count: int) -> np.ndarray:
    found = np.tile(np.eye(4), (count, 1, 1))
    found[:, :3, :3] = rotations("wxyz", rng.normal(size=(count, 4)))
    found[:, :3, 3] = rng.uniform(-1, 1, (count, 3))
    return found


def frames_of(transforms: np.ndarray) -> tuple[np.ndarray, ...]:
    """Transforms of shape (N, K, 4, 4) as axes and origins of shape (3, N, K)."""
    return tuple(transforms[..., :3, column].transpose(2, 0, 1) for column in range(4))


def targets_of(transforms: np.ndarray, *, turned: bool = True) -> Targets:
    """Transforms of shape (K, 4, 4) as observed poses."""
    known = np.full(len(transforms), float(turned))
    rotation = transforms[:, :3, :3].transpose(2, 1, 0)[:, :, None] * turned
    return Targets(transforms[:, :3, 3].T[:, None], rotation, known)


@pytest.mark.parametrize(("base", "tail"), [(True, False), (False, True), (True, True)])
def test_the_transforms_of_exact_poses_are_found(base: bool, tail: bool) -> None:
    rng = np.random.default_rng(3)
    first, second = random_transforms(rng, 2)
    left, right = first if base else np.eye(4), second if tail else np.eye(4)
    inner = random_transforms(rng, 6)
    wrong = random_transforms(rng, 6)
    predicted = frames_of(np.stack([wrong, inner]))
    wanted = targets_of(left @ inner @ right)

    assert plausible(predicted, wanted, LIMITS, base=base, tail=tail).tolist() == [False, True]
    found = fit(predicted, wanted, LIMITS, base=base, tail=tail)
    assert found.numbers == 6 * (base + tail)
    if base:
        assert found.base is not None
        assert np.abs(found.base[1] - left).max() < 1e-9
    if tail:
        assert found.tail is not None
        assert np.abs(found.tail[1] - right).max() < 1e-9
    again = mounted(predicted, found.base, found.tail)
    assert all(np.abs(a - b).max() < 1e-12 for a, b in zip(again, found.frames, strict=True))
    assert np.abs(found.frames[3][:, 1] - wanted.positions[:, 0]).max() < 1e-9


def test_a_base_and_a_tool_from_positions_alone() -> None:
    rng = np.random.default_rng(4)
    left, right = random_transforms(rng, 2)
    inner = random_transforms(rng, 6)
    base = fit(frames_of(inner[None]), targets_of(left @ inner, turned=False), LIMITS, base=True, tail=False)
    tail = fit(frames_of(inner[None]), targets_of(inner @ right, turned=False), LIMITS, base=False, tail=True)

    assert base.base is not None
    assert np.abs(base.base[0] - left).max() < 1e-9
    assert tail.tail is not None
    assert np.abs(tail.tail[0, :3, 3] - right[:3, 3]).max() < 1e-9
    assert np.abs(tail.tail[0, :3, :3] - np.eye(3)).max() < 1e-12


def test_orientations_about_one_axis_do_not_determine_base_and_tool() -> None:
    """A SCARA: any turn about the common axis could be of the base or of the tool."""
    rng = np.random.default_rng(5)
    inner = np.tile(np.eye(4), (6, 1, 1))
    inner[:, :3, :3] = rotations("rpy", np.array([[0, 0, angle] for angle in rng.uniform(-2, 2, 6)]))
    left, right = random_transforms(rng, 2)

    assert turn_about_one_axis(targets_of(left @ inner @ right))
    assert turn_about_one_axis(targets_of(np.tile(left, (4, 1, 1))))
    assert not turn_about_one_axis(targets_of(random_transforms(rng, 3)))


def test_round_numbers_of_a_transform_also_where_the_pitch_is_a_quarter_turn() -> None:
    rough = np.eye(4)
    rough[:3, :3] = rotations("rpy", np.radians([[-160.67, 89.999, -160.67]]))[0]
    rough[:3, 3] = 0.10002, -0.00001, 0.04998
    found = round_mount(rough, 15, 1e-3)

    assert np.abs(numbers_of("rpy", found[None, :3, :3])[0] - [0, np.pi / 2, 0]).max() < 1e-9
    assert np.abs(found[:3, 3] - [0.1, 0, 0.05]).max() < 1e-12


@pytest.mark.parametrize("form", FORMS)
def test_every_form_of_orientation_goes_there_and_back(form: str) -> None:
    turned = random_transforms(np.random.default_rng(6), 50)[:, :3, :3]
    numbers = numbers_of(form, turned)

    assert numbers.shape == (50, 3 if form in THREE else 4)
    assert np.abs(rotations(form, numbers) - turned).max() < 1e-12


def test_the_forms_are_those_of_the_books() -> None:
    """Rz(yaw) Ry(pitch) Rx(roll), and the same in other orders, written out."""
    roll, pitch, yaw = 0.3, -0.5, 0.7
    x = np.array([[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]])
    y = np.array([[np.cos(pitch), 0, np.sin(pitch)], [0, 1, 0], [-np.sin(pitch), 0, np.cos(pitch)]])
    z = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])

    assert np.abs(rotations("rpy", np.array([[roll, pitch, yaw]]))[0] - z @ y @ x).max() < 1e-12
    assert np.abs(rotations("ypr", np.array([[yaw, pitch, roll]]))[0] - z @ y @ x).max() < 1e-12
    assert np.abs(rotations("rpy_xyz", np.array([[roll, pitch, yaw]]))[0] - x @ y @ z).max() < 1e-12
    half = np.cos(yaw / 2), np.sin(yaw / 2)
    assert np.abs(rotations("wxyz", np.array([[half[0], 0, 0, half[1]]]))[0] - z).max() < 1e-12
    assert np.abs(rotations("xyzw", np.array([[0, 0, half[1], half[0]]]))[0] - z).max() < 1e-12
    assert np.abs(rotations("rotation_vector", np.array([[0, 0, yaw]]))[0] - z).max() < 1e-12
