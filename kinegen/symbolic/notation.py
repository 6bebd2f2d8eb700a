"""Prints closed forms: plain text, LaTeX, MathML and Python.

Each notation says how symbols, numbers, products, powers and roots look; sums and brackets are the same for all.
"""

from __future__ import annotations

import html
import re
from abc import ABC, abstractmethod
from fractions import Fraction

from kinegen.symbolic.textbook import ClosedForm, Factor, Other, Pi, Power, Ratio, Root, Sum, Symbol, Term

_GREEK = frozenset(
    "alpha beta gamma delta epsilon zeta eta theta kappa lambda mu nu xi rho sigma tau phi chi psi omega".split()
)
_INDEXED = re.compile(r"(?P<letter>[A-Za-z]|alpha|beta|gamma|delta|lambda|phi|theta)_?(?P<index>[A-Z]?[0-9]+)\Z")


class Notation(ABC):
    """How expressions are printed."""

    times = "*"
    plus, minus = " + ", " - "
    negative = "-"

    def entry(self, expression: Sum) -> str:
        """A whole entry."""
        if not expression.terms:
            return self.ratio(Fraction(0))
        text = ""
        for index, term in enumerate(expression.terms):
            if index:
                text += self.minus if term.sign < 0 else self.plus
            elif term.sign < 0:
                text += self.negative
            text += self.product(term)
        return text

    def product(self, term: Term) -> str:
        """The factors of a term, without its sign."""
        if not term.factors:
            return self.ratio(Fraction(1))
        over = [factor for factor in term.factors if not _is_under(factor)]
        under = [_inverted(factor) for factor in term.factors if _is_under(factor)]
        ratios = [factor for factor in over if isinstance(factor, Ratio)]
        if ratios and ratios[0].value.denominator != 1:
            over.remove(ratios[0])
            over += [Ratio(Fraction(ratios[0].value.numerator))] if ratios[0].value.numerator != 1 else []
            over.sort(key=lambda factor: not isinstance(factor, Ratio))
            under.insert(0, Ratio(Fraction(ratios[0].value.denominator)))
        top = self.times.join(self.factor(factor, len(over) + len(under) > 1) for factor in over)
        if not under:
            return top
        bottom = self.times.join(self.factor(factor, True) for factor in under)
        return self.fraction(top or self.ratio(Fraction(1)), bottom, len(under) > 1)

    def factor(self, factor: Factor, in_product: bool) -> str:
        """One factor, in brackets if it is a sum in a product."""
        match factor:
            case Symbol(name, kind):
                return self.symbol(name, kind)
            case Ratio(value):
                return self.ratio(value)
            case Pi():
                return self.pi()
            case Root(inside):
                return self.root(self.entry(inside))
            case Power(base, exponent):
                return self.power(self.factor(base, True), exponent)
            case Other(text):
                return self.other(text)
            case Sum():
                return self.brackets(self.entry(factor)) if in_product else self.entry(factor)

    @abstractmethod
    def symbol(self, name: str, kind: str) -> str:
        """A name; for a sine or cosine, `name` is the label of its angle."""

    @abstractmethod
    def ratio(self, value: Fraction) -> str:
        """A rational number."""

    @abstractmethod
    def fraction(self, top: str, bottom: str, several: bool) -> str:
        """A quotient; `several` if the divisor is a product."""

    def pi(self) -> str:
        """The number pi."""
        return "pi"

    def root(self, inside: str) -> str:
        """A square root."""
        return f"sqrt({inside})"

    def power(self, base: str, exponent: int) -> str:
        """A power."""
        return f"{base}**{exponent}"

    def other(self, text: str) -> str:
        """A constant as sympy writes it."""
        return text

    def brackets(self, inside: str) -> str:
        """A sum in brackets."""
        return f"({inside})"


def _is_under(factor: Factor) -> bool:
    return isinstance(factor, Power) and factor.exponent < 0


def _inverted(factor: Factor) -> Factor:
    if not isinstance(factor, Power):
        return factor
    return factor.base if factor.exponent == -1 else Power(factor.base, -factor.exponent)


class Text(Notation):
    """Plain text, as one types it: `c1*(a2*c2 + a3*c23)`."""

    def symbol(self, name: str, kind: str) -> str:
        """`a2`, `q3`, `c23`."""
        return {"sine": "s", "cosine": "c"}.get(kind, "") + name

    def ratio(self, value: Fraction) -> str:
        """`1/2`."""
        return str(value)

    def fraction(self, top: str, bottom: str, several: bool) -> str:
        """`p*q1/(2*pi)`."""
        return f"{top}/({bottom})" if several else f"{top}/{bottom}"


