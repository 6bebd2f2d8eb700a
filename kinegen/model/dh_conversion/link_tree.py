"""A robot as other tools describe one: links, and joints that turn about or shift along one axis, or follow another.

In: any robot. Out: joints, parents first, each with a fixed origin and at most one motion. A row that has its frame
behind a twist is a moving joint and a fixed one. Numbers are those of the file's parameters, in metres and radians.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import Any

from kinegen.errors import KinegenError
from kinegen.model import expression_values
from kinegen.model.dh_conversion.elementary_transforms import Steps, row_steps
from kinegen.model.dh_conversion.exact_poses import MP, Values, pose_of, rational, settled, value_of
from kinegen.model.dh_conversion.motion_tree import Cells, JointMotion, cells_of, fresh
from kinegen.model.dh_conversion.row_placement import angles_of
from kinegen.model.expression_parser import Expression, linear
from kinegen.model.robot import ROOT, TOOL, WRIST, JointType, Robot
from kinegen.support.dataclass import dataclass

METRES = {unit: Fraction(str(size)) for unit, size in expression_values.METRES.items()}
"""The length units of robot files, exactly."""

DIGITS = 20
"""Of a number that no decimal is."""


@dataclass(frozen=True, slots=True)
class Decimal:
    """A number as decimal text, and whether it is exact; a share of pi is named by its share."""

    text: str
    exact: bool


@dataclass(frozen=True, slots=True)
class Joint:
    """A fixed origin and a motion.

    Attributes:
        xyz: Origin of the joint in the parent, in metres.
        rpy: Roll, pitch and yaw of the origin, in radians.
        turns: Whether it turns about its axis; None if it is fixed.
        sign: 1, or -1 where it moves against z.
        limits: Bounds in radians or metres, or None.
        mimic: The joint that it follows and its multiplier, or None.
        row: The row that it comes from, or empty.
    """

    name: str
    parent: str
    child: str
    xyz: tuple[Decimal, Decimal, Decimal]
    rpy: tuple[Decimal, Decimal, Decimal]
    turns: bool | None = None
    sign: int = 1
    limits: tuple[Decimal, Decimal] | None = None
    mimic: tuple[str, Decimal] | None = None
    row: str = ""

    @property
    def decimals(self) -> tuple[Decimal, ...]:
        """All of its numbers."""
        further = (self.mimic[1],) if self.mimic else ()
        return (*self.xyz, *self.rpy, *(self.limits or ()), *further)


def decimal(value: Any) -> Decimal:
    """Return a number as decimal text: exactly if it has a short decimal, else with 20 digits."""
    simple = rational(MP.mpf(value))
    if simple is not None:
        scaled = simple * 10**18
        if scaled.denominator == 1:
            digits = str(abs(scaled.numerator)).rjust(19, "0")
            text = f"{digits[:-18]}.{digits[-18:]}".rstrip("0").rstrip(".")
            return Decimal("-" * (simple < 0) + text, exact=True)
    return Decimal(MP.nstr(MP.mpf(value), DIGITS, min_fixed=-8, max_fixed=20), exact=False)


def joints_of(robot: Robot) -> tuple[Joint, ...]:
    """Describe a robot by joints, parents first; every frame is a link, the tool too.

    Raises:
        KinegenError: If a joint moves by a factor of its own variable, which links and joints cannot say.
    """
    return _Describer(robot, cells_of(robot)).joints()


class _Describer:
    """Appends joints."""

    def __init__(self, robot: Robot, cells: Cells) -> None:
        self.robot, self.cells = robot, cells
        self.root = "base_link" if robot.root == ROOT else robot.root
        self.values = Values(tuple((p.name, value_of(p.value, {})) for p in robot.parameters), frozenset())
        self.metres = METRES[robot.units.length]
        self.links = [row.name for row in robot.rows] + [frame.name for frame in robot.frames] + [TOOL, self.root]
        self.names = [row.name for row in robot.rows]
        self.variables = {each.name: each for each in robot.variables}
        self.ends: dict[int | None, str] = {}
        self.signs: dict[str, int] = {}
        self.given: set[str] = set()

    def joints(self) -> tuple[Joint, ...]:
        """Return all joints."""
        robot = self.robot
        found: list[Joint] = []
        # A base transform gets a link of its own, so that joints begin behind it.
        start = self.root
        if robot.base:
            start = fresh("base_frame", self.links)
            self.links.append(start)
            found.append(self._fixed(self.root, start, robot.base))
        self.ends[None] = start
        self._note_signs()
        for number in range(len(self.cells.cells)):
            found += self._cell(number)
        # Rows that no motion ends at are fixed to what carries them.
        for row in robot.rows:
            if row.name in self.ends.values():
                continue
            if any(cell.origin is row for cell in self.cells.cells):
                anchor = self.cells.anchors[row.name]
                found.append(self._fixed(self.ends[anchor.cell], row.name, anchor.steps))
            else:
                above = start if row.parent == robot.root else row.parent
                found.append(self._fixed(above, row.name, row_steps(row)))
        last = robot.rows[-1].name if robot.rows else start
        if not robot.is_tree:
            found.append(self._fixed(last, TOOL, robot.tool))
        # Named frames are links too, and so is the tool of a chain.
        named = {row.name for row in robot.rows}
        for frame in robot.frames:
            parent = last if frame.parent == WRIST and WRIST not in named else frame.parent
            found.append(self._fixed(self.root if parent == robot.root else parent, frame.name, frame.steps))
        return tuple(found)

    def _note_signs(self) -> None:
        """Note which way each joint of the joint vector moves along its z."""
        for cell in self.cells.cells:
            for turns, name, factor in self._motions(cell):
                if name == cell.name and name not in self.signs and cell.origin.variable == name:
                    if abs(factor) != 1:
                        kind = "turns" if turns else "shifts"
                        raise KinegenError(
                            f"joint {name} {kind} by {MP.nstr(factor, 6)} times its variable, which a joint of a URDF "
                            "and other tools cannot do; give the row a variable without a factor"
                        )
                    self.signs[name] = int(factor)

    def _motions(self, cell: JointMotion) -> Iterator[tuple[bool, str, Any]]:
        """Return the motions of a cell: whether it turns, by which variable, and the factor; its own variable first."""
        found = []
        for turns, expression in ((True, cell.theta), (False, cell.d)):
            factors, _ = linear(expression, frozenset(self.variables))
            found += [(turns, name, self._factor(factor)) for name, factor in factors.items()]
        own = cell.origin.variable
        yield from sorted(found, key=lambda each: each[1] != own)

    def _factor(self, expression: Expression) -> Any:
        return settled(value_of(expression, dict(self.values.values)))

    def _cell(self, number: int) -> list[Joint]:
        cell = self.cells.cells[number]
        parent, origin = self.ends[cell.parent], cell.link
        anchor = self.cells.anchors[cell.origin.name]
        motions = list(self._motions(cell)) if cell.moves else []
        exact = anchor.cell == number and not anchor.steps
        found = []
        # A row that follows several joints is as many joints behind each other.
        for place, (turns, name, factor) in enumerate(motions):
            last = place == len(motions) - 1
            child = cell.origin.name if last and exact else fresh(f"{cell.name}_axis", self.links)
            self.links.append(child)
            found.append(self._moving(cell, (turns, name, factor), parent, child, origin))
            parent, origin = child, ()
        if not motions:
            found.append(self._fixed(parent, cell.name, origin))
            parent = cell.name
        self.ends[number] = parent
        return found

    def _moving(
        self, cell: JointMotion, motion: tuple[bool, str, Any], parent: str, child: str, origin: Steps
    ) -> Joint:
        turns, variable, factor = motion
        own = cell.origin.variable == variable and cell.name == variable and variable not in self.given
        name = variable if own else fresh(f"{cell.name}_{variable}", self.names)
        self.names.append(name)
        xyz, rpy = self._origin(origin)
        if own:
            self.given.add(variable)
            return Joint(name, parent, child, xyz, rpy, turns, self.signs[variable], self._limits(variable), None, name)
        # A joint shifts by radians, or turns by the file's lengths, of the joint that it follows.
        slides = self.variables[variable].type is JointType.PRISMATIC
        scale = (self.metres if not turns else Fraction(1)) / (self.metres if slides else Fraction(1))
        multiplier = decimal(factor * MP.mpf(scale.numerator) / scale.denominator)
        return Joint(name, parent, child, xyz, rpy, turns, 1, None, (variable, multiplier), cell.origin.name)

    def _limits(self, name: str) -> tuple[Decimal, Decimal] | None:
        variable = self.variables[name]
        if variable.limits is None:
            return None
        scale = self.metres if variable.type is JointType.PRISMATIC else Fraction(1)
        low, high = (
            decimal(value_of(limit, {}) * MP.mpf(scale.numerator) / scale.denominator) for limit in variable.limits
        )
        return low, high

    def _fixed(self, parent: str, child: str, steps: Steps) -> Joint:
        name = fresh(f"{child}_fixed", self.names)
        self.names.append(name)
        return Joint(name, parent, child, *self._origin(steps))

    def _origin(self, steps: Steps) -> tuple[tuple[Decimal, Decimal, Decimal], tuple[Decimal, Decimal, Decimal]]:
        pose = pose_of(steps, self.values)
        scale = MP.mpf(self.metres.numerator) / self.metres.denominator
        x, y, z = (decimal(self.values.length(form) * scale) for form in pose.shift)
        yaw, pitch, roll = angles_of(pose.rotation)
        return (x, y, z), (decimal(roll), decimal(pitch), decimal(yaw))
