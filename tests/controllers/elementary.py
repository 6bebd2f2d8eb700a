"""Arms as products of elementary transforms, and as the links and joints that a URDF would have: nothing of kinegen."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

Numbers = NDArray[np.float64]

METRES = {"m": 1.0, "mm": 0.001}


def turn(axis: int, angle: float) -> Numbers:
    """A rotation about one axis, as a (4, 4) matrix."""
    c, s = math.cos(angle), math.sin(angle)
    first, second = (axis + 1) % 3, (axis + 2) % 3
    pose = np.eye(4)
    pose[first, first] = pose[second, second] = c
    pose[first, second], pose[second, first] = -s, s
    return pose


def shift(*xyz: float) -> Numbers:
    """A translation."""
    pose = np.eye(4)
    pose[:3, 3] = xyz
    return pose


def about(axis: Numbers, angle: float) -> Numbers:
    """A rotation about a unit vector, by the formula of Rodrigues."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    pose = np.eye(4)
    pose[:3, :3] += math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    return pose


@dataclass(frozen=True)
class Joint:
    """A joint: a constant transform, a motion along or about an axis, and a constant transform."""

    name: str
    turns: bool
    sign: float
    before: Numbers
    after: Numbers
    limits: tuple[float, float] | None


def joints_of(path: Path, parameters: Mapping[str, float] = MappingProxyType({})) -> list[Joint]:
    """The joints of a file in convention `standard` or `modified`, in metres and radians.

    Args:
        path: The file.
        parameters: Values of parameters other than those of the file, in its units.
    """
    file = yaml.safe_load(path.read_text(encoding="utf-8"))
    unit = math.radians(1.0) if file["units"]["angle"] == "deg" else 1.0
    metres = METRES[file["units"]["length"]]
    known: dict[str, float] = {"pi": math.pi}
    for name, text in file.get("parameters", {}).items():
        usual = value_of(text["value"] if isinstance(text, dict) else text, known)
        known[name] = parameters.get(name, usual)
    made: list[Joint] = []
    for row in file["joints"]:
        theta, d = ([value_of(row[key], {**known, "q": q}) for q in (0.0, 1.0)] for key in ("theta", "d"))
        link = shift(value_of(row["a"], known) * metres, 0, 0), turn(0, value_of(row["alpha"], known) * unit)
        rest = turn(2, theta[0] * unit) @ shift(0, 0, d[0] * metres)
        sign = (theta[1] - theta[0]) or (d[1] - d[0])
        if file["convention"] == "modified":
            before, after = link[1] @ link[0] @ rest, np.eye(4)
        else:
            before, after = np.eye(4), rest @ link[0] @ link[1]
        if not sign:  # a row without a joint
            last = made.pop()
            made.append(Joint(last.name, last.turns, last.sign, last.before, last.after @ before @ after, last.limits))
            continue
        turns = theta[0] != theta[1]
        limits = tuple(value_of(each, known) * (unit if turns else metres) for each in row.get("limits", ()))
        made.append(Joint(row["name"], turns, sign, before, after, limits or None))  # type: ignore[arg-type]
    return made


def value_of(text: Any, names: Mapping[str, float]) -> float:
    """A number, or an expression of our own files."""
    return float(eval(str(text), {"__builtins__": {}}, dict(names)))  # noqa: S307 - our text


