"""Standard and modified tables as text that people paste: CSV, Markdown, LaTeX."""

from __future__ import annotations

import csv
import io
from fractions import Fraction

from kinegen.errors import KinegenError
from kinegen.io.robot_file.entry_text import spell_number
from kinegen.io.robot_file.write import Entries, entries_of
from kinegen.model.expression_parser import (
    ZERO,
    Atan2,
    Call,
    Expression,
    Name,
    Number,
    Pi,
    Power,
    Product,
    Sum,
    parse,
    substitute,
)
from kinegen.model.expression_values import Dimension
from kinegen.model.robot import Convention, JointType, Robot, Step, frame_label
from kinegen.support.dataclass import dataclass

COLUMNS = ("a", "alpha", "d", "theta")
_ANGLES = frozenset({"alpha", "theta"})


@dataclass(frozen=True, slots=True)
class Line:
    """One row of a table: its number, name, parent, the four entries and its limits as text."""

    number: int
    name: str
    parent: str
    entries: tuple[str, str, str, str]
    limits: tuple[str, str] | None


@dataclass(frozen=True, slots=True)
class Cells:
    """A table as text.

    Attributes:
        lines: Its rows; parameters are in them by name, or by value.
        fixed: Base, tool and named frames with their parent and steps.
        parents: Whether a row does not follow the one above it.
    """

    convention: Convention
    length: str
    angle: str
    lines: tuple[Line, ...]
    fixed: tuple[tuple[str, str, tuple[tuple[str, str], ...]], ...]
    parameters: tuple[tuple[str, str], ...]
    parents: bool


def cells_of(robot: Robot, *, named: bool) -> Cells:
    """Write the cells of a table; parameters stay names if `named`, otherwise their values are in the cells.

    Raises:
        KinegenError: If the rows are not all standard or all modified.
    """
    kinds = {row.convention for row in robot.rows}
    if kinds not in ({Convention.STANDARD}, {Convention.MODIFIED}):
        raise KinegenError(
            f"robot {robot.name} has {' and '.join(sorted(kinds)) or 'no'} rows, and a table has standard or modified "
            "ones; convert it with --convention standard"
        )
    # The cells are those of a robot file, without its quotes.
    entries = entries_of(robot)
    values = {} if named else {parameter.name: parameter.value for parameter in robot.parameters}

    def text(expression: Expression | None, dimension: Dimension, own: str = "") -> str:
        return entries.text(substitute(expression or ZERO, values), dimension, own).strip('"')

    limits = {each.name: each for each in robot.variables}
    lines = []
    for row in robot.rows:
        found = [
            text(getattr(row, key), Dimension.ANGLE if key in _ANGLES else Dimension.LENGTH, row.name)
            for key in COLUMNS
        ]
        bounds = None
        if row.name in limits and (given := limits[row.name].limits):
            kind = Dimension.LENGTH if row.type is JointType.PRISMATIC else Dimension.ANGLE
            bounds = text(given[0], kind), text(given[1], kind)
        line = Line(row.number, row.name, frame_label(row.parent), (found[0], found[1], found[2], found[3]), bounds)
        lines.append(line)
    # Only a table with forks needs a column for parents.
    above = [robot.root, *(row.name for row in robot.rows)]
    return Cells(
        convention=next(iter(kinds)),
        length=robot.units.length,
        angle=entries.angle,
        lines=tuple(lines),
        fixed=tuple(_fixed(robot, entries)),
        parameters=tuple((each.name, text(each.value, each.dimension)) for each in robot.parameters) if named else (),
        parents=any(row.parent != before for row, before in zip(robot.rows, above, strict=False)),
    )


def sequence(steps: tuple[tuple[str, str], ...]) -> str:
    """Return steps on one line."""
    return " ".join(f"{kind}({text})" for kind, text in steps) or "nothing"


