"""The robot as its owner wrote it: frozen records, exact values, kernel units.

Everything here is in radians and the length unit of the file. Names in expressions are joint variables (named after
their joint) and parameters.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field

from kinegen.model.actuators import NO_ACTUATORS, Actuators
from kinegen.model.expression_parser import Expression, names
from kinegen.model.expression_values import Dimension
from kinegen.support.compat import StrEnum
from kinegen.support.dataclass import dataclass

BASE = "base"
"""The root frame of every robot, unless a joint has this name."""

ROOT = "(base)"
"""The root frame of a robot with a joint named base; no file can spell it."""

TOOL = "tool"
"""The tip of a chain: the last link, or the tool mounted on it."""

WRIST = "wrist"
"""Another name for the last link of a chain."""


def root_name(joints: Iterable[str]) -> str:
    """Return what the root frame is called beside some joints."""
    return ROOT if BASE in joints else BASE


def frame_label(name: str | int) -> str:
    """Return what printouts call a frame."""
    return BASE if name == ROOT else str(name)


class Convention(StrEnum):
    """The rules by which a row of the table becomes a transform (see `derive/transforms.py`)."""

    STANDARD = "standard"
    MODIFIED = "modified"
    MODIFIED_PREV_D = "modified_prev_d"
    HAYATI = "hayati"
    ETS = "ets"


class JointType(StrEnum):
    """The motion of a row when its own variable changes."""

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
        """Tell whether it turns; otherwise it shifts."""
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
        value: Closed expression, in radians or the file's length unit; names no other parameter.
        runtime: Whether it stays an argument of the kernels.
        made_of: Names of the earlier parameters that its value was computed from.
        chosen: Whether the derivatives with respect to it are wanted (see `runtime_entries`).
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
        index: Its place in q, from 0.
        type: Revolute or screw (radians), or prismatic (lengths).
        limits: Lower and upper bound, closed expressions in kernel units; None where the file has none.
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
        alpha: Twist; None in an elementary sequence.
        a: Length; None in an elementary sequence.
        d: Offset; None in Hayati rows and elementary sequences.
        theta: Angle; None in an elementary sequence.
        beta: Second twist, in Hayati rows alone.
        steps: The elementary sequence; empty for the table conventions.
        variable: Name of its own joint variable (its own name), or None.
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
        parent: The robot's `root`, `TOOL`, `WRIST`, a row or another frame.
        steps: From the parent to this frame.
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
        convention: Convention of the table, for rows that state none; those of its rows are `row_conventions`.
        units: Units of the file; the kernels use radians and `units.length`.
        variables: In the order of the table; `q[i]` is `variables[i]`.
        rows: In the order of the table; a parent always stands before its children.
        base: Fixed transform from `BASE` to the frame before the first row.
        tool: Fixed transform from the last row to `TOOL`; empty for a tree.
        frames: Further named frames; a parent always stands before its children.
        source: Base name of the file.
        digest: Hash of the content that decides the output, as hexadecimal text.
        actuators: What drives the joints; empty where the file says nothing of it.
        version: Three numbers with dots; empty where the file says nothing.
        redundancy: What an inverse is given besides the pose: joints with commas between them, or `ARM_ANGLE`; usually
            empty.
        strict_limits: Whether a solution of an inverse that rounding moved beyond a limit is not valid.
        links: Each link of a file that has links, with its frame; no content of its own, so the digest leaves it out.
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
    strict_limits: bool = False
    links: tuple[tuple[str, str], ...] = field(default=(), repr=False)

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
    def row_conventions(self) -> tuple[Convention, ...]:
        """The conventions that rows have, in the order of the table; that of the table where there are no rows."""
        return tuple(dict.fromkeys(row.convention for row in self.rows)) or (self.convention,)

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
        """Tell whether there is more than one tip."""
        return len(self.leaves) > 1

    @property
    def is_arm(self) -> bool:
        """Tell whether there is one tip, and a joint that moves it."""
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


ROW_ENTRIES: dict[Convention, tuple[str, ...]] = {
    Convention.STANDARD: ("a", "alpha", "d", "theta"),
    Convention.MODIFIED: ("a", "alpha", "d", "theta"),
    Convention.MODIFIED_PREV_D: ("a", "alpha", "d", "theta"),
    Convention.HAYATI: ("a", "alpha", "theta", "beta"),
    Convention.ETS: (),
}
"""The entries that a row of each convention must have."""

ANGLE_ENTRIES = frozenset({"alpha", "theta", "beta"})
MOVING_ENTRIES = frozenset({"theta", "d"})
"""The entries in which a joint variable may stand; both turn about or move along z."""


def angles_of(row: Row) -> tuple[Expression, ...]:
    """Return the angles of a row."""
    turns = (step.value for step in row.steps if step.kind.is_rotation)
    return (*turns, *(entry for entry in (row.alpha, row.theta, row.beta) if entry is not None))


def lengths_of(row: Row) -> tuple[Expression, ...]:
    """Return the lengths of a row."""
    shifts = (step.value for step in row.steps if not step.kind.is_rotation)
    return (*shifts, *(entry for entry in (row.a, row.d) if entry is not None))


def turning(robot: Robot) -> frozenset[str]:
    """Return the names in the angles of a table, of joints and parameters."""
    return frozenset(name for row in robot.rows for angle in angles_of(row) for name in names(angle))


def shifting(robot: Robot) -> frozenset[str]:
    """Return the names in the lengths of a table, of joints and parameters."""
    return frozenset(name for row in robot.rows for length in lengths_of(row) for name in names(length))


def shifts_by_joints(robot: Robot) -> bool:
    """Tell whether a length of the table follows a joint variable."""
    return not shifting(robot).isdisjoint(variable.name for variable in robot.variables)
