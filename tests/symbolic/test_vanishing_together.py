"""Where several minors vanish together: no place is lost, and none is written with more than it takes."""

from __future__ import annotations

import pytest
import sympy as sp

from kinegen.derive.singularities.factors import vanishing_together

Q2, Q3, Q4 = JOINTS = sp.symbols("q2 q3 q4", real=True)
A, B = sp.symbols("a b", real=True)
C2, S2, C4, S4 = sp.cos(Q2), sp.sin(Q2), sp.cos(Q4), sp.sin(Q4)


@pytest.mark.parametrize(
    ("products", "sets"),
    [
        # A sine that is 1 or -1 may make a sum vanish.
        ([[C2], [1 + S2]], [{C2, 1 + S2}]),
        ([[C2], [A + B * S2]], []),
        # The sines of two angles need not be the same.
        ([[C2], [C4], [S2 * S4 + 1]], [{C2, C4, S2 * S4 + 1}]),
        ([[C2], [C4], [A * S2 - A * S4]], [{C2, C4, A * S2 - A * S4}]),
        ([[C2], [C4], [A * S2 - B * S4]], []),
        # A slide that is where one sum vanishes is so in the others.
        ([[10 * Q3 + 1], [C2 * (10 * Q3 + 1) + 5 * S2], [10 * Q3 + S2 + 1]], [{10 * Q3 + 1, S2}]),
        ([[5 * (2 * Q3 + A)], [(2 * Q3 + A) * C4 + B * S2]], [{5 * (2 * Q3 + A), S2}]),
    ],
)
def test_the_smallest_sets_are_found(products: list[list[sp.Expr]], sets: list[set[sp.Expr]]) -> None:
    found = vanishing_together(products, [], JOINTS)

    assert found is not None
    assert [set(each) for each in found] == sets
