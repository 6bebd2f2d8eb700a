"""Where the Jacobian of a chain loses rank: determinants of its square parts, as products.

What counts as its square part: of arms that move in a plane or like a SCARA, the rows that do not vanish; of two or
three joints in general, the rows of linear velocity at the end, or of angular velocity where the end cannot be moved;
else all six rows. Where joints or rows are left over, the Jacobian is singular where all minors vanish.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import accumulate, combinations, product
from math import comb

import numpy as np
import sympy as sp
from numpy.typing import NDArray
from sympy.polys.rings import PolyElement

from kinegen.derive.singularities.factors import factored, vanishing_together
from kinegen.derive.singularities.screws import (
    NOTHING,
    ROWS,
    Numbers,
    Screws,
    View,
    block_determinants,
    blocks,
    make_screws,
)
from kinegen.derive.singularities.trigonometric_polynomials import TooLongError, Unit, shortened
from kinegen.derive.transforms import FrameName, Turn, frames_between, links_between, symbols
from kinegen.errors import KinegenError
from kinegen.model.robot import Robot, frame_label
from kinegen.support.dataclass import dataclass

MOST_MINORS = 150
"""A Jacobian with more minors that do not vanish identically is refused."""

MOST_PARTS = 2000
"""So is one with more square parts, which are not looked through."""

_LEFT = 1e-11
"""A minor that is so small beside the product of its whole columns is what rounding leaves of zero."""

TRIED = 3
"""So many views are tried for a determinant, the best by their blocks."""


@dataclass(frozen=True, slots=True)
class Factor:
    """A factor of a determinant.

    `expression`: in joint variables and parameters, nested, not expanded.
    """

    expression: sp.Expr
    power: int


@dataclass(frozen=True, slots=True)
class Minor:
    """A determinant as a product."""

    rows: tuple[str, ...]
    joints: tuple[str, ...]
    constant: sp.Rational
    factors: tuple[Factor, ...]


@dataclass(frozen=True, slots=True)
class Loci:
    """Where a Jacobian is singular: where a common factor vanishes, or all minors together.

    Attributes:
        rows: Names of the rows of which minors are taken.
        joints: Joint variables that move the end, in order.
        rank: The rank of these rows in general.
        axes: The frame in whose axes the rows are, if they are not all six of a determinant.
        point: The frame whose origin has the linear velocity, if that matters; else empty.
        common: What all minors have in common; of one minor, all of it. None if one of them is too long.
        minors: The minors without it, those that vanish identically left out; none if there is only one.
        missing: How many minors there are, if one of them is too long to be computed; else 0.
        partial: Whether other rows are left out that do not vanish; these rows alone are singular then.
        sets: Expressions that vanish together where the Jacobian is singular, one set for each such place; None if they
            are not known, because minors are too long or there are too many.
    """

    rows: tuple[str, ...]
    joints: tuple[str, ...]
    rank: int
    axes: str
    point: str
    common: Minor | None
    minors: tuple[Minor, ...]
    missing: int
    partial: bool
    sets: tuple[tuple[sp.Expr, ...], ...] | None


@dataclass(frozen=True, slots=True)
class Choice:
    """A view, and the rows of the Jacobian in it that count."""

    view: View
    rows: tuple[int, ...]


def singular_loci(robot: Robot, start: FrameName, end: FrameName) -> Loci:
    """Factor the determinant, or the minors, of the Jacobian between two frames.

    `start`: frame that counts as being at rest, by name or row number.

    Raises:
        KinegenError: If a frame does not exist, no joint moves it, or there are too many minors.
    """
    screws = chain_screws(robot, start, end)
    if not screws.joints:
        raise KinegenError(f"no joint of {robot.name} moves {end} relative to {start}, so there is no Jacobian")
    ways = frames_between(robot, start, end)
    return _Finder(screws, (ways[0][0], *(child for _, child in ways))).loci(f"{frame_label(start)} to {end}")


def chain_screws(robot: Robot, start: FrameName, end: FrameName) -> Screws:
    """Return the chain between two frames, with its frames that have names; arguments as for `singular_loci`."""
    values = symbols(robot, keep_parameters=True)
    links = links_between(robot, start, end, values)
    stations = (0, *accumulate(map(len, links)))
    steps = tuple(step for link in links for step in link)
    return make_screws(steps, [values[variable.name] for variable in robot.variables], stations)


class _Finder:
    """Finds the loci of one chain, whose frames at its stations have the names given."""

    def __init__(self, screws: Screws, frames: tuple[str, ...]) -> None:
        self.screws = screws
        self.frames = dict(reversed(list(zip(screws.stations, frames, strict=True))))
        self.generic = screws.generic()
        self.jacobians = {view: self.generic.jacobian(view) for view in self.generic.views()}
        self.groups = _parallel(screws, self.generic)

    def loci(self, what: str) -> Loci:
        choices, rank = self._choices()
        joints = range(len(self.screws.joints))
        view, rows = choices[0].view, choices[0].rows
        if len(rows) != rank:
            # Minors by rows depend on the axes and the point, so one view serves all of them.
            choices = [min(self._named(choices), key=lambda choice: (len(choice.rows), *self._size(choice, joints)))]
            view, rows = choices[0].view, choices[0].rows
        parts = self._parts(choices[0], rank, what)
        minors: list[Minor] = []
        missing = 0
        for some, columns in parts:
            try:
                minor = self._minor([Choice(c.view, tuple(c.rows[i] for i in some)) for c in choices], columns)
            except TooLongError:
                # What all minors share is not known without this one.
                minors, missing = [], len(parts)
                break
            minors += [minor] if minor.constant else []
        common, rest = divided(tuple(minors)) if not missing else (None, tuple(minors))
        # Where one minor alone does not vanish, neither do its rows; the others do, for this point.
        named = minors[0].rows if len(minors) == 1 else tuple(ROWS[row] for row in rows)
        return Loci(
            rows=named,
            joints=tuple(joint.name for joint in self.screws.joints),
            rank=rank,
            axes=self.frames.get(view.axes, "") if rank < len(ROWS) else "",
            point=self.frames.get(view.point, "")
            if rank < len(rows) or len({c.view.point for c in choices}) == 1
            else "",
            common=common,
            minors=rest,
            missing=missing,
            partial=self._is_partial(named),
            sets=self._sets(common, rest),
        )

    def _parts(self, choice: Choice, rank: int, what: str) -> list[tuple[tuple[int, ...], tuple[int, ...]]]:
        """Return the places in the rows, and the joints, of the minors that do not vanish identically."""
        rows, count = len(choice.rows), len(self.screws.joints)
        number = comb(rows, rank) * comb(count, rank)
        if number <= MOST_PARTS:
            jacobian = self.jacobians[choice.view][list(choice.rows)]
            parts = list(product(combinations(range(rows), rank), combinations(range(count), rank)))
            parts = [each for each in parts if rank == rows == count or _is_regular(jacobian, *each)]
            if len(parts) <= MOST_MINORS:
                return parts
            number = len(parts)
        raise KinegenError(
            f"the Jacobian from {what}, of rank {rank} in general, has {number} minors, of which at most {MOST_MINORS} "
            "are factored: choose a part of the chain with fewer joints (--from and --to)"
        )

    def _is_partial(self, rows: tuple[str, ...]) -> bool:
        """Tell whether rows of one kind are taken, and those of the other kind do not vanish for any point."""
        kinds = {row[0] for row in rows}
        others = slice(3, 6) if kinds == {"v"} else slice(0, 3)
        return len(kinds) == 1 and all(np.abs(each[others]).max() > NOTHING for each in self.jacobians.values())

    def _sets(self, common: Minor | None, rest: tuple[Minor, ...]) -> tuple[tuple[sp.Expr, ...], ...] | None:
        if common is None:
            return None
        joints = self.screws.joints
        shared = [factor.expression for factor in common.factors]
        alone = tuple((factor,) for factor in shared if factor.free_symbols & set(joints))
        others = [[factor.expression for factor in minor.factors] for minor in rest]
        together = vanishing_together(others, shared, joints) if rest else ()
        return None if together is None else (*alone, *together)

    def _named(self, choices: Sequence[Choice]) -> list[Choice]:
        """Return those whose axes and points belong to frames with a name; if none, such ones with more rows."""
        stations = set(self.screws.stations)
        found = [[c for c in some if {c.view.axes, c.view.point} <= stations] for some in (choices, self._full())]
        return found[0] or found[1]

    def _full(self) -> list[Choice]:
        """Return all views, each with the rows that do not vanish for every point."""
        moving: dict[int, set[int]] = {}
        for view, jacobian in self.jacobians.items():
            moving.setdefault(view.axes, set()).update(np.flatnonzero(np.abs(jacobian).max(axis=1) > NOTHING).tolist())
        return [Choice(view, tuple(sorted(moving[view.axes]))) for view in self.jacobians]

    def _choices(self) -> tuple[list[Choice], int]:
        """Views with the rows that count in them, and the rank of these rows."""
        count, full = len(self.screws.joints), self._full()
        # Arms with few joints: their position, or else their direction, is what can be singular.
        end = max(view.point for view in self.jacobians)
        linear = [Choice(c.view, tuple(row for row in c.rows if row < 3)) for c in full if c.view.point == end]
        angular = [Choice(c.view, tuple(row for row in c.rows if row > 2)) for c in full]
        rank = self._rank(full[0])
        square = [[c for c in kind if len(c.rows) == count == self._rank(c)] for kind in (linear, angular)]
        if count == 2 and square[0]:
            return square[0], count
        fewest = min(len(choice.rows) for choice in full)
        if fewest > rank and count == 3 and any(square):
            return square[0] or square[1], count
        return [choice for choice in full if len(choice.rows) == fewest], rank

    def _rank(self, choice: Choice) -> int:
        rows = self.jacobians[choice.view][list(choice.rows)]
        return int(np.linalg.matrix_rank(rows, tol=NOTHING)) if rows.size else 0

    def _size(self, choice: Choice, columns: Sequence[int]) -> tuple[int, float]:
        """Return how many entries there are in a view, and how far its axes are from the joints."""
        filled = self._filled(choice, columns)
        away = [abs(np.mean(list(self.screws.rates[column])) - choice.view.axes) for column in columns]
        return int(filled.sum()), float((filled * away).sum())

    def _filled(self, choice: Choice, columns: Sequence[int]) -> NDArray[np.bool_]:
        return np.abs(self.jacobians[choice.view][np.ix_(choice.rows, columns)]) > NOTHING

    def _minor(self, choices: Sequence[Choice], columns: tuple[int, ...]) -> Minor:
        """Return a determinant, from the view in which its blocks are smallest.

        Raises TooLongError if it has too many terms in every view that is tried.
        """
        joints = tuple(self.screws.joints[column].name for column in columns)
        names = tuple(ROWS[row] for row in choices[0].rows)
        # The same determinant is short in some views and long in others.
        ranked = sorted(choices, key=lambda choice: self._rating(choice, columns))
        found: list[tuple[PolyElement, ...]] = []
        for choice in ranked[:TRIED]:
            try:
                parts = self._determinant(choice, columns)
            except TooLongError:
                continue
            if not all(parts):
                return Minor(names, joints, sp.S.Zero, ())
            sign = self._orientation(choices[0], columns) * self._orientation(choice, columns)
            found.append((int(sign) * parts[0], *parts[1:]))
        if not found:
            raise TooLongError
        # The shortest expansion is factored; its factors are written with few operations.
        algebra = self.screws.algebra
        whole = factored(min(found, key=lambda parts: sum(map(len, parts))), algebra)
        factors = tuple(Factor(shortened(p, algebra, self.groups), power) for p, power in whole.factors)
        return Minor(names, joints, whole.constant, factors)

    def _orientation(self, choice: Choice, columns: Sequence[int]) -> float:
        """Return the sign of a determinant; that of six rows is the same in every view."""
        if len(choice.rows) == len(ROWS):
            return 1
        return float(np.sign(np.linalg.det(self.jacobians[choice.view][np.ix_(choice.rows, columns)])))

    def _rating(self, choice: Choice, columns: Sequence[int]) -> tuple[tuple[int, ...], tuple[int, float]]:
        pattern = tuple(map(tuple, self._filled(choice, columns).tolist()))
        sizes = sorted((len(rows) for rows, _ in blocks(pattern) or ()), reverse=True)
        return tuple(sizes), self._size(choice, columns)

    def _determinant(self, choice: Choice, columns: Sequence[int]) -> tuple[PolyElement, ...]:
        entries = self.screws.columns(choice.view)
        matrix = [[entries[column][row] for column in columns] for row in choice.rows]
        return block_determinants(matrix, self.screws.algebra)


def _is_regular(jacobian: NDArray[np.float64], rows: Sequence[int], columns: Sequence[int]) -> bool:
    """Tell whether a square part of a Jacobian has a determinant that is more than what rounding leaves."""
    whole = jacobian[:, columns]
    return bool(abs(np.linalg.det(whole[list(rows)])) > _LEFT * np.prod(np.linalg.norm(whole, axis=0)))


def divided(minors: tuple[Minor, ...]) -> tuple[Minor, tuple[Minor, ...]]:
    """Return what minors have in common, and the minors without it; none where one of them has nothing else."""
    counts = [Counter({factor.expression: factor.power for factor in minor.factors}) for minor in minors]
    shared = counts[0]
    for count in counts[1:]:
        shared = shared & count
    constant = minors[0].constant if len(minors) == 1 else sp.S.One
    rest = [
        replace(minor, constant=minor.constant / constant, factors=_factors(count - shared))
        for minor, count in zip(minors, counts, strict=True)
    ]
    common = Minor(minors[0].rows, minors[0].joints, constant, _factors(shared))
    return common, () if len(minors) == 1 else tuple(rest)


def _factors(counts: Counter[sp.Expr]) -> tuple[Factor, ...]:
    return tuple(Factor(expression, power) for expression, power in counts.items())


def _parallel(screws: Screws, generic: Numbers) -> tuple[tuple[Unit, ...], ...]:
    """Angles of neighbouring turns whose axes are always parallel."""
    groups: list[list[Unit]] = [[]]
    last = np.zeros(3)
    for index, step in enumerate(screws.steps):
        units = screws.algebra.units_of(step.angle) if isinstance(step, Turn) else ()
        if units:
            axis = generic.frames[index][:3, step.axis]
            groups += [[]] if np.abs(np.cross(axis, last)).max() > NOTHING or not last.any() else []
            groups[-1] += [unit for unit in units if unit not in groups[-1]]
            last = axis
    return tuple(tuple(group) for group in groups if len(group) > 1)
