"""Everything that `kinegen show` prints about a robot, as ordered trees: the table, link matrices, closed forms.

In: a robot and two frames. Out: one record, which every notation lays out in its own way. A product that no page could
hold is left as a product of shorter ones.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

from kinegen.angles import AngleLabels
from kinegen.errors import KinegenError
from kinegen.outputs import Reference
from kinegen.robot.model import BASE, TOOL, Robot
from kinegen.symbolic.chain import FrameName, frames_between, transforms_between
from kinegen.symbolic.fold import fold
from kinegen.symbolic.transforms import symbols
from kinegen.textbook.closed_form import ClosedForm, Sum, closed_form, label_order, transform_name
from kinegen.textbook.jacobian import jacobian_form, jacobian_name
from kinegen.textbook.table import Table, read_table

MOST_TURNS = 10
"""A product of more turns, which doubles its length with every other one, is printed in parts."""

TURNS_OF_A_PART = 7
"""As many as an arm has that people know how to read."""

TURNS_OF_A_LINK = 14
"""A single row can hold many more, and its matrix would fill all memory."""


@dataclass(frozen=True, slots=True)
class Product:
    """A transform as a product of closed forms, of which there is one unless it is long.

    Attributes:
        name: Such as `base_T_tool`.
        factors: From left to right.
    """

    name: str
    factors: tuple[ClosedForm, ...]


@dataclass(frozen=True, slots=True)
class Sheet:
    """What is printed.

    Attributes:
        robot: The robot.
        table: Its table, or of a part the rows on the way.
        links: The link matrices on the way; empty unless asked for.
        products: One for each tip, or the one asked for.
        angles: Label and angle of every sine and cosine that occurs.
    """

    robot: Robot
    table: Table
    links: tuple[ClosedForm, ...]
    products: tuple[Product, ...]
    angles: tuple[tuple[str, Sum], ...]


def make_sheet(
    robot: Robot,
    start: FrameName | None,
    end: FrameName | None,
    *,
    steps: bool = False,
    jacobian: Reference | None = None,
) -> Sheet:
    """Gather what is to be printed.

    Args:
        robot: The robot.
        start: Frame of reference; if left out the base, which is frame 0 where nothing lies between the two.
        end: Frame that is reached; the tool, or every tip of a tree, if left out.
        steps: Whether to add every link matrix on the way.
        jacobian: Reference of the Jacobian that is printed in place of the pose; None for the pose.

    Raises:
        KinegenError: If a frame does not exist, or a single row is too long to be printed.
    """
    if start == BASE != robot.root:
        raise KinegenError("'base' is a joint of this robot as well as its root frame; give a row number, or no --from")
    labels = AngleLabels(robot.dof)
    begin = start if start is not None else 0 if str(end).isdecimal() and not robot.base else robot.root
    ends: tuple[FrameName, ...] = robot.tips if end is None else (end,)
    ways = [frames_between(robot, begin, tip) for tip in ends]
    pairs = dict.fromkeys(pair for way in ways for pair in way if steps and _is_link(robot, pair))
    matrices = tuple(_form(robot, *_numbered(robot, pair), labels) for pair in pairs)
    if jacobian is None:
        products = tuple(_product(robot, begin, tip, labels) for tip in ends)
    else:
        products = tuple(_jacobian(robot, begin, tip, jacobian, labels) for tip in ends)
    # A way of one link is its link matrix.
    links = tuple(form for form in matrices if all(form not in product.factors for product in products))
    forms = (*links, *(form for product in products for form in product.factors))
    found = {label: angle for form in forms for label, angle in form.angles}
    return Sheet(
        robot=robot,
        table=read_table(robot, None if start is end is None else frozenset(name for way in ways for _, name in way)),
        links=links,
        products=products,
        angles=tuple(sorted(found.items(), key=lambda item: label_order(item[0]))),
    )


def _product(robot: Robot, start: FrameName, end: FrameName, labels: AngleLabels) -> Product:
    cuts = _cuts(robot, start, end)
    factors = tuple(_form(robot, left, right, labels) for left, right in itertools.pairwise(cuts))
    return Product(transform_name(start, end), factors)


def _jacobian(robot: Robot, start: FrameName, end: FrameName, reference: Reference, labels: AngleLabels) -> Product:
    name = jacobian_name(start, end, reference)
    turns = _turns(robot, start, end)
    if turns > MOST_TURNS:
        raise KinegenError(
            f"{name} has {turns} turns and is too long to be printed; select a part with --from and --to"
        )
    return Product(name, (jacobian_form(robot, start, end, reference, labels),))


def _form(robot: Robot, start: FrameName, end: FrameName, labels: AngleLabels) -> ClosedForm:
    turns = _turns(robot, start, end)
    if turns > TURNS_OF_A_LINK:
        name = transform_name(start, end)
        raise KinegenError(
            f"{name} has {turns} turns and is too long to be printed; select a part with --from and --to"
        )
    return closed_form(robot, start, end, labels)


def _cuts(robot: Robot, start: FrameName, end: FrameName) -> tuple[FrameName, ...]:
    """The frames at which a product is cut into parts, with both of its ends."""
    if _turns(robot, start, end) <= MOST_TURNS:
        return start, end
    ancestors = {child: parent for parent, child in frames_between(robot, robot.root, end)}
    stations = [start]
    before = start
    for parent, child in frames_between(robot, start, end):
        reached = child if ancestors.get(child) == parent else parent
        if _turns(robot, stations[-1], reached) > TURNS_OF_A_PART and _turns(robot, stations[-1], before):
            stations.append(before)
        before = _number(robot, reached)
    return (*stations, end)


def _turns(robot: Robot, start: FrameName, end: FrameName) -> int:
    return len(fold(transforms_between(robot, start, end, symbols(robot, keep_parameters=True))).turns)


def _is_link(robot: Robot, pair: tuple[str, str]) -> bool:
    """Whether two frames are joined by something; base and tool often are not."""
    if pair == (robot.root, "0"):
        return bool(robot.base)
    return pair[1] != TOOL or bool(robot.tool)


def _numbered(robot: Robot, pair: tuple[str, str]) -> tuple[FrameName, FrameName]:
    return _number(robot, pair[0]), _number(robot, pair[1])


def _number(robot: Robot, frame: FrameName) -> FrameName:
    return next((row.number for row in robot.rows if row.name == frame), frame)
