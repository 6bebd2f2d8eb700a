"""Joint vectors beside those where branches of an arm that is nearly of a family merge."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from kinegen.derive.inverse.family import Family
from kinegen.derive.inverse.singular_configurations import alignments, boundaries
from kinegen.model.joint_bounds import joint_box
from kinegen.model.robot import TOOL, Robot
from kinegen.verify import reference
from kinegen.verify.samples import SEED, FloatArray, random_joints

BESIDE_ELBOW = "beside the stretched or folded elbow"
BESIDE_WRIST = "beside the wrist in line"
BESIDE_WAIST = "beside the axis of the waist"
MERGING = (BESIDE_ELBOW, BESIDE_WRIST, BESIDE_WAIST)
"""Special targets of an arm that is nearly of a family: branches merge there."""


def beside_merging(robot: Robot, family: Family, count: int) -> Iterator[tuple[str, FloatArray]]:
    """Yields joint vectors beside those where branches of the nearest arm meet, from 1e-7 rad on, by what meets there.

    The waist has no joint that says where; the one after it is turned until the arm's own Jacobian has no inverse.
    """
    low, high = np.array(joint_box(robot)).T
    second = family.axes.joints[1].number - 1
    on_sets = [
        (name, index, with_joint(robot, family, index, value, count))
        for name, places in ((BESIDE_ELBOW, boundaries(family)), (BESIDE_WRIST, alignments(family)))
        for index, values in places
        for value in values
    ]
    on_sets.append((BESIDE_WAIST, second, _without_inverse(robot, family, second, count)))
    found: dict[str, list[FloatArray]] = {name: [] for name in MERGING}
    for name, index, points in on_sets:
        parts = np.random.default_rng(SEED + index).uniform(-1, 1, len(points))
        points[:, index] += np.sign(parts) * 10 ** (-7 + 6 * np.abs(parts)) / abs(float(family.joints[index].rate))
        found[name].append(points[((points >= low) & (points <= high)).all(axis=1)])
    for name, planted in found.items():
        yield name, np.concatenate(planted)


_TRIED = 24
"""Values of a joint between which a sign of the determinant is looked for."""

_HALVINGS = 45
"""How often what lies between two of them is halved: to 1e-13 of a turn."""


def _without_inverse(robot: Robot, family: Family, index: int, count: int) -> FloatArray:
    """Random joint vectors with one joint where the Jacobian by the others has no inverse; fewer than a count."""
    solved = sorted(number - 1 for number in family.axes.numbers)

    def signs(q: FloatArray) -> FloatArray:
        found: FloatArray = np.sign(np.linalg.det(reference.Kinematics(robot, q).jacobian(TOOL)[..., solved]))
        return found

    points = random_joints(robot, count, SEED + index)
    tried = np.repeat(points[:, None], _TRIED, axis=1)
    tried[..., index] = np.linspace(*joint_box(robot)[index], _TRIED)
    sides = signs(tried.reshape(-1, robot.dof)).reshape(count, _TRIED)
    changes = sides[:, 1:] != sides[:, :-1]
    rows = np.flatnonzero(changes.any(axis=1))
    first = changes[rows].argmax(axis=1)
    low: FloatArray = tried[rows, first]
    high, side = tried[rows, first + 1], sides[rows, first]
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        is_low = (signs(middle) == side)[:, None]
        low, high = np.where(is_low, middle, low), np.where(is_low, high, middle)
    return low


def with_joint(robot: Robot, family: Family, index: int, value: float, count: int) -> FloatArray:
    """Returns random joint vectors with one joint at a value, or whole turns from it; none if its limits exclude it."""
    low, high = joint_box(robot)[index]
    turn = 2 * math.pi / abs(float(family.joints[index].rate))
    turned = value + turn * math.ceil((low - value) / turn - 1e-9)
    points = random_joints(robot, count, SEED + index)
    points[:, index] = turned
    return points if turned <= high else points[:0]
