"""The notations of closed forms: plain text, LaTeX, MathML and Python.

Each says how symbols, numbers, products, powers and roots look; `printing` has what is the same for all.
"""

from __future__ import annotations

import re
from fractions import Fraction

from kinegen.naming import python_identifier
from kinegen.textbook.closed_form import ClosedForm
from kinegen.textbook.printing import Notation

_GREEK_NAMES = """
alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi rho sigma tau phi chi psi omega
"""
_GREEK = dict(zip(_GREEK_NAMES.split(), "αβγδεζηθικλμνξρστφχψω", strict=True))
_INDEXED = re.compile(r"(?P<letter>[A-Za-z]|alpha|beta|gamma|delta|lambda|phi|theta)_?(?P<index>[A-Z]?[0-9]+)\Z")


_LATEX_ARCS = {
    "asin": r"\arcsin",
    "acos": r"\arccos",
    "atan": r"\arctan",
    "atan2": r"\operatorname{atan2}",
}


class Text(Notation):
    """Plain text, as one types it: `c1*(a2*c2 + a3*c23)`."""

    def symbol(self, name: str, kind: str) -> str:
        """`a2`, `q3`, `c23`."""
        return {"sine": "s", "cosine": "c"}.get(kind, "") + name

    def ratio(self, value: Fraction) -> str:
        """`1/2`, `0.4318`."""
        return self.decimal(value) or str(value)

    def fraction(self, top: str, bottom: str) -> str:
        """`a2/2`."""
        return f"{top}/{bottom}"

    def divisor(self, product: str) -> str:
        """`p*q1/(2*pi)`."""
        return f"({product})"


class TableText(Text):
    """Plain text for the numbers of a table, where a half is 0.5."""

    quarters = False


class Python(Text):
    """Python, to be run with the sines and cosines that `kinegen show --format python` defines."""

    def symbol(self, name: str, kind: str) -> str:
        """As in plain text, but `lambda_` for a parameter that is called `lambda`, and `math_` for `math`."""
        text = python_identifier(super().symbol(name, kind))
        return f"{text}_" if text == "math" else text

    def pi(self) -> str:
        """`math.pi`."""
        return "math.pi"

    def root(self, inside: str) -> str:
        """`math.sqrt(2)`."""
        return f"math.sqrt({inside})"

    def function(self, name: str, inside: str) -> str:
        """`math.cos(math.pi/7)`."""
        return super().function(name if name == "abs" else f"math.{name}", inside)


class Latex(Notation):
    """LaTeX."""

    times = r" \, "

    def symbol(self, name: str, kind: str) -> str:
        """`a_{2}`, `c_{23}`."""
        if kind in ("sine", "cosine"):
            return f"{'s' if kind == 'sine' else 'c'}_{{{_index(name)}}}"
        indexed = _INDEXED.match(name)
        if indexed:
            return f"{_latex_word(indexed['letter'])}_{{{indexed['index']}}}"
        return _latex_word(name)

    def ratio(self, value: Fraction) -> str:
        r"""`\frac{1}{2}`, `0.4318`."""
        if value.denominator == 1 or self.decimal(value):
            return self.decimal(value) or str(value)
        return rf"\frac{{{value.numerator}}}{{{value.denominator}}}"

    def fraction(self, top: str, bottom: str) -> str:
        r"""`\frac{p \, q_{1}}{2 \, \pi}`."""
        return rf"\frac{{{top}}}{{{bottom}}}"

    def pi(self) -> str:
        r"""`\pi`."""
        return r"\pi"

    def root(self, inside: str) -> str:
        r"""`\sqrt{2}`."""
        return rf"\sqrt{{{inside}}}"

    def power(self, base: str, exponent: int) -> str:
        """`a^{2}`."""
        return f"{{{base}}}^{{{exponent}}}"

    def function(self, name: str, inside: str) -> str:
        r"""`\cos\left(\frac{\pi}{7}\right)`."""
        if name == "abs":
            return rf"\left|{inside}\right|"
        return f"{_LATEX_ARCS.get(name, chr(92) + name)}{self.brackets(inside)}"

    def brackets(self, inside: str) -> str:
        r"""`(a + b)`, or `\left(\frac{a}{2} + b\right)`; lines can be broken between brackets that do not grow."""
        return rf"\left({inside}\right)" if r"\frac" in inside or r"\sqrt" in inside else f"({inside})"