def _fixed(robot: Robot, entries: Entries) -> list[tuple[str, str, tuple[tuple[str, str], ...]]]:
    """List base, tool and named frames: name, parent, steps."""

    def said(steps: tuple[Step, ...]) -> tuple[tuple[str, str], ...]:
        dimensions = (Dimension.ANGLE if step.kind.is_rotation else Dimension.LENGTH for step in steps)
        texts = (entries.text(step.value, each).strip('"') for step, each in zip(steps, dimensions, strict=True))
        return tuple(zip((str(step.kind) for step in steps), texts, strict=True))

    found = [("row 1", "base", said(robot.base))] if robot.base else []
    last = robot.rows[-1].name
    found += [("tool", last, said(robot.tool))] if robot.tool else []
    return [*found, *((frame.name, frame_label(frame.parent), said(frame.steps)) for frame in robot.frames)]


def write_csv(robot: Robot) -> str:
    """Write a CSV table: a name, four entries and two limits a row, with the values of the parameters.

    It reads back with the convention and the units that its first line says.

    Raises:
        KinegenError: If the rows are not of one convention, or have forks, for which a CSV table has no column.
    """
    cells = cells_of(robot, named=False)
    if cells.parents:
        raise KinegenError(f"robot {robot.name} has forks, for which a CSV table has no column; write YAML or URDF")
    limits = any(line.limits for line in cells.lines)
    out = io.StringIO()
    out.write(f"# {cells.convention},{cells.length},{cells.angle}\n")
    for name, parent, steps in cells.fixed:
        out.write(f"# {name} from {parent}: {sequence(steps)}\n")
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["name", *COLUMNS, *(["lower", "upper"] * limits)])
    for line in cells.lines:
        writer.writerow([line.name, *line.entries, *((line.limits or ("", "")) * limits)])
    return out.getvalue()


_SIGNS = {"alpha": "α", "theta": "θ"}


def write_markdown(robot: Robot) -> str:
    """Write a Markdown table of standard or modified rows, with what lies before and behind it."""
    cells = cells_of(robot, named=True)
    heads = ["i", *(["from"] * cells.parents), "joint", *_heads(cells)]
    limits = any(line.limits for line in cells.lines)
    rows = [[*heads, *(["limits"] * limits)], ["---"] * (len(heads) + limits)]
    for line in cells.lines:
        bounds = f"{line.limits[0]} to {line.limits[1]}" if line.limits else ""
        parent = [line.parent] * cells.parents
        entries = (entry.replace("*", r"\*") for entry in line.entries)
        rows.append([str(line.number), *parent, line.name, *entries, *([bounds.replace("*", r"\*")] * limits)])
    text = [f"{robot.name}: {cells.convention} Denavit-Hartenberg table", ""]
    text += [f"| {' | '.join(row)} |" for row in rows]
    if cells.fixed:
        text += ["", "| frame | from | transform |", "| --- | --- | --- |"]
        text += [
            f"| {name} | {parent} | {sequence(steps).replace('*', chr(92) + '*')} |"
            for name, parent, steps in cells.fixed
        ]
    if cells.parameters:
        text += ["", "| parameter | value |", "| --- | --- |"]
        text += [f"| {name} | {value.replace('*', chr(92) + '*')} |" for name, value in cells.parameters]
    return "\n".join(text) + "\n"


def _heads(cells: Cells) -> list[str]:
    units = {"alpha": cells.angle, "theta": cells.angle}
    return [f"{_SIGNS.get(column, column)} [{units.get(column, cells.length)}]" for column in COLUMNS]


_FUNCTIONS = {"asin": r"\arcsin", "acos": r"\arccos", "atan": r"\arctan", "sin": r"\sin", "cos": r"\cos"}


