"""The tip of a robot as a function to call: its position kernel, compiled for this machine.

In: a robot with its position program. Out: a callable from joint vectors to points, both joint-major.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinegen import reference
from kinegen.emit.kernels import Kernels
from kinegen.errors import KinegenError
from kinegen.ir.program import Program, Temporary, Variable
from kinegen.outputs import Kind, Quantity
from kinegen.robot.model import TOOL, JointType, Robot
from kinegen.workspace.package import make_package

FloatArray = NDArray[np.float64]

WRIST_CENTRE = "wrist_centre"
"""The point where the axes of the last three joints meet, as data sheets quote the reach of an arm."""

_PLACES, _NEAR = 16, 1e-9
"""Joint vectors at which a wrist is looked at, and how far its centre may move, of its distance from the base."""


@dataclass(frozen=True, slots=True)
class Tip:
    """One tip of a robot.

    Attributes:
        name: Its frame: a tip, a link or a named frame.
        dof: Length of the joint vector.
        movers: Places in the joint vector of those variables on which the tip's position depends.
        position: Joint vectors (dof, N), in radians and lengths, to points (3, N) in the base frame.
        backend: What evaluates: `c`, or `numpy` without a compiler.
    """

    name: str
    dof: int
    movers: tuple[int, ...]
    position: Callable[[FloatArray], FloatArray]
    backend: str


def position_of(robot: Robot, name: str | None = None) -> Quantity:
    """The output that gives the position of a tip, a link or a named frame.

    Args:
        robot: The robot.
        name: A frame, or `WRIST_CENTRE`; None for the tip of a chain.

    Returns:
        The output.

    Raises:
        KinegenError: If there is no such frame, there are several tips and none is named, or no frame is at the wrist
            centre.
    """
    frames = robot.frame_names
    if name is None and robot.is_tree:
        raise KinegenError(f"{robot.name} has {len(robot.tips)} tips; choose one with --tip ({', '.join(robot.tips)})")
    if name is None or name == TOOL:
        return Quantity.POSITION
    if name == WRIST_CENTRE and name not in frames:
        return Quantity(Kind.POSITION, frame=_wrist_centre(robot))
    if name not in frames:
        raise KinegenError(f"unknown tip {name!r} (expected {', '.join((*frames, WRIST_CENTRE))})")
    return Quantity(Kind.POSITION, frame=name)


def find_tip(kernels: Kernels) -> Tip:
    """Compile the position kernel of a robot.

    Args:
        kernels: The robot and its position program for one frame, the only one.

    Returns:
        The tip.
    """
    program = kernels.programs[0]
    kernel = getattr(make_package(kernels), program.quantity.function)

    def position(q: FloatArray) -> FloatArray:
        points: FloatArray = kernel(q, layout="joint_major", threads=1)
        return points

    (frame,) = program.signature.frames
    return Tip(frame, kernels.robot.dof, _movers(program), position, str(kernel.backend))


def _wrist_centre(robot: Robot) -> str:
    """The frame whose origin stays where it is, as a point of the tool, whichever of the last three joints turns."""
    last = robot.variables[-3:]
    if not robot.is_tree and len(last) == 3 and all(variable.type is JointType.REVOLUTE for variable in last):
        q = np.random.default_rng(1).uniform(-1, 1, (_PLACES, robot.dof))
        before = reference.frames(robot, q)
        moves = []
        for variable in last:
            after = reference.frames(robot, q + np.eye(robot.dof)[variable.index])
            moves.append(after[TOOL] @ np.linalg.inv(before[TOOL]))
        for name in robot.frame_names:
            origin = before[name][:, :, 3:]
            near = _NEAR * float(np.abs(origin[:, :3]).max())
            if all(np.abs(move @ origin - origin).max() <= near for move in moves):
                return name
    raise KinegenError(f"{robot.name} has no frame where the axes of its last three joints meet")


def _movers(program: Program) -> tuple[int, ...]:
    """The inputs that the outputs depend on, in order."""
    wanted = set(program.outputs)
    for statement in reversed(program.statements):
        if not wanted.isdisjoint(map(Temporary, statement.results)):
            wanted.update(statement.operands)
    return tuple(sorted(operand.index for operand in wanted if isinstance(operand, Variable)))
