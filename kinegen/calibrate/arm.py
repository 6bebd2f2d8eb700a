"""The arm to be fitted: poses of the measured frame and their derivatives by everything that is varied.

The table is evaluated by the kernels that a build emits, compiled for this machine where there is a compiler. Base and
tool are corrections to what the file says, with derivatives of their own: base = [Exp(w) R0 | t0 + t], tool likewise
with Exp(w) behind R0.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from kinegen.calibrate.choice import BASE_NAMES, TOOL_NAMES, Choice, measured_frame
from kinegen.calibrate.options import TOOL_WORD
from kinegen.calibrate.parallel import Prepared
from kinegen.calibrate.rotations import cross, from_vector, left_jacobian, to_vector
from kinegen.outputs import Kind, Quantity
from kinegen.pipeline import lower_robot
from kinegen.reference.chain import links_of, values_of
from kinegen.reference.numbers import FLOATS
from kinegen.robot.calibrated import calibrated
from kinegen.robot.dimension import Dimension
from kinegen.robot.extent import reach
from kinegen.robot.model import Robot
from kinegen.workspace.package import make_package

Floats = NDArray[np.float64]

SHARE = 0.01
"""What counts as one unit of a parameter: this share of the reach for a length, this many radians for an angle."""


@dataclass(frozen=True, slots=True)
class Arm:
    """An arm whose numbers can be varied.

    Attributes:
        robot: The robot of the kernels, with all that is varied of the table as runtime parameters.
        names: What is varied: parameters of the kernels, then numbers of base and tool.
        start: Their values in the file, (P,), in radians and the file's length unit.
        units: What counts as one unit of each, (P,).
        reach: Upper bound of the distance of the frame from the base.
        backend: What evaluates: `c` or `numpy`.
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
        """Poses (N, 4, 4) of the measured frame at joint vectors (N, dof)."""
        base, tool = self._corrections(values)
        found: Floats = base @ self._kernel(values, q) @ tool
        return found

    def derivatives(self, values: Floats, q: Floats) -> tuple[Floats, Floats, Floats]:
        """Poses and their derivatives.

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
            linear[..., :kernels] = base[:3, :3] @ (columns[:, :3] + _turned(columns[:, 3:], lever))
            angular[..., :kernels] = base[:3, :3] @ columns[:, 3:]
        self._add_base(values, poses, linear, angular)
        self._add_tool(values, base @ inner, poses, linear, angular)
        return poses, linear, angular

    def is_angle(self, name: str) -> bool:
        """Whether a varied number is an angle."""
        return _is_angle(name, {parameter.name: parameter.dimension for parameter in self.robot.parameters})

    def with_base(self, values: Floats, base: Floats) -> Floats:
        """The values with another base (4, 4), as far as its numbers are varied."""
        return self._with_mount(values, BASE_NAMES, np.r_[base[:3, 3] - self._base[:3, 3], _log(base @ self._inv_base)])

    def base(self, values: Floats) -> Floats:
        """The base (4, 4) with its correction."""
        found: Floats = self._corrections(values)[0] @ self._base
        return found

    def tool(self, values: Floats) -> Floats:
        """The tool (4, 4) with its correction."""
        found: Floats = self._tool @ self._corrections(values)[1]
        return found

    @property
    def _inv_base(self) -> Floats:
        return np.asarray(np.linalg.inv(self._base), dtype=np.float64)

    def _with_mount(self, values: Floats, names: tuple[str, ...], numbers: Floats) -> Floats:
        found = values.copy()
        for name, number in zip(names, numbers, strict=True):
            if name in self.names:
                found[self.names.index(name)] = number
        return found

    def _numbers(self, values: Floats, names: tuple[str, ...]) -> Floats:
        """The six numbers of a correction; what is not varied is zero."""
        by_name = dict(zip(self.names, values, strict=True))
        return np.array([by_name.get(name, 0.0) for name in names])

    def _corrections(self, values: Floats) -> tuple[Floats, Floats]:
        """What stands in front of the kernel and behind it, (4, 4) each."""
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
    """Compile the kernels of an arm.

    Args:
        prepared: The robot, and what is varied of its table.
        choice: What is varied of base and tool.
        frame: The measured frame; empty for the tool.
    """
    robot = calibrated(prepared.robot, prepared.names) if prepared.names else prepared.robot
    where = measured_frame(robot, frame)
    quantities = (Quantity(Kind.POSE, frame=where), Quantity(Kind.PARAMETER_JACOBIAN, frame=where))
    kernels = lower_robot(robot, quantities if prepared.names else quantities[:1])
    package = make_package(kernels)
    varied = [parameter.name for parameter in robot.varied_parameters] if prepared.names else []
    names = (*varied, *choice.base, *choice.tool)
    defaults = package.Params()._asdict() if varied else {}
    dimensions = {parameter.name: parameter.dimension for parameter in robot.parameters}
    span = reach(robot)
    links = links_of(robot, values_of(robot, [0.0] * robot.dof, None, FLOATS), FLOATS)
    return Arm(
        robot=robot,
        names=names,
        start=np.array([defaults.get(name, 0.0) for name in names], dtype=np.float64),
        units=np.array([SHARE * (1.0 if _is_angle(name, dimensions) else span) for name in names]),
        reach=span,
        backend=str(package.backend),
        frame=where,
        _package=package,
        _functions=(quantities[0].function, quantities[1].function),
        _columns=tuple(package.Params._fields.index(name) for name in varied),
        _base=_fixed(links[""]),
        _tool=np.eye(4) if robot.is_tree else _fixed(links[TOOL_WORD]),
    )


def _is_angle(name: str, dimensions: dict[str, Dimension]) -> bool:
    if name in dimensions:
        return dimensions[name] is not Dimension.LENGTH
    return name in (*BASE_NAMES[3:], *TOOL_NAMES[3:])


def _fixed(matrix: Floats) -> Floats:
    """One transform of the reference; it has the shape of a batch."""
    return np.asarray(np.array(matrix, dtype=np.float64).reshape(-1, 4, 4)[0])


def _log(transform: Floats) -> Floats:
    return np.asarray(to_vector(transform[None, :3, :3])[0])


def _turned(angular: Floats, lever: Floats) -> Floats:
    """The motion of a point at levers (N, 3) from the frame while it turns, (N, 3, P)."""
    return np.asarray(-cross(lever) @ angular)