class Python(Text):
    """Python, to be run with the sines and cosines that `kinegen show --format python` defines."""

    def pi(self) -> str:
        """`math.pi`."""
        return "math.pi"

    def root(self, inside: str) -> str:
        """`math.sqrt(2)`."""
        return f"math.sqrt({inside})"

    def other(self, text: str) -> str:
        """`math.cos(math.pi/7)`."""
        return re.sub(r"\b(sin|cos|sqrt|pi)\b", r"math.\1", text)


class Latex(Notation):
    """LaTeX."""

    times = " "

    def symbol(self, name: str, kind: str) -> str:
        """`a_{2}`, `c_{23}`."""
        if kind in ("sine", "cosine"):
            return f"{'s' if kind == 'sine' else 'c'}_{{{name.replace('_', ',').replace('m', '-')}}}"
        indexed = _INDEXED.match(name)
        if indexed:
            return f"{_latex_word(indexed['letter'])}_{{{indexed['index']}}}"
        return _latex_word(name)

    def ratio(self, value: Fraction) -> str:
        r"""`\frac{1}{2}`."""
        return str(value) if value.denominator == 1 else rf"\frac{{{value.numerator}}}{{{value.denominator}}}"

    def fraction(self, top: str, bottom: str, several: bool) -> str:
        r"""`\frac{p q_{1}}{2 \pi}`."""
        return rf"\frac{{{top}}}{{{bottom}}}"

    def pi(self) -> str:
        r"""`\pi`."""
        return r"\pi"

    def root(self, inside: str) -> str:
        r"""`\sqrt{2}`."""
        return rf"\sqrt{{{inside}}}"

    def power(self, base: str, exponent: int) -> str:
        """`a^{2}`."""
        return f"{base}^{{{exponent}}}"

    def other(self, text: str) -> str:
        r"""`\mathrm{cos(pi/7)}`."""
        return rf"\mathrm{{{text}}}"

    def brackets(self, inside: str) -> str:
        r"""`\left(a + b\right)`."""
        return rf"\left({inside}\right)"


def _latex_word(name: str) -> str:
    if name in _GREEK:
        return rf"\{name}"
    return name if len(name) == 1 else rf"\mathrm{{{name.replace('_', chr(92) + '_')}}}"


class MathML(Notation):
    """Presentation MathML, for web pages."""

    times = "<mo>&#x2062;</mo>"
    plus, minus, negative = "<mo>+</mo>", "<mo>-</mo>", "<mo>-</mo>"

    def symbol(self, name: str, kind: str) -> str:
        """A letter with its index below."""
        if kind in ("sine", "cosine"):
            return f"<msub><mi>{'s' if kind == 'sine' else 'c'}</mi><mn>{name}</mn></msub>"
        indexed = _INDEXED.match(name)
        if indexed:
            return f"<msub>{_mathml_word(indexed['letter'])}<mn>{indexed['index']}</mn></msub>"
        return _mathml_word(name)

    def ratio(self, value: Fraction) -> str:
        """A number or a fraction."""
        if value.denominator == 1:
            return f"<mn>{value}</mn>"
        return f"<mfrac><mn>{value.numerator}</mn><mn>{value.denominator}</mn></mfrac>"

    def fraction(self, top: str, bottom: str, several: bool) -> str:
        """A fraction."""
        return f"<mfrac><mrow>{top}</mrow><mrow>{bottom}</mrow></mfrac>"

    def pi(self) -> str:
        """Pi."""
        return "<mi>&#x3C0;</mi>"

    def root(self, inside: str) -> str:
        """A root."""
        return f"<msqrt>{inside}</msqrt>"

    def power(self, base: str, exponent: int) -> str:
        """A power."""
        return f"<msup>{base}<mn>{exponent}</mn></msup>"

    def other(self, text: str) -> str:
        """Text."""
        return f"<mtext>{html.escape(text)}</mtext>"

    def brackets(self, inside: str) -> str:
        """A sum in brackets."""
        return f"<mrow><mo>(</mo>{inside}<mo>)</mo></mrow>"


def _mathml_word(name: str) -> str:
    return f"<mi>&{name};</mi>" if name in _GREEK else f"<mi>{name}</mi>"


NOTATIONS: dict[str, Notation] = {"text": Text(), "latex": Latex(), "mathml": MathML(), "python": Python()}
"""The notations of `kinegen show --format`."""


def entry_names() -> tuple[tuple[str, ...], ...]:
    """Names of the entries of a transform: r11 to r33, px, py, pz."""
    return tuple((*(f"r{row}{column}" for column in (1, 2, 3)), f"p{axis}") for row, axis in zip((1, 2, 3), "xyz"))


def entry_texts(form: ClosedForm, notation: Notation) -> tuple[tuple[str, ...], ...]:
    """The entries of a closed form, printed."""
    return tuple(tuple(notation.entry(entry) for entry in row) for row in form.entries)
