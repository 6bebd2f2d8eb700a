"""Reads observed poses, as a person or a measuring device wrote them, in all forms of orientations.

Numbers are read as decimal text, because the last printed digit says how exact they can be.

| form | numbers | the rotation is |
| --- | --- | --- |
| `rpy` | roll, pitch, yaw | Rz(yaw) Ry(pitch) Rx(roll) |
| `ypr` | yaw, pitch, roll | Rz(yaw) Ry(pitch) Rx(roll) |
| `rpy_xyz` | roll, pitch, yaw | Rx(roll) Ry(pitch) Rz(yaw) |
| `zyz` | three angles | Rz(first) Ry(second) Rz(third) |
| `rotation_vector` | x, y, z | by the length of the vector about it, in radians |
| `wxyz` | w, x, y, z | of the unit quaternion |
| `xyzw` | x, y, z, w | of the unit quaternion |
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from decimal import Decimal, InvalidOperation

import numpy as np
from numpy.typing import NDArray

from kinegen.errors import KinegenError, quote
from kinegen.model.outputs import Kind
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass
from kinegen.verify import reference

FloatArray = NDArray[np.float64]

_KINDS = {
    "rpy": Kind.RPY_ZYX,
    "ypr": Kind.RPY_ZYX,
    "rpy_xyz": Kind.RPY_XYZ,
    "zyz": Kind.EULER_ZYZ,
    "rotation_vector": Kind.AXIS_ANGLE,
    "wxyz": Kind.QUATERNION_WXYZ,
    "xyzw": Kind.QUATERNION_XYZW,
}
"""The form of each name, whose numbers `ypr` has in the other order."""

ORIENTATION_ANGLES = ("rpy", "ypr", "rpy_xyz", "zyz")
THREE = (*ORIENTATION_ANGLES, "rotation_vector")
FOUR = ("wxyz", "xyzw")
FORMS = (*THREE, *FOUR)

WORDS = {
    "rpy": "roll, pitch, yaw of Rz(yaw) Ry(pitch) Rx(roll)",
    "ypr": "yaw, pitch, roll of Rz(yaw) Ry(pitch) Rx(roll)",
    "rpy_xyz": "roll, pitch, yaw of Rx(roll) Ry(pitch) Rz(yaw)",
    "zyz": "the angles of Rz Ry Rz",
    "rotation_vector": "rotation vectors",
    "wxyz": "quaternions w, x, y, z",
    "xyzw": "quaternions x, y, z, w",
}
"""What messages call each form."""


def others(form: str) -> tuple[str, ...]:
    """Return the forms that the same numbers could have."""
    return tuple(name for name in (THREE if form in THREE else FOUR) if name != form)


def rotations(form: str, numbers: FloatArray) -> FloatArray:
    """Return the rotation matrices (N, 3, 3) of numbers of a form, (N, 3) in radians or (N, 4)."""
    if form in FOUR:
        numbers = numbers / np.linalg.norm(numbers, axis=1, keepdims=True)
    found: FloatArray = reference.rotations(_KINDS[form], numbers[:, ::-1] if form == "ypr" else numbers)
    return found


def numbers_of(form: str, rotation: FloatArray) -> FloatArray:
    """Return the numbers of some rotations, shape (N, 3, 3): the inverse of `rotations`."""
    found: FloatArray = reference.Orientation(rotation).numbers(_KINDS[form])
    return found[:, ::-1] if form == "ypr" else found


MOST_POSES = 10_000
ANGLES = ("deg", "rad")
LENGTHS = ("m", "cm", "mm", "in")
"""The units that poses may have."""

_LARGEST = Decimal("1e9")
_FINEST = 17
"""Decimals beyond which a digit says nothing of a measurement."""


@dataclass(frozen=True, slots=True)
class Said:
    """Statements of the user about the poses; None where the file decides, or nothing is stated.

    Attributes:
        angle: Unit of joint values and of roll, pitch and yaw.
        length: Unit of positions and of prismatic joints.
    """

    angle: str | None = None
    length: str | None = None
    form: str | None = None


@dataclass(frozen=True, slots=True)
class Line:
    """One observed pose as written, with 0, 3 or 4 numbers of orientation, and its line or place among `--pose`."""

    joints: tuple[Decimal, ...]
    position: tuple[Decimal, ...]
    orientation: tuple[Decimal, ...]
    line: int


@dataclass(frozen=True, slots=True)
class Observations:
    """Observed poses, in the units in which they are written.

    Attributes:
        joints: Shape (K, dof).
        positions: Shape (K, 3).
        orientations: Shape (K, 3) or (K, 4), NaN where a pose has none; (K, 0) where no pose has one.
        angle: Unit of joint values and orientations.
        length: Unit of positions and prismatic joints.
        joint_digit: Half a unit of the last printed decimal of each joint value, shape (dof,); 0 for whole numbers.
    """

    joints: FloatArray
    positions: FloatArray
    orientations: FloatArray
    angle: str
    length: str
    form: str
    stated_angle: bool
    stated_length: bool
    stated_form: bool
    joint_digit: FloatArray
    position_digit: float
    orientation_digit: float
    lines: tuple[int, ...]

    def __len__(self) -> int:
        """K."""
        return len(self.joints)

    def spread(self, count: int) -> Observations:
        """At most `count` of the poses, evenly spread over the list."""
        if len(self) <= count:
            return self
        which = np.linspace(0, len(self) - 1, count).round().astype(int)
        return replace(
            self,
            joints=self.joints[which],
            positions=self.positions[which],
            orientations=self.orientations[which],
            lines=tuple(self.lines[at] for at in which),
        )


def number(text: str, label: str) -> Decimal:
    """Read a decimal number; anything else is an error."""
    try:
        value = Decimal(text.strip().replace("\u2212", "-"))
    except InvalidOperation:
        comma = " (the decimal separator is a point)" if "," in text else ""
        raise KinegenError(f"{label}: {quote(text.strip())} is not a number{comma}") from None
    if not value.is_finite():
        raise KinegenError(f"{label}: {quote(text.strip())} is not a finite number")
    if abs(value) > _LARGEST:
        raise KinegenError(f"{label}: {quote(text.strip())} is too large (at most {_LARGEST:.0e})")
    return value


def read_pose(robot: Robot, text: str, place: int) -> Line:
    """Read the text of one `--pose`, such as `0 -90 30 0 0 0 = 0.45 0.15 0.43`.

    Joint values, an equals sign, and 3 numbers of a position, with 3 or 4 more of an orientation or none; anything else
    is an error. `place` counts the options from 1.
    """
    label = f"--pose {quote(text)}"
    left, sign, right = text.partition("=")
    if not sign:
        raise KinegenError(f"{label}: expected joint values, '=' and a position, as in '0 90 = 0.4 0 0.1'")
    # Commas between numbers are as good as blanks.
    joints = tuple(number(word, label) for word in left.replace(",", " ").split())
    if len(joints) != robot.dof:
        names = ", ".join(variable.name for variable in robot.variables)
        raise KinegenError(f"{label}: {robot.name} takes {robot.dof} joint values ({names}), {len(joints)} given")
    found = tuple(number(word, label) for word in right.replace(",", " ").split())
    if len(found) not in (3, 6, 7):
        wanted = "x y z, x y z and three angles, or x y z and a quaternion w x y z"
        raise KinegenError(f"{label}: {len(found)} numbers after '=' (expected {wanted})")
    return Line(joints, found[:3], found[3:], place)


def observations(robot: Robot, lines: Sequence[Line], said: Said, form: str = "") -> Observations:
    """Put lines together that belong together; `form` is that of the orientations whose columns have names."""
    if not lines:
        raise KinegenError("there are no poses")
    sizes = sorted({len(line.orientation) for line in lines} - {0})
    if len(sizes) > 1:
        raise KinegenError("some orientations have 3 numbers and some have 4; give all in one form")
    size = sizes[0] if sizes else 0
    chosen = _form(size, said.form, form)
    for line in lines:
        _check_quaternion(line, size)
    missing = (math.nan,) * size
    turned = [tuple(map(float, line.orientation)) or missing for line in lines]
    digits = [_half_digit(column) for column in zip(*(line.joints for line in lines), strict=True)]
    # Whole numbers are commanded values, which are exact.
    whole = [0.0 if step == 0.5 else step for step in digits]
    return Observations(
        joints=np.array([tuple(map(float, line.joints)) for line in lines], dtype=np.float64).reshape(len(lines), -1),
        positions=np.array([tuple(map(float, line.position)) for line in lines], dtype=np.float64),
        orientations=np.array(turned, dtype=np.float64).reshape(len(lines), size),
        angle=said.angle or robot.units.angle,
        length=said.length or robot.units.length,
        form=chosen,
        stated_angle=said.angle is not None,
        stated_length=said.length is not None,
        stated_form=said.form is not None,
        joint_digit=np.array(whole, dtype=np.float64),
        position_digit=_half_digit(value for line in lines for value in line.position),
        orientation_digit=_half_digit(value for line in lines for value in line.orientation),
        lines=tuple(line.line for line in lines),
    )


def _form(size: int, said: str | None, named: str) -> str:
    if size == 0:
        if said is not None:
            raise KinegenError(f"the poses have no orientation, but --orientation {said} is given")
        return ""
    chosen = said or named or ("rpy" if size == 3 else "wxyz")
    if size != (3 if chosen in THREE else 4):
        raise KinegenError(f"the orientations have {size} numbers, but --orientation {chosen} is given")
    return chosen


def _check_quaternion(line: Line, size: int) -> None:
    """Refuse four numbers that are far from a unit quaternion."""
    if size != 4 or not line.orientation:
        return
    length = math.hypot(*map(float, line.orientation))
    if abs(length - 1) > 0.05:
        raise KinegenError(f"the quaternion has length {length:.3g} (expected 1)", None, line.line)


def _half_digit(values: Iterable[Decimal]) -> float:
    """Half a unit of the last decimal that any of the values shows."""
    exponents = [value.as_tuple().exponent for value in values]
    decimals = max((-exponent for exponent in exponents if isinstance(exponent, int)), default=0)
    return 0.5 * 10.0 ** -min(max(decimals, 0), _FINEST)
