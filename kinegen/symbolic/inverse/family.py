"""The families of arms that have a closed-form inverse, with the constants that their formulas need.

The records say how an arm is built; the modules `solve_...` turn each into formulas. Joints are directed here as the
formulas want them, so that a rate may have changed its sign against the table.
"""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from kinegen.older import StrEnum
from kinegen.symbolic.fold import Vector
from kinegen.symbolic.inverse.axes import Axes, JointAxis
from kinegen.symbolic.inverse.defect import Defect
from kinegen.symbolic.inverse.exact import Rotation
from kinegen.symbolic.inverse.geometry import Planar, Waist, Wrist


class Aim(StrEnum):
    """What of a target an arm is solved for."""

    POSE = "pose"
    POSITION = "position"


@dataclass(frozen=True, slots=True)
class ElbowArm:
    """A waist, and two parallel axes that carry a point: PUMA's first three joints.

    Attributes:
        waist: The first joint.
        shoulder: The second joint.
        elbow: The third, parallel to the second and directed like it.
        end: The point that is carried, in the base frame.
        upper: From axis 2 to axis 3, across both, in the axes of the waist's second frame.
        lower: From axis 3 to the point.
        depth: Of the point along axis 2.
    """

    waist: Waist
    shoulder: JointAxis
    elbow: JointAxis
    end: Vector
    upper: Planar
    lower: Planar
    depth: sp.Expr


@dataclass(frozen=True, slots=True)
class StrokeArm:
    """A waist, an axis, and a stroke at right angles to that axis: Stanford's first three joints.

    Attributes:
        waist: The first joint.
        shoulder: The second joint.
        stroke: The third, which shifts.
        end: The point that is carried, in the base frame.
        start: From axis 2 to the point at q = 0, across the axis, in the axes of the waist's second frame.
        heading: Direction of the stroke, in the same axes.
        depth: Of the point along axis 2.
    """

    waist: Waist
    shoulder: JointAxis
    stroke: JointAxis
    end: Vector
    start: Planar
    heading: Planar
    depth: sp.Expr


@dataclass(frozen=True, slots=True)
class GimbalArm:
    """Two axes that meet, and a third anywhere: the shoulder of a Panda, seen from its hand.

    Attributes:
        waist: The first joint; its axis and the second one meet, so that its offset is 0.
        shoulder: The second joint.
        elbow: The third.
        end: The point that is carried, in the base frame.
        frame: Columns of a frame whose z axis is axis 3.
        upper: From where axes 1 and 2 meet to axis 3, across axis 3, in the axes of the frame.
        lower: From axis 3 to the point, likewise.
        depth: From where axes 1 and 2 meet to the point, along axis 3.
    """

    waist: Waist
    shoulder: JointAxis
    elbow: JointAxis
    end: Vector
    frame: Rotation
    upper: Planar
    lower: Planar
    depth: sp.Expr


@dataclass(frozen=True, slots=True)
class ColumnArm:
    """A turn, a lift along its axis and a reach across it, the lift anywhere: the cylindrical arm.

    Attributes:
        turn: The joint that turns.
        lift: The joint that shifts along the axis, directed like it.
        stroke: The joint that shifts across the axis.
        frame: Columns of a frame whose z axis is the axis.
        end: The point that is carried, in the base frame.
        start: From a point of the axis to the point at q = 0, in the axes of the frame.
        heading: Direction of the reach, in the axes of the frame.
    """

    turn: JointAxis
    lift: JointAxis
    stroke: JointAxis
    frame: Rotation
    end: Vector
    start: Vector
    heading: Planar


@dataclass(frozen=True, slots=True)
class GantryArm:
    """Three shifts: the Cartesian arm.

    Attributes:
        joints: The three.
        end: The point that is carried, in the base frame.
        inverse: Rows of the inverse of the matrix of their directions.
    """

    joints: tuple[JointAxis, JointAxis, JointAxis]
    end: Vector
    inverse: Rotation


Arm = ElbowArm | GimbalArm | StrokeArm | ColumnArm | GantryArm


@dataclass(frozen=True, slots=True)
class PointArm:
    """An arm of three joints that puts a point in its place; the attitude is what it is."""

    arm: Arm


@dataclass(frozen=True, slots=True)
class WristArm:
    """An arm of three joints and a spherical wrist."""

    arm: Arm
    wrist: Wrist


