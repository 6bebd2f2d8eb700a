"""The readable closed form, factored as textbooks print it: `c1*(a2*c2 + a3*c23) - d3*s1`. It feeds no kernel."""

from __future__ import annotations

from collections.abc import Mapping

import sympy as sp

from kinegen.backends.textbook.products import UNIT
from kinegen.backends.textbook.reader import Reader
from kinegen.backends.textbook.trees import (
    Factor,
    Function,
    Pi,
    Power,
    Ratio,
    Root,
    Sum,
    Symbol,
    Term,
    label_order,
    printed_name,
    transform_name,
)
from kinegen.derive.pose import product
from kinegen.derive.transforms import Elementary, FrameName, Shift, Turn, elementary, symbols, transforms_between
from kinegen.model.angle_sums import AngleLabels
from kinegen.model.robot import Convention, JointType, Robot
from kinegen.model.row_transforms import ROW_TRANSFORMS
from kinegen.support.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class Chain:
    """The way between two frames.

    `steps`: elementary transforms, left to right; a numeric length is a number times the symbol of its place. `places`:
    where each symbol that makes a length stands first.
    """

    steps: tuple[Elementary, ...]
    places: Mapping[str, int]


def printed_chain(robot: Robot, start: FrameName, end: FrameName) -> Chain:
    """Return the elementary transforms from one frame to another, for a printed form.

    `robot`: the robot; its parameters stay symbols. `start`: frame of reference, by name or row number. `end`: frame
    that is reached. Raises KinegenError if a frame does not exist.
    """
    turning = {variable.name for variable in robot.variables if variable.type is not JointType.PRISMATIC}
    steps: list[Elementary] = []
    places: dict[str, int] = {}
    for place, step in enumerate(transforms_between(robot, start, end, symbols(robot, keep_parameters=True))):
        if not isinstance(step, Shift):
            steps.append(step)
            continue
        length = sum((_marked(part, turning, place) for part in sp.Add.make_args(step.length)), sp.S.Zero)
        steps.append(Shift(step.axis, length))
        for symbol in step.length.free_symbols:
            places.setdefault(symbol.name, place)
    return Chain(tuple(steps), places)


def _marked(part: sp.Expr, turning: set[str], place: int) -> sp.Expr:
    """Return a term of a length, with its unit if it is a number or so much for each radian of a joint."""
    _, rest = part.as_coeff_Mul()
    is_rate = rest.is_Symbol and rest.name in turning
    is_number = part.is_number and part != 0
    return part * sp.Symbol(f"{UNIT}{place}", real=True) if is_number or is_rate else part


__all__ = [
    "ClosedForm",
    "Factor",
    "Function",
    "Pi",
    "Power",
    "Ratio",
    "Reader",
    "Root",
    "Sum",
    "Symbol",
    "Term",
    "closed_form",
    "gathered",
    "label_order",
    "printed_name",
    "transform_name",
]


@dataclass(frozen=True, slots=True)
class ClosedForm:
    """A transform, or a Jacobian, for people.

    Attributes:
        name: Such as `base_T_tool`, `1T3` or `base_J_tool`.
        entries: Three rows of four entries; or six rows, one column for each joint variable.
        angles: Label and angle of every sine and cosine that occurs.
        joints: Number and joint name of every joint variable that occurs.
        kind: `T` for a transform, `J` for a Jacobian or a block of one, `D` for determinants, `A` for angles.
        names: Of angles what they are called; empty for others.
        words: What else there is to say, such as which rows of a Jacobian are left.
        definitions: Names that the entries use, in order, and what they stand for.
    """

    name: str
    entries: tuple[tuple[Sum, ...], ...]
    angles: tuple[tuple[str, Sum], ...]
    joints: tuple[tuple[int, str], ...]
    kind: str = "T"
    names: tuple[str, ...] = ()
    words: str = ""
    definitions: tuple[tuple[str, Sum], ...] = ()

    @property
    def is_transform(self) -> bool:
        """Return whether the row 0 0 0 1 belongs below."""
        return self.kind == "T"

    @property
    def is_orientation(self) -> bool:
        """Return whether the entries are angles, each with a name of its own."""
        return self.kind == "A"


def closed_form(robot: Robot, start: FrameName, end: FrameName, labels: AngleLabels | None = None) -> ClosedForm:
    """Write a transform between two frames as a textbook would.

    Args:
        robot: The robot; its parameters stay symbols.
        start: Frame of reference, by name or row number.
        end: Frame that is reached.
        labels: Names of angles, to be shared by forms that are printed together.

    Returns:
        The entries of `start_T_end`, factored.

    Raises:
        KinegenError: If a frame does not exist.
    """
    chain = printed_chain(robot, start, end)
    matrix = product(chain.steps)
    reader = Reader(robot, labels, chain.places)
    reader.name_angles(matrix)
    entries = tuple(tuple(reader.sum(matrix[row, column]) for column in range(4)) for row in range(3))
    return gathered(transform_name(start, end), entries, reader)


def gathered(name: str, entries: tuple[tuple[Sum, ...], ...], reader: Reader) -> ClosedForm:
    """Return a form with the angles and joints that its reader met."""
    return ClosedForm(
        name=name,
        entries=entries,
        angles=tuple(sorted(reader.angles.items(), key=lambda item: label_order(item[0]))),
        joints=tuple(sorted(reader.joints.items())),
    )


GENERAL = "i-1_T_i"
"""The name of the general link matrix."""

SEQUENCES: dict[Convention, tuple[Elementary, ...]] = {
    convention: tuple(elementary(kind, sp.Symbol(entry, real=True)) for kind, entry in transforms)
    for convention, transforms in ROW_TRANSFORMS.items()
    if transforms
}
"""One row of each table convention, with symbols for its entries."""

_ORDER = ("a", "d", "theta", "alpha", "beta")
"""The order of factors: lengths, then sines and cosines."""


def link_matrix(convention: Convention) -> ClosedForm:
    """Return the matrix of one row of a table.

    `convention`: a table convention; elementary sequences have no general matrix.
    """
    matrix = product(SEQUENCES[convention])
    angles = [each.angle for each in SEQUENCES[convention] if isinstance(each, Turn)]
    return ClosedForm(
        name=GENERAL,
        entries=tuple(tuple(_sum(matrix[row, column]) for column in range(4)) for row in range(3)),
        angles=tuple((angle.name, Sum((Term(1, (Symbol(angle.name, "parameter"),)),))) for angle in angles),
        joints=(),
    )


def _sum(expression: sp.Expr) -> Sum:
    """Return an entry: products of lengths, sines and cosines."""
    terms = [_term(each) for each in sp.Add.make_args(sp.expand(expression)) if each != 0]
    return Sum(tuple(sorted(terms, key=lambda term: (term.sign < 0, str(term.factors)))))


def _term(expression: sp.Expr) -> Term:
    sign, factors = 1, list[Symbol]()
    for part in sp.Mul.make_args(expression):
        if part.is_Number:
            sign = -1 if part < 0 else 1
        elif part.is_Symbol:
            factors.append(Symbol(part.name, "parameter"))
        else:
            factors.append(Symbol(part.args[0].name, "sine" if isinstance(part, sp.sin) else "cosine"))
    ordered: list[Symbol] = sorted(factors, key=lambda each: (each.kind != "parameter", _ORDER.index(each.name)))
    return Term(sign, tuple(ordered))
