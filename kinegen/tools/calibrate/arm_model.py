"""The arm to be fitted: poses of the measured frame and their derivatives by everything that is varied.

The table is evaluated by the kernels that a build emits, compiled for this machine where there is a compiler. Base and
tool are corrections to what the file says, with derivatives of their own: base = [Exp(w) R0 | t0 + t], tool likewise
with Exp(w) behind R0. R = Rz(yaw) Ry(pitch) Rx(roll).
"""

from __future__ import annotations

from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from kinegen.driver.artifacts import make_package
from kinegen.driver.pipeline import lower_robot
from kinegen.model.expression_values import Dimension
from kinegen.model.joint_bounds import reach
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import Robot
from kinegen.model.runtime_entries import with_runtime_entries
from kinegen.support.dataclass import dataclass
from kinegen.tools.calibrate.fitted_parameters import BASE_NAMES, TOOL_NAMES, Choice, Prepared, measured_frame
from kinegen.tools.calibrate.options import TOOL_WORD
from kinegen.verify.reference.chain import links_of, values_of
from kinegen.verify.reference.number_types import FLOATS

Floats = NDArray[np.float64]

_SMALL = 1e-4


def cross(vectors: Floats) -> Floats:
    """Return the matrices [v]x, (N, 3, 3), of vectors (N, 3)."""
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)


def from_vector(vectors: Floats) -> Floats:
    """Rotations by rotation vectors (N, 3), in radians."""
    angle = np.linalg.norm(vectors, axis=1)[:, None, None]
    k = cross(vectors)
    found: Floats = np.eye(3) + np.sinc(angle / np.pi) * k + np.sinc(angle / 2 / np.pi) ** 2 / 2 * k @ k
    return found


def from_quaternion(quaternions: Floats) -> Floats:
    """Rotations by quaternions w, x, y, z (N, 4), of any length but zero."""
    w, x, y, z = (quaternions / np.linalg.norm(quaternions, axis=1)[:, None]).T
    rows = [
        1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
        2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
        2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
    ]  # fmt: skip
    return np.stack(rows, axis=1).reshape(-1, 3, 3)


def from_rpy(angles: Floats) -> Floats:
    """Rotations by roll, pitch and yaw (N, 3), in radians, about the fixed axes x, y and z in this order."""
    turns = []
    for axis in range(3):
        vectors = np.zeros_like(angles)
        vectors[:, axis] = angles[:, axis]
        turns.append(from_vector(vectors))
    return turns[2] @ turns[1] @ turns[0]


def to_rpy(rotation: Floats) -> tuple[float, float, float]:
    """Roll, pitch and yaw of one rotation (3, 3), in radians; yaw is 0 where only a sum of roll and yaw is defined."""
    pitch = float(np.arctan2(-rotation[2, 0], np.hypot(rotation[0, 0], rotation[1, 0])))
    if np.hypot(rotation[0, 0], rotation[1, 0]) < 1e-9:
        return float(np.arctan2(-rotation[1, 2], rotation[1, 1])), pitch, 0.0
    roll = float(np.arctan2(rotation[2, 1], rotation[2, 2]))
    return roll, pitch, float(np.arctan2(rotation[1, 0], rotation[0, 0]))


def to_vector(rotations: Floats) -> Floats:
    """Rotation vectors (N, 3) of rotations, of length up to pi."""
    skew = np.stack([rotations[:, i, j] - rotations[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))], axis=1) / 2
    sine = np.linalg.norm(skew, axis=1)
    cosine = (np.trace(rotations, axis1=1, axis2=2) - 1) / 2
    angle = np.arctan2(sine, cosine)
    with np.errstate(divide="ignore", invalid="ignore"):
        found = skew * np.where(sine > 1e-8, angle / sine, 1.0)[:, None]
    # Near half a turn the axis is the column of R + I with the largest diagonal.
    for row in np.flatnonzero((sine < 1e-5) & (cosine < 0)):
        column = int(np.argmax(np.diagonal(rotations[row])))
        axis = rotations[row][:, column] + np.eye(3)[column]
        axis /= np.linalg.norm(axis)
        found[row] = axis * angle[row] * (1.0 if axis @ skew[row] >= 0 else -1.0)
    return np.asarray(found)


def left_jacobian(vector: Floats) -> Floats:
    """Return the matrix J (3, 3) with Exp(v + dv) = Exp(J dv) Exp(v), of one rotation vector."""
    angle = float(np.linalg.norm(vector))
    k = cross(vector[None])[0]
    third = 1 / 6 if angle < _SMALL else (angle - np.sin(angle)) / angle**3
    found: Floats = np.eye(3) + np.sinc(angle / 2 / np.pi) ** 2 / 2 * k + third * k @ k
    return found


