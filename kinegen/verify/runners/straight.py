"""That the kernels of a language are straight: nothing but the forms of its syntax, one after the other.

In: emitted text and the `Syntax` it was printed in. Out: the first line that is something else. Why it matters is said
in `kinegen.verify.straight`: what is straight cannot be right at all points tried and wrong in a strip between them.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from kinegen.emit.printing import Syntax
from kinegen.errors import ProofError
from kinegen.ir.program import Operator

_NAME = r"[A-Za-z_]\w*"
_PLACE = rf"{_NAME}(?:\(\d+, :\)|[.]{_NAME}|\[{_NAME}(?: \+ \d+)?\]|(?:\[\d+\])+)?"
_NUMBER = r"\d[\d.]*(?:[eE][-+]?\d+)?"
_OPERAND = rf"(?:-?{_PLACE}|-?{_NUMBER}|\(-{_NUMBER}\))"
_SINE, _COSINE, _ANGLE = "SINE__", "COSINE__", "ANGLE__"


def require_forms(
    syntax: Syntax[Operator],
    owner: str,
    text: str,
    heads: Sequence[str],
    end: str,
    others: Sequence[frozenset[str]] = (),
    more: Sequence[str] = (),
) -> None:
    """Read the bodies of some functions.

    Args:
        syntax: What they were printed in.
        owner: Robot and file, for the message.
        text: The file.
        heads: For each function a regular expression of its first line.
        end: The line that ends a body.
        others: For each function the lines of its body beside statements: comments, declarations, what it returns.
        more: Forms of expressions beside those of the syntax.

    Raises:
        ProofError: Naming the function and the line, or the function that is not there exactly once.
    """
    forms = _forms(syntax, more)
    lines = text.split("\n")
    for head, known in zip(heads, others or [frozenset[str]()] * len(heads), strict=True):
        starts = [number for number, line in enumerate(lines, start=1) if re.fullmatch(head, line)]
        if len(starts) != 1:
            raise ProofError(f"{owner}: {len(starts)} functions match '{head}', not one; nothing was written")
        for line in lines[starts[0] : lines.index(end, starts[0])]:
            if line.strip() not in known and not forms.fullmatch(line.strip()):
                raise ProofError(f"{owner}: '{line.strip()}' is not straight; nothing was written")


def _forms(syntax: Syntax[Operator], more: Sequence[str]) -> re.Pattern[str]:
    """What a line of a body may be."""
    expressions = [_expression(form) for form in (*syntax.forms.values(), *more)]
    defined = [_escaped(syntax.define, {"{name}": _NAME, "{value}": value}) for value in (_OPERAND, *expressions)]
    stored = _escaped(syntax.store, {"{place}": _PLACE, "{value}": _OPERAND})
    pair = syntax.sincos(_SINE, _COSINE, _ANGLE)
    pairs = [_escaped(line, {_SINE: _NAME, _COSINE: _NAME, _ANGLE: _OPERAND}) for line in pair]
    return re.compile("|".join((*defined, stored, *pairs)))


def _expression(form: str) -> str:
    return _escaped(form, {f"{{{index}}}": _OPERAND for index in range(4)})


def _escaped(form: str, places: dict[str, str]) -> str:
    """A form as a regular expression, with other ones in its places."""
    parts = re.split("|".join(f"({re.escape(place)})" for place in places), form)
    return "".join(places[part] if part in places else re.escape(part) for part in parts if part)
