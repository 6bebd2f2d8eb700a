"""The tip of a robot as a function to call: its position kernel, compiled for this machine.

In: a robot with its position program. Out: a callable from joint vectors to points, both joint-major.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kinegen.emit.kernels import Kernels
from kinegen.errors import KinegenError
from kinegen.ir.program import Program, Temporary, Variable
from kinegen.workspace.package import make_package

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Tip:
    """One tip of a robot.

    Attributes:
        name: Its frame.
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


def find_tip(kernels: Kernels, name: str | None = None) -> Tip:
    """Compile the position kernel of a robot for one of its tips.

    Args:
        kernels: The robot and its position program, the only one.
        name: Which tip of a tree; a chain has but one.

    Returns:
        The tip.

    Raises:
        KinegenError: If there is no such tip, or there are several and none is named.
    """
    tips = kernels.robot.tips
    if name is None and len(tips) > 1:
        raise KinegenError(f"{kernels.robot.name} has {len(tips)} tips; choose one with --tip ({', '.join(tips)})")
    if name is not None and name not in tips:
        raise KinegenError(f"unknown tip {name!r} (expected {', '.join(tips)})")
    place = 0 if name is None else tips.index(name)
    package, kept = make_package(kernels), slice(3 * place, 3 * place + 3)

    def position(q: FloatArray) -> FloatArray:
        points: FloatArray = package.position(q, layout="joint_major", threads=1)[kept]
        return points

    movers = _movers(kernels.programs[0], kept)
    return Tip(tips[place], kernels.robot.dof, movers, position, str(package.backend))


def _movers(program: Program, kept: slice) -> tuple[int, ...]:
    """The inputs that some of the outputs depend on, in order."""
    wanted = set(program.outputs[kept])
    for statement in reversed(program.statements):
        if Temporary(statement.name) in wanted:
            wanted.update(statement.operands)
    return tuple(sorted(operand.index for operand in wanted if isinstance(operand, Variable)))