def right_jacobian_inverse(vectors: Floats) -> Floats:
    """Return the matrices (N, 3, 3) with log(Exp(v) Exp(d)) = v + J d to first order."""
    angle = np.linalg.norm(vectors, axis=1)
    k = cross(vectors)
    safe = np.where(angle < _SMALL, 1.0, angle)
    third = np.where(angle < _SMALL, 1 / 12, 1 / safe**2 - (1 + np.cos(safe)) / (2 * safe * np.sin(safe)))
    return np.asarray(np.eye(3) + k / 2 + third[:, None, None] * k @ k)


SHARE = 0.01
"""What counts as one unit of a parameter: this share of the reach for a length, this many radians for an angle."""


@dataclass(frozen=True, slots=True)
class Arm:
    """An arm whose numbers can be varied.

    Attributes:
        names: What is varied: parameters of the kernels, then numbers of base and tool.
        start: Their values in the file, (P,), in radians and the file's length unit.
        units: What counts as one unit of each, (P,).
        reach: Upper bound of the distance of the frame from the base.
        frame: The measured frame; empty for the tool.
    """

    robot: Robot
    names: tuple[str, ...]
    start: Floats
    units: Floats
    reach: float
    backend: str
    frame: str
    _package: ModuleType
    _functions: tuple[str, str]
    _columns: tuple[int, ...]
    _base: Floats
    _tool: Floats

    def poses(self, values: Floats, q: Floats) -> Floats:
        """Return poses (N, 4, 4) of the measured frame at joint vectors (N, dof)."""
        base, tool = self._corrections(values)
        found: Floats = base @ self._kernel(values, q) @ tool
        return found

    def derivatives(self, values: Floats, q: Floats) -> tuple[Floats, Floats, Floats]:
        """Return poses and their derivatives.

        Returns:
            Poses (N, 4, 4); derivatives of the position (N, 3, P); rotation vectors of the derivatives of the
            orientation (N, 3, P), dR = [w]x R; all in the axes of the base.
        """
        base, tool = self._corrections(values)
        inner = self._kernel(values, q)
        poses: Floats = base @ inner @ tool
        linear, angular = np.zeros((2, len(q), 3, len(self.names)))
        kernels = len(self._columns)
        if kernels:
            columns = np.asarray(getattr(self._package, self._functions[1])(q, params=self._params(values)))
            # Its columns are the varied parameters, in the order of `names`.
            columns = columns.reshape(len(q), 6, kernels)
            lever = inner[:, :3, :3] @ tool[:3, 3]
            linear[..., :kernels] = base[:3, :3] @ (columns[:, :3] - cross(lever) @ columns[:, 3:])
            angular[..., :kernels] = base[:3, :3] @ columns[:, 3:]
        self._add_base(values, poses, linear, angular)
        self._add_tool(values, base @ inner, poses, linear, angular)
        return poses, linear, angular

    def dimension(self, name: str) -> Dimension:
        """Return what a varied number measures."""
        return _dimension(name, {parameter.name: parameter.dimension for parameter in self.robot.parameters})

    def with_base(self, values: Floats, base: Floats) -> Floats:
        """Return the values with another base (4, 4), as far as its numbers are varied."""
        turn = to_vector((base @ np.linalg.inv(self._base))[None, :3, :3])[0]
        return self._with_mount(values, BASE_NAMES, np.r_[base[:3, 3] - self._base[:3, 3], turn])

    def base(self, values: Floats) -> Floats:
        """Return the base (4, 4) with its correction."""
        found: Floats = self._corrections(values)[0] @ self._base
        return found

    def tool(self, values: Floats) -> Floats:
        """Return the tool (4, 4) with its correction."""
        found: Floats = self._tool @ self._corrections(values)[1]
        return found

    def _with_mount(self, values: Floats, names: tuple[str, ...], numbers: Floats) -> Floats:
        found = values.copy()
        for name, number in zip(names, numbers, strict=True):
            if name in self.names:
                found[self.names.index(name)] = number
        return found

    def _numbers(self, values: Floats, names: tuple[str, ...]) -> Floats:
        """Return the six numbers of a correction; what is not varied is zero."""
        by_name = dict(zip(self.names, values, strict=True))
        return np.array([by_name.get(name, 0.0) for name in names])

    def _corrections(self, values: Floats) -> tuple[Floats, Floats]:
        """Return what stands in front of the kernel and behind it, (4, 4) each."""
        numbers = self._numbers(values, BASE_NAMES)
        base, tool = np.eye(4), np.eye(4)
        base[:3, :3] = from_vector(numbers[None, 3:])[0]
        base[:3, 3] = self._base[:3, 3] + numbers[:3] - base[:3, :3] @ self._base[:3, 3]
        numbers = self._numbers(values, TOOL_NAMES)
        tool[:3, :3] = from_vector(numbers[None, 3:])[0]
        tool[:3, 3] = self._tool[:3, :3].T @ numbers[:3]
        return base, tool

    def _kernel(self, values: Floats, q: Floats) -> Floats:
        found = getattr(self._package, self._functions[0])(q, params=self._params(values))
        return np.asarray(found).reshape(len(q), 4, 4)

    def _params(self, values: Floats) -> tuple[float, ...] | None:
        if not self._columns:
            return None
        numbers = list(self._package.Params())
        for place, column in enumerate(self._columns):
            numbers[column] = float(values[place])
        found: tuple[float, ...] = self._package.Params(*numbers)
        return found

    def _add_base(self, values: Floats, poses: Floats, linear: Floats, angular: Floats) -> None:
        numbers = self._numbers(values, BASE_NAMES)
        jacobian = left_jacobian(numbers[3:])
        arms = -cross(poses[:, :3, 3] - self._base[:3, 3] - numbers[:3]) @ jacobian
        for column, name in enumerate(self.names):
            if name in BASE_NAMES[:3]:
                linear[:, BASE_NAMES.index(name), column] = 1.0
            elif name in BASE_NAMES[3:]:
                axis = BASE_NAMES.index(name) - 3
                linear[..., column] = arms[..., axis]
                angular[..., column] = jacobian[:, axis]

    def _add_tool(self, values: Floats, inner: Floats, poses: Floats, linear: Floats, angular: Floats) -> None:
        numbers = self._numbers(values, TOOL_NAMES)
        flange = inner[:, :3, :3] @ self._tool[:3, :3].T
        # The right Jacobian is the left one of the opposite vector.
        turns = poses[:, :3, :3] @ left_jacobian(-numbers[3:])
        for column, name in enumerate(self.names):
            if name in TOOL_NAMES[:3]:
                linear[..., column] = flange[..., TOOL_NAMES.index(name)]
            elif name in TOOL_NAMES[3:]:
                angular[..., column] = turns[..., TOOL_NAMES.index(name) - 3]