def write_latex(robot: Robot) -> str:
    """Write an array of standard or modified rows, with what lies before and behind it, for `amsmath`."""
    cells = cells_of(robot, named=True)
    heads = [r"a", r"\alpha", "d", r"\theta"]
    units = (cells.length, cells.angle, cells.length, cells.angle)
    columns = [rf"{head} \; [\mathrm{{{unit}}}]" for head, unit in zip(heads, units, strict=True)]
    parents = [r"\text{from}"] * cells.parents
    lines = [" & ".join(["i", *parents, r"\text{joint}", *columns]) + r" \\ \hline"]
    for line in cells.lines:
        parent = [_text(line.parent)] * cells.parents
        lines.append(" & ".join([str(line.number), *parent, _text(line.name), *map(_formula, line.entries)]) + r" \\")
    layout = "c" + "l" * cells.parents + "l" + "c" * 4
    text = [f"% {robot.name}: {cells.convention} Denavit-Hartenberg table. Needs \\usepackage{{amsmath}}."]
    text += [r"\begin{equation*}", rf"\begin{{array}}{{{layout}}}", *lines, r"\end{array}", r"\end{equation*}"]
    rest = [rf"{_text(name)} &\colon {_text(parent)} \; {_steps(steps)}" for name, parent, steps in cells.fixed]
    rest += [rf"{_formula(name)} &= {_formula(value)}" for name, value in cells.parameters]
    if rest:
        text += [r"\begin{align*}", " \\\\\n".join(rest), r"\end{align*}"]
    return "\n".join(text) + "\n"


def _steps(steps: tuple[tuple[str, str], ...]) -> str:
    found = (rf"{kind[0]}_{{{kind[1]}}}({_formula(text)})" for kind, text in steps)
    return r" \, ".join(found) or r"\text{nothing}"


def _text(words: str) -> str:
    return rf"\text{{{words.replace('_', chr(92) + '_')}}}"


def _formula(text: str) -> str:
    return _latex(parse(text))


def _latex(expression: Expression) -> str:
    """Return an entry of the table as a formula."""
    match expression:
        case Number(value):
            return _number(value)
        case Pi():
            return r"\pi"
        case Name(name):
            head, _, index = name.partition("_")
            head = head if len(head) == 1 else rf"\mathrm{{{head}}}"
            return rf"{head}_{{{index.replace('_', ',')}}}" if index else head
        case Sum(terms):
            parts = [_latex(term) for term in terms]
            return parts[0] + "".join(f" - {each[1:]}" if each.startswith("-") else f" + {each}" for each in parts[1:])
        case Product(factors):
            return _product(factors)
        case Power(_, exponent) if exponent < 0:
            return _product((expression,))
        case Power(base, exponent):
            return f"{_factor(base)}^{{{exponent}}}"
        case Call("sqrt", inner):
            return rf"\sqrt{{{_latex(inner)}}}"
        case Call(function, inner):
            return rf"{_FUNCTIONS[function]}\left({_latex(inner)}\right)"
        case Atan2(y, x):
            return rf"\operatorname{{atan2}}\left({_latex(y)}, {_latex(x)}\right)"


def _number(value: Fraction) -> str:
    text = spell_number(value)
    if "/" in text:
        return rf"{'-' * (value < 0)}\frac{{{abs(value.numerator)}}}{{{value.denominator}}}"
    digits, _, exponent = text.partition("e")
    return rf"{digits} \cdot 10^{{{exponent}}}" if exponent else text


def _product(factors: tuple[Expression, ...]) -> str:
    """Return a fraction where there are divisors."""
    value, rest = (factors[0].value, factors[1:]) if isinstance(factors[0], Number) else (Fraction(1), factors)
    below = [Power(each.base, -each.exponent) for each in rest if isinstance(each, Power) and each.exponent < 0]
    above = [each for each in rest if not (isinstance(each, Power) and each.exponent < 0)]
    top = " ".join(map(_factor, above))
    bottom = " ".join(_factor(each.base) if each.exponent == 1 else _latex(each) for each in below)
    sign = "-" if value == -1 else "" if value == 1 else f"{_number(value)} "
    return f"{sign}{top}" if not bottom else rf"{sign}\frac{{{top or '1'}}}{{{bottom}}}"


def _factor(expression: Expression) -> str:
    return rf"\left({_latex(expression)}\right)" if isinstance(expression, Sum) else _latex(expression)
