"""What is printed of a robot: the table, the forms, and the names of joint variables, ready for any notation."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any, TypeVar, cast

from kinegen.backends.textbook import ORIENTATIONS, OUTPUTS, SINGULARITIES, VARIABLES
from kinegen.backends.textbook.closed_form import (
    SEQUENCES,
    ClosedForm,
    Sum,
    Symbol,
    closed_form,
    label_order,
    link_matrix,
    transform_name,
)
from kinegen.backends.textbook.table import Table, read_table
from kinegen.derive.folding import fold
from kinegen.derive.transforms import FrameName, frames_between, symbols, transforms_between
from kinegen.errors import KinegenError
from kinegen.model.angle_sums import AngleLabels
from kinegen.model.robot import BASE, TOOL, JointType, Robot
from kinegen.support.dataclass import dataclass

if TYPE_CHECKING:
    from kinegen.backends.textbook.singularities import LociForm

T = TypeVar("T")


def kind_names(robot: Robot) -> dict[str, str]:
    """Return the names of joint variables by kind, for those of q1, q2, ... that no parameter has already."""
    taken = {parameter.name.replace("_", "") for parameter in robot.parameters}
    found = {}
    for variable in robot.variables:
        name = f"{'d' if variable.type is JointType.PRISMATIC else 'theta'}{variable.index + 1}"
        if name not in taken:
            found[f"q{variable.index + 1}"] = name
    return found


def renamed(record: T, names: Mapping[str, str]) -> T:
    """Return a record with other names for joint variables, wherever these are in it.

    `record`: a sheet, a table, a form, a tree, or a tuple of such. `names`: new names by the old ones.
    """
    return cast("T", _renamed(record, names))


def _renamed(record: Any, names: Mapping[str, str]) -> Any:
    if isinstance(record, Symbol):
        return replace(record, name=names.get(record.name, record.name)) if record.kind == "joint" else record
    if isinstance(record, tuple):
        return tuple(_renamed(each, names) for each in record)
    if is_dataclass(record) and not isinstance(record, (Robot, type)):
        return replace(record, **{each.name: _renamed(getattr(record, each.name), names) for each in fields(record)})
    return record


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
    """Holds what is printed.

    Attributes:
        table: Its table, or of a part the rows on the way.
        links: The link matrices on the way; empty unless asked for.
        products: One for each tip, or the one asked for.
        angles: Label and angle of every sine and cosine that occurs.
        loci: Determinants and singular places, printed in place of the products, which are then their values.
        variables: Names of joint variables in place of q1, q2, ..., by those.
    """

    robot: Robot
    table: Table
    links: tuple[ClosedForm, ...]
    products: tuple[Product, ...]
    angles: tuple[tuple[str, Sum], ...]
    loci: tuple[LociForm, ...] = ()
    variables: tuple[tuple[str, str], ...] = ()


def make_sheet(
    robot: Robot,
    start: FrameName | None,
    end: FrameName | None,
    *,
    output: str = "pose",
    steps: bool = False,
    named: bool = False,
    blocks: bool = False,
    general: bool = False,
    variables: str = VARIABLES[0],
) -> Sheet:
    """Gather what is to be printed.

    Args:
        start: Frame of reference; if left out the base, which is frame 0 where nothing lies between the two.
        end: Frame that is reached; the tool, or every tip of a tree, if left out.
        output: What is printed of these frames, one of `kinegen.backends.textbook.OUTPUTS`.
        steps: Whether to add every link matrix on the way, and their products.
        named: Whether what is used more than once has a name.
        blocks: Whether a Jacobian is printed as its linear and its angular part.
        general: Whether to add the general link matrix of each convention.
        variables: What joint variables are called, one of `kinegen.backends.textbook.VARIABLES`.

    Raises:
        KinegenError: If a frame does not exist, or a single row is too long to be printed.
    """
    if start == BASE != robot.root:
        raise KinegenError("'base' is a joint of this robot as well as its root frame; give a row number, or no --from")
    _check(robot, output, named=named, blocks=blocks, general=general)
    labels = AngleLabels(robot.dof)
    begin = start if start is not None else 0 if str(end).isdecimal() and not robot.base else robot.root
    ends: tuple[FrameName, ...] = robot.tips if end is None else (end,)
    ways = [frames_between(robot, begin, tip) for tip in ends]
    matrices = _steps(robot, begin, ways, labels) if steps else ()
    loci = _loci(robot, begin, ends, labels) if output == SINGULARITIES else ()
    if output == SINGULARITIES:
        products = tuple(Product(form.values.name, (form.values,)) for form in loci if form.values)
    else:
        printer = _Printer(robot, labels, output, named=named, blocks=blocks)
        products = tuple(product for tip in ends for product in printer.products(begin, tip))
    # A way of one link is its link matrix.
    links = tuple(form for form in matrices if all(form not in product.factors for product in products))
    if general:
        used = dict.fromkeys(row.convention for row in robot.rows if row.convention in SEQUENCES)
        links = (*map(link_matrix, used), *links)
    forms = (*links, *(form for product in products for form in product.factors))
    met = [*(form.angles for form in forms), *(form.angles for form in loci)]
    found = {label: angle for angles in met for label, angle in angles}
    sheet = Sheet(
        robot=robot,
        table=read_table(robot, None if start is end is None else frozenset(name for way in ways for _, name in way)),
        links=links,
        products=products,
        angles=tuple(sorted(found.items(), key=lambda item: label_order(item[0]))),
        loci=loci,
    )
    names = {} if variables == VARIABLES[0] else kind_names(robot)
    return replace(renamed(sheet, names), variables=tuple(names.items())) if names else sheet


def _loci(robot: Robot, begin: FrameName, ends: tuple[FrameName, ...], labels: AngleLabels) -> tuple[LociForm, ...]:
    """Return the determinants of all ends; of several ends, one that no joint moves is left out."""
    # Other printouts need no NumPy, and do not wait for it.
    from kinegen.backends.textbook.singularities import loci_form
    from kinegen.derive.singularities.loci import chain_screws

    moved = tuple(end for end in ends if chain_screws(robot, begin, end).joints)
    return tuple(loci_form(robot, begin, end, labels) for end in moved or ends[:1])


def _check(robot: Robot, output: str, *, named: bool, blocks: bool, general: bool) -> None:
    """Refuse what would change nothing."""
    if blocks and OUTPUTS[output] is None:
        raise KinegenError(f"blocks are parts of a Jacobian, and the output is {output} (expected --output jacobian)")
    if named and (output in ORIENTATIONS or output == SINGULARITIES):
        raise KinegenError(
            f"--name-subexpressions is for poses and Jacobians; {output} has names for long parts already"
        )
    if general and not any(row.convention in SEQUENCES for row in robot.rows):
        raise KinegenError(
            f"{robot.name} has no row of a table, only elementary transforms, so there is no link matrix"
        )


def _steps(
    robot: Robot, begin: FrameName, ways: Sequence[Sequence[tuple[str, str]]], labels: AngleLabels
) -> tuple[ClosedForm, ...]:
    """Return the link matrices on some ways, and their products from the beginning on."""
    first = 0 if begin == robot.root and not robot.base else begin
    pairs = dict.fromkeys(_numbered(robot, pair) for way in ways for pair in way if _is_link(robot, pair))
    for way in ways:
        joined = [_numbered(robot, pair) for pair in way if _is_link(robot, pair)]
        longer = [(first, reached) for _, reached in joined[1:-1]]
        pairs |= dict.fromkeys(pair for pair in longer if _turns(robot, *pair) <= MOST_TURNS)
    return tuple(_form(robot, left, right, labels) for left, right in pairs)


@dataclass(frozen=True, slots=True)
class _Printer:
    """Makes the forms of one output."""

    robot: Robot
    labels: AngleLabels
    output: str
    named: bool
    blocks: bool

    def products(self, start: FrameName, end: FrameName) -> tuple[Product, ...]:
        """Return the forms for two frames; a Jacobian in blocks has two."""
        reference = OUTPUTS[self.output]
        if self.output in ORIENTATIONS:
            from kinegen.backends.textbook.orientation_form import orientation_form

            self._check(start, end, transform_name(start, end))
            angles = orientation_form(self.robot, start, end, ORIENTATIONS[self.output], self.labels)
            return (Product(angles.name, (angles,)),)
        if reference is None and not self.named:
            return (_product(self.robot, start, end, self.labels),)
        from kinegen.backends.textbook.jacobian import jacobian_blocks, jacobian_form, jacobian_name, named_form

        if self.named or reference is None:
            form = named_form(self.robot, start, end, reference, self.labels)
        else:
            self._check(start, end, jacobian_name(start, end, reference))
            form = jacobian_form(self.robot, start, end, reference, self.labels)
        forms = jacobian_blocks(form) if self.blocks and reference else (form,)
        return tuple(Product(each.name, (each,)) for each in forms)

    def _check(self, start: FrameName, end: FrameName, name: str) -> None:
        turns = _turns(self.robot, start, end)
        if turns > MOST_TURNS:
            raise KinegenError(
                f"{name} has {turns} turns and is too long to be printed; select a part with --from and --to"
            )


def _product(robot: Robot, start: FrameName, end: FrameName, labels: AngleLabels) -> Product:
    cuts = _cuts(robot, start, end)
    factors = tuple(_form(robot, left, right, labels) for left, right in itertools.pairwise(cuts))
    return Product(transform_name(start, end), factors)


def _form(robot: Robot, start: FrameName, end: FrameName, labels: AngleLabels) -> ClosedForm:
    turns = _turns(robot, start, end)
    if turns > TURNS_OF_A_LINK:
        name = transform_name(start, end)
        raise KinegenError(
            f"{name} has {turns} turns and is too long to be printed; select a part with --from and --to"
        )
    return closed_form(robot, start, end, labels)


def _cuts(robot: Robot, start: FrameName, end: FrameName) -> tuple[FrameName, ...]:
    """Return the frames at which a product is cut into parts, with both of its ends."""
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
    """Return whether two frames are joined by something; base and tool often are not."""
    if pair == (robot.root, "0"):
        return bool(robot.base)
    return pair[1] != TOOL or bool(robot.tool)


def _numbered(robot: Robot, pair: tuple[str, str]) -> tuple[FrameName, FrameName]:
    return _number(robot, pair[0]), _number(robot, pair[1])


def _number(robot: Robot, frame: FrameName) -> FrameName:
    return next((row.number for row in robot.rows if row.name == frame), frame)
