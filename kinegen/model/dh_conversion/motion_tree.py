"""The tree of motions about z with fixed transforms between them, and where axes that only shift are put.

In: a robot. Out: its cells, parents first, and for each of its rows the cell that carries the row's frame with the
steps from there. A row has one cell for each axis that its entries move about; nearly always that is one or none.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field

from kinegen.model.dh_conversion.elementary_transforms import Steps, folded, row_steps, tidy, total
from kinegen.model.dh_conversion.exact_poses import Form, NotNumeric, Values, combined, expression_of, pose_of, scaled
from kinegen.model.dh_conversion.fixed_transforms import cost, link_cost, links
from kinegen.model.expression_parser import PI, ZERO, Expression, linear, multiply, names, negate, number
from kinegen.model.expression_values import join
from kinegen.model.robot import JointType, Robot, Row, Step, StepKind
from kinegen.support.dataclass import dataclass

_QUARTER = multiply(number("1/2"), PI)
_ONTO = {
    0: (Step(StepKind.RY, _QUARTER), Step(StepKind.RY, negate(_QUARTER))),
    1: (Step(StepKind.RX, negate(_QUARTER)), Step(StepKind.RX, _QUARTER)),
}
"""The turns that bring z onto x and y, and back."""


@dataclass(slots=True)
class JointMotion:
    """A motion about and along z.

    Attributes:
        name: Of its row in the new table.
        origin: The row that it comes from.
        parent: Number of the cell before it; None at the root.
        link: Fixed steps from the parent's frame, after its motion, to the frame before this motion.
        theta: The turn, of joint variables alone.
        d: The shift, of joint variables alone.
        type: Type of the new row.
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
        """Tell whether it has a motion; the fixed end of a branch has none."""
        return self.type is not JointType.FIXED


@dataclass(frozen=True, slots=True)
class Attachment:
    """The cell that the frame of a row is on, or the root, and the fixed steps from there."""

    cell: int | None
    steps: Steps


@dataclass(slots=True)
class Cells:
    """All cells of a robot, and where the frames of its rows are."""

    cells: list[JointMotion] = field(default_factory=list)
    anchors: dict[str, Attachment] = field(default_factory=dict)

    def children(self, parent: int | None) -> list[int]:
        """Return the cells behind one, those that move first, in the order of the table."""
        found = [place for place, cell in enumerate(self.cells) if cell.parent == parent]
        return sorted(found, key=lambda place: (not self.cells[place].moves, place))


def fresh(name: str, taken: Iterable[str]) -> str:
    """Return a name that is not taken yet, also not in other case."""
    known = {each.upper() for each in taken}
    base, number_ = name[:36].rstrip("_"), 2
    found = base
    while found.upper() in known:
        found, number_ = f"{base}_{number_}", number_ + 1
    return found


def cells_of(robot: Robot) -> Cells:
    """Take a robot apart into its motions."""
    found = Cells()
    variables = frozenset(variable.name for variable in robot.variables)
    taken = {row.name for row in robot.rows} | {frame.name for frame in robot.frames}
    leaves = frozenset(robot.leaves) if robot.is_tree else frozenset()
    for row in robot.rows:
        start = found.anchors.get(row.parent, Attachment(None, ()))
        first = len(found.cells)
        found.anchors[row.name] = _walk(row, start, variables, found.cells)
        own = found.cells[first:]
        if not own and row.name in leaves:
            anchor = found.anchors[row.name]
            found.cells.append(JointMotion(row.name, row, anchor.cell, anchor.steps, ZERO, ZERO, JointType.FIXED))
            found.anchors[row.name] = Attachment(first, ())
        _name(row, own, taken)
    return found


def _walk(row: Row, start: Attachment, variables: frozenset[str], cells: list[JointMotion]) -> Attachment:
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
            cells.append(JointMotion("", row, here, link, theta, d, JointType.FOLLOWER))
            here, pending = len(cells) - 1, []
        pending.append(Step(StepKind.RZ if turns else StepKind.TZ, rest))
        pending += [back] if back else []
    return Attachment(here, folded(pending))


def _name(row: Row, own: list[JointMotion], taken: set[str]) -> None:
    """Give the cells of a row their names and types; the row's own name goes to the one with its variable."""
    holders = [cell for cell in own if row.variable and row.variable in _variables(cell)]
    main = holders[0] if holders else own[-1] if own else None
    for cell in own:
        if cell is main:
            cell.name, cell.type = row.name, row.type
        else:
            cell.name = fresh(f"{row.name}_follower", taken)
            taken.add(cell.name)


def _variables(cell: JointMotion) -> frozenset[str]:
    return frozenset((*names(cell.theta), *names(cell.d)))


FREE = "the lateral position of its axis"


def slide(cells: Cells, values: Values) -> dict[int, str]:
    """Move the axes of prismatic cells, with all that is on them; return a line for each that could be anywhere."""
    found = {}
    for place, cell in enumerate(cells.cells):
        if not cell.moves or cell.theta != ZERO:
            continue
        found[place] = FREE
        behind = cells.children(place)
        after = cells.cells[behind[0]].link if behind else ()
        try:
            best = min(_places(cell.link, after, values), key=lambda move: _needs(cell.link, move, after, values))
        except NotNumeric:
            continue
        _move(cells, place, best)
    return found


def _places(before: Steps, after: Steps, values: Values) -> tuple[Steps, ...]:
    """Return where the axis can go: it stays, or meets the next origin, or the one before."""
    ahead, back = pose_of(after, values), pose_of(before, values)
    matrix = back.rotation
    turned = [combined(*(scaled(-matrix[i][j], back.shift[i]) for i in range(3))) for j in range(2)]
    return (
        (),
        _across(ahead.shift[0], ahead.shift[1], algebraic=ahead.algebraic),
        _across(turned[0], turned[1], algebraic=back.algebraic),
    )


def _across(x: Form, y: Form, *, algebraic: bool) -> Steps:
    found = [expression_of(form, algebraic=algebraic) for form in (x, y)]
    if not all(each.exact for each in found):
        return ()
    steps = (Step(kind, each.expression) for kind, each in zip((StepKind.TX, StepKind.TY), found, strict=True))
    return tuple(step for step in steps if step.value != ZERO)


def _back(move: Steps) -> Steps:
    return tuple(Step(step.kind, tidy(negate(step.value))) for step in move)


def _needs(before: Steps, move: Steps, after: Steps, values: Values) -> float:
    """Return what the transforms on both sides cost, each taken apart in the best way."""
    near = links(folded((*before, *move)), values)
    far = links(folded((*_back(move), *after)), values)
    return min(link_cost(a) + link_cost(b) + cost(a.last + b.pairs[0][0]) for a in near for b in far)


def _move(cells: Cells, place: int, move: Steps) -> None:
    if not move:
        return
    cells.cells[place].link = folded((*cells.cells[place].link, *move))
    for cell in cells.cells:
        if cell.parent == place:
            cell.link = folded((*_back(move), *cell.link))
    for name, anchor in cells.anchors.items():
        if anchor.cell == place:
            cells.anchors[name] = Attachment(place, folded((*_back(move), *anchor.steps)))
