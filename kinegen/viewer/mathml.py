"""MathML as nested lists of JSON: the page makes elements of them, and no text of a file is ever parsed as markup.

An element is `[tag, child, ...]` with text as a string; `["term", name, child, ...]` is a part of a formula that can
be pointed at, such as `c23`, `q2` or `a2`.
"""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree as ET

from kinegen.textbook.closed_form import Factor, Power, Ratio, Sum, Term
from kinegen.textbook.notation import NOTATIONS, MathML

Math = list[Any]
"""An element."""

LONGEST_PIECE = 22
"""Characters of a product in plain text; a longer one is broken inside its brackets."""

_TERM = "term"
_HEADS = {"sine": "s", "cosine": "c"}


class MarkedMathML(MathML):
    """MathML in which every name is an element that can be found again."""

    def symbol(self, name: str, kind: str) -> str:
        """A letter with its index below, in an element with the name of the term."""
        return f'<{_TERM} name="{_HEADS.get(kind, "")}{name}">{super().symbol(name, kind)}</{_TERM}>'


class TableMathML(MathML):
    """MathML for the numbers of a table, where a half is 0.5."""

    quarters = False


MARKED = MarkedMathML()
TABLE = TableMathML()


def math_list(markup: str) -> Math:
    """MathML as nested lists.

    Args:
        markup: What a notation printed: elements one after the other, well formed.

    Returns:
        A row of them.
    """
    # The markup is that of `kinegen.textbook.notation`, which has no entities and no declarations.
    return _listed(ET.fromstring(f"<mrow>{markup}</mrow>"))  # noqa: S314


def pieces(entry: Sum) -> list[Math]:
    """A sum as pieces between which a line can be broken, since browsers do not break formulas.

    Args:
        entry: The sum.

    Returns:
        Its terms, long ones in several pieces, each with the sign or the bracket that it begins with.
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
    """Whether a product has brackets, and nothing that is printed as a fraction."""
    return any(isinstance(factor, Sum) for factor in term.factors) and not any(map(_is_divisor, term.factors))


def _is_divisor(factor: Factor) -> bool:
    match factor:
        case Power(exponent=exponent):
            return exponent < 0
        case Ratio(value):
            return value.denominator > 1
    return False


def _listed(element: ET.Element) -> Math:
    found: Math = [element.tag, *([element.get("name")] if element.tag == _TERM else [])]
    found += [element.text] if element.text else []
    found += [_listed(child) for child in element]
    return found[1] if found[0] == "mrow" and len(found) == 2 and isinstance(found[1], list) else found
