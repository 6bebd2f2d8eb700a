"""The families of arms that have a closed-form inverse, with the constants that their formulas need.

The records say how an arm is built; the modules `solve_...` turn each into formulas. Joints are directed as the
formulas want them, so that a rate may have changed its sign against the table. The point `end` that an arm carries, and
the columns of a `frame`, are in the base frame at q = 0. Links `upper` and `lower` lead across the axes of the elbow,
to its axis and from there to `end`; the `depth` is that of `end` along these axes.
"""

from __future__ import annotations

import sympy as sp

from kinegen.derive.folding import Vector
from kinegen.derive.inverse.axes import Axes, JointAxis
from kinegen.derive.inverse.exact_geometry import Rotation
from kinegen.derive.inverse.geometry import Planar, Waist, Wrist
from kinegen.derive.inverse.nearest_family import Defect
from kinegen.support.compat import StrEnum
from kinegen.support.dataclass import dataclass


class Aim(StrEnum):
    """What of a target an arm is solved for."""

    POSE = "pose"
    POSITION = "position"


@dataclass(frozen=True, slots=True)
class ElbowArm:
    """A waist, and two parallel axes that carry a point: PUMA's first three joints.

    The elbow is directed like the shoulder. Links and depth are in the axes of the waist's second frame.
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

    `start` leads from axis 2 to the point at q = 0, across the axis, and `heading` is the direction of the stroke, both
    in the axes of the waist's second frame.
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

    Axes 1 and 2 meet, so that the waist's offset is 0. `upper` and `depth` begin where they do; both links are in the
    axes of `frame`, whose z axis is axis 3.
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

    The lift is directed like the axis, which is the z axis of `frame`. In its axes are `start`, from a point of the
    axis to the point that is carried at q = 0, and `heading`, the direction of the reach.
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
    """Three shifts: the Cartesian arm; `inverse` has the rows of the inverse of the matrix of their directions."""

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

    All joints are directed alike, along the z axis of `frame`, in whose axes the links are. `end` is the point that is
    put in its place: on the third axis, or the tool.
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

    The parallel joints are directed alike. The links between them and the `hand`, from the third to `end`, are in the
    axes of the waist's second frame. `end` is on the axis of joint 5, and joint 6 does not move it either. An arm of
    five joints has the fifth as its `roll`, one of six the last parallel joint with joints 5 and 6 as its `wrist`; the
    other is None.
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

    The centres of shoulder and wrist are in one plane square to axis 4, the z axis of `frame`. In its axes, the links
    lead from the shoulder's centre to axis 4, across it, and from there to the wrist's centre.
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


def elbow_of(build: Build) -> tuple[JointAxis, Planar, Planar] | None:
    """Return the joint between the two links of an arm, and the links; None where it has no elbow."""
    match build:
        case PointArm(ElbowArm() | GimbalArm() as arm) | WristArm(ElbowArm() | GimbalArm() as arm):
            return arm.elbow, arm.upper, arm.lower
        case FlatArm() | TripleArm():
            return build.turns[1], build.upper, build.lower
        case SphericalArm():
            return build.elbow, build.upper, build.lower
        case _:
            return None


def wrist_of(build: Build) -> Wrist | None:
    """Return the wrist of an arm; None where it has none."""
    return build.wrist if isinstance(build, WristArm | TripleArm | SphericalArm) else None


@dataclass(frozen=True, slots=True)
class Held:
    """The joints that an inverse is given: those first and last on the chain from base to tool, and those beside it.

    `names` has the order in which their values are given, the other fields that of the chain.
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
        name: The usual name of such arms.
        axes: Its chain at q = 0, in the direction in which it is solved.
        aim: The part of a target that decides.
        branches: Names of the solutions, in order.
        meanings: Sentences that explain the words in these names.
        conditions: Sentences on what a target must be besides within reach, and on what is chosen where there is a
            choice.
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
