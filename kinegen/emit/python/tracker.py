"""The inverse along a path in the public module: its numbers as Python text."""

from __future__ import annotations

from kinegen.emit.c.inverse_tracker import strides
from kinegen.emit.inverse import allowed, branches_of
from kinegen.emit.kernels import Kernels
from kinegen.emit.python.context import Tracking
from kinegen.emit.reals import Real
from kinegen.emit.tracking import given_joint
from kinegen.outputs import POSE_AND_JACOBIAN
from kinegen.robot.extent import reach


def tracking_of(kernels: Kernels) -> Tracking:
    """What the template of the public module prints.

    Args:
        kernels: The robot and its programs, its inverse among them.
    """
    robot, branches = kernels.robot, branches_of(kernels)
    if branches is None:
        raise ValueError("arms without a closed form are refused before this")
    rigid = tuple(allowed(branches.rigid, real) for real in (Real.DOUBLE, Real.FLOAT))
    return Tracking(
        kernel=POSE_AND_JACOBIAN.function,
        strides=repr(tuple(map(float, strides(robot)))),
        reach=repr(float(reach(robot, robot.tips))),
        rigid=repr(rigid) if branches.reads_attitude else "None",
        given=repr(given_joint(robot, branches)),
    )
