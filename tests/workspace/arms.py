"""Arms whose workspaces are known, and their surveys."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.python.formula import emit_formula
from kinegen.derive.dispatch import derive
from kinegen.io.load import load, loads
from kinegen.ir.lower import lower, runtime_defaults
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import Robot
from kinegen.tools.workspace.options import SurveyOptions
from kinegen.tools.workspace.sampling import Workspace, survey
from kinegen.tools.workspace.tip_samples import FloatArray, Tip, find_tip, joint_ranges

ROBOTS = Path(__file__).resolve().parents[2] / "robots"

HEAD = "kinegen: 1\nname: arm\nconvention: standard\nunits: {length: m, angle: deg}\njoints:\n"

TWO_LINKS = """\
  - {name: shoulder, theta: q, d: 0, a: 0.5, alpha: 0}
  - {name: elbow, theta: q, d: 0, a: 0.3, alpha: 0}
"""
SECTOR = TWO_LINKS.replace("a: 0.5", "limits: [-90, 90], a: 0.5").replace("a: 0.3", "limits: [0, 180], a: 0.3")
TILTED = TWO_LINKS + "base: {xyz: [0.1, 0.2, 0.3], rpy: [30, 40, 50]}\n"
THREE_LINKS = """\
  - {name: one, theta: q, d: 0, a: 1, alpha: 0}
  - {name: two, theta: q, d: 0, a: 0.6, alpha: 0}
  - {name: three, theta: q, d: 0, a: 0.2, alpha: 0}
"""
SHELL = """\
  - {name: turn, ets: [Rz(q)]}
  - {name: lift, ets: [Ry(q)]}
  - {name: out, ets: [Tx(q)], limits: [0.5, 1]}
"""
SPHERE = """\
  - {name: turn, ets: [Rz(q)]}
  - {name: lift, ets: [Ry(q), Tx(0.5)]}
"""
BOX = """\
  - {name: x, ets: [Tx(q)], limits: [-0.4, 0.6]}
  - {name: y, ets: [Ty(q)], limits: [0, 0.8]}
  - {name: z, ets: [Tz(q)], limits: [1, 1.5]}
"""
RING = TWO_LINKS + "  - {name: stroke, ets: [Tz(q)], limits: [0.1, 0.7]}\n"
CIRCLE = "  - {name: turn, theta: q, d: 0.2, a: 0.5, alpha: 0}\n"
LINE = "  - {name: slide, ets: [Tx(q)], limits: [0.3, 1]}\n"
CLIMB = """\
  - {name: turn, theta: q, d: 0, a: 0.3, alpha: 0}
  - {name: climb, ets: [Tz(0.1*turn)]}
"""
RING_WITH_ROLL = RING + "  - {name: roll, ets: [Rz(q)]}\n"
POINT = "  - {name: spin, ets: [Rz(q), Tz(0.4)]}\n"


@cache
def robot(joints: str) -> Robot:
    """A robot of `robots/` by its name, or one with these joints."""
    return loads(HEAD + joints, "arm.yaml") if "\n" in joints else load(ROBOTS / f"{joints}.yaml")


@cache
def kernels(joints: str, kind: Kind) -> RobotPrograms:
    """It and one of its programs."""
    found = robot(joints)
    return RobotPrograms(found, (lower(derive(found, Quantity(kind))),), runtime_defaults(found))


@cache
def tip(joints: str) -> Tip:
    """Its tip."""
    return find_tip(kernels(joints, Kind.POSITION))


def formula_tip(robot: Robot) -> Tip:
    """The first tip of a robot, evaluated by the NumPy form of its kernel, which takes no compiler."""
    program = lower(derive(robot, Quantity.POSITION))
    namespace: dict[str, Any] = {}
    text = emit_formula(RobotPrograms(robot, (program,), ()))["_numpy.py"]
    exec(compile(text, "_numpy.py", "exec"), namespace)  # noqa: S102 - our own output

    def position(q: FloatArray) -> FloatArray:
        return np.stack([np.broadcast_to(row, q.shape[1:]) for row in namespace["position"](q)[:3]])

    return Tip(robot.tips[0], robot.dof, tuple(range(robot.dof)), position, "numpy")


@cache
def surveyed(joints: str, samples: int = 200_000, voxel: float | None = None, seed: int = 0) -> Workspace:
    """A survey of it."""
    options = SurveyOptions(samples, voxel, seed)
    return survey(robot(joints), tip(joints), joint_ranges(robot(joints)), options)


def measured(workspace: Workspace) -> float:
    """Length, area or volume."""
    assert workspace.tally is not None
    measure = workspace.tally.counts[2].measure
    assert measure is not None
    return measure
