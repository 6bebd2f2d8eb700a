"""The constructors: the text is executed with small stand-ins of the libraries that multiply what they are given."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from kinegen.errors import KinegenError
from kinegen.io import link_writers
from kinegen.io.load import load
from kinegen.model.robot import Robot
from kinegen.tools.compare.frame_differences import poses, units_of
from tests.formats.test_write_urdf import shift, turn

FOLDER = Path(__file__).parents[2] / "robots"
NAMES = ["puma560", "ur5", "panda", "stanford", "puma560_mm", "jaco2", "xarm6", "scara", "al5d", "cylindrical_arm"]


def expected(robot: Robot, q: np.ndarray) -> np.ndarray:
    return poses(robot, "tool", q[None])[0]


def joint_vector(robot: Robot) -> np.ndarray:
    return np.linspace(0.1, 0.9, robot.dof)


@pytest.mark.parametrize("name", NAMES)
def test_robotics_toolbox(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = load(FOLDER / f"{name}.yaml")
    q = joint_vector(robot)

    class Elementary:
        """Stands in for `ET`: a value, or the next entry of q with or without its sign turned."""

    def maker(kind: str, axis: int):  # noqa: ANN202
        def make(value: float | None = None, flip: bool = False):  # noqa: ANN202
            return kind, axis, value, flip

        return staticmethod(make)

    for kind in "Rt":
        for axis, letter in enumerate("xyz"):
            setattr(Elementary, f"{kind}{letter}", maker(kind, axis))
    module = ModuleType("roboticstoolbox")
    module.ET, module.ETS = Elementary, list  # type: ignore[attr-defined]
    module.Robot = lambda ets, name: SimpleNamespace(ets=ets, name=name)  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "roboticstoolbox", module)
    space: dict[str, object] = {}
    exec(link_writers.write_toolbox(robot), space)  # noqa: S102
    made = space["make_robot"]()  # type: ignore[operator]

    found, entries = np.eye(4), iter(q)
    for kind, axis, value, flip in made.ets:
        amount = value if value is not None else (-1 if flip else 1) * next(entries)
        found = found @ (turn(axis, amount) if kind == "R" else shift(amount * np.eye(3)[axis]))

    assert made.name == robot.name
    assert np.abs(found - expected(robot, q)).max() < 1e-14
    if all(variable.limits for variable in robot.variables):
        assert np.shape(made.qlim) == (2, robot.dof)


@pytest.mark.parametrize("name", NAMES)
def test_matlab(name: str) -> None:
    """The text is read line by line, as MATLAB's documentation defines the functions in it."""
    robot = load(FOLDER / f"{name}.yaml")
    q = iter(joint_vector(robot))
    number = r"\[([^\]]*)\]"
    found: dict[str, np.ndarray] = {}
    body, kind, pose, axis = "", "", np.eye(4), 1.0
    for line in link_writers.write_matlab(robot).splitlines():
        if match := re.match(r"robot.BaseName = '(\w+)'", line):
            found[match[1]] = np.eye(4)
        elif match := re.match(r"body = rigidBody\('(\w+)'\)", line):
            body, axis = match[1], 1.0
        elif match := re.match(r"joint = rigidBodyJoint\('\w+', '(\w+)'\)", line):
            kind = match[1]
        elif match := re.match(
            rf"setFixedTransform\(joint, trvec2tform\({number}\) \* eul2tform\({number}, 'ZYX'\)\)", line
        ):
            xyz, (yaw, pitch, roll) = ([float(each) for each in group.split(",")] for group in match.groups())
            pose = shift(np.array(xyz)) @ turn(2, yaw) @ turn(1, pitch) @ turn(0, roll)
        elif match := re.match(r"joint.JointAxis = \[0, 0, (-?1)\]", line):
            axis = float(match[1])
        elif match := re.match(r"addBody\(robot, body, '(\w+)'\)", line):
            move = np.eye(4)
            if kind != "fixed":
                amount = axis * next(q)
                move = turn(2, amount) if kind == "revolute" else shift(np.array([0, 0, amount]))
            found[body] = found[match[1]] @ pose @ move

    assert np.abs(found["tool"] - expected(robot, joint_vector(robot))).max() < 1e-14