def make_arm(prepared: Prepared, choice: Choice, frame: str = "") -> Arm:
    """Compile the kernels of an arm; an empty frame is the tool."""
    # All that is varied is an argument of the kernels, so they are compiled once.
    robot = with_runtime_entries(prepared.robot, prepared.names) if prepared.names else prepared.robot
    where = measured_frame(robot, frame)
    quantities = (Quantity(Kind.POSE, frame=where), Quantity(Kind.PARAMETER_JACOBIAN, frame=where))
    kernels = lower_robot(robot, quantities if prepared.names else quantities[:1])
    package = make_package(kernels)
    varied = [parameter.name for parameter in robot.varied_parameters] if prepared.names else []
    names = (*varied, *choice.base, *choice.tool)
    defaults = package.Params()._asdict() if varied else {}
    dimensions = {parameter.name: parameter.dimension for parameter in robot.parameters}
    # Base and tool stay outside of the kernels, since they may be varied.
    span = reach(robot)
    links = links_of(robot, values_of(robot, [0.0] * robot.dof, None, FLOATS), FLOATS)
    return Arm(
        robot=robot,
        names=names,
        start=np.array([defaults.get(name, 0.0) for name in names], dtype=np.float64),
        units=np.array([SHARE * (span if _dimension(name, dimensions) is Dimension.LENGTH else 1.0) for name in names]),
        reach=span,
        backend=str(package.backend),
        frame=where,
        _package=package,
        _functions=(quantities[0].function, quantities[1].function),
        _columns=tuple(package.Params._fields.index(name) for name in varied),
        _base=_fixed(links[""]),
        _tool=np.eye(4) if robot.is_tree else _fixed(links[TOOL_WORD]),
    )


def _dimension(name: str, dimensions: dict[str, Dimension]) -> Dimension:
    if name in dimensions:
        return dimensions[name]
    return Dimension.ANGLE if name in (*BASE_NAMES[3:], *TOOL_NAMES[3:]) else Dimension.LENGTH


def _fixed(matrix: Floats) -> Floats:
    """Return one transform of the reference; it has the shape of a batch."""
    return np.asarray(np.array(matrix, dtype=np.float64).reshape(-1, 4, 4)[0])
