"""Random models as MJCF text with their poses: a plain evaluation in floats, with nothing of kinegen."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tests.formats.plain import shift, turn


@dataclass(frozen=True)
class Orientation:
    """An orientation as MJCF writes it: the attribute, its numbers."""

    form: str
    numbers: tuple[str, ...]

    @property
    def attribute(self) -> str:
        """As MJCF, with a space before it."""
        return f' {self.form}="{" ".join(self.numbers)}"'

    def matrix(self, *, degrees: bool, sequence: str) -> np.ndarray:
        """What the manual of MuJoCo says that it means."""
        values = [float(number) for number in self.numbers]
        unit = math.radians(1) if degrees else 1.0
        match self.form:
            case "quat":
                w, *vector = np.array(values) / np.linalg.norm(values)
                angle = 2 * math.atan2(float(np.linalg.norm(vector)), w)
                return turn(np.array(vector), angle) if any(vector) else np.eye(4)
            case "axisangle":
                return turn(np.array(values[:3]), values[3] * unit)
            case "euler":
                pose = np.eye(4)
                for letter, value in zip(sequence, values, strict=True):
                    step = turn(np.eye(3)["xyz".index(letter.lower())], value * unit)
                    pose = pose @ step if letter.islower() else step @ pose
                return pose
            case "zaxis":
                z = np.array(values) / np.linalg.norm(values)
                axis = np.cross([0, 0, 1], z)
                if not axis.any():
                    axis = np.array([1.0, 0, 0])
                return turn(axis, math.atan2(math.hypot(z[0], z[1]), z[2]))
            case _:
                x, y = np.array(values[:3]), np.array(values[3:])
                x = x / np.linalg.norm(x)
                y = y - x * (x @ y)
                y = y / np.linalg.norm(y)
                pose = np.eye(4)
                pose[:3, :3] = np.column_stack([x, y, np.cross(x, y)])
                return pose


@dataclass(frozen=True)
class Hinge:
    """A joint of a body."""

    name: str
    slides: bool
    position: tuple[str, ...]
    axis: tuple[str, ...]
    reference: str

    @property
    def text(self) -> str:
        """As MJCF."""
        kind, position, axis = "slide" if self.slides else "hinge", " ".join(self.position), " ".join(self.axis)
        return f'<joint name="{self.name}" type="{kind}" pos="{position}" axis="{axis}" ref="{self.reference}"/>\n'

    def matrix(self, value: float, *, degrees: bool) -> np.ndarray:
        """The transform of the body, for a value in radians or metres."""
        reference = float(self.reference) * (math.radians(1) if degrees and not self.slides else 1.0)
        axis = np.array([float(each) for each in self.axis])
        if self.slides:
            return shift(axis / np.linalg.norm(axis) * (value - reference))
        anchor = np.array([float(each) for each in self.position])
        return shift(anchor) @ turn(axis, value - reference) @ shift(-anchor)


@dataclass(frozen=True)
class Body:
    """A body, with the place of its parent in the list, or -1 for the world."""

    parent: int
    position: tuple[str, ...]
    orientation: Orientation | None
    joints: tuple[Hinge, ...]


@dataclass(frozen=True)
class Model:
    """A whole model; parents are before their children."""

    bodies: tuple[Body, ...]
    degrees: bool
    sequence: str

    @property
    def text(self) -> str:
        """As MJCF."""
        angle = "degree" if self.degrees else "radian"
        world = "".join(self._body(i) for i, body in enumerate(self.bodies) if body.parent < 0)
        head = f'<compiler angle="{angle}" eulerseq="{self.sequence}"/>'
        return f'<mujoco model="random">\n{head}\n<worldbody>\n{world}</worldbody>\n</mujoco>\n'

    def _body(self, place: int) -> str:
        body = self.bodies[place]
        turned, position = body.orientation, " ".join(body.position)
        orientation = turned.attribute if turned else ""
        joints = "".join(joint.text for joint in body.joints)
        inside = "".join(self._body(i) for i, other in enumerate(self.bodies) if other.parent == place)
        inertia = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>\n'
        inside = inertia + joints + inside
        return f'<body name="b{place}" pos="{position}"{orientation}>\n{inside}</body>\n'

    def poses(self, q: dict[str, float]) -> dict[str, np.ndarray]:
        """The pose of each body in the world."""
        found: list[np.ndarray] = []
        for body in self.bodies:
            pose = np.eye(4) if body.parent < 0 else found[body.parent]
            pose = pose @ shift(np.array([float(each) for each in body.position]))
            if body.orientation is not None:
                pose = pose @ body.orientation.matrix(degrees=self.degrees, sequence=self.sequence)
            for joint in body.joints:
                pose = pose @ joint.matrix(q[joint.name], degrees=self.degrees)
            found.append(pose)
        return {f"b{i}": pose for i, pose in enumerate(found)}
