"""Ranges of inputs, of the angles that a kernel takes sines of, and the pieces that interval analysis needs.

The pair subtracts the nearest multiple of pi/2 from its angle. Intervals do not see that both belong together: over all
angles at once the difference seems as large as the angle, and a polynomial of it is worth nothing. Over a piece on
which the multiple is one number they do. So the angle is cut where the multiple changes, and between.

The cuts decide how tight the results are, and nothing else: whatever they are, every angle lies in one piece.
"""

from __future__ import annotations

import itertools
import math
import operator
import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.limits import ARRAY as ACTUATORS
from kinegen.backends.routines import SINCOS
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.templates import environment
from kinegen.ir.program import Constant, Operand, Operator, RuntimeParameter, Statement, Temporary, Variable
from kinegen.model.actuator_limits import reading_ranges
from kinegen.model.expression_values import Dimension
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.outputs import Array
from kinegen.model.robot import JointType, Robot
from kinegen.support.dataclass import dataclass

PIECES = 16
"""Pieces of a quarter turn. The terms that make up for rounding are differences of near numbers, whose intervals are as
wide as the piece."""

_KINDS: Mapping[ScalarType, Any] = {ScalarType.DOUBLE: np.float64, ScalarType.FLOAT: np.float32}


def pair_text(prefix: str, real: ScalarType) -> str:
    """Returns the emitted pair, as it stands in the kernels."""
    return environment().get_template(SINCOS[real].template).render(prefix=prefix, qualifier="static")


def cuts(real: ScalarType, low: float, high: float, pieces: int = PIECES) -> tuple[float, ...]:
    """Places at which a range of angles is cut.

    `pieces`: pieces of a quarter turn. Returns numbers of the type between the two, ascending; a piece begins with
    each, and the first one with `low`.
    """
    kind = _KINDS[real]
    multiple = multiple_of(real)
    numbers = range(math.floor(low / (math.pi / 2)), math.ceil(high / (math.pi / 2)) + 2)
    found: list[float] = []
    for left, right in itertools.pairwise(_first(multiple, number, kind) for number in numbers):
        found += [float(kind(left + (right - left) * part / pieces)) for part in range(pieces)]
    return tuple(place for place in found if low < place <= high)


def multiple_of(real: ScalarType) -> Callable[[Any], float]:
    """Returns how the pair of a number type finds the nearest multiple of pi/2, read from its text."""
    kind = _KINDS[real]
    text = pair_text("pair", real)
    number = r"(-?[\d.]+(?:e[+-]?\d+)?)F?;"
    steps = ("scaled = x * ", "turns = scaled * ", "shifted = turns + ", "k = shifted - ")
    scale, back, up, down = (kind(_only(re.escape(step) + number, text)) for step in steps)

    def multiple(x: Any) -> float:
        with np.errstate(over="ignore", invalid="ignore"):
            return float((((kind(x) * scale) * back) + up) - down)

    return multiple


def _only(pattern: str, text: str) -> str:
    """Returns the one match of a pattern."""
    (found,) = re.findall(pattern, text)
    return str(found)


def _first(multiple: Callable[[Any], float], number: int, kind: Any) -> float:
    """Returns the smallest number that belongs to a multiple, found by halving."""
    low, high = kind((number - 1) * math.pi / 2), kind(number * math.pi / 2)
    while np.nextafter(low, high) < high:
        middle = kind(low + (high - low) / kind(2))
        if multiple(middle) < number:
            low = middle
        else:
            high = middle
    return float(high)


Box = tuple[tuple[float, float], ...]
"""Lower and upper bound of each of some numbers."""

TURNS = 2
"""How far a revolute joint without limits is taken to turn, to either side."""

RATE, ACCELERATION = 100.0, 10_000.0
"""Largest rate and acceleration of a joint, in rad or lengths for a second, to either side."""

FAR = 2
"""How many times the reach of the robot the coordinates of points and targets go."""

_READING = 1e6
"""Largest reading of an actuator whose range nothing says."""


@dataclass(frozen=True, slots=True)
class InputRange:
    """What one number of an input may be.

    Attributes:
        name: Of the joint, the actuator, or the entry, such as `base_T_tool[3]`.
        unit: `rad`, a length, one of these for a second or its square, or empty for a bare number.
        source: `limits` of the file, or `assumed`.
    """

    name: str
    low: float
    high: float
    unit: str
    source: str


def joint_range(robot: Robot) -> Box:
    """Returns what is proved of which joint values: the limits, or what stands for them.

    Lower and upper bound of each joint variable, in radians or the file's length unit. Without limits: `TURNS` turns to
    either side, or for a prismatic joint the sum of the robot's lengths.
    """
    half = TURNS * 2 * math.pi
    return tuple(
        (-half, half) if variable.limits is None and variable.type is not JointType.PRISMATIC else bounds
        for variable, bounds in zip(robot.variables, joint_box(robot), strict=True)
    )


