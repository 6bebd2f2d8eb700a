"""Both solutions of a five-axis machine, found from poses alone: a second way, which knows no axis of the table.

What the reference gives at a few joint vectors decides everything: the component of the tool axis along the first
rotary axis is a constant, a cosine and a sine of the second joint, and three samples give these; the point is linear in
the joints that shift.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from kinegen.model.robot import JointType, Robot
from kinegen.support.dataclass import dataclass
from kinegen.verify.reference import Kinematics
from kinegen.verify.samples import FloatArray, random_joints


@dataclass(frozen=True)
class Sampled:
    """A machine by its poses."""

    robot: Robot  # The robot, with the values of the runtime parameters that are tried
    way: str  # Tool and workpiece, as `tool/workpiece`

    def poses(self, q: FloatArray) -> FloatArray:
        """Poses of the tool in the frame of the workpiece, shape (N, 4, 4)."""
        return np.asarray(Kinematics(self.robot, q).pose(self.way), dtype=np.float64)

    @cached_property
    def turning(self) -> tuple[int, int]:
        """The places of the joints that turn, the one whose axis is at rest in the workpiece first."""
        places = [each.index for each in self.robot.variables if each.type is not JointType.PRISMATIC]
        apart = np.ptp(Kinematics(self.robot, random_joints(self.robot, 2)).jacobian(self.way)[:, 3:, places], axis=0)
        first = int(np.abs(apart).max(axis=0).argmin())
        return places[first], places[1 - first]

    @cached_property
    def axis(self) -> FloatArray:
        """Angular velocity of the tool at unit rate of the first joint."""
        jacobian = Kinematics(self.robot, np.zeros((1, self.robot.dof))).jacobian(self.way)
        return np.asarray(jacobian[0, 3:, self.turning[0]])

    @cached_property
    def rate(self) -> float:
        """Radians for one unit of the second joint, positive."""
        jacobian = Kinematics(self.robot, np.zeros((1, self.robot.dof))).jacobian(self.way)
        return float(np.linalg.norm(jacobian[0, 3:, self.turning[1]]))

    @cached_property
    def wave(self) -> tuple[float, float, float]:
        """Constant, cosine and sine of the component of the tool axis along the first rotary axis."""
        q = np.zeros((3, self.robot.dof))
        q[:, self.turning[1]] = np.array([0, np.pi / 2, np.pi]) / self.rate
        ahead, square, behind = self.poses(q)[:, :3, 2] @ self.axis / np.linalg.norm(self.axis)
        middle = (ahead + behind) / 2
        return float(middle), float(ahead - middle), float(square - middle)

    def cosines(self, axes: FloatArray) -> FloatArray:
        """The cosine of the second joint from where the tool is nearest to the first axis; beyond 1 out of reach."""
        middle, cosine, sine = self.wave
        along = axes @ self.axis / np.linalg.norm(self.axis)
        found: FloatArray = (along - middle) / np.hypot(cosine, sine)
        return found

    def solutions(self, points: FloatArray, axes: FloatArray) -> FloatArray:
        """Joint vectors, forward and backward, shape (N, 2, dof); angles are up to whole turns, NaN out of reach."""
        _, cosine, sine = self.wave
        with np.errstate(invalid="ignore"):
            swing = np.arccos(self.cosines(axes))
        lead = np.arctan2(sine, cosine)
        both = [self._solved(points, axes, (lead + sign * swing) / self.rate) for sign in (1, -1)]
        return np.stack(both, axis=1)

    def _solved(self, points: FloatArray, axes: FloatArray, second: FloatArray) -> FloatArray:
        first_place, second_place = self.turning
        q = np.zeros((len(points), self.robot.dof))
        q[:, second_place] = second
        start, unit = self.poses(q)[:, :3, 2], self.axis / np.linalg.norm(self.axis)
        across = np.cross(start, axes) @ unit
        along = (start * axes).sum(axis=1) - (start @ unit) * (axes @ unit)
        q[:, first_place] = np.arctan2(across, along) / np.linalg.norm(self.axis)
        places = [place for place in range(self.robot.dof) if place not in self.turning]
        origin = self.poses(q)[:, :3, 3]
        columns = [self.poses(q + np.eye(self.robot.dof)[place])[:, :3, 3] - origin for place in places]
        matrices = np.stack(columns, axis=2)
        with np.errstate(invalid="ignore"):
            q[:, places] = np.linalg.solve(np.nan_to_num(matrices), (points - origin)[..., None])[..., 0]
        return q
