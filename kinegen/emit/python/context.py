"""What the templates of the public module of a robot and of its types are given."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PublicKernel:
    """One kernel of the module.

    Attributes:
        name: Its name.
        brief: What it computes, in paragraphs.
        inputs: What it is given, as Python text.
        results: What it gives, as Python text.
        relation: The shapes of inputs and results in words.
        operations: What a configuration costs.
        wrapper: The class that it is an object of, with its type.
        notes: More lines of its docstring.
        options: Lines of more arguments of its constructor, as Python text.
    """

    name: str
    brief: tuple[str, ...]
    inputs: str
    results: str
    relation: str
    operations: str
    wrapper: str
    notes: tuple[str, ...]
    options: tuple[str, ...]

    @property
    def is_named(self) -> bool:
        """Whether its results have an axis of tips or frames."""
        return self.wrapper.startswith("NamedKernel")


@dataclass(frozen=True, slots=True)
class Numeric:
    """The search for joint values.

    Attributes:
        name: Its name in the module.
        kernel: Name of the kernel it searches on.
        joints: Where each joint may stand, as Python text.
        reach: What a position error is compared with.
        tolerances: Accepted errors for float64 and for float32, as Python text.
        moving: The joints that move each tip of a tree, as Python text; empty for an arm.
    """

    name: str
    kernel: str
    joints: tuple[str, ...]
    reach: str
    tolerances: str
    moving: tuple[str, ...]

    @property
    def wrapper(self) -> str:
        """The class that it is an object of."""
        return "TipsInverse" if self.moving else "NumericInverse"


@dataclass(frozen=True, slots=True)
class RangeOptions:
    """The ranges of a redundancy.

    Attributes:
        redundancy: What it is, in words.
        most: Intervals of a branch at most.
        lines: Arguments of the constructor, as Python text.
    """

    redundancy: str
    most: int
    lines: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Tracking:
    """The inverse along a path, as Python text.

    Attributes:
        kernel: Name of the kernel of pose and Jacobian.
        strides: What of each joint counts as much as an angle of 1 rad.
        reach: What a position error is compared with.
        rigid: How far targets may be from rotations, for float64 and for float32; None where rotations are not read.
        given: Index of the joint that is given with the target; None where none is.
    """

    kernel: str
    strides: str
    reach: str
    rigid: str
    given: str


@dataclass(frozen=True, slots=True)
class PackageContext:
    """What the template `python/__init__.py.jinja` is given."""

    name: str
    description: tuple[str, ...]
    provenance: str
    length: str
    dof: int
    joints: tuple[str, ...]
    joint_names: tuple[str, ...]
    limits: tuple[str, ...]
    single_limits: tuple[str, ...]
    actuators: tuple[tuple[str, str, str], ...]
    actuator_lines: tuple[str, ...]
    frames: tuple[str, ...]
    tips: tuple[str, ...]
    branches: tuple[str, ...]
    varied: tuple[str, ...]
    parameters: tuple[tuple[str, str], ...]
    example: str
    kernels: tuple[PublicKernel, ...]
    reals: str
    plain: bool
    named: bool
    has_jacobians: bool
    numeric_inverse: Numeric | None
    complete_inverse: bool
    redundancy_range: RangeOptions | None
    inverse_tracker: Tracking | None
    stamp: str
    exported: tuple[str, ...]
