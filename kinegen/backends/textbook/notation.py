"""The notations of closed forms: plain text, LaTeX, MathML and Python.

Each says how symbols, numbers, products, powers and roots look; `printing` has what is the same for all.
"""

from __future__ import annotations

import re
from fractions import Fraction

from kinegen.backends.textbook.closed_form import ClosedForm
from kinegen.backends.textbook.printing import Notation
from kinegen.backends.textbook.trees import is_parameter, short_angle
from kinegen.support.naming import python_identifier

_GREEK_NAMES = """
alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi rho sigma tau phi chi psi omega
"""
_CAPITALS = "Gamma Delta Theta Lambda Xi Sigma Upsilon Phi Psi Omega"
_GREEK = dict(zip(_GREEK_NAMES.split(), "αβγδεζηθικλμνξρστφχψω", strict=True))
_GREEK |= dict(zip(_CAPITALS.split(), "ΓΔΘΛΞΣΥΦΨΩ", strict=True))
_LETTER = "|".join((*sorted(_GREEK, key=len, reverse=True), "[A-Za-z]"))
_INDEXED = re.compile(rf"(?P<letter>{_LETTER})(?:_(?P<word>[A-Za-z0-9]+)|(?P<index>[A-Za-z][0-9]*|[0-9]+[A-Za-z]?))\Z")
"""A letter with what stands behind it: `a2`, `df`, `l2a`, `lT1`, `Delta_d`, `L_arm`."""


_LATEX_ARCS = {
    "asin": r"\arcsin",
    "acos": r"\arccos",
    "atan": r"\arctan",
    "atan2": r"\operatorname{atan2}",
}


class Text(Notation):
    """Plain text, as one types it: `c1*(a2*c2 + a3*c23)`."""

    def symbol(self, name: str, kind: str) -> str:
        """Return `a2`, `q3`, `c23`."""
        head = {"sine": "s", "cosine": "c"}.get(kind, "")
        return head + (short_angle(name) if head else name)

    def ratio(self, value: Fraction) -> str:
        """Return `1/2`, `2`."""
        return str(value)

    def fraction(self, top: str, bottom: str) -> str:
        """Return `a2/2`."""
        return f"{top}/{bottom}"

    def divisor(self, product: str) -> str:
        """Return `p*q1/(2*pi)`."""
        return f"({product})"


class TableText(Text):
    """Plain text for the numbers of a table, where a half is 0.5."""

    quarters = False


class Python(Text):
    """Python, to be run with the sines and cosines that `kinegen show --format python` defines."""

    def symbol(self, name: str, kind: str) -> str:
        """Print as in plain text, but `lambda_` for a parameter that is called `lambda`, and `math_` for `math`."""
        text = python_identifier(super().symbol(name, kind))
        return f"{text}_" if text == "math" else text

    def pi(self) -> str:
        """Return `math.pi`."""
        return "math.pi"

    def root(self, inside: str) -> str:
        """Return `math.sqrt(2)`."""
        return f"math.sqrt({inside})"

    def function(self, name: str, inside: str) -> str:
        """Return `math.cos(math.pi/7)`."""
        return super().function(name if name == "abs" else f"math.{name}", inside)


class Latex(Notation):
    """LaTeX."""

    times = r" \, "
    stacked = True

    def symbol(self, name: str, kind: str) -> str:
        """Return `a_{2}`, `c_{23}`."""
        if kind in ("sine", "cosine"):
            index = self.symbol(name, "parameter") if is_parameter(name) else _index(name)
            return f"{'s' if kind == 'sine' else 'c'}_{{{index}}}"
        letter, index = _split(name)
        if index:
            shown = rf"\mathrm{{{index}}}" if len(index) > 1 and index.isalpha() else index
            return f"{_latex_word(letter)}_{{{shown}}}"
        return _latex_word(name)

    def ratio(self, value: Fraction) -> str:
        r"""Return `\frac{1}{2}`, `2`."""
        if value.denominator == 1:
            return str(value)
        return rf"\frac{{{value.numerator}}}{{{value.denominator}}}"

    def fraction(self, top: str, bottom: str) -> str:
        r"""Return `\frac{p \, q_{1}}{2 \, \pi}`."""
        return rf"\frac{{{top}}}{{{bottom}}}"

    def pi(self) -> str:
        r"""Return `\pi`."""
        return r"\pi"

    def root(self, inside: str) -> str:
        r"""Return `\sqrt{2}`."""
        return rf"\sqrt{{{inside}}}"

    def power(self, base: str, exponent: int) -> str:
        """Return `a^{2}`."""
        return f"{{{base}}}^{{{exponent}}}"

    def function(self, name: str, inside: str) -> str:
        r"""Return `\cos\left(\frac{\pi}{7}\right)`."""
        if name == "abs":
            return rf"\left|{inside}\right|"
        return f"{_LATEX_ARCS.get(name, chr(92) + name)}{self.brackets(inside)}"

    def brackets(self, inside: str) -> str:
        r"""`(a + b)`, or `\left(\frac{a}{2} + b\right)`; lines can be broken between brackets that do not grow."""
        return rf"\left({inside}\right)" if r"\frac" in inside or r"\sqrt" in inside else f"({inside})"


