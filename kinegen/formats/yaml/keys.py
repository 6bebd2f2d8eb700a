"""The words of the robot file: every key with its meaning, and which keys go together.

The loader and the published schema both read these tables, so that neither can know a key that the other does not.
"""

from __future__ import annotations

from kinegen.robot.dimension import Dimension
from kinegen.robot.model import Convention, JointType

VERSION = "1"
MAX_ROWS = 256
MAX_PARAMETERS = 200
MAX_FRAMES = 200
MAX_STEPS = 64
MAX_DESCRIPTION = 500

VERSION_PATTERN = r"^(0|[1-9][0-9]{0,5})(\.(0|[1-9][0-9]{0,5})){2}$"
"""Three numbers, which CMake and every registry take."""

LENGTH_UNITS = ("m", "cm", "mm", "in")
ANGLE_UNITS = ("deg", "rad")
BOOLEANS = ("true", "false")
DIMENSIONS = tuple(str(dimension) for dimension in Dimension)
JOINT_TYPES = tuple(str(kind) for kind in JointType)
TABLE_CONVENTIONS = tuple(str(convention) for convention in Convention if convention is not Convention.ETS)

TOP = {
    "kinegen": "Version of this format; always 1.",
    "name": "Name of the robot: a C identifier that prefixes everything public.",
    "description": "One line about the robot; it is repeated in headers and docstrings.",
    "version": "Version of the robot in packages, such as 1.2.0; by default one made from the digest of the model.",
    "convention": "How a row of the table becomes a transform; never guessed.",
    "units": "Length and angle units of this file; never guessed.",
    "parameters": "Named constants that the entries below may use.",
    "joints": "The table, one row for each joint, from the base to the tip.",
    "base": "Fixed transform from the root frame to the frame before the first row.",
    "tool": "Fixed transform from the last row to the tool frame.",
    "frames": "Further named frames, each fixed to another one.",
    "actuators": "The motors, and how the joints follow from what they read.",
    "redundancy": "What the inverse is given in addition to the pose: a joint, a list of joints, or arm_angle.",
}
TOP_REQUIRED = {
    "kinegen": "kinegen: 1",
    "name": "name: my_arm",
    "convention": "convention: standard",
    "units": "units: {length: m, angle: deg}",
    "joints": "joints: [{name: waist, ...}]",
}
"""Each required key with an example to show when it is missing."""

UNITS = {
    "length": "Unit of a, d, translations and prismatic joints.",
    "angle": "Unit of theta, alpha, beta, rotations and revolute limits.",
}

PARAMETER = {
    "value": "An exact number or expression; it may use the parameters above.",
    "runtime": "Whether the value stays an argument of the kernels.",
    "dimension": "What it measures; needed only where its use leaves that open.",
}

ENTRIES = {
    "a": "Link length, along x.",
    "alpha": "Twist, about x.",
    "d": "Offset, along z; q goes here for a prismatic joint.",
    "theta": "Angle, about z; q goes here for a revolute joint.",
    "beta": "Second twist, about y, of nearly parallel axes (hayati rows only).",
}
ROW_COMMON = {
    "name": "Name of the joint and of the frame that the row reaches.",
    "ets": "Elementary transforms in order, such as [Rz(q), Tx(l1), Ry(-90)], instead of a table row.",
    "parent": "Name of an earlier row, or base; without it the row follows the one above.",
    "offset": "Constant that is added to q: theta or d becomes q + offset.",
    "limits": "Lower and upper bound of the joint's own variable q, without the offset.",
    "type": "Checked against what the row says, if given.",
    "convention": "Convention of this row, where it differs from the file's.",
}
ROW = ENTRIES | ROW_COMMON

TRANSFORM = {
    "xyz": "Translation along x, y and z.",
    "rpy": "Roll, pitch and yaw about the fixed axes x, y and z, turned in this order.",
    "ets": "Elementary transforms in order, instead of xyz and rpy.",
}
FRAME = (
    {"parent": "A row, base, tool, wrist or another frame."}
    | TRANSFORM
    | {"tip": "Whether the frame is a tip of a tree; the row that it is on is then not one itself."}
)

ACTUATORS = {
    "readings": "What each motor reads, in the order of the actuator vector: angle, length or number.",
    "joints": "How each joint variable follows, in order; the later ones may use the earlier joints.",
    "inverse": "Readings as expressions of the joints, where only free expressions use them.",
}
READING = {
    "dimension": "What it measures; an angle is in the unit of the file, a number has none.",
    "limits": "Lower and upper bound of the reading.",
}

FORMS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "gear": (("joint", "actuator", "ratio"), ("sign", "offset")),
    "coupling": (("joints", "actuators", "matrix"), ("offsets",)),
    "linear_actuator": (("joint", "actuator", "sides"), ("length", "sign", "offset")),
    "four_bar": (
        ("joint", "actuator", "ground", "crank", "coupler", "rocker"),
        ("angle", "branch", "sign", "offset"),
    ),
}
"""The keys that each form must have, and those that it may have."""

FORMULA = ("joint", "value")
"""The keys of an entry without a form."""

BRANCHES = ("open", "crossed")
SIGNS = ("1", "-1")
BARS = ("ground", "crank", "coupler", "rocker")

DRIVE = {
    "joint": "The joint that the entry drives.",
    "joints": "The joints that a coupling drives.",
    "form": "A named form: joint = sign*(what the form makes of the reading) + offset.",
    "value": "The joint as a free expression of readings, earlier joints and parameters.",
    "actuator": "Whose reading the form takes.",
    "actuators": "The readings of a coupling, one for each column of its matrix.",
    "ratio": "How far the actuator moves for one unit of the joint, such as 100 turns for one turn.",
    "matrix": "One row for each joint: joints = matrix*readings + offsets.",
    "offsets": "One value for each joint of a coupling; it may use earlier joints.",
    "sides": "The two fixed sides of the triangle that a linear actuator closes.",
    "length": "Length of a linear actuator, linear in its reading; the reading itself if left out.",
    "ground": "Distance between the pivots of crank and rocker.",
    "crank": "Length of the bar that the motor turns.",
    "coupler": "Length of the bar between crank and rocker.",
    "rocker": "Length of the bar that turns with the joint.",
    "angle": "Angle of the crank from the ground line, linear in its reading; the reading itself if left out.",
    "branch": "Assembly with the crank between 0 and 180 degrees: open, as in a parallelogram, or crossed.",
    "sign": "1, or -1 where the joint moves in the other direction.",
    "offset": "What is added to give the joint; it may use earlier joints, as in 90 - shoulder.",
}

STEPS = ("Rx", "Ry", "Rz", "Tx", "Ty", "Tz")
