"""An arm that is nearly of a family: its own axes, and how far each condition of the family fails."""

from __future__ import annotations

from dataclasses import dataclass

from kinegen.symbolic.inverse.axes import Axes

SINGULAR_PER_DEFECT = 12.0
"""Branches may merge where the least singular value of the Jacobian is below so many times the defect.

Of 950,000 random targets of a calibrated UR5, 2.1 % lost a branch, all of them below 9.0 times the defect.
"""

SINGULAR_PER_DEFECT_OF_FOUR = 36.0
"""The same where two axes meet before a third anywhere: the angle of that is a root of an equation of degree four.

Of 60,000 random targets of a Gen3 with its first joint given, 2.7 % lost a branch, all below 26.5 times the defect; of
a GEN72 with its last joint given 0.2 %, below 20.8 times.
"""


@dataclass(frozen=True, slots=True)
class Failing:
    """One condition of a family that an arm meets only nearly.

    Attributes:
        text: The condition, such as `axes 2, 3, 4 are parallel`.
        amount: How far it fails: radians, or the length unit of the file.
        is_angle: Whether it is an angle.
    """

    text: str
    amount: float
    is_angle: bool


@dataclass(frozen=True, slots=True)
class Defect:
    """What an arm is apart from the nearest one of a family.

    Attributes:
        axes: The arm's own axes, from the base to the tool.
        failing: The conditions that fail.
        angle: The largest angle between an axis and that of the arm of the family, in radians.
        length: The largest distance between an axis and that of the arm of the family, where other axes meet it.
        of_four: Whether the family solves an equation of degree four, whose roots merge in more ways.
    """

    axes: Axes
    failing: tuple[Failing, ...]
    angle: float
    length: float
    of_four: bool = False

    def singular_below(self, reach: float) -> float:
        """The least singular value of the Jacobian, lengths by the reach, below which branches may merge."""
        return (SINGULAR_PER_DEFECT_OF_FOUR if self.of_four else SINGULAR_PER_DEFECT) * self.size(reach)

    def size(self, reach: float) -> float:
        """The larger of the angle and of the length by the reach."""
        return max(self.angle, self.length / reach)
