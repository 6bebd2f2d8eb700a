"""What the tests of the doctor share: poses of a robot, rounded and written as a person would."""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal
from pathlib import Path

import numpy as np

from kinegen.io.load import loads
from kinegen.tools.doctor.observed_poses import THREE, Line, Observations, Said, numbers_of, observations
from kinegen.verify import reference

ROBOTS = Path(__file__).resolve().parent.parent.parent / "robots"
COLUMNS = {
    "": (),
    "rpy": ("roll", "pitch", "yaw"),
    "rotation_vector": ("rx", "ry", "rz"),
    "wxyz": ("qw", "qx", "qy", "qz"),
}


def robot_text(name: str) -> str:
    """The text of one of our robots."""
    return (ROBOTS / f"{name}.yaml").read_text(encoding="utf-8")


def some_joints(text: str, count: int = 6, seed: int = 1) -> np.ndarray:
    """Joint values in whole degrees or hundredths of a length, shape (count, dof)."""
    robot = loads(text, "arm.yaml")
    rng = np.random.default_rng(seed)
    turned = rng.integers(-150, 150, (count, robot.dof)).astype(float)
    moved = rng.integers(0, 60, (count, robot.dof)) / 100
    prismatic = np.array([variable.type == "prismatic" for variable in robot.variables])
    return np.where(prismatic, moved, turned)


def lines(text: str, joints: np.ndarray, form: str = "rpy", decimals: int = 4, frame: str = "tool") -> list[Line]:
    """What the robot of a text does: angles in degrees, lengths in the unit of the file, rounded."""
    robot = loads(text, "arm.yaml")
    units = np.array([1.0 if variable.type == "prismatic" else np.pi / 180 for variable in robot.variables])
    poses = reference.frames(robot, joints * units)[frame]
    numbers = numbers_of(form, poses[:, :3, :3]) if form else np.zeros((len(poses), 0))
    if form in THREE:
        numbers = np.degrees(numbers)
    places = 2 if form in THREE else 5
    return [
        Line(
            tuple(Decimal(f"{value:g}") for value in q),
            tuple(Decimal(f"{value:.{decimals}f}") for value in pose[:3, 3]),
            tuple(Decimal(f"{value:.{places}f}") for value in turned),
            place,
        )
        for place, (q, pose, turned) in enumerate(zip(joints, poses, numbers, strict=True), start=1)
    ]


def observed(text: str, found: Sequence[Line], said: Said | None = None, form: str = "") -> Observations:
    """Lines as the doctor gets them with the robot of a text."""
    return observations(loads(text, "arm.yaml"), found, said or Said(), form)


def csv(text: str, found: Sequence[Line], form: str = "rpy") -> str:
    """The same lines as a CSV file."""
    names = [variable.name for variable in loads(text, "arm.yaml").variables]
    head = ",".join([*names, "x", "y", "z", *COLUMNS[form]])
    rows = [",".join(map(str, (*line.joints, *line.position, *line.orientation))) for line in found]
    return "\n".join([head, *rows, ""])


def same_robot(first: str, second: str, frame: str = "tool") -> bool:
    """Whether two texts describe the same poses, in radians and in the unit of each."""
    one, two = loads(first, "arm.yaml"), loads(second, "arm.yaml")
    q = np.random.default_rng(5).uniform(-2, 2, (16, one.dof))
    difference = reference.frames(one, q)[frame] - reference.frames(two, q)[frame]
    return bool(np.abs(difference).max() < 1e-9)
