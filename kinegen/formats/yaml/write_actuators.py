"""The `actuators` of a robot as lines of a robot file."""

from __future__ import annotations

from collections.abc import Callable

from kinegen.formats.yaml.blocks import Cells, flow
from kinegen.formats.yaml.keys import BARS
from kinegen.robot.actuators.model import Coupling, Drive, Formula, FourBar, Triangle
from kinegen.robot.dimension import Dimension
from kinegen.robot.expressions import ZERO, Expression, Name, add, multiply, negate, power
from kinegen.robot.model import JointType, Robot
from kinegen.robot.units import RADIAN
from kinegen.robot.values import checked_value

Spell = Callable[[Expression, Dimension], str]
"""Text of an expression in the units of the file, by what its place measures."""


def actuator_lines(robot: Robot, spell: Spell, *, degrees: bool) -> list[str]:
    """Write `actuators`; nothing where the robot has none.

    Args:
        robot: The robot.
        spell: Writes one expression.
        degrees: Whether the angles of the file count in degrees.
    """
    actuators = robot.actuators
    if not actuators.readings:
        return []
    lines = ["actuators:", "  readings:"]
    for reading in actuators.readings:
        cells = {"dimension": str(reading.dimension)}
        if reading.limits:
            cells["limits"] = f"[{', '.join(spell(limit, reading.dimension) for limit in reading.limits)}]"
        lines.append(f"    {reading.name}: {flow(cells)}")
    writer = _Drives(robot, spell, degrees=degrees)
    lines += ["  joints:", *(f"    - {flow(writer.drive(drive))}" for drive in actuators.drives)]
    if actuators.inverse:
        lines.append("  inverse:")
        known = {reading.name: reading.dimension for reading in actuators.readings}
        lines += [f"    {name}: {spell(value, known[name])}" for name, value in actuators.inverse]
    return lines


class _Drives:
    """Writes entry by entry."""

    def __init__(self, robot: Robot, spell: Spell, *, degrees: bool) -> None:
        self.spell, self.degrees = spell, degrees
        self.values = {each.name: checked_value(each.value, {}) for each in robot.parameters}
        self.readings = {reading.name: reading.dimension for reading in robot.actuators.readings}
        self.slides = {each.name for each in robot.variables if each.type is JointType.PRISMATIC}

    def drive(self, drive: Drive) -> Cells:
        """The keys of one entry with their texts."""
        match drive:
            case Coupling():
                return self._coupling(drive)
            case Triangle():
                cells = {"joint": drive.joint, "form": "linear_actuator", "actuator": drive.actuator}
                cells["sides"] = f"[{', '.join(self.spell(side, Dimension.LENGTH) for side in drive.sides)}]"
                cells["length"] = self.spell(self._linear(drive.actuator, drive.length), Dimension.LENGTH)
                return cells | self._turned(drive)
            case FourBar():
                cells = {"joint": drive.joint, "form": "four_bar", "actuator": drive.actuator}
                cells |= {key: self.spell(bar, Dimension.LENGTH) for key, bar in zip(BARS, drive.bars, strict=True)}
                cells["angle"] = self.spell(self._linear(drive.actuator, drive.angle), Dimension.ANGLE)
                return cells | {"branch": "crossed" if drive.crossed else "open"} | self._turned(drive)
            case Formula():
                return {"joint": drive.joint, "value": self.spell(drive.value, self._dimension(drive.joint))}

    def _dimension(self, joint: str) -> Dimension:
        return Dimension.LENGTH if joint in self.slides else Dimension.ANGLE

    def _linear(self, reading: str, factors: tuple[Expression, Expression]) -> Expression:
        return add(multiply(factors[0], Name(reading)), factors[1])

    def _turned(self, drive: Triangle | FourBar) -> Cells:
        offset = {} if drive.offset == ZERO else {"offset": self.spell(drive.offset, Dimension.ANGLE)}
        return ({"sign": "-1"} if drive.sign < 0 else {}) | offset

    def _entry(self, joint: str, reading: str, entry: Expression) -> str:
        """An entry of a matrix; a bare number turns a joint by the unit of the file."""
        return self.spell(entry, Dimension.ANGLE if self._is_bare(joint, reading) else Dimension.LENGTH)

    def _is_bare(self, joint: str, reading: str) -> bool:
        return self._dimension(joint) is Dimension.ANGLE and self.readings[reading] is Dimension.NUMBER

    def _coupling(self, drive: Coupling) -> Cells:
        offsets = [
            self.spell(each, self._dimension(joint)) for joint, each in zip(drive.joints, drive.offsets, strict=True)
        ]
        if len(drive.joints) == 1:
            return self._gear(drive, offsets[0])
        lines = [
            f"[{', '.join(self._entry(joint, name, entry) for name, entry in zip(drive.actuators, row, strict=True))}]"
            for joint, row in zip(drive.joints, drive.matrix, strict=True)
        ]
        cells = {"joints": f"[{', '.join(drive.joints)}]", "form": "coupling"}
        cells |= {"actuators": f"[{', '.join(drive.actuators)}]", "matrix": f"[{', '.join(lines)}]"}
        return cells | ({"offsets": f"[{', '.join(offsets)}]"} if set(drive.offsets) != {ZERO} else {})

    def _gear(self, drive: Coupling, offset: str) -> Cells:
        """One joint of one reading: its ratio is positive, and may hold runtime parameters."""
        (joint,), (reading,), ((entry,),) = drive.joints, drive.actuators, drive.matrix
        if self.degrees and self._is_bare(joint, reading):
            entry = multiply(RADIAN, entry)
        turned = checked_value(entry, self.values) < 0
        ratio = power(negate(entry) if turned else entry, -1)
        cells = {"joint": joint, "form": "gear", "actuator": reading}
        cells |= {"ratio": self.spell(ratio, Dimension.LENGTH)} | ({"sign": "-1"} if turned else {})
        return cells | ({"offset": offset} if drive.offsets != (ZERO,) else {})
