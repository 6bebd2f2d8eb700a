"""What is fixed: judged among all unknowns, stable among equals, and chosen where two solutions lead to each other."""

from __future__ import annotations

import numpy as np

from kinegen.tools.calibrate.solve import Tied, _chosen, _Try, tied

NAMES = ("a", "b", "c")
UNITS = np.ones(3)
SUM_ONLY = np.array([[9.0, 9.0, 0.0], [8.0, 8.0, 1.0], [7.0, 7.0, -5.0], [9.0, 9.0, 2.0]])
"""Only a + b is measured, and c."""


def test_of_equal_unknowns_the_one_that_is_fixed_stays_fixed() -> None:
    first = tied(NAMES, SUM_ONLY, UNITS)
    again = tied(NAMES, SUM_ONLY, UNITS, frozenset({"a"}))

    assert [each.name for each in first] == ["b"]
    assert [each.name for each in again] == ["a"]
    assert [name for name, _ in again[0].partners] == ["b"]
    assert np.isclose(again[0].partners[0][1], 1)


def test_what_is_known_is_released_though_it_was_fixed() -> None:
    assert tied(NAMES, np.diag([9.0, 8.0, 7.0]), UNITS, frozenset({"a", "b"})) == ()


def attempt(*names: str, exact: tuple[str, ...] = ()) -> _Try:
    """A solution at which some are tied, of these some exactly."""
    judged = tuple(Tied(name, (), float("inf") if name in exact else 2.0) for name in names)
    return _Try(None, np.zeros(3), np.ones(3, dtype=bool), (), judged)  # type: ignore[arg-type]


def test_a_solution_that_confirms_itself_is_taken() -> None:
    tries = {frozenset({"a", "b"}): attempt("a"), frozenset({"a"}): attempt("a")}

    assert _chosen(tries, frozenset({"a"})) is tries[frozenset({"a"})]


def test_of_solutions_that_lead_to_each_other_the_one_that_fixes_least_is_taken() -> None:
    """With b fixed all is just known, with b varied just not."""
    tries = {frozenset({"a", "b"}): attempt("a"), frozenset({"a"}): attempt("a", "b")}
    lost = {frozenset({"a", "b"}): attempt("a"), frozenset({"a"}): attempt("a", "b", exact=("b",))}

    assert _chosen(tries, frozenset({"a", "b"})) is tries[frozenset({"a"})]
    # What no measurement knows cannot be varied.
    assert _chosen(lost, frozenset({"a", "b"})) is lost[frozenset({"a", "b"})]
