"""Writes closed forms and MathML as JSON: nested lists, so that no text of a file is ever parsed as markup.

A list begins with an operation, as in `data`; `["c", label]` and `["s", label]` are the cosine and sine of an angle of
the closed form, and `["n", name]` is a parameter as it is printed. An element of MathML is `[tag, child, ...]` with
text as a string; `["term", name, child, ...]` is a part of a formula that can be pointed at, such as `c23`, `q2` or
`a2`.
"""

from __future__ import annotations

import math
from typing import Any
from xml.etree import ElementTree as ET

from kinegen.backends.textbook.closed_form import Factor, Function, Pi, Power, Ratio, Root, Sum, Symbol, Term
from kinegen.backends.textbook.notation import NOTATIONS, MathML
from kinegen.tools.viewer.data import Tree


def printed_tree(part: Sum | Factor | Term) -> Tree:
    """Return a part of a closed form as a tree, with every name, in radians and the file's length unit."""
    match part:
        case Sum(terms):
            return _joined("+", [printed_tree(term) for term in terms], 0)
        case Term(sign, factors):
            trees = [printed_tree(factor) for factor in factors]
            return _joined("*", [-1, *trees] if sign < 0 else trees, 1)
        case Symbol(name, "sine"):
            return ["s", name]
        case Symbol(name, "cosine"):
            return ["c", name]
        case Symbol(name, "joint"):
            return ["q", int(name[1:]) - 1]
        case Symbol(name):
            return ["n", name]
        case Ratio(value):
            return int(value) if value.denominator == 1 else float(value)
        case Pi():
            return math.pi
        case Root(inside):
            return ["sqrt", printed_tree(inside)]
        case Power(base, exponent):
            return ["^", printed_tree(base), exponent]
        case Function(name, arguments):
            return [name, *map(printed_tree, arguments)]


def _joined(operator: str, parts: list[Tree], neutral: int) -> Tree:
    return parts[0] if len(parts) == 1 else [operator, *parts] if parts else neutral


Math = list[Any]
"""An element."""

LONGEST_PIECE = 22
"""Characters of a product in plain text; a longer one is broken inside its brackets."""

_TERM = "term"
_TOKENS = frozenset({"mi", "mn", "mo", "mtext"})
_HEADS = {"sine": "s", "cosine": "c"}


class MarkedMathML(MathML):
    """MathML in which every name is an element that can be found again."""

    def symbol(self, name: str, kind: str) -> str:
        """Return a letter with its index below, in an element with the name of the term."""
        return f'<{_TERM} name="{_HEADS.get(kind, "")}{name}">{super().symbol(name, kind)}</{_TERM}>'


class TableMathML(MathML):
    """MathML for the numbers of a table, where a half is 0.5."""

    quarters = False


MARKED = MarkedMathML()
TABLE = TableMathML()


def math_list(markup: str) -> Math:
    """Return MathML, elements one after the other and well formed, as nested lists: a row of them."""
    # The markup is that of `kinegen.backends.textbook.notation`, which has no entities and no declarations.
    return _listed(ET.fromstring(f"<mrow>{markup}</mrow>"))  # noqa: S314


def pieces(entry: Sum) -> list[Math]:
    """Return the terms of a sum as pieces between which a line can be broken, since browsers do not break formulas.

    Long terms are several pieces, each with the sign or the bracket that it begins with.
    """
    return [math_list(markup) for markup in _pieces(entry)]


def _pieces(entry: Sum) -> list[str]:
    found: list[str] = []
    printed = MARKED.terms(entry)
    if not entry.terms:
        return list(printed)
    for index, (term, markup) in enumerate(zip(entry.terms, printed, strict=True)):
        if len(NOTATIONS["text"].entry(Sum((term,)))) <= LONGEST_PIECE or not _is_plain_product(term):
            found.append(markup)
            continue
        # A long product breaks inside its brackets, where the sign or the factor before them leads.
        added = MARKED.plus if index else ""
        taken = MARKED.minus if index else MARKED.negative
        outer = [factor for factor in term.factors if not isinstance(factor, Sum)]
        lead = MARKED.times.join(MARKED.factor(factor, in_product=True) for factor in outer)
        lead = (taken if term.sign < 0 else added) + lead
        for factor in term.factors:
            if isinstance(factor, Sum):
                first, *others = _pieces(factor)
                inside = [f"{lead}<mo>(</mo>{first}", *others]
                found += [*inside[:-1], f"{inside[-1]}<mo>)</mo>"]
                lead = ""
    return found


def _is_plain_product(term: Term) -> bool:
    """Tell whether a product has brackets, and nothing that is printed as a fraction."""
    return any(isinstance(factor, Sum) for factor in term.factors) and not any(map(_is_divisor, term.factors))


def _is_divisor(factor: Factor) -> bool:
    match factor:
        case Power(exponent=exponent):
            return exponent < 0
        case Ratio(value):
            return value.denominator > 1
    return False


def _listed(element: ET.Element) -> Math:
    stray = element.tail or ("" if element.tag in _TOKENS else element.text)
    if stray:
        raise ValueError(f"text of MathML outside of mi, mn, mo and mtext: {stray}")
    found: Math = [element.tag, *([element.get("name")] if element.tag == _TERM else [])]
    found += [element.text] if element.text else []
    found += [_listed(child) for child in element]
    return found[1] if found[0] == "mrow" and len(found) == 2 and isinstance(found[1], list) else found
