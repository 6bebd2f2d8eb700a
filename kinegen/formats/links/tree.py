"""Links and joints as URDF and MJCF describe them, with exact numbers: what their readers share.

A joint's frame is at `origin` in the frame of its parent link. The joint moves about or along `axis`, given in that
frame, and `after` leads on to the frame of the child link.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction

from kinegen.formats.links.rotations import Vector
from kinegen.older import StrEnum
from kinegen.robot.expressions import ZERO, Expression
from kinegen.robot.model import Step


class Motion(StrEnum):
    """How the child link of a joint moves."""

    REVOLUTE = "revolute"
    CONTINUOUS = "continuous"
    PRISMATIC = "prismatic"
    FIXED = "fixed"


@dataclass(frozen=True, slots=True)
class Mimic:
    """A joint that follows another one: `multiplier * master + offset`; without a master it stays at the offset."""

    master: str
    multiplier: Fraction
    offset: Expression


@dataclass(frozen=True, slots=True)
class Link:
    """A body.

    Attributes:
        name: As written.
        line: Line of the file.
    """

    name: str
    line: int


@dataclass(frozen=True, slots=True)
class Joint:
    """What holds a link on another one.

    Attributes:
        name: As written.
        line: Line of the file.
        motion: How it moves; empty for a motion that kinegen does not have, such as floating.
        parent: The link that it is on.
        child: The link that it moves.
        origin: From the frame of the parent to that of the joint.
        axis: About or along which it moves.
        limits: Of its variable, in radians or lengths.
        mimic: The joint that it follows.
        zero: What is added to the variable.
        after: From the frame of the joint, moved, to that of the child.
        refused: Why the joint cannot be carried, with what to do, if it cannot.
    """

    name: str
    line: int
    motion: Motion
    parent: str
    child: str
    origin: tuple[Step, ...] = ()
    axis: Vector = (Fraction(1), Fraction(0), Fraction(0))
    limits: tuple[Expression, Expression] | None = None
    mimic: Mimic | None = None
    zero: Expression = ZERO
    after: tuple[Step, ...] = ()
    refused: str = ""


@dataclass(frozen=True, slots=True)
class Suspect:
    """A number that is nearly something else, before its effect is known.

    Attributes:
        line: Its line.
        where: Where it is.
        text: As printed.
        exact: What it became, or what it is near to.
        digits: How far apart, in units of the last printed digit.
        gap: How far apart, in radians or lengths.
        turns: Whether it is an angle.
        joint: Name of the joint whose origin or axis it is part of.
        changed: Whether the exact value was taken.
    """

    line: int
    where: str
    text: str
    exact: str
    digits: float
    gap: float
    turns: bool
    joint: str
    changed: bool


@dataclass(frozen=True, slots=True)
class LinkTree:
    """What a file says, with every name checked to be used once.

    Attributes:
        name: Of the robot, as written.
        links: In the order of the file.
        joints: In the order of the file.
        suspects: Numbers that are nearly something else.
        notes: What was left out or chosen, one sentence each.
        degrees: Whether people get its angles in degrees.
    """

    name: str
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    suspects: tuple[Suspect, ...] = field(default=())
    notes: tuple[str, ...] = ()
    degrees: bool = False
