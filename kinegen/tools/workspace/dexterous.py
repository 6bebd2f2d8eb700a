"""Finds where the tip can stand in every orientation that the arm is able to give it.

(The usual definition; some course notes print "more than one orientation", by which nearly every point would count.)
The orientations are read off the Jacobian: none but one, all turns about one line, or all there are. An arm has a
dexterous part only if it can turn while the tip stands still, which the rank of the whole Jacobian tells without any
inverse. An inverse has to say, target by target, how large the part is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from kinegen.backends.bundle import RobotPrograms
from kinegen.driver.artifacts import make_package
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass
from kinegen.tools.workspace.sampling import Workspace
from kinegen.tools.workspace.tip_samples import FloatArray, Range, spread
from kinegen.verify import reference

Inverse = Callable[[FloatArray], NDArray[np.bool_]]
"""Poses (N, 4, 4) of the tip in the base frame to whether some joint vector within the limits reaches each, (N,)."""

_RANK = 1e-6
_STEP = 1e-4  # of a joint's range; the reference is exact to 1e-15
_PLACES = 32

_ABOUT_A_LINE = 72
_EVERY_WAY = 240
"""Orientations that stand for all: 5 degrees apart about a line, some 35 degrees apart in space."""

_VOXELS = 20_000


@dataclass(frozen=True, slots=True)
class Turning:
    """The orientations that an arm gives its tip.

    Attributes:
        freedom: 0 for one orientation, 1 for turns about a line, 3 for all; 2 for what is no group of turns.
        free: Whether it turns through them while the tip stands still, at generic places.
        line: Shape (3,), that line's direction; None unless `freedom` is 1.
        one: Shape (3, 3), one of the orientations.
    """

    freedom: int
    free: bool
    line: FloatArray | None
    one: FloatArray


@dataclass(frozen=True, slots=True)
class Dexterity:
    """The part of a sample of voxels and orientations that an inverse reached.

    Attributes:
        voxels: Number of voxels that were tried, spread evenly over all, each at the first point reached in it.
        share: Of the region, 0 to 1. A voxel on the rim counts as much as the measure of the whole counts it.
    """

    voxels: int
    orientations: int
    dexterous: int
    share: float
    measure: float


def find_turning(robot: Robot, workspace: Workspace) -> Turning:
    """Find the orientations that an arm gives its tip."""
    box = workspace.samples.box
    # All joints move here, those too that only turn the tip.
    q = replace(workspace.samples, movers=tuple(range(len(box))), start=np.full(len(box), 0.5)).at(np.arange(_PLACES)).T
    poses = _poses(robot, workspace, q)
    columns = []
    for joint, width in enumerate(np.ptp(box, axis=1)):
        step = np.zeros(len(box))
        step[joint] = _STEP * width
        ahead, behind = _poses(robot, workspace, q + step), _poses(robot, workspace, q - step)
        columns.append(_twist(ahead, behind) / (2 * _STEP))
    if not columns:
        return Turning(0, False, None, poses[0, :3, :3])
    jacobians = np.stack(columns, axis=2)
    jacobians[:, :3] /= max(np.abs(jacobians[:, :3]).max(), np.finfo(float).tiny)
    spins = jacobians[:, 3:].transpose(1, 0, 2).reshape(3, -1)
    directions, sizes, _ = np.linalg.svd(spins, full_matrices=False)
    lines = int((sizes > _RANK * np.sqrt(spins.shape[1])).sum())
    freedom = lines if lines <= 1 else max(2, _rank(jacobians[:, 3:]))
    free = freedom > 0 and _rank(jacobians) == workspace.shape.dimension + freedom
    return Turning(freedom, free, directions[:, 0] if freedom == 1 else None, poses[0, :3, :3])


def dexterous_part(workspace: Workspace, turning: Turning, inverse: Inverse) -> Dexterity:
    """Measure the part of a region where the tip stands in every orientation, at a point in each of some voxels."""
    tally = workspace.tally
    whole = None if tally is None else tally.counts[2].measure
    if tally is None or whole is None or not turning.free:
        raise ValueError("there is no dexterous part to measure")
    # The points that joined the voxels: all of them are in the region, the middles of voxels on the rim need not be.
    chosen = np.linspace(0, tally.q.shape[1] - 1, min(tally.q.shape[1], _VOXELS)).astype(int)
    points = workspace.tip.position(np.ascontiguousarray(tally.q[:, chosen])).T
    reached = np.ones(len(points), np.bool_)
    orientations = _orientations(turning)
    for orientation in orientations:
        left = np.flatnonzero(reached)
        targets = np.tile(np.eye(4), (len(left), 1, 1))
        targets[:, :3, :3] = orientation
        targets[:, :3, 3] = points[left]
        reached[left] = inverse(targets)
    # The part and the whole are sums over the same voxels, so that the part is never the larger one.
    weights = tally.voxels.weights(workspace.shape.axes @ points.T)
    total = float(weights.sum())
    share = float(weights[reached].sum()) / total if total else float(reached.mean())
    return Dexterity(len(points), len(orientations), int(reached.sum()), share, share * whole)


def _poses(robot: Robot, workspace: Workspace, q: FloatArray) -> FloatArray:
    return reference.frames(robot, q)[workspace.tip.name]


def _twist(ahead: FloatArray, behind: FloatArray) -> FloatArray:
    """Shifts and small turns (N, 6) between poses."""
    R = ahead[:, :3, :3] @ behind[:, :3, :3].transpose(0, 2, 1)
    turns = np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1) / 2
    return np.concatenate([ahead[:, :3, 3] - behind[:, :3, 3], turns], axis=1)


def _rank(matrices: FloatArray) -> int:
    return int((np.linalg.svd(matrices, compute_uv=False) > _RANK).sum(axis=1).max())


def _orientations(turning: Turning) -> FloatArray:
    """Orientations (N, 3, 3), spread evenly over all that the arm gives."""
    if turning.line is not None:
        angles = np.arange(_ABOUT_A_LINE) * (2 * np.pi / _ABOUT_A_LINE)
        halves = np.concatenate([np.cos(angles / 2)[None], np.sin(angles / 2) * turning.line[:, None]])
        return _matrices(halves) @ turning.one
    # Shoemake, "Uniform random rotations", 1992: three numbers of the unit cube to a unit quaternion.
    first, second, third = spread(np.arange(_EVERY_WAY), np.full(3, 0.5))
    one, other = np.sqrt(1 - first), np.sqrt(first)
    second, third = 2 * np.pi * second, 2 * np.pi * third
    return _matrices(
        np.stack([other * np.cos(third), one * np.sin(second), one * np.cos(second), other * np.sin(third)])
    )


def _matrices(quaternions: FloatArray) -> FloatArray:
    """Rotation matrices (N, 3, 3) of unit quaternions (4, N), the real part first."""
    w, x, y, z = quaternions
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.array(rows).transpose(2, 0, 1)


_SLACK = 1e-9
"""By which a joint may pass its bound, as in the inverse itself."""


def find_inverse(kernels: RobotPrograms, ranges: tuple[Range, ...]) -> Inverse:
    """Compile the only program, an inverse; it tells whether a branch reaches a pose within the ranges of the file."""
    package = make_package(kernels)
    low, high = np.array([each.bounds for each in ranges]).T

    def reached(poses: FloatArray) -> NDArray[np.bool_]:
        solutions, valid = package.inverse(poses, threads=0)
        # A slide without limits has a range all the same, which the inverse knows nothing of.
        within = ((low - _SLACK <= solutions) & (solutions <= high + _SLACK)).all(axis=-1)
        found: NDArray[np.bool_] = ((valid == 1) & within).any(axis=-1)
        return found

    return reached
