"""The robot as its owner wrote it: frozen records, exact values, kernel units.

Everything here is already in the units of the kernels: radians, and the length unit of the file. Names in
expressions are joint variables (named after their joint) and parameters.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from kinegen.older import StrEnum
from kinegen.robot.actuators.model import NO_ACTUATORS, Actuators
from kinegen.robot.dimension import Dimension
from kinegen.robot.expressions import Expression

BASE = "base"
"""The root frame of every robot, unless a joint has this name."""

ROOT = "(base)"
"""The root frame of a robot with a joint named base; no file can spell it."""

TOOL = "tool"
"""The tip of a chain: the last link, or the tool mounted on it."""

WRIST = "wrist"
"""Another name for the last link of a chain."""


def root_name(joints: Iterable[str]) -> str:
    """What the root frame is called beside some joints."""
    return ROOT if BASE in joints else BASE


def frame_label(name: str | int) -> str:
    """What printouts call a frame."""
    return BASE if name == ROOT else str(name)


class Convention(StrEnum):
    """How a row of the table becomes a transform (see `symbolic/transforms.py`)."""

    STANDARD = "standard"
    MODIFIED = "modified"
    MODIFIED_PREV_D = "modified_prev_d"
    HAYATI = "hayati"
    ETS = "ets"


class JointType(StrEnum):
    """What a row does when its own variable changes."""

    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"
    SCREW = "screw"
    FOLLOWER = "follower"
    FIXED = "fixed"


class StepKind(StrEnum):
    """The elementary transforms."""

    RX = "Rx"
    RY = "Ry"
    RZ = "Rz"
    TX = "Tx"
    TY = "Ty"
    TZ = "Tz"

    @property
    def axis(self) -> int:
        """0, 1 or 2 for x, y or z."""
        return "xyz".index(self.value[1])

    @property
    def is_rotation(self) -> bool:
        """Whether it turns; otherwise it shifts."""
        return self.value[0] == "R"


@dataclass(frozen=True, slots=True)
class Step:
    """One elementary transform: a turn (radians) about an axis, or a shift (lengths) along it."""

    kind: StepKind
    value: Expression


@dataclass(frozen=True, slots=True)
class Parameter:
    """A named constant of the table.

    Attributes:
        name: As written.
        value: Closed expression, in radians or the file's length unit; names no other parameter.
        dimension: What it measures.
        runtime: Whether it stays an argument of the kernels.
        line: Line of the file.
        made_of: Names of the earlier parameters that its value was computed from.
        chosen: Whether the derivatives with respect to it are wanted (see `calibrated`).
    """

    name: str
    value: Expression
    dimension: Dimension
    runtime: bool
    line: int
    made_of: tuple[str, ...] = ()
    chosen: bool = False


@dataclass(frozen=True, slots=True)
class JointVariable:
    """One entry of the joint vector q.

    Attributes:
        name: Name of its joint.
        index: Its place in q, from 0.
        type: Revolute or screw (radians), or prismatic (lengths).
        limits: Lower and upper bound, closed expressions in kernel units; None where the file has none.
        line: Line of the file.
    """

    name: str
    index: int
    type: JointType
    limits: tuple[Expression, Expression] | None
    line: int


@dataclass(frozen=True, slots=True)
class Row:
    """One row of the table: the transform from its parent frame to the frame named after it.

    Attributes:
        name: Joint name; also the name of the frame that the row reaches.
        number: Its place in the table, from 1.
        parent: Name of an earlier row, or the robot's `root` for the frame after its fixed base transform.
        convention: How the entries combine.
        alpha: Twist; None in an elementary sequence.
        a: Length; None in an elementary sequence.
        d: Offset; None in Hayati rows and elementary sequences.
        theta: Angle; None in an elementary sequence.
        beta: Second twist, in Hayati rows alone.
        steps: The elementary sequence; empty for the table conventions.
        type: What the row does.
        variable: Name of its own joint variable (its own name), or None.
        line: Line of the file.
    """

    name: str
    number: int
    parent: str
    convention: Convention
    alpha: Expression | None
    a: Expression | None
    d: Expression | None
    theta: Expression | None
    beta: Expression | None
    steps: tuple[Step, ...]
    type: JointType
    variable: str | None
    line: int


@dataclass(frozen=True, slots=True)
class Frame:
    """A named frame fixed to another one.

    Attributes:
        name: As written.
        parent: The robot's `root`, `TOOL`, `WRIST`, a row or another frame.
        steps: From the parent to this frame.
        line: Line of the file.
        tip: Whether it is a tip; in trees alone.
    """

    name: str
    parent: str
    steps: tuple[Step, ...]
    line: int
    tip: bool = False


@dataclass(frozen=True, slots=True)
class Units:
    """The units of the file: `length` is one of m, cm, mm, in; `angle` is deg or rad."""

    length: str
    angle: str


@dataclass(frozen=True, slots=True)
class Robot:
    """A whole robot file, validated.

    Attributes:
        name: Identifier that prefixes everything public.
        description: One line of free text, possibly empty.
        convention: Convention of the table.
        units: Units of the file; the kernels use radians and `units.length`.
        parameters: In the order of the file.
        variables: In the order of the table; `q[i]` is `variables[i]`.
        rows: In the order of the table; a parent always stands before its children.
        base: Fixed transform from `BASE` to the frame before the first row.
        tool: Fixed transform from the last row to `TOOL`; empty for a tree.
        frames: Further named frames; a parent always stands before its children.
        source: Base name of the file.
        digest: Hash of the content that decides the output, as hexadecimal text.
        actuators: What drives the joints; empty where the file says nothing of it.
        version: As the file says, three numbers with dots; empty where it says nothing.
        redundancy: What an inverse is given besides the pose: joints with commas between them, or `ARM_ANGLE`; usually
            empty.
    """

    name: str
    description: str
    convention: Convention
    units: Units
    parameters: tuple[Parameter, ...]
    variables: tuple[JointVariable, ...]
    rows: tuple[Row, ...]
    base: tuple[Step, ...]
    tool: tuple[Step, ...]
    frames: tuple[Frame, ...]
    source: str
    digest: str
    actuators: Actuators = NO_ACTUATORS
    version: str = ""
    redundancy: str = ""

    @property
    def release(self) -> str:
        """The version that packages get: that of the file, or one made of the digest, which differs between robots.

        Its minor number is from the digest, because a new minor number below 1.0 is an incompatible change.
        """
        return self.version or f"0.{int(self.digest[:6], 16)}.0"

    @property
    def given(self) -> tuple[str, ...]:
        """The names in `redundancy`, in the order in which their values are given."""
        return tuple(self.redundancy.split(",")) if self.redundancy else ()

    @property
    def dof(self) -> int:
        """Number of joint variables."""
        return len(self.variables)

    @property
    def root(self) -> str:
        """The root frame, by which no joint is called."""
        return root_name(row.name for row in self.rows)

    @property
    def runtime_parameters(self) -> tuple[Parameter, ...]:
        """The parameters that stay arguments of the kernels."""
        return tuple(parameter for parameter in self.parameters if parameter.runtime)

    @property
    def varied_parameters(self) -> tuple[Parameter, ...]:
        """The parameters by which `parameter_jacobian` is taken: those chosen, or all runtime parameters."""
        return tuple(parameter for parameter in self.parameters if parameter.chosen) or self.runtime_parameters

    @property
    def leaves(self) -> tuple[str, ...]:
        """Rows that no other row follows, in the order of the table."""
        parents = {row.parent for row in self.rows}
        return tuple(row.name for row in self.rows if row.name not in parents)

    @property
    def is_tree(self) -> bool:
        """Whether there is more than one tip."""
        return len(self.leaves) > 1

    @property
    def is_arm(self) -> bool:
        """Whether there is one tip, and a joint that moves it."""
        return not self.is_tree and self.dof > 0

    @property
    def tips(self) -> tuple[str, ...]:
        """Frames whose poses the pose kernel computes: `TOOL` for a chain.

        For a tree: the named tips, and every leaf that no named tip is on, in the order of the links that they are on.
        """
        if not self.is_tree:
            return (TOOL,)
        links, named = self.frame_links, {row.name: list[str]() for row in self.rows}
        for frame in self.frames:
            if frame.tip:
                named[links[frame.name]].append(frame.name)
        leaves = frozenset(self.leaves)
        own = {link: [link] * (link in leaves) for link in named}
        return tuple(tip for link, tips in named.items() for tip in (tips or own[link]))

    @property
    def frame_links(self) -> dict[str, str]:
        """The row that each named frame is on, directly or by way of other frames; the root, `TOOL` or `WRIST` too."""
        links: dict[str, str] = {}
        for frame in self.frames:
            links[frame.name] = links.get(frame.parent, frame.parent)
        return links

    @property
    def frame_names(self) -> tuple[str, ...]:
        """Every frame of the `frames` output: rows, `TOOL` (chains), then named frames, in that order."""
        tip = () if self.is_tree else (TOOL,)
        return tuple(row.name for row in self.rows) + tip + tuple(frame.name for frame in self.frames)
