"""Decides exactly whether a sympy expression is zero: sines and cosines to a polynomial normal form, nothing guessed.

In: an expression in sines and cosines of sums of angles, other symbols, rational numbers, square roots and pi.
Out: yes or no. Angle sums are expanded to the sines and cosines of single angles, `s**2` becomes `1 - c**2`, and what
remains is a polynomial whose coefficients are looked at. No `simplify`, no numbers, no search.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable

import sympy as sp

Monomial = tuple[int, ...]

_PI = sp.Symbol("_pi")
"""Stands for pi outside of angles, where it is just a transcendental number."""


class NotDecidableError(ValueError):
    """The expression holds something this normal form does not know."""


def is_zero(expression: sp.Expr) -> bool:
    """Whether an expression is identically zero.

    Args:
        expression: Sines and cosines of linear forms with rational factors; everything else rational in the symbols.

    Raises:
        NotDecidableError: If an angle is no such form or a function is unknown.
    """
    return not normal_form(expression)


def are_equal(left: sp.Matrix, right: sp.Matrix) -> list[tuple[int, int]]:
    """The places, counted from 0, in which two matrices differ; empty if they are equal."""
    rows, columns = left.shape
    return [(i, j) for i in range(rows) for j in range(columns) if not is_zero(left[i, j] - right[i, j])]


def normal_form(expression: sp.Expr) -> dict[Monomial, sp.Rational]:
    """The coefficients of an expression over its own generators; empty exactly if the expression is zero.

    The generators are algebraically independent but for `s**2 + c**2 = 1`, and for square roots, whose squares are
    rational. A common denominator is dropped, which changes no zero.
    """
    angles = _Angles(expression)
    plain = sp.sympify(expression).xreplace(angles.replacements).xreplace({sp.pi: _PI})
    plain, roots = _square_roots(plain)
    numerator = sp.fraction(sp.together(plain))[0] if _has_denominator(plain) else plain
    unknown = numerator.atoms(sp.Function)
    if unknown:
        raise NotDecidableError(f"unknown function in the expression: {sorted(map(str, unknown))[0]}")
    squares = {sine: 1 - cosine**2 for cosine, sine in angles.pairs} | roots
    generators = sorted(numerator.free_symbols | {symbol for pair in angles.pairs for symbol in pair}, key=str)
    if not generators:
        return {(): numerator} if numerator != 0 else {}
    return _reduced(sp.Poly(numerator, *generators), squares)


def _reduced(polynomial: sp.Poly, squares: dict[sp.Symbol, sp.Expr]) -> dict[Monomial, sp.Rational]:
    """Replace the squares until each such generator stands at most linearly."""
    for symbol in [generator for generator in polynomial.gens if generator in squares]:
        place = polynomial.gens.index(symbol)
        square = sp.Poly(squares[symbol], *polynomial.gens)
        parts: defaultdict[int, dict[Monomial, sp.Rational]] = defaultdict(dict)
        for powers, coefficient in polynomial.terms():
            rest = (*powers[:place], powers[place] % 2, *powers[place + 1 :])
            parts[powers[place] // 2][rest] = coefficient
        polynomial = sum(
            (sp.Poly(terms, *polynomial.gens) * square**half for half, terms in parts.items()),
            start=sp.Poly(0, *polynomial.gens),
        )
    return {powers: coefficient for powers, coefficient in polynomial.terms() if coefficient != 0}


def _has_denominator(expression: sp.Expr) -> bool:
    return any(power.exp.is_negative for power in expression.atoms(sp.Pow))


def _square_roots(expression: sp.Expr) -> tuple[sp.Expr, dict[sp.Symbol, sp.Expr]]:
    """Replace square roots of rational numbers by products of one symbol for the root of each prime."""
    replacements: dict[sp.Expr, sp.Expr] = {}
    squares: dict[sp.Symbol, sp.Expr] = {}
    for power in expression.atoms(sp.Pow):
        if not power.exp.is_Rational or power.exp.is_Integer:
            continue
        if power.exp.q != 2 or not power.base.is_Integer or power.base <= 0:
            raise NotDecidableError(f"{power} is no square root of a positive integer")
        root = sp.S.One
        for prime, count in sp.factorint(power.base).items():
            symbol = sp.Symbol(f"_root{prime}")
            squares[symbol] = sp.Integer(prime)
            root *= symbol**count
        replacements[power] = root**power.exp.p
    return expression.xreplace(replacements), squares


class _Angles:
    """The sines and cosines of an expression as polynomials in those of single angles.

    Attributes:
        replacements: A polynomial for every sine and cosine that occurs.
        pairs: The cosine and the sine of every single angle.
    """

    def __init__(self, expression: sp.Expr) -> None:
        found = sorted(sp.sympify(expression).atoms(sp.sin, sp.cos), key=sp.default_sort_key)
        forms = {function: _linear_form(function.args[0]) for function in found}
        shares = _common_denominators(forms.values())
        self._units: dict[sp.Expr, tuple[sp.Symbol, sp.Symbol]] = {}
        self.replacements: dict[sp.Expr, sp.Expr] = {}
        for function, (factors, turn) in forms.items():
            cosine, sine = self._expand(factors, turn, shares)
            self.replacements[function] = cosine if isinstance(function, sp.cos) else sine

    @property
    def pairs(self) -> list[tuple[sp.Symbol, sp.Symbol]]:
        return list(self._units.values())

    def _expand(
        self, factors: dict[sp.Expr, sp.Rational], turn: sp.Expr, shares: dict[sp.Expr, int]
    ) -> tuple[sp.Expr, sp.Expr]:
        """The cosine and sine of a sum, by the addition theorems, one single angle after the other."""
        cosine, sine = sp.cos(turn), sp.sin(turn)
        for angle, factor in factors.items():
            if angle not in self._units:
                name = f"{angle}/{shares[angle]}"
                self._units[angle] = (sp.Symbol(f"_c[{name}]"), sp.Symbol(f"_s[{name}]"))
            c, s = self._units[angle]
            times = int(factor * shares[angle])
            if times < 0:
                s = -s
            for _ in range(abs(times)):
                cosine, sine = sp.expand(cosine * c - sine * s), sp.expand(sine * c + cosine * s)
        return cosine, sine


def _linear_form(angle: sp.Expr) -> tuple[dict[sp.Expr, sp.Rational], sp.Expr]:
    """The rational factor of each symbol in an angle, and the rest, a rational multiple of pi.

    A number that is no multiple of pi is a factor of the single angle 1.
    """
    factors: dict[sp.Expr, sp.Rational] = {}
    turn = sp.S.Zero
    for term in sp.Add.make_args(sp.expand(angle)):
        factor, rest = term.as_coeff_Mul(rational=True)
        if not factor.is_Rational or not (rest.is_Symbol or rest in (sp.pi, sp.S.One)):
            raise NotDecidableError(f"{term} is no rational multiple of an angle")
        if rest == sp.pi:
            turn += term
        elif factor != 0:
            factors[rest] = factor
    return factors, turn


def _common_denominators(
    forms: Iterable[tuple[dict[sp.Expr, sp.Rational], sp.Expr]],
) -> dict[sp.Expr, int]:
    """For each symbol the smallest share of it of which all its factors are multiples."""
    shares: dict[sp.Expr, int] = {}
    for factors, _ in forms:
        for angle, factor in factors.items():
            shares[angle] = int(sp.ilcm(shares.get(angle, 1), factor.q))
    return shares
