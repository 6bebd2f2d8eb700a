r"""A table as LaTeX, for a document with `\usepackage{amsmath}`."""

from __future__ import annotations

from fractions import Fraction

from kinegen.formats.tables.cells import cells_of
from kinegen.formats.yaml.spell import spell_number
from kinegen.robot.expressions import Atan2, Call, Expression, Name, Number, Pi, Power, Product, Sum, parse
from kinegen.robot.model import Robot

_FUNCTIONS = {"asin": r"\arcsin", "acos": r"\arccos", "atan": r"\arctan", "sin": r"\sin", "cos": r"\cos"}


def write(robot: Robot) -> str:
    """Write an array with the table, and what lies before and behind it.

    Args:
        robot: A robot whose rows are all standard or all modified.

    Raises:
        KinegenError: If they are not.
    """
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
    """An entry of the table as a formula."""
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
    """A fraction where there are divisors."""
    value, rest = (factors[0].value, factors[1:]) if isinstance(factors[0], Number) else (Fraction(1), factors)
    below = [Power(each.base, -each.exponent) for each in rest if isinstance(each, Power) and each.exponent < 0]
    above = [each for each in rest if not (isinstance(each, Power) and each.exponent < 0)]
    top = " ".join(map(_factor, above))
    bottom = " ".join(_factor(each.base) if each.exponent == 1 else _latex(each) for each in below)
    sign = "-" if value == -1 else "" if value == 1 else f"{_number(value)} "
    return f"{sign}{top}" if not bottom else rf"{sign}\frac{{{top or '1'}}}{{{bottom}}}"


def _factor(expression: Expression) -> str:
    return rf"\left({_latex(expression)}\right)" if isinstance(expression, Sum) else _latex(expression)