class TableLatex(Latex):
    """LaTeX for the numbers of a table, whose rows would touch each other with fractions in them."""

    quarters = False
    stacked = False

    def ratio(self, value: Fraction) -> str:
        """Return `1/3`."""
        return str(value)

    def fraction(self, top: str, bottom: str) -> str:
        r"""Return `\pi/2`."""
        return f"{top}/{bottom}"

    def divisor(self, product: str) -> str:
        r"""Return `p \, q_{1}/(2 \, \pi)`."""
        return f"({product})"


def _split(name: str) -> tuple[str, str]:
    """Return a letter and its index, or a whole word and none."""
    found = None if name in _GREEK else _INDEXED.match(name)
    return (found["letter"], found["word"] or found["index"]) if found else (name, "")


def _index(label: str) -> str:
    """Return the label of an angle as an index: `2-3` for `2m3`, `1,12` for `1_12`, `u,1` stays `u1`."""
    return label.replace("_", ",").replace("m", "-")


def _latex_word(name: str) -> str:
    if name in _GREEK:
        return rf"\{name}"
    return name if len(name) == 1 else rf"\mathrm{{{name.replace('_', chr(92) + '_')}}}"


class MathML(Notation):
    """Presentation MathML, for web pages; characters are written as such, so that it is XML as well as HTML."""

    times = "<mo>\u2062</mo>"
    stacked = True
    plus, minus, negative = "<mo>+</mo>", "<mo>\u2212</mo>", "<mo>\u2212</mo>"
    comma = "<mo>,</mo>"

    def symbol(self, name: str, kind: str) -> str:
        """Return a letter with its index below."""
        if kind in ("sine", "cosine"):
            joints = f"<mn>{_index(name).replace('-', chr(0x2212))}</mn>"
            index = self.symbol(name, "parameter") if is_parameter(name) else joints
            return f"<msub><mi>{'s' if kind == 'sine' else 'c'}</mi>{index}</msub>"
        letter, index = _split(name)
        if index:
            token = "mn" if index[0].isdecimal() or not index.isalpha() else "mi"
            return f"<msub>{_mathml_word(letter)}<{token}>{index}</{token}></msub>"
        return _mathml_word(name)

    def number(self, digits: str) -> str:
        """Return a number in an element of its own: text that has none is not shown."""
        return f"<mn>{digits}</mn>"

    def ratio(self, value: Fraction) -> str:
        """Return a number or a fraction."""
        if value.denominator == 1:
            return self.number(str(value))
        return f"<mfrac>{self.number(str(value.numerator))}{self.number(str(value.denominator))}</mfrac>"

    def fraction(self, top: str, bottom: str) -> str:
        """Return a fraction."""
        return f"<mfrac><mrow>{top}</mrow><mrow>{bottom}</mrow></mfrac>"

    def pi(self) -> str:
        """Return the number pi."""
        return "<mi>π</mi>"

    def root(self, inside: str) -> str:
        """Return a root."""
        return f"<msqrt>{inside}</msqrt>"

    def power(self, base: str, exponent: int) -> str:
        """Return a power."""
        return f"<msup><mrow>{base}</mrow><mn>{exponent}</mn></msup>"

    def function(self, name: str, inside: str) -> str:
        """Return a function with its argument in brackets."""
        if name == "abs":
            return f"<mrow><mo>|</mo>{inside}<mo>|</mo></mrow>"
        return f"<mi>{name}</mi><mo>\u2061</mo>{self.brackets(inside)}"

    def brackets(self, inside: str) -> str:
        """Return a sum in brackets."""
        return f"<mrow><mo>(</mo>{inside}<mo>)</mo></mrow>"


def _mathml_word(name: str) -> str:
    return f"<mi>{_GREEK.get(name, name)}</mi>"


NOTATIONS: dict[str, Notation] = {"text": Text(), "latex": Latex(), "mathml": MathML(), "python": Python()}
"""The notations of `kinegen show --format`."""


def entry_names(form: ClosedForm) -> tuple[tuple[str, ...], ...]:
    """Names of the entries: r11 to r33, px, py, pz of a transform; J11, J12 and so on of a Jacobian; or of angles."""
    if form.is_orientation:
        return tuple((name,) for name in form.names)
    if not form.is_transform:
        gap = "_" if len(form.entries[0]) > 9 else ""
        columns = range(1, len(form.entries[0]) + 1)
        return tuple(tuple(f"J{row}{gap}{column}" for column in columns) for row in range(1, len(form.entries) + 1))
    return tuple((*(f"r{row}{column}" for column in (1, 2, 3)), f"p{axis}") for row, axis in zip((1, 2, 3), "xyz"))


def entry_texts(form: ClosedForm, notation: Notation) -> tuple[tuple[str, ...], ...]:
    """Return the entries of a closed form, printed."""
    return tuple(tuple(notation.entry(entry) for entry in row) for row in form.entries)
