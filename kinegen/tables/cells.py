"""The tree of motions: each cell turns about and moves along its own z, and fixed transforms lie between cells.

In: a robot. Out: its cells, parents first, and for each of its rows the cell that carries the row's frame with the
steps from there. A row has one cell for each axis that its entries move about; nearly always that is one or none.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from kinegen.robot.expressions import PI, ZERO, Expression, linear, multiply, names, negate, number
from kinegen.robot.model import JointType, Robot, Row, Step, StepKind
from kinegen.robot.units import join
from kinegen.tables.steps import Steps, folded, row_steps, total

_QUARTER = multiply(number("1/2"), PI)
_ONTO = {
    0: (Step(StepKind.RY, _QUARTER), Step(StepKind.RY, negate(_QUARTER))),
    1: (Step(StepKind.RX, negate(_QUARTER)), Step(StepKind.RX, _QUARTER)),
}
"""The turns that bring z onto x and y, and back."""


@dataclass(slots=True)
class Cell:
    """A motion about and along z.

    Attributes:
        name: Of its row in the new table.
        origin: The row that it comes from.
        parent: Number of the cell before it; None at the root.
        link: Fixed steps from the parent's frame, after its motion, to the frame before this motion.
        theta: The turn, of joint variables alone.
        d: The shift, of joint variables alone.
        type: What the new row does.
    """

    name: str
    origin: Row
    parent: int | None
    link: Steps
    theta: Expression
    d: Expression
    type: JointType

    @property
    def moves(self) -> bool:
        """Whether it has a motion; the fixed end of a branch has none."""
        return self.type is not JointType.FIXED


@dataclass(frozen=True, slots=True)
class Anchor:
    """Where the frame of a row is: on a cell, or on the root, and the fixed steps from there."""

    cell: int | None
    steps: Steps


@dataclass(slots=True)
class Cells:
    """All cells of a robot, and where the frames of its rows are."""

    cells: list[Cell] = field(default_factory=list)
    anchors: dict[str, Anchor] = field(default_factory=dict)

    def children(self, parent: int | None) -> list[int]:
        """The cells behind one, those that move first, in the order of the table."""
        found = [place for place, cell in enumerate(self.cells) if cell.parent == parent]
        return sorted(found, key=lambda place: (not self.cells[place].moves, place))


def fresh(name: str, taken: Iterable[str]) -> str:
    """A name that is not taken yet, also not in other case."""
    known = {each.upper() for each in taken}
    base, number_ = name[:36].rstrip("_"), 2
    found = base
    while found.upper() in known:
        found, number_ = f"{base}_{number_}", number_ + 1
    return found


def cells_of(robot: Robot) -> Cells:
    """Take a robot apart into its motions.

    Args:
        robot: Any robot.
    """
    found = Cells()
    variables = frozenset(variable.name for variable in robot.variables)
    taken = {row.name for row in robot.rows} | {frame.name for frame in robot.frames}
    leaves = frozenset(robot.leaves) if robot.is_tree else frozenset()
    for row in robot.rows:
        start = found.anchors.get(row.parent, Anchor(None, ()))
        first = len(found.cells)
        found.anchors[row.name] = _walk(row, start, variables, found.cells)
        own = found.cells[first:]
        if not own and row.name in leaves:
            anchor = found.anchors[row.name]
            found.cells.append(Cell(row.name, row, anchor.cell, anchor.steps, ZERO, ZERO, JointType.FIXED))
            found.anchors[row.name] = Anchor(first, ())
        _name(row, own, taken)
    return found


def _walk(row: Row, start: Anchor, variables: frozenset[str], cells: list[Cell]) -> Anchor:
    """Append the cells of one row; return where its frame is."""
    here, pending, first = start.cell, list(start.steps), len(cells)
    for step in row_steps(row):
        factors, rest = linear(step.value, variables)
        if not factors:
            pending.append(step)
            continue
        there, back = _ONTO.get(step.kind.axis, (None, None))
        link = folded([*pending, there] if there else pending)
        moving = total(join(factors, ZERO))
        turns = step.kind.is_rotation
        # A shift along the axis that the row already turns about is the same motion.
        if len(cells) > first and all(each.kind.axis == 2 for each in link):
            cell, pending = cells[-1], list(link)
            cell.theta, cell.d = (total(cell.theta, moving), cell.d) if turns else (cell.theta, total(cell.d, moving))
        else:
            theta, d = (moving, ZERO) if turns else (ZERO, moving)
            cells.append(Cell("", row, here, link, theta, d, JointType.FOLLOWER))
            here, pending = len(cells) - 1, []
        pending.append(Step(StepKind.RZ if turns else StepKind.TZ, rest))
        pending += [back] if back else []
    return Anchor(here, folded(pending))


def _name(row: Row, own: list[Cell], taken: set[str]) -> None:
    """Give the cells of a row their names and types; the row's own name goes to the one with its variable."""
    holders = [cell for cell in own if row.variable and row.variable in _variables(cell)]
    main = holders[0] if holders else own[-1] if own else None
    for cell in own:
        if cell is main:
            cell.name, cell.type = row.name, row.type
        else:
            cell.name = fresh(f"{row.name}_follower", taken)
            taken.add(cell.name)


def _variables(cell: Cell) -> frozenset[str]:
    return frozenset((*names(cell.theta), *names(cell.d)))