class Model:
    """An arm on a pedestal with a gripper, and with frames of links that are not those of the table.

    Every frame is turned at random about any axis and shifted along the axis of its joint, as in a URDF.
    """

    def __init__(
        self, path: Path, seed: int = 1, gripper: bool = True, parameters: Mapping[str, float] = MappingProxyType({})
    ) -> None:
        rng = np.random.default_rng(seed)
        self.joints = joints_of(path, parameters)
        own = [shift(0, 0, rng.uniform(-0.2, 0.2)) @ self._any(rng, 0.0) for _ in self.joints]
        self.mount = self._any(rng, 0.5)
        base = self._any(rng, 0.3)
        self.origins, self.axes = [], []
        behind = base
        for joint, frame in zip(self.joints, own, strict=True):
            self.origins.append(behind @ joint.before @ frame)
            self.axes.append(frame[:3, :3].T @ np.array([0.0, 0.0, joint.sign]))
            behind = np.linalg.inv(frame) @ joint.after
        self.tip = behind @ (self._any(rng, 0.2) if gripper else np.eye(4))

    @staticmethod
    def _any(rng: np.random.Generator, size: float) -> Numbers:
        axis = rng.normal(size=3)
        return shift(*rng.uniform(-size, size, 3)) @ about(axis / np.linalg.norm(axis), rng.uniform(0.2, 3.0))

    @property
    def names(self) -> list[str]:
        """Names of the joints, with a dash where the robot file has an underscore."""
        return [joint.name.replace("_", "-") for joint in self.joints]

    def lines(self, order: Sequence[int] = (), kind: str = "chain") -> list[str]:
        """What the program is given of the model; the group is called arm."""
        lines = ["root world", joint_line("mount", "fixed", "world", "pedestal", self.mount, (0, 0, 1), None)]
        parent = "pedestal"
        parts = zip(self.joints, self.names, self.origins, self.axes, strict=True)
        for k, (joint, name, origin, axis) in enumerate(parts):
            type_ = "revolute" if joint.turns else "prismatic"
            lines.append(joint_line(name, type_, parent, f"link{k + 1}", origin, axis, joint.limits))
            parent = f"link{k + 1}"
        lines.append(joint_line("gripper_joint", "fixed", parent, "gripper", self.tip, (0, 0, 1), None))
        names = [self.names[k] for k in order or range(len(self.joints))]
        return [*lines, " ".join(["group arm", kind, *names, "gripper_joint"])]

    def poses(self, q: Sequence[float] | Numbers) -> dict[str, Numbers]:
        """Poses of all links in the base of the group, at joint values in the order of the file."""
        pose = np.eye(4)
        found = {"pedestal": pose}
        for k, (joint, origin, axis) in enumerate(zip(self.joints, self.origins, self.axes, strict=True)):
            motion = about(axis, q[k]) if joint.turns else shift(*(q[k] * axis))
            pose = pose @ origin @ motion
            found[f"link{k + 1}"] = pose
        return {**found, "gripper": pose @ self.tip}

    def random(self, rng: np.random.Generator) -> Numbers:
        """Joint values within the limits."""
        limits = [joint.limits or (-math.pi, math.pi) for joint in self.joints]
        return np.array([rng.uniform(low, high) for low, high in limits])


def joint_line(
    name: str, kind: str, parent: str, child: str, origin: Numbers, axis: Sequence[float] | Numbers,
    limits: tuple[float, float] | None,
) -> str:  # fmt: skip
    """A joint as the program reads it."""
    numbers = [*origin[:3].ravel(), *axis, *(limits or ())]
    return " ".join(["joint", name, kind, parent, child, *(repr(float(each)) for each in numbers)])


def quaternion(pose: Numbers) -> tuple[float, float, float, float]:
    """x, y, z, w of a rotation, from the largest of the four."""
    r = pose[:3, :3]
    squares = np.array([1 + r[0, 0] - r[1, 1] - r[2, 2], 1 - r[0, 0] + r[1, 1] - r[2, 2],
                        1 - r[0, 0] - r[1, 1] + r[2, 2], 1 + np.trace(r)])  # fmt: skip
    products = np.array([
        [squares[0], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0], r[2, 1] - r[1, 2]],
        [r[0, 1] + r[1, 0], squares[1], r[1, 2] + r[2, 1], r[0, 2] - r[2, 0]],
        [r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], squares[2], r[1, 0] - r[0, 1]],
        [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], squares[3]],
    ])  # fmt: skip
    row = products[int(np.argmax(squares))]
    x, y, z, w = row / np.linalg.norm(row)
    return float(x), float(y), float(z), float(w)


def pose_of(row: Sequence[float]) -> Numbers:
    """A (4, 4) matrix from a position and a quaternion x, y, z, w."""
    x, y, z, w = row[3:]
    half = math.hypot(x, y, z)
    pose = about(np.array([x, y, z]) / half, 2 * math.atan2(half, w)) if half else np.eye(4)
    pose[:3, 3] = row[:3]
    return pose


def pose_line(pose: Numbers) -> str:
    """A pose as the program reads it."""
    return "pose " + " ".join(repr(float(each)) for each in (*pose[:3, 3], *quaternion(pose)))