class SE3:
    """Stands in for `pin.SE3`."""

    def __init__(self, rotation: np.ndarray, position: np.ndarray) -> None:
        self.pose = np.eye(4)
        self.pose[:3, :3], self.pose[:3, 3] = rotation, position

    @staticmethod
    def Identity() -> SE3:  # noqa: N802 - the library's name
        """No rotation and no shift."""
        return SE3(np.eye(3), np.zeros(3))

    def __mul__(self, other: SE3) -> SE3:
        product = self.pose @ other.pose
        return SE3(product[:3, :3], product[:3, 3])


class Model:
    """Stands in for `pin.Model`, with the poses at one joint vector."""

    def __init__(self, q: np.ndarray) -> None:
        self.q, self.poses, self.frames = q, [np.eye(4)], {}
        self.joints = [SimpleNamespace(idx_q=-1)]
        self.lowerPositionLimit, self.upperPositionLimit = np.full(len(q), -9.0), np.full(len(q), 9.0)

    def addJoint(self, parent: int, joint: tuple[str, np.ndarray], placement: SE3, name: str) -> int:  # noqa: N802
        """A joint behind another one."""
        assert name
        value = self.q[len(self.poses) - 1]
        move = shift(value * joint[1]) if joint[0] == "t" else turn(2, value * joint[1][2])
        self.joints.append(SimpleNamespace(idx_q=len(self.poses) - 1))
        self.poses.append(self.poses[parent] @ placement.pose @ move)
        return len(self.poses) - 1

    def addFrame(self, frame: tuple[str, int, SE3]) -> None:  # noqa: N802
        """A frame on a joint."""
        self.frames[frame[0]] = self.poses[frame[1]] @ frame[2].pose


@pytest.mark.parametrize("name", [*NAMES, "planar_joint"])
def test_pinocchio(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = load(FOLDER / f"{name}.yaml")
    q = joint_vector(robot)
    module = ModuleType("pinocchio")
    parts = {
        "SE3": SE3,
        "Model": lambda: Model(q),
        "JointModelRevoluteUnaligned": lambda axis: ("R", axis),
        "JointModelPrismaticUnaligned": lambda axis: ("t", axis),
        "Frame": lambda name, joint, placement, _: (name, joint, placement),
        "FrameType": SimpleNamespace(OP_FRAME=0),
        "rpy": SimpleNamespace(rpyToMatrix=lambda r, p, y: (turn(2, y) @ turn(1, p) @ turn(0, r))[:3, :3]),
    }
    for key, part in parts.items():
        setattr(module, key, part)
    monkeypatch.setitem(sys.modules, "pinocchio", module)
    space: dict[str, object] = {}
    exec(link_writers.write_pinocchio(robot), space)  # noqa: S102

    made = space["make_model"]()  # type: ignore[operator]

    assert np.abs(made.frames["tool"] - expected(robot, q)).max() < 1e-14
    for variable, low in zip(robot.variables, made.lowerPositionLimit, strict=True):
        assert (low != -9.0) == (variable.limits is not None)
    assert len(units_of(robot)) == len(made.poses) - 1


def test_followers_and_trees_are_one_line() -> None:
    for write in (link_writers.write_toolbox, link_writers.write_pinocchio, link_writers.write_matlab):
        with pytest.raises(KinegenError, match="joint level_shoulder follows shoulder"):
            write(load(FOLDER / "palletiser.yaml"))
    with pytest.raises(KinegenError, match="has 5 tips"):
        link_writers.write_toolbox(load(FOLDER / "hand.yaml"))