@dataclass(frozen=True, slots=True)
class FlatArm:
    """Two or three parallel axes, and possibly a shift along them anywhere: planar arms and SCARA.

    Attributes:
        turns: The joints that turn, directed alike.
        lift: The joint that shifts, directed like them, or None.
        frame: Columns of a frame whose z axis is theirs.
        upper: From the first axis to the second, in the axes of the frame.
        lower: From the second to the point that is put in its place: the third axis, or the tool.
        end: That point, in the base frame.
    """

    turns: tuple[JointAxis, ...]
    lift: JointAxis | None
    frame: Rotation
    upper: Planar
    lower: Planar
    end: Vector


@dataclass(frozen=True, slots=True)
class TripleArm:
    """A waist, three parallel axes, and a hand of one or two joints: AL5D and the UR type.

    Attributes:
        waist: The first joint.
        turns: The three parallel joints, directed alike.
        upper: From the first of them to the second, in the axes of the waist's second frame.
        lower: From the second to the third.
        hand: From the third to the point `end`.
        depth: Of that point along the three axes.
        end: A point on the axis of joint 5, which joint 6 does not move either, in the base frame.
        roll: The fifth joint of an arm of five, or None.
        wrist: The last of the parallel joints with joints 5 and 6 of an arm of six, or None.
    """

    waist: Waist
    turns: tuple[JointAxis, JointAxis, JointAxis]
    upper: Planar
    lower: Planar
    hand: Planar
    depth: sp.Expr
    end: Vector
    roll: JointAxis | None
    wrist: Wrist | None


@dataclass(frozen=True, slots=True)
class SphericalArm:
    """A spherical shoulder, an elbow and a spherical wrist: seven joints, solved with the arm angle.

    Attributes:
        shoulder: The first three joints.
        elbow: The fourth; the centres of shoulder and wrist are in one plane square to its axis.
        wrist: The last three joints.
        frame: Columns of a frame whose z axis is axis 4.
        upper: From the shoulder's centre to axis 4, across it, in the axes of the frame.
        lower: From axis 4 to the wrist's centre, likewise.
    """

    shoulder: Wrist
    elbow: JointAxis
    wrist: Wrist
    frame: Rotation
    upper: Planar
    lower: Planar


PlainBuild = PointArm | WristArm | FlatArm | TripleArm
"""The arms of at most six joints, whose words are in `names`."""

Build = PlainBuild | SphericalArm


@dataclass(frozen=True, slots=True)
class Held:
    """The joints that an inverse is given.

    Attributes:
        names: In the order in which their values are given.
        first: Those at the beginning of the chain from base to tool, in its order.
        last: Those at its end, in its order.
        beside: Those that do not move the tool.
    """

    names: tuple[str, ...]
    first: tuple[JointAxis, ...]
    last: tuple[JointAxis, ...]
    beside: tuple[JointAxis, ...]

    @property
    def joints(self) -> tuple[JointAxis, ...]:
        """In the order of their values."""
        known = {joint.name: joint for joint in (*self.first, *self.last, *self.beside)}
        return tuple(known[name] for name in self.names)


@dataclass(frozen=True, slots=True)
class Family:
    """An arm whose inverse is known in closed form.

    Attributes:
        name: What people call such arms.
        build: How it is built.
        axes: Its chain at q = 0, in the direction in which it is solved.
        aim: What of a target decides.
        branches: Names of the solutions, in order.
        meanings: What the words in these names mean; sentences.
        conditions: What a target must be besides within reach, and what is chosen where there is a choice; sentences.
        redundancy: What is given besides the target: joints, which are not in `axes`, with commas between them, or the
            arm angle; else empty.
        held: These joints, as in the whole chain from base to tool.
        defect: What the arm is apart from one of the family, where it is only nearly one; `axes` are of that one.
    """

    name: str
    build: Build
    axes: Axes
    aim: Aim
    branches: tuple[str, ...]
    meanings: tuple[str, ...]
    conditions: tuple[str, ...]
    redundancy: str = ""
    held: Held | None = None
    defect: Defect | None = None

    @property
    def is_reversed(self) -> bool:
        """Whether the chain is solved from the tool to the base."""
        return self.axes.is_reversed

    @property
    def chain(self) -> tuple[int, ...]:
        """The numbers of the joints from base to tool, those that are given among them."""
        own = self.axes.numbers[::-1] if self.is_reversed else self.axes.numbers
        if self.held is None:
            return own
        first, last = ([joint.number for joint in joints] for joints in (self.held.first, self.held.last))
        return (*first, *own, *last)

    @property
    def joints(self) -> tuple[JointAxis, ...]:
        """The joints in the order of the joint vector, those that are given among them."""
        joints = (*self.axes.joints, *self.held.joints) if self.held else self.axes.joints
        return tuple(sorted(joints, key=lambda joint: joint.number))
