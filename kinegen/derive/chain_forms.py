"""Other forms of a chain, which may take fewer operations.

Fixed turns: a mount turned by roll, pitch and yaw has up to three. Those about the axes of the joints before and after
it are offsets of these joints, which take no product; what is left is one turn from the one axis to the other, as in
a row of a table by Denavit and Hartenberg.

Turns about parallel axes: merged ones take a product with the sine and cosine of their sum for each shift behind them.
Where the shift between them goes across in two directions, it is turned together with what the second turn gives: four
products serve for both, and the sum of the angles is not needed. A shift between a fixed turn and a quarter turn about
one axis is shorter where it is not turned by the first.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Sequence
from dataclasses import field, replace
from fractions import Fraction
from functools import cache
from itertools import chain, combinations, takewhile

import mpmath
import sympy as sp

from kinegen.derive.folding import FoldedChain, Last, fold, fold_apart, total
from kinegen.derive.transforms import Elementary, Shift, Turn, is_identity
from kinegen.support.dataclass import dataclass

_DIGITS = 230
"""Of the sines and cosines of fixed turns; kernels take 150 of them, so that equal numbers are equal there."""

_SMALL = mpmath.mpf(10) ** -150

_NAMED = 10**6
"""The largest denominator of a part of pi that is recognised."""

_LONG = 30
"""A chain with more joints stays as it came: its forms take their time."""

Matrix = tuple[tuple[mpmath.mpf, mpmath.mpf, mpmath.mpf], ...]

_UPRIGHT: Matrix = tuple((mpmath.mpf(i == 0), mpmath.mpf(i == 1), mpmath.mpf(i == 2)) for i in range(3))

Chain = tuple[Elementary, ...]


def forms(chains: Sequence[Sequence[Elementary]]) -> Iterator[tuple[Chain, ...]]:
    """Yield chains, and where fixed turns that are no quarter turns stand in them the same with few of these.

    Returns the chains as they came first. Then of a single one, with slides where they are, and with slides along the
    axes behind a joint. Of several, with all mounts as one turn each, and with those as they came behind which another
    chain parts: offsets of the joint before them would differ, and with them its sine and cosine. Each of these forms
    only where its turns take less, since several chains take their time.
    """
    came = tuple(map(tuple, chains))
    yield came
    if not any(map(_is_inclined, came)) or any(sum(not _is_fixed(step) for step in each) > _LONG for each in came):
        return
    folded_as_came = tuple(map(fold, came))
    known = {folded_as_came}
    none = (frozenset[int](),) * len(came)
    choices = ((False, none), (True, none)) if len(came) == 1 else ((False, none), (False, _partings(came)))
    for moves_slides, parted in choices:
        form = tuple(_shorter(steps, moves_slides, kept) for steps, kept in zip(came, parted, strict=True))
        if (folded := tuple(map(fold, form))) not in known:
            known.add(folded)
            if len(came) == 1 or _weight(folded) < _weight(folded_as_came):
                yield form


PAIR = 30
"""About how many operations the sine and cosine of an angle take together."""

_TURN = 6
"""About how many a turn of one or two vectors takes."""


def _weight(chains: Sequence[FoldedChain]) -> int:
    """Return about how many operations the turns of some chains take, those that they share once."""
    turns = [each.turns for each in chains]
    shared = {each[:end] for each in turns for end in range(1, len(each) + 1)}
    angles = {turn.angle for each in turns for turn in each if turn.angle.free_symbols}
    return _TURN * len(shared) + PAIR * sum(-angle not in angles or str(angle) < str(-angle) for angle in angles)


def _partings(chains: Sequence[Chain]) -> tuple[frozenset[int], ...]:
    """Return for each chain the places of the joints that are the last ones which it shares with another chain."""
    found: list[set[int]] = [set() for _ in chains]
    for (one, left), (other, right) in combinations(enumerate(chains), 2):
        alike = sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(left, right, strict=False)))
        last = next((place for place in reversed(range(alike)) if not _is_fixed(left[place])), None)
        if last is not None:
            found[one].add(last)
            found[other].add(last)
    return tuple(map(frozenset, found))


def without_last_turns(steps: Sequence[Elementary]) -> Chain:
    """Return a chain without the fixed turns at its end, which do not move it."""
    found = tuple(steps)
    while found and isinstance(found[-1], Turn) and not found[-1].angle.free_symbols:
        found = found[:-1]
    return found


def _is_fixed(step: Elementary) -> bool:
    return not (step.angle if isinstance(step, Turn) else step.length).free_symbols


def _is_inclined(steps: Sequence[Elementary]) -> bool:
    return any(isinstance(step, Turn) and _is_fixed(step) and not (2 * step.angle / sp.pi).is_Integer for step in steps)


@dataclass(slots=True)
class _Run:
    """What stands between two joints: its steps, where they lead and which way the axes are there."""

    steps: list[Elementary] = field(default_factory=list)
    matrix: Matrix = _UPRIGHT
    shift: list[sp.Expr] = field(default_factory=lambda: [sp.S.Zero] * 3)

    def pass_by(self, step: Elementary) -> None:
        self.steps.append(step)
        if isinstance(step, Turn):
            self.matrix = _times(self.matrix, _turned(step.axis, _number(step.angle)))
        else:
            for row in range(3):
                self.shift[row] += _symbol(self.matrix[row][step.axis]) * step.length


def _shorter(steps: Sequence[Elementary], moves_slides: bool, kept: Container[int]) -> Chain:
    """Return a chain with runs as one turn each, but for those behind the joints at some places."""
    found: list[Elementary] = []
    before: int | None = None
    run, keeps = _Run(), False
    with mpmath.workdps(_DIGITS):
        for place, step in enumerate(steps):
            if _is_fixed(step) or (moves_slides and isinstance(step, Shift)):
                run.pass_by(step)
                continue
            found += (*(run.steps if keeps else _parts(run, before, step.axis)), step)
            before, run, keeps = step.axis, _Run(), place in kept
        found += run.steps if keeps else _parts(run, before, None)
    return tuple(step for step in found if not is_identity(step))


def _parts(run: _Run, before: int | None, after: int | None) -> Sequence[Elementary]:
    """Return a run as one turn between turns about the axes of the joints around it, or about any axis."""
    if not _is_inclined(run.steps) or (before is None and after is None):
        return run.steps
    choices = (
        _decomposed(run, a, c, before is None)
        for a in (range(3) if before is None else (before,))
        for c in (range(3) if after is None else (after,))
    )

    def rest(parts: Sequence[Elementary]) -> int:
        turns = [step for step in parts if isinstance(step, Turn)]
        turns = turns[before is not None : -1 if after is not None else None]
        return sum(not (2 * turn.angle / sp.pi).is_Integer for turn in turns)

    return min(choices, key=rest)


def _decomposed(run: _Run, a: int, c: int, is_first: bool) -> list[Elementary]:
    """Return turns about a, an axis across it, by quarters, about c; shifts before them or after the first."""
    direction = [run.matrix[row][c] for row in range(3)]
    across = (a + 1) % 3, (a + 2) % 3
    x, y = (direction[axis] for axis in across)
    first, b = mpmath.mpf(0), across[0]
    if abs(x) > _SMALL or abs(y) > _SMALL:
        # The second turn is about the axis across that needs the smaller first turn.
        azimuth = mpmath.atan2(y, x)
        options = [(azimuth + quarter * mpmath.pi / 2, quarter) for quarter in (-1, 0, 1, 2)]
        options = [(angle - 2 * mpmath.pi if angle > mpmath.pi + _SMALL else angle, place) for angle, place in options]
        first, quarter = min(options, key=lambda each: (abs(each[0]) > mpmath.pi / 4 + _SMALL, each[1]))
        b = across[quarter % 2 == 0]
    # What is left behind the first turn is the second one, about the axis across.
    turned = _times(_turned(a, -first), run.matrix)
    i, j = (b + 1) % 3, (b + 2) % 3
    second = mpmath.atan2(turned[j][c], turned[i][c]) - (0 if a == i else mpmath.pi / 2)
    rest = _times(_turned(b, -second), turned)
    # Where the axes differ, a quarter turn leads from the one to the other.
    quarters: list[Elementary] = []
    if a != c:
        third = 3 - a - c
        angle = sp.pi / 2 if (third + 1) % 3 == c else -sp.pi / 2
        quarters = [Turn(third, angle)]
        rest = _times(_turned(third, -_number(angle)), rest)
    i, j = (c + 1) % 3, (c + 2) % 3
    last = mpmath.atan2(rest[j][i], rest[i][i])
    # Behind the first turn, shifts are seen in its axes.
    shift = run.shift
    if not is_first:
        back = _turned(a, -first)
        shift = [sum((_symbol(back[row][k]) * shift[k] for k in range(3)), sp.S.Zero) for row in range(3)]
    shifts = [Shift(axis, sp.expand(length)) for axis, length in enumerate(shift)]
    turns = [Turn(a, _angle(first)), Turn(b, _angle(second)), *quarters, Turn(c, _angle(last))]
    return [*shifts, *turns] if is_first else [turns[0], *shifts, *turns[1:]]


@cache
def _number(expression: sp.Expr) -> mpmath.mpf:
    return mpmath.mpf(sp.N(expression, _DIGITS)._mpf_)


def _turned(axis: int, angle: mpmath.mpf) -> Matrix:
    cosine, sine = map(_settled, (mpmath.cos(angle), mpmath.sin(angle)))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    found = [list(row) for row in _UPRIGHT]
    found[i][i] = found[j][j] = cosine
    found[i][j], found[j][i] = -sine, sine
    return tuple((row[0], row[1], row[2]) for row in found)


def _times(left: Matrix, right: Matrix) -> Matrix:
    rows = (
        [_settled(sum((left[i][k] * right[k][j] for k in range(3)), mpmath.mpf(0))) for j in range(3)] for i in range(3)
    )
    return tuple((row[0], row[1], row[2]) for row in rows)


def _settled(value: mpmath.mpf) -> mpmath.mpf:
    """Return a number, or the simple one that it is."""
    nearest = mpmath.nint(2 * value) / 2
    return nearest if abs(value - nearest) < _SMALL else value


def _symbol(value: mpmath.mpf) -> sp.Expr:
    value = _settled(value)
    twice = 2 * value
    return sp.Rational(int(twice), 2) if twice == mpmath.nint(twice) else sp.Float(value, _DIGITS)


def _angle(value: mpmath.mpf) -> sp.Expr:
    share = value / mpmath.pi
    part = Fraction(int(mpmath.nint(share * 10**60)), 10**60).limit_denominator(_NAMED)
    if abs(share - mpmath.mpf(part.numerator) / part.denominator) < _SMALL:
        return sp.Rational(part.numerator, part.denominator) * sp.pi
    return sp.Float(value, _DIGITS)


_MET = 3
"""All subsets of so many turns are folded apart; of more, all or none."""


def foldings(steps: Iterable[Elementary], last: Last = Last.SHARED) -> Iterator[FoldedChain]:
    """Fold a chain in every way that may be the shortest for the position of its end.

    Returns the folded chains; the one with all turns merged comes first.
    """
    steps = tuple(steps)
    _, met = fold_apart(steps, last, frozenset())
    sizes = range(met + 1) if met <= _MET else (0, met)
    some = chain.from_iterable(combinations(range(met), size) for size in sizes)
    yield from dict.fromkeys((fold(steps, last), *(fold_apart(steps, last, frozenset(apart))[0] for apart in some)))


def moved_back(folded: FoldedChain) -> FoldedChain:
    """Return the same with every shift along the axis of the turn before it on the other side of that turn."""
    shifts = list(folded.shifts)
    for place in range(len(folded.turns), 0, -1):
        axis = folded.turns[place - 1].axis
        along = [length if each == axis else sp.S.Zero for each, length in enumerate(shifts[place])]
        across = [sp.S.Zero if each == axis else length for each, length in enumerate(shifts[place])]
        shifts[place] = across[0], across[1], across[2]
        shifts[place - 1] = total(shifts[place - 1], (along[0], along[1], along[2]))
    return replace(folded, shifts=tuple(shifts))
