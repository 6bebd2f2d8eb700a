"""Velocities and their derivatives, by the definitions themselves, and as differences of poses in 50 digits.

A way is written `frame`, which is seen from the base, or `frame/other`, which is seen from the other frame. Joints that
move both are in both products; that they cancel is found here by numbers, and in the kernels by structure.

The chain product is evaluated in series, and velocities are read off the products R'R^T and R^T R' of a rotation and
its derivative, the cross products by the angular velocity in the axes of the base and of the frame. Rows of all results
are linear, then angular. `Reference` says what moves and in which axes: the origin of the frame, in the axes of the
base (`LOCAL_WORLD_ALIGNED`) or of the frame (`LOCAL`), or the point of the moving body at the base's origin, in the
axes of the base (`WORLD`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import lru_cache
from typing import Any

import mpmath
import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinegen.model.expression_parser import evaluate
from kinegen.model.outputs import Reference
from kinegen.model.robot import Robot
from kinegen.verify.reference.chain import chain, values_of
from kinegen.verify.reference.exact_numbers import DIGITS, Kind
from kinegen.verify.reference.number_types import FLOATS, WIDE, WIDE_TABLES, digit_arrays
from kinegen.verify.reference.series import Monomial, Series, in_series, product


def seen_series(places: Mapping[str, Series], way: str) -> Series:
    """Returns a pose as a series, of frames whose poses in the base are series.

    `places`: poses in the base by frame; `way`: a frame, or a frame and the one from which it is seen.
    """
    frame, slash, start = way.partition("/")
    if not slash:
        return places[frame]
    back = places[start].map(_turned_back)
    # The inverse of a pose is R^T times the pose without rotation that shifts by -p.
    inverse = product(back, _shifted_back(places[start]), np.matmul)
    return product(inverse, places[frame], np.matmul)


def seen_pose(places: Mapping[str, Any], way: str) -> Any:
    """Returns the same of poses that are numbers, shape (N, 4, 4) each."""
    frame, slash, start = way.partition("/")
    if not slash:
        return places[frame]
    return seen_series({name: Series({(): places[name]}, 0) for name in (frame, start)}, way).parts[()]


def _turned_back(part: Any) -> Any:
    """Returns the transposed rotation of a pose or of its derivative, without the shift."""
    found = np.zeros_like(part)
    found[..., :3, :3] = part[..., :3, :3].swapaxes(-1, -2)
    found[..., 3, 3] = part[..., 3, 3]
    return found


def _shifted_back(place: Series) -> Series:
    """Returns the shift of a pose alone, the other way."""

    def back(part: Any) -> Any:
        found = np.zeros_like(part)
        found[..., :3, 3] = -part[..., :3, 3]
        return found

    moved = place.map(back)
    return moved + Series({(): np.zeros_like(place.parts[()]) + np.eye(4, dtype=int)}, place.order)


Numbers = NDArray[Any]

TIP = Reference.LOCAL_WORLD_ALIGNED


class Kinematics:
    """A robot at some configurations: poses, velocities, accelerations and derivatives of all its frames.

    Args:
        q: Joint vectors, shape (N, dof); radians and the file's length unit.
        params: Values of parameters that differ from the file.
        exact: Whether to compute with `DIGITS` digits. Floats are then taken as the exact binary numbers they are, and
            all results are arrays of mpmath numbers.
        wide: Whether to compute with the widest floats of NumPy in place of float64.
    """

    def __init__(
        self,
        robot: Robot,
        q: ArrayLike,
        params: Mapping[str, Any] | None = None,
        *,
        exact: bool = False,
        wide: bool = False,
    ) -> None:
        self.robot = robot
        self.exact = exact
        self._wide = wide
        self._params = params or {}
        self.q = self._rows(q)
        self._places: dict[str, Numbers] = {}
        self._by_order: dict[int, dict[str, Series]] = {}
        self._latest: tuple[Any, Any, int, dict[str, Series]] = (None, None, 0, {})

    def pose(self, frame: str) -> Numbers:
        """Pose `base_T_frame`, shape (N, 4, 4); of a way such as `tool/table`, the pose `table_T_tool`."""
        if not self._places:
            with mpmath.workdps(DIGITS):
                self._places = self._all_poses()
        with mpmath.workdps(DIGITS):
            return np.broadcast_to(seen_pose(self._places, frame), (len(self.q), 4, 4))

    def jacobian(self, frame: str, reference: Reference = TIP) -> Numbers:
        """Geometric Jacobian, shape (N, 6, dof): velocities of the frame at unit rates of the joints."""
        with mpmath.workdps(DIGITS):
            return self._columns(seen_series(self._by_joints(1), frame), self.robot.dof, reference)

    def hessian(self, frame: str, reference: Reference = TIP) -> Numbers:
        """Derivative of the Jacobian, shape (N, dof, 6, dof): [:, k, :, j] is column j differentiated by joint k."""
        joints = range(self.robot.dof)
        with mpmath.workdps(DIGITS):
            place = seen_series(self._by_joints(2), frame)
            columns = [self._velocity(place, joint, reference) for joint in joints]
            blocks = [self._joined([self._read(column, (other,)) for column in columns]) for other in joints]
        return np.stack(blocks, axis=1) if blocks else np.zeros((len(self.q), 0, 6, 0))

    def twist(self, frame: str, qd: ArrayLike, reference: Reference = TIP) -> Numbers:
        """Velocity, shape (N, 6), at joint rates (N, dof)."""
        with mpmath.workdps(DIGITS):
            place = seen_series(self._in_time(qd, None, 1), frame)
            return self._read(self._velocity(place, 0, reference), ())

    def acceleration(self, frame: str, qd: ArrayLike, qdd: ArrayLike | None, reference: Reference = TIP) -> Numbers:
        """Time derivative of the twist, shape (N, 6), at joint rates and accelerations (N, dof); None for zeros."""
        with mpmath.workdps(DIGITS):
            place = seen_series(self._in_time(qd, qdd, 2), frame)
            return self._read(self._velocity(place, 0, reference), (0,))

    def bias_acceleration(self, frame: str, qd: ArrayLike, reference: Reference = TIP) -> Numbers:
        """The same without accelerations of the joints, which is the derivative of the Jacobian times the rates."""
        return self.acceleration(frame, qd, None, reference)

    def parameter_jacobian(self, frame: str, names: Iterable[str], reference: Reference = TIP) -> Numbers:
        """Velocities of the frame at unit rates of parameters, shape (N, 6, number of names)."""
        wanted = tuple(names)
        with mpmath.workdps(DIGITS):
            return self._columns(seen_series(self._by_parameters(wanted), frame), len(wanted), reference)

    def _rows(self, values: ArrayLike) -> Numbers:
        """Joint vectors in the numbers of this object."""
        if not self.exact:
            return np.atleast_2d(np.asarray(values, dtype=WIDE if self._wide else np.float64))
        with mpmath.workdps(DIGITS):
            return np.atleast_2d(np.frompyfunc(mpmath.mpf, 1, 1)(np.asarray(values, dtype=object)))

    def _all_poses(self) -> dict[str, Numbers]:
        """Returns the poses of all frames: where series in small changes are known, what is left without a change."""
        for known in self._by_order.values():
            return {name: series.parts[()] for name, series in known.items()}
        if self.exact and not self._params:
            return _exact_poses(self.robot, tuple(map(tuple, self.q)))
        kind = self._kind()
        return chain(self.robot, values_of(self.robot, list(self.q.T), self._params, kind), kind)

    def _kind(self) -> Kind:
        if self.exact:
            return digit_arrays()
        return WIDE_TABLES if self._wide else FLOATS

    def _by_joints(self, order: int) -> dict[str, Series]:
        """Returns all poses in small changes of the joints."""
        if order not in self._by_order:
            q = [Series({(): entry, (joint,): 1}, order) for joint, entry in enumerate(self.q.T)]
            self._by_order[order] = self._chain(q, {}, order)
        return self._by_order[order]

    def _in_time(self, qd: ArrayLike, qdd: ArrayLike | None, order: int) -> dict[str, Series]:
        """All poses in a small time, with q(t) = q + t qd + t^2/2 qdd; remembered while the rates are the same."""
        if self._latest[0] is not qd or self._latest[1] is not qdd or self._latest[2] < order:
            rates = self._rows(qd)
            more = 0 * rates if qdd is None else self._rows(qdd) / 2
            motions = zip(self.q.T, rates.T, more.T, strict=True)
            parts = ({(): at, (0,): rate, (0, 0): further} for at, rate, further in motions)
            kept = [{monomial: part for monomial, part in each.items() if len(monomial) <= order} for each in parts]
            self._latest = (qd, qdd, order, self._chain([Series(each, order) for each in kept], {}, order))
        return self._latest[3]

    def _by_parameters(self, names: tuple[str, ...]) -> dict[str, Series]:
        """Returns all poses in small changes of parameters."""
        found = {entry.name: evaluate(entry.value, {}, self._kind().arithmetic) for entry in self.robot.parameters}
        found |= self._params
        return self._chain(
            list(self.q.T), {name: Series({(): found[name], (at,): 1}, 1) for at, name in enumerate(names)}, 1
        )

    def _chain(self, q: list[Any], params: Mapping[str, Any], order: int) -> dict[str, Series]:
        with mpmath.workdps(DIGITS):
            kind = in_series(self._kind(), order)
            return chain(self.robot, values_of(self.robot, q, {**self._params, **params}, kind), kind)

    def _part(self, series: Series, monomial: Monomial, shape: tuple[int, ...]) -> Numbers:
        """Returns one coefficient, for every configuration."""
        found = series.parts.get(monomial)
        whole = (len(self.q), *shape)
        return np.zeros(whole) if found is None else np.broadcast_to(found, whole)

    def _columns(self, place: Series, count: int, reference: Reference) -> Numbers:
        """Returns the velocities when each of the variables grows at unit rate, side by side."""
        with mpmath.workdps(DIGITS):
            return self._joined([self._read(self._velocity(place, column, reference), ()) for column in range(count)])

    def _velocity(self, place: Series, variable: int, reference: Reference) -> tuple[Series, Series]:
        """Linear velocity, shape (N, 3, 1), and the cross product matrix of the angular velocity, shape (N, 3, 3)."""
        rotation, position = _blocks(place)
        turned, shifted = _blocks(place.derivative(variable))
        inverse = rotation.map(lambda part: part.swapaxes(-1, -2))
        if reference is Reference.LOCAL:
            return product(inverse, shifted, np.matmul), product(inverse, turned, np.matmul)
        turning = product(turned, inverse, np.matmul)
        return shifted if reference is TIP else shifted - product(turning, position, np.matmul), turning

    def _read(self, velocity: tuple[Series, Series], monomial: Monomial) -> Numbers:
        """Returns a velocity, or with a monomial of one variable its derivative, shape (N, 6)."""
        linear, turning = velocity
        point = self._part(linear, monomial, (3, 1))
        cross = self._part(turning, monomial, (3, 3))
        angular = ((cross[:, i, j] - cross[:, j, i]) / 2 for i, j in ((2, 1), (0, 2), (1, 0)))
        return np.stack([*(point[:, row, 0] for row in range(3)), *angular], axis=1)

    def _joined(self, columns: list[Numbers]) -> Numbers:
        return np.stack(columns, axis=-1) if columns else np.zeros((len(self.q), 6, 0))


def _blocks(place: Series) -> tuple[Series, Series]:
    """Rotation and position of a pose, or their derivatives."""
    return place.map(lambda part: part[..., :3, :3]), place.map(lambda part: part[..., :3, 3:])


@lru_cache(maxsize=1)
def _exact_poses(robot: Robot, rows: tuple[tuple[Any, ...], ...]) -> dict[str, Numbers]:
    """Returns the poses of all frames in `DIGITS` digits; a build asks for them at the same joint vectors twice."""
    kind = digit_arrays()
    q = np.array(rows, dtype=object).reshape(len(rows), robot.dof)
    return chain(robot, values_of(robot, list(q.T), None, kind), kind)


STEP = mpmath.mpf(10) ** -15
"""Central differences of smooth functions are then right to thirty digits, and 35 are left of 50."""


class Differences(Kinematics):
    """The same as `Kinematics` with `DIGITS` digits, but for the Jacobian.

    Args:
        q: Joint vectors, shape (N, dof).
        params: Values of parameters that differ from the file.
    """

    def __init__(self, robot: Robot, q: ArrayLike, params: Mapping[str, Any] | None = None) -> None:
        super().__init__(robot, q, params, exact=True)
        with mpmath.workdps(DIGITS):
            self._moved = [
                tuple(Kinematics(robot, self.q + sign * STEP * row, params, exact=True) for sign in (1, -1))
                for row in np.eye(robot.dof, dtype=int)
            ]

    def jacobian(self, frame: str, reference: Reference = TIP) -> Numbers:
        """Geometric Jacobian, shape (N, 6, dof), from poses on both sides of each joint value."""
        place = self.pose(frame)
        rotation, position = place[:, :3, :3], place[:, :3, 3:]
        columns = []
        with mpmath.workdps(DIGITS):
            for ahead, behind in self._moved:
                moving = (ahead.pose(frame) - behind.pose(frame)) / (2 * STEP)
                turning = moving[:, :3, :3] @ rotation.swapaxes(1, 2)
                angular = np.stack([turning[:, 2, 1], turning[:, 0, 2], turning[:, 1, 0]], axis=1)[..., None]
                linear = moving[:, :3, 3:]
                if reference is Reference.LOCAL:
                    linear, angular = (rotation.swapaxes(1, 2) @ part for part in (linear, angular))
                elif reference is Reference.WORLD:
                    linear = linear - turning @ position
                columns.append(np.concatenate([linear, angular], axis=1)[..., 0])
        return self._joined(columns)
