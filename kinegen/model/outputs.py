"""The kinematic quantities that kernels are built for, and the arrays that kernels take and give."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import ClassVar

from kinegen.errors import KinegenError, did_you_mean
from kinegen.model.branches import Branches
from kinegen.support.compat import StrEnum
from kinegen.support.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class Array:
    """One argument of a kernel, an input or a result, as Python sees it for one configuration.

    Attributes:
        name: What it is called, such as `q` or `base_T_tool`.
        shape: Its shape, such as (6,) or (4, 4).
        is_pose: Whether it holds homogeneous matrices, whose last row is 0 0 0 1; shape then ends in (4, 4).
        per_frame: Whether its first axis counts the frames (or tips) of the program.
        per_branch: Whether its first axis counts the branches of an inverse.
        is_truth: Whether its numbers are truth values, 1 or 0.
        words: What it holds, where its name does not say that.
    """

    name: str
    shape: tuple[int, ...]
    is_pose: bool = False
    per_frame: bool = False
    per_branch: bool = False
    is_truth: bool = False
    words: str = ""

    @property
    def size(self) -> int:
        """Numbers that are computed or read: of each 4x4 matrix the upper three rows."""
        return math.prod(self.shape) * 3 // 4 if self.is_pose else math.prod(self.shape)

    @property
    def is_point(self) -> bool:
        """Tell whether it is where a frame is."""
        return "_p_" in self.name and self.shape[-1:] == (3,)

    @property
    def blocks(self) -> int:
        """Return how often the innermost block occurs: frames, branches, or 1."""
        return self.shape[0] if self.in_blocks else 1

    @property
    def in_blocks(self) -> bool:
        """Tell whether C has it as an array of blocks, one for each frame or branch."""
        return self.per_frame or self.per_branch

    @property
    def stored(self) -> int:
        """Numbers of one block as they lie in memory, the constant last row of a matrix among them."""
        return math.prod(self.shape[1:] if self.in_blocks else self.shape)


REDUNDANCY = Array("redundancy", ())
"""What an inverse is given besides the pose: the value of a joint, or the arm angle."""


def redundancy_arrays(units: Sequence[tuple[str, str]]) -> tuple[Array, ...]:
    """Return the argument for what an inverse is given besides the pose: none, a number, or a vector.

    Args:
        units: Names of joints and the units of their values, in order.
    """
    if len(units) < 2:
        return (REDUNDANCY,) * len(units)
    words = ", ".join(f"[{place}] {name} in {unit}" for place, (name, unit) in enumerate(units))
    return (Array(REDUNDANCY.name, (len(units),), words=f"values of the joints that are given: {words}"),)


class Kind(StrEnum):
    """The kinds of quantities."""

    POSE = "pose"
    FRAMES = "frames"
    POSITION = "position"
    JACOBIAN = "jacobian"
    FK_JACOBIAN = "fk_jacobian"
    TWIST = "twist"
    BIAS_ACCELERATION = "bias_acceleration"
    ACCELERATION = "acceleration"
    HESSIAN = "hessian"
    QUATERNION_WXYZ = "quaternion_wxyz"
    QUATERNION_XYZW = "quaternion_xyzw"
    RPY_ZYX = "rpy_zyx"
    RPY_XYZ = "rpy_xyz"
    EULER_ZYZ = "euler_zyz"
    AXIS_ANGLE = "axis_angle"
    QUATERNION_WXYZ_JACOBIAN = "quaternion_wxyz_jacobian"
    QUATERNION_XYZW_JACOBIAN = "quaternion_xyzw_jacobian"
    RPY_ZYX_JACOBIAN = "rpy_zyx_jacobian"
    RPY_XYZ_JACOBIAN = "rpy_xyz_jacobian"
    EULER_ZYZ_JACOBIAN = "euler_zyz_jacobian"
    AXIS_ANGLE_JACOBIAN = "axis_angle_jacobian"
    PARAMETER_JACOBIAN = "parameter_jacobian"
    INVERSE_POSE = "inverse_pose"
    TRANSFORM_POINT = "transform_point"
    ADJOINT = "adjoint"
    INVERSE = "inverse"
    AXIS_INVERSE = "axis_inverse"
    ACTUATORS_TO_JOINTS = "actuators_to_joints"
    JOINTS_TO_ACTUATORS = "joints_to_actuators"
    FK_ACTUATORS = "fk_actuators"
    JACOBIAN_ACTUATORS = "jacobian_actuators"
    NUMERIC_INVERSE = "numeric_inverse"
    COMPLETE_INVERSE = "complete_inverse"
    REDUNDANCY_RANGE = "redundancy_range"
    INVERSE_TRACKER = "inverse_tracker"


class Reference(StrEnum):
    """The axes and the point in which a velocity is expressed, named as in Pinocchio.

    `local_world_aligned` has the axes of the base and the origin of the frame (Craig's 0J), `local` the axes and the
    origin of the frame (the body velocity), `world` the axes and the origin of the base (the spatial velocity).
    """

    LOCAL_WORLD_ALIGNED = "local_world_aligned"
    LOCAL = "local"
    WORLD = "world"


_REFERRED = (
    Kind.JACOBIAN,
    Kind.FK_JACOBIAN,
    Kind.TWIST,
    Kind.BIAS_ACCELERATION,
    Kind.ACCELERATION,
    Kind.JACOBIAN_ACTUATORS,
)
_FRAMELESS = (
    Kind.FRAMES,
    Kind.INVERSE_POSE,
    Kind.TRANSFORM_POINT,
    Kind.ADJOINT,
    Kind.ACTUATORS_TO_JOINTS,
    Kind.JOINTS_TO_ACTUATORS,
    Kind.NUMERIC_INVERSE,
    Kind.COMPLETE_INVERSE,
    Kind.REDUNDANCY_RANGE,
    Kind.INVERSE_TRACKER,
)


@dataclass(frozen=True, slots=True)
class Quantity:
    """One kinematic quantity, as `--outputs` names it; each becomes a function of its own.

    `pose` is the pose of every tip, `frames` the pose of every link and named frame, `position` the position of
    every tip, all relative to the base frame.

    Attributes:
        kind: What is computed.
        reference: For velocities, where and in which axes.
        frame: The frame it is computed for; empty for the tips.
        seen_from: The frame that takes the place of the base, such as that of a workpiece; empty for the base itself.
    """

    kind: Kind
    reference: Reference = Reference.LOCAL_WORLD_ALIGNED
    frame: str = ""
    seen_from: str = ""

    POSE: ClassVar[Quantity]
    FRAMES: ClassVar[Quantity]
    POSITION: ClassVar[Quantity]

    def __str__(self) -> str:
        """As `--outputs` names it: `pose`, `jacobian_local@elbow`, `pose@spindle/table`."""
        return f"{self._stem}@{self.way}" if self.frame else self._stem

    @property
    def way(self) -> str:
        """The frame, and after a slash the one in which it is seen if that is not the base; empty for the tips."""
        return f"{self.frame}/{self.seen_from}" if self.seen_from else self.frame

    @property
    def function(self) -> str:
        """Name of the function in C (after the robot's prefix) and in Python."""
        stem = "fk" if self.kind is Kind.POSE else self._stem
        if self.seen_from:
            return f"{stem}_{self.frame}_in_{self.seen_from}"
        return f"{stem}_{self.frame}" if self.frame else stem

    @property
    def is_pose(self) -> bool:
        """Tell whether the result is poses alone."""
        return self.kind in (Kind.POSE, Kind.FRAMES)

    @property
    def _stem(self) -> str:
        aligned = self.reference is Reference.LOCAL_WORLD_ALIGNED
        return self.kind.value if aligned else f"{self.kind}_{self.reference}"


Quantity.POSE = Quantity(Kind.POSE)
Quantity.FRAMES = Quantity(Kind.FRAMES)
Quantity.POSITION = Quantity(Kind.POSITION)

POSE_AND_JACOBIAN = Quantity(Kind.FK_JACOBIAN)
NUMERIC_INVERSE = Quantity(Kind.NUMERIC_INVERSE)
"""A search on the kernel of pose and Jacobian; it has no program of its own."""

COMPLETE_INVERSE = Quantity(Kind.COMPLETE_INVERSE)
"""All solutions of an arm with six turning joints, by elimination; it has no program of its own either."""

REDUNDANCY_RANGE = Quantity(Kind.REDUNDANCY_RANGE)
"""Where the redundancy of an inverse may be for a pose, and the nearest solution over all of it; no program either."""
INVERSE_TRACKER = Quantity(Kind.INVERSE_TRACKER)
"""The closed-form inverse along a path; it has no program, and needs those of the inverse and of pose and Jacobian."""

INVERSES = (Kind.INVERSE, Kind.AXIS_INVERSE)
"""Closed forms that give several joint vectors for a target."""

SOLVERS = (NUMERIC_INVERSE, COMPLETE_INVERSE, REDUNDANCY_RANGE, INVERSE_TRACKER)
"""Outputs without a program, which need the pose with its Jacobian; the last two need the inverse too."""

USUAL = (Quantity.POSE, Quantity.FRAMES, Quantity.POSITION)
"""What kernels in integers compute, and what `kinegen size` and `kinegen prove` take where nothing is asked for."""

DEFAULT = (Quantity.POSE, Quantity(Kind.JACOBIAN), Quantity(Kind.INVERSE))
"""What a build has where nothing is asked for; the inverse where there is one."""


@dataclass(frozen=True, slots=True)
class Signature:
    """The quantity that a kernel computes, for which frames, from what; arrays are in order.

    Attributes:
        dof: Number of joint variables of the robot.
        branches: Of a closed-form inverse, the branches of its results; None for others.
    """

    quantity: Quantity
    frames: tuple[str, ...]
    dof: int
    inputs: tuple[Array, ...]
    results: tuple[Array, ...]
    branches: Branches | None = None


def parse_quantity(text: str) -> Quantity:
    """Read a quantity as `--outputs` names it.

    Args:
        text: A kind, then for velocities `_local` or `_world`, then `@` and a frame, then `/` and the frame in which
            that one is seen, in place of the base; such as `jacobian_local@elbow` or `pose@spindle/table`. `fk`, the
            function that computes it, is `pose` too.

    Returns:
        The quantity; whether the robot has the frame is not known here.

    Raises:
        KinegenError: If there is no such quantity; the message lists what there is.
    """
    stem, at, way = text.partition("@")
    frame, slash, seen_from = way.partition("/")
    known = {str(quantity): quantity for quantity in every_quantity()}
    stem = str(Quantity.POSE) if stem == Quantity.POSE.function else stem
    if stem not in known:
        if not stem:
            raise KinegenError("the name of an output is missing (expected a list such as pose,jacobian)")
        # A stem of several names lists them; a slip gets the one that is alike.
        near = [name for name in known if name.startswith(stem)]
        if not near and (hint := did_you_mean(stem, known)):
            raise KinegenError(f"unknown output '{stem}'{hint}")
        raise KinegenError(f"unknown output '{stem}' (expected {', '.join(near or known)})")
    quantity = known[stem]
    # Poses of all frames and searches have no single frame.
    if at and (quantity.kind in _FRAMELESS or not frame):
        reason = f"'{stem}' is not computed for a single frame" if frame else "the name of a frame is missing after @"
        raise KinegenError(f"{text}: {reason}")
    if slash and (not seen_from or seen_from == frame):
        reason = f"frame '{frame}' is seen from itself" if seen_from else "the name of a frame is missing after /"
        raise KinegenError(f"{text}: {reason}")
    return Quantity(quantity.kind, quantity.reference, frame, seen_from)


def with_needed(quantities: tuple[Quantity, ...]) -> tuple[Quantity, ...]:
    """Return the quantities that have programs, with those that others are built on."""
    programs = tuple(quantity for quantity in quantities if quantity not in SOLVERS)
    needed = [POSE_AND_JACOBIAN] * any(solver in quantities for solver in SOLVERS)
    needed += [Quantity(Kind.INVERSE)] * (REDUNDANCY_RANGE in quantities or INVERSE_TRACKER in quantities)
    return (*programs, *(each for each in needed if each not in programs))


def every_quantity() -> tuple[Quantity, ...]:
    """Return all quantities, in order, with every reference and without frames."""
    return tuple(
        Quantity(kind, reference)
        for kind in Kind
        for reference in Reference
        if kind in _REFERRED or reference is Reference.LOCAL_WORLD_ALIGNED
    )
