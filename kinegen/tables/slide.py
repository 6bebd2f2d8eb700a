"""The axis of a joint that only shifts may be anywhere beside itself: it is put where its neighbours need least."""

from __future__ import annotations

from kinegen.robot.expressions import ZERO, negate
from kinegen.robot.model import Step, StepKind
from kinegen.tables.cells import Anchor, Cells
from kinegen.tables.choose import cost, link_cost
from kinegen.tables.links import links
from kinegen.tables.poses import Form, NotNumeric, Values, combined, expression_of, pose_of, scaled
from kinegen.tables.steps import Steps, folded, tidy

FREE = "the place of its axis"


def slide(cells: Cells, values: Values) -> dict[int, str]:
    """Move the axes of prismatic cells, with everything that is on them.

    Args:
        cells: Changed where an axis moves.
        values: The parameters.

    Returns:
        A line for each cell whose axis could be anywhere.
    """
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
    """Where the axis can go: it stays, or meets the next origin, or the one before."""
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
    """What the transforms on both sides cost, each taken apart in the best way."""
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
            cells.anchors[name] = Anchor(place, folded((*_back(move), *anchor.steps)))