def input_ranges(robot: Robot, array: Array) -> tuple[InputRange, ...]:
    """Returns the range of each number of an input, those of the last row of a matrix among them.

    One range for each stored number, in order.
    """
    if array.is_pose:
        return _pose_ranges(robot, array)
    if array.name == ACTUATORS:
        return _reading_ranges(robot)
    if array.shape == (robot.dof,) and array.name in ("q", "qd", "qdd"):
        return _joint_ranges(robot, array.name)
    far = FAR * reach(robot)
    names = (f"{array.name}[{index}]" for index in range(array.stored))
    return tuple(InputRange(name, -far, far, robot.units.length, "assumed") for name in names)


def _joint_ranges(robot: Robot, name: str) -> tuple[InputRange, ...]:
    """Joint values, or their rates or accelerations."""
    most = {"qd": RATE, "qdd": ACCELERATION}.get(name)
    found = []
    for variable, (low, high) in zip(robot.variables, joint_range(robot), strict=True):
        unit = robot.units.length if variable.type is JointType.PRISMATIC else "rad"
        if most is None:
            source = "assumed" if variable.limits is None else "limits"
            found.append(InputRange(variable.name, low, high, unit, source))
        else:
            unit += "/s" if name == "qd" else "/s^2"
            found.append(InputRange(f"{name} of {variable.name}", -most, most, unit, "assumed"))
    return tuple(found)


def _reading_ranges(robot: Robot) -> tuple[InputRange, ...]:
    units = {Dimension.LENGTH: robot.units.length, Dimension.ANGLE: "rad", Dimension.NUMBER: ""}
    found = []
    for reading, (low, high) in zip(robot.actuators.readings, reading_ranges(robot), strict=True):
        source = "limits" if math.isfinite(low) and math.isfinite(high) else "assumed"
        bounds = max(low, -_READING), min(high, _READING)
        found.append(InputRange(reading.name, *bounds, units[reading.dimension], source))
    return tuple(found)


def _pose_ranges(robot: Robot, array: Array) -> tuple[InputRange, ...]:
    """Rotation entries between -1 and 1, each by itself; positions as far as `FAR` times the reach."""
    far, found = FAR * reach(robot), []
    for index in range(array.stored):
        row, column = divmod(index % 16, 4)
        name = f"{array.name}[{index}]"
        if row == 3:
            found.append(InputRange(name, float(column == 3), float(column == 3), "", "assumed"))
        elif column == 3:
            found.append(InputRange(name, -far, far, robot.units.length, "assumed"))
        else:
            found.append(InputRange(name, -1.0, 1.0, "", "assumed"))
    return tuple(found)


_COMBINED: Mapping[Operator, Callable[..., Any]] = {
    Operator.ADD: operator.add,
    Operator.SUB: operator.sub,
    Operator.MUL: operator.mul,
    Operator.NEG: operator.neg,
}


def angle_range(kernels: RobotPrograms, real: ScalarType, box: Box, most: float = np.inf) -> tuple[float, float]:
    """Returns the smallest and the largest angle whose sine and cosine the kernels take.

    `box`: the inputs, those of each program in order; its ends are rounded outwards; `most`: what stands for an angle
    that is not a sum of inputs, to either side. Numbers of the type; zero lies between them.
    """
    found = [(0.0, 0.0)]
    for program in kernels.programs:
        statements = {name: each for each in program.statements for name in each.results}
        sums = _Sums(kernels, real, box, statements, most)
        angles = {each.operands[0] for each in program.statements if each.operator is Operator.SINCOS}
        found += [sums.bounds(angle) for angle in angles]
    return min(float(low) for low, _ in found), max(float(high) for _, high in found)


def rounded(real: ScalarType, value: float, towards: float | None = None) -> float:
    """Returns a number of the type: the nearest, or, where one is named, the nearest on the way to an infinity."""
    kind = _KINDS[real]
    nearest = kind(value)
    if towards is not None and (float(nearest) > value if towards < 0 else float(nearest) < value):
        nearest = np.nextafter(nearest, kind(towards))
    return float(nearest)


@dataclass(frozen=True, slots=True)
class _Sums:
    """Bounds of sums of joint values, which rise or fall with each of them, so that ends go to ends."""

    kernels: RobotPrograms
    real: ScalarType
    box: Box
    statements: Mapping[str, Statement]
    most: float

    def bounds(self, operand: Operand) -> tuple[Any, Any]:
        """Returns the smallest and the largest value of an operand."""
        kind = _KINDS[self.real]
        match operand:
            case Variable(index):
                low, high = self.box[index]
                return kind(rounded(self.real, low, -np.inf)), kind(rounded(self.real, high, np.inf))
            case Constant(value):
                return (kind(self.real.round(value)),) * 2
            case RuntimeParameter(name):
                names = [parameter.name for parameter in self.kernels.robot.runtime_parameters]
                return (kind(self.real.round(self.kernels.defaults[names.index(name)])),) * 2
            case Temporary(name):
                return self._combined(self.statements[name])

    def _combined(self, statement: Statement) -> tuple[Any, Any]:
        if statement.operator not in _COMBINED:
            kind = _KINDS[self.real]
            return kind(-self.most), kind(self.most)
        parts = [self.bounds(operand) for operand in statement.operands]
        ends = [_COMBINED[statement.operator](*choice) for choice in itertools.product(*parts)]
        return min(ends), max(ends)
