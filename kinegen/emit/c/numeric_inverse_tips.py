"""What the templates of a search for several tips are given: `hand_numeric_inverse.c` and its batch."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction

from kinegen.emit.reals import Real
from kinegen.emit.search import TUNING
from kinegen.emit.tips import ROWS, tips_of
from kinegen.naming import macro
from kinegen.robot.model import Robot


@dataclass(frozen=True, slots=True)
class TipsContext:
    """The structure of a tree as C text.

    Attributes:
        count: Number of tips.
        macro: The macro that counts them.
        groups: Number of groups of tips that share joints.
        size: Rows of the damped equations.
        by_joints: Whether these have a row for each joint.
        is_moved: Which joints move a tip.
        tip_groups: The group of each tip.
        joint_groups: The group of each joint.
        first: For each row of their matrix, the first entry that is not always zero.
        ones: A weight of 1 for each part of each tip.
        heaviest: The largest weight.
        greatest: The same as text for readers.
    """

    count: int
    macro: str
    groups: int
    size: int
    by_joints: bool
    is_moved: str
    tip_groups: str
    joint_groups: str
    first: str
    ones: str
    heaviest: str
    greatest: str


def tips_context(robot: Robot, real: Real) -> TipsContext | None:
    """The structure of a tree; None for an arm, whose search has one target.

    Args:
        robot: The robot.
        real: The number type.
    """
    if not robot.is_tree:
        return None
    tips, one = tips_of(robot), real.literal(Fraction(1))
    return TipsContext(
        count=len(tips.moving),
        macro=macro(robot.name, "TIPS"),
        groups=tips.groups,
        size=robot.dof if tips.by_joints else ROWS * len(tips.moving),
        by_joints=tips.by_joints,
        is_moved=_array(_array(f"{int(j in joints)}U" for j in range(robot.dof)) for joints in tips.moving),
        tip_groups=_array(f"{group}U" for group in tips.tip_groups),
        joint_groups=_array(f"{group}U" for group in tips.joint_groups),
        first=_array(f"{column}U" for column in tips.first),
        ones=_array(f"{{{one}, {one}}}" for _ in tips.moving),
        heaviest=real.literal(TUNING.heaviest),
        greatest=f"{float(TUNING.heaviest):.0e}",
    )


def _array(items: Iterable[str]) -> str:
    return f"{{{', '.join(items)}}}"
