"""Raghavan and Roth's elimination in NumPy, as the C files make it. It needs NumPy alone."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

_STEPS, _LONGEST, _FIRM, _MOST = 24, 0.4, 1e7, 16
_ALONG, _X, _Y = [2, 5, 8, 11, 12, 13], [0, 3, 6, 9], [1, 4, 7, 10]
_COSINES = np.array([[0.5, 0, 0.5, 0], [0, 0.5, 0, 0.5], [0, 0, 1, 0]])
_SINES = np.array([[0, 0.5, 0, -0.5], [-0.5, 0, 0.5, 0], [0, 0, 0, 1]])


class Elimination(NamedTuple):
    """The constants of one elimination; the C file says what they are."""

    order: tuple[int, ...]
    backwards: bool
    closes_first: bool
    real: int
    shift: tuple[float, float]
    left: tuple[float, ...]
    right: tuple[float, ...]
    fixed: tuple[float, ...]
    along: tuple[tuple[float, ...], ...]
    across: tuple[tuple[tuple[float, ...], ...], ...]
    basis: tuple[tuple[float, ...], ...]


class Bounds(NamedTuple):
    """The tolerances of a solution, what is the same one, which roots are followed; the reach; steps aside."""

    accepted: float
    merged: float
    nearly_real: float
    reach: float
    asides: tuple[float, ...]


class Problem:
    """One elimination for some targets (n, 4, 4)."""

    def __init__(self, table: Elimination, targets: Floats, reach: float) -> None:
        self.table, self.targets, self.is_firm = table, targets, np.zeros(len(targets), bool)
        scaled = targets.copy()
        scaled[:, :3, 3] /= reach
        seen = scaled if table.backwards else _inverse(scaled)
        opened = _inverse(_motion(table.left) @ seen @ _motion(table.right))
        self._along, self._across = np.array(table.along), np.array(table.across[0]) + 1j * np.array(table.across[1])
        self._see(opened)
        rows = self._equations().reshape(-1, 6, 3, 9)
        c, s = table.shift
        cosine, sine = rows[:, :, 0] * c + rows[:, :, 1] * s, rows[:, :, 1] * c - rows[:, :, 0] * s
        rest = rows[:, :, 2]
        self.square, self.linear, self.constant = _wide(rest - cosine), _wide(2 * sine), _wide(rest + cosine)

    def _see(self, opened: Floats) -> None:
        """The line from the base side: factors of the cosine and the sine of a, and the rest."""
        start = np.zeros((len(opened), 15))
        start[:, [2, 14]] = 1.0
        fixed = np.broadcast_to(_motion(self.table.fixed), opened.shape)
        first, last = (opened, fixed) if self.table.closes_first else (fixed, opened)
        line = _carried(last, start)
        cosine, sine, rest = np.zeros_like(line), np.zeros_like(line), line.copy()
        cosine[:, _X], cosine[:, _Y] = line[:, _X], line[:, _Y]
        sine[:, _X], sine[:, _Y] = line[:, _Y], -line[:, _X]
        rest[:, _X + _Y] = 0.0
        self._parts = np.stack([_carried(first, part) for part in (cosine, sine, rest)], axis=-1)
        self._level, self._round = self._parts[:, _ALONG], self._parts[:, _X] + 1j * self._parts[:, _Y]

    def _equations(self) -> Floats:
        """Six equations in c, d and e, shape (n, 6, 27)."""
        free = np.linalg.qr(self._level[:, :, :2], mode="complete")[0][:, :, 2:].swapaxes(1, 2)
        rows = free @ self._along
        rows[:, :, 26] -= (free @ self._level[:, :, 2:])[:, :, 0]
        factors = np.linalg.qr(self._round, mode="complete")[0][:, :, 3].conj()
        other = factors @ self._across
        return np.concatenate([rows, other.real[:, None], other.imag[:, None]], axis=1)

    def roots(self) -> NDArray[Any]:
        """All values of tan(c / 2), less the shift, shape (n, 16); NaN where there are none."""
        real, basis = self.table.real, np.array(self.table.basis)
        pairs = 4 - real
        re, im, more = np.split(basis[:, real:], [pairs, 2 * pairs], axis=1)
        tail = [-self.constant @ im, self.constant @ re, self.linear @ more, self.constant @ more]
        found = np.zeros((len(self.targets), 16, 16))
        found[:, 12 - real :, 2 * pairs : 2 * pairs + more.shape[1]] = np.eye(more.shape[1])
        lead, tails = self.square @ basis, np.concatenate(tail, axis=2)
        roots = np.full((len(found), 16), np.nan, complex)
        self.is_firm = np.linalg.cond(lead) < _FIRM
        for index in range(len(found)):  # one of them may be singular
            try:
                found[index, : 12 - real] = -np.linalg.solve(lead[index], tails[index])[real:]
                roots[index] = np.linalg.eigvals(found[index])
            except np.linalg.LinAlgError:
                continue
        return roots

    def angles(self, rows: Rows, t: Floats) -> Floats:
        """Angles a to f for some targets and roots, (m,) each; f is 0."""
        square = (t * t)[:, None, None]
        matrix = self.square[rows] * square + self.linear[rows] * t[:, None, None] + self.constant[rows]
        v = np.linalg.svd(matrix / (1 + square))[2][:, -1].reshape(-1, 4, 3)
        best = np.where((v[:, 2] ** 2).sum(axis=1) > (v[:, 3] ** 2).sum(axis=1), 2, 3)
        row = v[np.arange(len(v)), best]
        row = row * np.where(row[:, 2:] < 0, -1.0, 1.0)
        column = v[np.arange(len(v)), :, (v[:, 2:] ** 2).sum(axis=1).argmax(axis=1)]
        c = 2 * np.arctan(t) + np.arctan2(self.table.shift[1], self.table.shift[0])
        inner = np.stack([c, 2 * np.arctan2(column[:, 3], column[:, 2]), np.arctan2(row[:, 1], row[:, 0])], axis=1)
        turns = np.stack([np.cos(inner), np.sin(inner), np.ones_like(inner)], axis=2)
        terms = np.einsum("ni,nj,nk->nijk", *turns.swapaxes(0, 1)).reshape(-1, 27)
        level, seen = self._level[rows], terms @ self._along.T - self._level[rows][:, :, 2]
        a = np.einsum("nij,nj->ni", np.linalg.pinv(level[:, :, :2]), seen)
        first = np.arctan2(a[:, 1], a[:, 0])
        side = np.stack([np.cos(first), np.sin(first), np.ones_like(first)], axis=1)
        turned = (np.einsum("nij,nj->ni", self._round[rows], side) * (terms @ self._across.T).conj()).sum(axis=1)
        return np.column_stack([first, np.angle(turned), inner, np.zeros_like(first)])


class Solver:
    """All solutions of some targets; see `solve`."""

    def __init__(
        self, evaluate: Callable[[Floats], tuple[Any, Any]], tables: tuple[Elimination, ...], bounds: Bounds
    ) -> None:
        self._evaluate, self._tables, self._bounds = evaluate, tables, bounds

    def solve(self, targets: Floats) -> list[list[Floats]]:
        """A list of joint vectors for each of the targets (n, 4, 4), which are poses."""
        found: list[list[Floats]] = [[] for _ in targets]
        doubtful: Rows = np.arange(len(targets))
        for attempt in range(len(self._bounds.asides)):
            if len(doubtful):
                doubtful = self._eliminate(attempt, targets, doubtful, found)
        return found

    def _eliminate(self, attempt: int, targets: Floats, rows: Rows, found: list[list[Floats]]) -> Rows:
        """Collect what one elimination finds; returns the targets that are left in doubt, as the C files see it."""
        table, aside = self._tables[attempt % len(self._tables)], self._bounds.asides[attempt]
        problem = Problem(table, _moved(targets[rows], aside, self._bounds.reach), self._bounds.reach)
        roots = problem.roots()
        nearness = np.abs(roots.imag) / (1 + roots.real**2)
        at, which = np.nonzero((nearness <= self._bounds.nearly_real) & (roots.imag >= 0))
        root, near = roots[at, which], nearness[at, which]
        lower, upper = root.real - root.imag, root.real + root.imag
        pairs = np.flatnonzero(root.imag > 0)
        places = np.concatenate([at, at[pairs], at[pairs]])
        angles = problem.angles(places, np.concatenate([root.real, upper[pairs], lower[pairs]]))
        q = np.empty_like(angles)
        q[:, table.order] = -angles if table.backwards else angles
        q, reached = self._polish(self._finished(q, table.order[5], targets[rows[places]]), targets[rows[places]])
        sure = problem.is_firm.copy()
        sure[at[(root.imag == 0) & ~reached[: len(at)]]] = False
        sure[at[pairs[near[pairs] < 1e-6]]] = False
        sure[places[len(at) :][reached[len(at) :]]] = False
        with_root: list[set[int]] = [set() for _ in rows]
        for index in np.flatnonzero(reached):
            row = places[index]
            place = self._collect(q[index], found[rows[row]])
            if index < len(at) and root[index].imag == 0:
                sure[row] &= place < _MOST and place not in with_root[row]
                with_root[row].add(place)
        # Each real root has a solution of its own, and all that are known have a root.
        sure &= [len(found[row]) == len(places_of) > 0 for row, places_of in zip(rows, with_root, strict=True)]
        left: Rows = rows[~sure]
        return left

    def _collect(self, q: Floats, found: list[Floats]) -> int:
        """Take up a joint vector, unless it is there; returns its place, and `_MOST` if there was none left.

        Isolated solutions leave one, but a curve of them may take all. Then the one nearest to singular makes room.
        """
        for place, other in enumerate(found):
            if np.abs((q - other + np.pi) % (2 * np.pi) - np.pi).max() < self._bounds.merged:
                return place
        if len(found) < _MOST:
            found.append(q)
            return len(found) - 1
        least = self._firmness(np.array([*found, q]))
        softest = int(least.argmin())
        if softest < _MOST:
            found[softest] = q
        return _MOST

    def _firmness(self, q: Floats) -> Floats:
        """How far joint vectors (n, 6) are from a curve of solutions: the least singular value of each Jacobian."""
        jacobian = np.array(self._evaluate(q)[1])
        jacobian[:, :3] /= self._bounds.reach
        least: Floats = np.linalg.svd(jacobian, compute_uv=False)[:, -1]
        return least

    def _finished(self, q: Floats, joint: int, targets: Floats) -> Floats:
        """The last angle, a turn about its axis."""
        pose, jacobian = self._evaluate(q)
        r = targets[:, :3, :3] @ pose[:, :3, :3].swapaxes(1, 2)
        q[:, joint] = np.arctan2((_skew(r) * jacobian[:, 3:, joint]).sum(axis=1), np.trace(r, axis1=1, axis2=2) - 1)
        return q

    def _polish(self, q: Floats, targets: Floats) -> tuple[Floats, NDArray[np.bool_]]:
        """Damped Newton steps, and where they lead to the targets."""
        best, least = q.copy(), np.full(len(q), np.inf)
        near = self._bounds.accepted**2
        open_: Rows = np.arange(len(q))
        for _ in range(_STEPS):
            if not len(open_):
                break
            e, jacobian = self._difference(q[open_], targets[open_])
            error = (e * e).sum(axis=1)
            before = least[open_]
            better = error < before
            best[open_[better]], least[open_[better]] = q[open_[better]], error[better]
            done = (error < 1e-30) | (((error < near) | (before < near)) & ~(error < before / 16)) | np.isnan(error)
            open_, e, jacobian, error = open_[~done], e[~done], jacobian[~done], error[~done]
            normal = jacobian.swapaxes(1, 2) @ jacobian + (0.01 * error + 1e-16)[:, None, None] * np.eye(6)
            # Where two solutions meet, the matrix may be singular.
            inverses = np.linalg.pinv(normal, 1e-15, hermitian=True)
            step = (inverses @ (jacobian.swapaxes(1, 2) @ e[:, :, None]))[:, :, 0]
            q[open_] += step * (_LONGEST / np.maximum(np.abs(step).max(axis=1, initial=0), _LONGEST))[:, None]
        return best, least < near

    def _difference(self, q: Floats, targets: Floats) -> tuple[Floats, Floats]:
        """The way to go as a part of the reach with the rotation vector, and the Jacobian."""
        pose, jacobian = self._evaluate(q)
        reach, scaled = self._bounds.reach, np.array(jacobian)
        scaled[:, :3] /= reach
        r = targets[:, :3, :3] @ pose[:, :3, :3].swapaxes(1, 2)
        v = _skew(r)
        sine, cosine = np.linalg.norm(v, axis=1), np.trace(r, axis1=1, axis2=2) - 1
        turn = v * (np.arctan2(sine, cosine) / np.where(sine > 0, sine, 1.0))[:, None]
        turn[(sine <= 0) & (cosine < 0), 0] = np.pi
        return np.concatenate([(targets[:, :3, 3] - pose[:, :3, 3]) / reach, turn], axis=1), scaled


def _moved(targets: Floats, aside: float, reach: float) -> Floats:
    """Poses slightly off the targets, as in the C files."""
    found = targets.copy()
    for index, (shift, axis) in enumerate(((0.36, 0.48), (-0.48, 0.8), (0.8, -0.36))):
        upper, lower = found[:, (index + 1) % 3, :3].copy(), found[:, (index + 2) % 3, :3].copy()
        sine = axis * aside
        cosine = np.sqrt(1 - sine * sine)
        found[:, (index + 1) % 3, :3] = cosine * upper - sine * lower
        found[:, (index + 2) % 3, :3] = sine * upper + cosine * lower
        found[:, index, 3] += shift * aside * reach
    return found


def _skew(r: Floats) -> Floats:
    return np.stack([r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]], axis=1)


def _motion(numbers: tuple[float, ...]) -> Floats:
    return np.array([*numbers, 0, 0, 0, 1.0]).reshape(4, 4)


def _inverse(motions: Floats) -> Floats:
    found = np.zeros_like(motions)
    found[:, :3, :3] = motions[:, :3, :3].swapaxes(1, 2)
    found[:, :3, 3:] = -found[:, :3, :3] @ motions[:, :3, 3:]
    found[:, 3, 3] = 1.0
    return found


def _carried(motions: Floats, numbers: Floats) -> Floats:
    """The fifteen numbers of lines (n, 15) after rigid motions (n, 4, 4)."""
    r, t, one = motions[:, :3, :3], motions[:, :3, 3], numbers[:, 14:]
    l, p, w, c = ((r @ numbers[:, first : first + 3, None])[:, :, 0] for first in (0, 3, 6, 9))
    far, lead = (t * t).sum(axis=1, keepdims=True), (t * l).sum(axis=1, keepdims=True)
    square, product = numbers[:, 12:13], numbers[:, 13:14] + lead
    c = c + far * l - 2 * np.cross(t, w) - 2 * product * t
    square = square + 2 * (t * p).sum(axis=1, keepdims=True) + far * one
    return np.concatenate([l, p + t * one, w + np.cross(t, l), c, square, product, one], axis=1)


def _wide(rows: Floats) -> Floats:
    """Rows of nine in d and e times cos(d / 2) and times sin(d / 2): (n, 6, 9) to (n, 12, 12)."""
    parts = rows.reshape(-1, 6, 3, 3)
    both = [np.einsum("nrij,ik->nrkj", parts, factors).reshape(-1, 6, 12) for factors in (_COSINES, _SINES)]
    return np.stack(both, axis=2).reshape(-1, 12, 12)