def _index(label: str) -> str:
    """The label of an angle as an index: `2-3` for `2m3`, `1,12` for `1_12`, `u,1` stays `u1`."""
    return label.replace("_", ",").replace("m", "-")


def _latex_word(name: str) -> str:
    if name in _GREEK:
        return rf"\{name}"
    return name if len(name) == 1 else rf"\mathrm{{{name.replace('_', chr(92) + '_')}}}"


class MathML(Notation):
    """Presentation MathML, for web pages; characters are written as such, so that it is XML as well as HTML."""

    times = "<mo>\u2062</mo>"
    plus, minus, negative = "<mo>+</mo>", "<mo>\u2212</mo>", "<mo>\u2212</mo>"
    comma = "<mo>,</mo>"

    def symbol(self, name: str, kind: str) -> str:
        """A letter with its index below."""
        if kind in ("sine", "cosine"):
            index = _index(name).replace("-", "\u2212")
            return f"<msub><mi>{'s' if kind == 'sine' else 'c'}</mi><mn>{index}</mn></msub>"
        indexed = _INDEXED.match(name)
        if indexed:
            return f"<msub>{_mathml_word(indexed['letter'])}<mn>{indexed['index']}</mn></msub>"
        return _mathml_word(name)

    def ratio(self, value: Fraction) -> str:
        """A number or a fraction."""
        if value.denominator == 1 or self.decimal(value):
            return f"<mn>{self.decimal(value) or value}</mn>"
        return f"<mfrac><mn>{value.numerator}</mn><mn>{value.denominator}</mn></mfrac>"

    def fraction(self, top: str, bottom: str) -> str:
        """A fraction."""
        return f"<mfrac><mrow>{top}</mrow><mrow>{bottom}</mrow></mfrac>"

    def pi(self) -> str:
        """Pi."""
        return "<mi>π</mi>"

    def root(self, inside: str) -> str:
        """A root."""
        return f"<msqrt>{inside}</msqrt>"

    def power(self, base: str, exponent: int) -> str:
        """A power."""
        return f"<msup><mrow>{base}</mrow><mn>{exponent}</mn></msup>"

    def function(self, name: str, inside: str) -> str:
        """A function with its argument in brackets."""
        if name == "abs":
            return f"<mrow><mo>|</mo>{inside}<mo>|</mo></mrow>"
        return f"<mi>{name}</mi><mo>\u2061</mo>{self.brackets(inside)}"

    def brackets(self, inside: str) -> str:
        """A sum in brackets."""
        return f"<mrow><mo>(</mo>{inside}<mo>)</mo></mrow>"


def _mathml_word(name: str) -> str:
    return f"<mi>{_GREEK.get(name, name)}</mi>"


NOTATIONS: dict[str, Notation] = {"text": Text(), "latex": Latex(), "mathml": MathML(), "python": Python()}
"""The notations of `kinegen show --format`."""


def entry_names(form: ClosedForm) -> tuple[tuple[str, ...], ...]:
    """Names of the entries: r11 to r33, px, py, pz of a transform; J11, J12 and so on of a Jacobian."""
    if not form.is_transform:
        gap = "_" if len(form.entries[0]) > 9 else ""
        columns = range(1, len(form.entries[0]) + 1)
        return tuple(tuple(f"J{row}{gap}{column}" for column in columns) for row in range(1, 7))
    return tuple((*(f"r{row}{column}" for column in (1, 2, 3)), f"p{axis}") for row, axis in zip((1, 2, 3), "xyz"))


def entry_texts(form: ClosedForm, notation: Notation) -> tuple[tuple[str, ...], ...]:
    """The entries of a closed form, printed."""
    return tuple(tuple(notation.entry(entry) for entry in row) for row in form.entries)
