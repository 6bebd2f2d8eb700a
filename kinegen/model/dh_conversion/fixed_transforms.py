"""The ways to take a fixed transform apart into screws about z, x and z, and those that leave most zeros.

Skew axes have one common normal, with either direction. For parallel axes the place along them is free, for axes on
one line the turn as well. Where a runtime parameter decides, or is an angle, the steps are kept as they are written,
with further fixed rows between them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Any

from kinegen.model.dh_conversion.elementary_transforms import Steps, folded, kept_turn, terms, tidy, total, upright
from kinegen.model.dh_conversion.exact_poses import (
    MP,
    ExactValue,
    Form,
    NotNumeric,
    Pose,
    Values,
    combined,
    expression_of,
    identified_angle,
    is_noise,
    is_small,
    pose_of,
    scaled,
    settled,
)
from kinegen.model.expression_parser import ONE, PI, ZERO, Expression, Number, Product, negate
from kinegen.model.robot import Step, StepKind
from kinegen.support.dataclass import dataclass

ALONG = "the position along parallel axes"
ABOUT = "the turn about one line"
WHICH = "the direction of the common normal"


@dataclass(frozen=True, slots=True)
class Screw:
    """A turn about an axis and a shift along it."""

    turn: Expression = ZERO
    shift: Expression = ZERO

    def __add__(self, other: Screw) -> Screw:
        """Return both, one after the other, about the same axis."""
        return Screw(kept_turn(total(self.turn, other.turn)), total(self.shift, other.shift))

    @property
    def still(self) -> bool:
        """Tell whether it does nothing."""
        return self.turn == ZERO == self.shift


@dataclass(frozen=True, slots=True)
class Link:
    """A fixed transform as screws: about z and x in turn, and about z at the end.

    Attributes:
        pairs: Screws about z and x; one pair, or more where rows are kept as they are written.
        last: Screw about z.
        exact: Whether all numbers are exact.
        free: What else could have been chosen, in words.
    """

    pairs: tuple[tuple[Screw, Screw], ...]
    last: Screw
    exact: bool = True
    free: tuple[str, ...] = ()


@lru_cache(maxsize=1024)
def links(steps: Steps, values: Values) -> tuple[Link, ...]:
    """Return all ways to take a fixed transform apart, the one that keeps expressions as written first."""
    written = _written(folded(steps))
    plain = written if written and len(written.pairs) == 1 else None
    try:
        pose = pose_of(steps, values)
        found = [*([plain] if plain and not _is_plain_screw(plain) else []), *_numeric(pose, values)]
    except NotNumeric:
        return (written or _written(upright(steps)),)  # type: ignore[return-value]
    if plain and _is_plain_screw(plain):
        found = [*_splits(plain), *found]
    return tuple(dict.fromkeys(found))


def _written(steps: Steps) -> Link | None:
    """Return the screws as the steps have them; None where there are steps about y."""
    if any(step.kind.axis == 1 for step in steps):
        return None
    # Neighbours about and along one axis are one screw.
    groups: list[tuple[int, Screw]] = []
    for step in steps:
        screw = Screw(kept_turn(step.value)) if step.kind.is_rotation else Screw(ZERO, tidy(step.value))
        if groups and groups[-1][0] == step.kind.axis:
            groups[-1] = (step.kind.axis, groups[-1][1] + screw)
        else:
            groups.append((step.kind.axis, screw))
    # Screws about z and x in turn; one that is missing does nothing.
    pairs: list[tuple[Screw, Screw]] = []
    before = Screw()
    for axis, screw in groups:
        if axis == 2:
            before = screw
        else:
            pairs.append((before, screw))
            before = Screw()
    return Link(tuple(pairs) or ((before, Screw()),), before if pairs else Screw())


def _is_plain_screw(link: Link) -> bool:
    return link.pairs[0][1].turn in (ZERO, PI)


def _splits(link: Link) -> Iterator[Link]:
    """Divide parallel axes as written: what lies along them may go to either side, and the turn too on one line."""
    ((first, across),), last = link.pairs, link.last
    turned = across.turn == PI
    shift = total(first.shift, negate(last.shift) if turned else last.shift)
    beyond = negate(shift) if turned else shift
    free: tuple[str, ...] = (ALONG,) if shift != ZERO else ()
    turns = [(first.turn, last.turn)]
    if across.shift == ZERO:
        turn = kept_turn(total(first.turn, negate(last.turn) if turned else last.turn))
        turns = [(turn, ZERO), (ZERO, kept_turn(negate(turn) if turned else turn))]
        free += (ABOUT,) if turn != ZERO else ()
    for left, right in turns:
        for near, far in ((first.shift, last.shift), (shift, ZERO), (ZERO, beyond)):
            yield Link(((Screw(left, near), across),), Screw(right, far), free=free)


def _numeric(pose: Pose, values: Values) -> Iterator[Link]:
    """Take a transform apart by its rotation and shift in numbers."""
    matrix = pose.rotation
    sine = MP.hypot(matrix[0][2], matrix[1][2])
    if is_noise(sine):
        yield from _parallel(pose, values)
        return
    for sign in (1, -1):
        size = sign * sine
        direction = (settled(-matrix[1][2] / size), settled(matrix[0][2] / size))
        first = MP.atan2(direction[1], direction[0])
        last = MP.atan2(sign * matrix[2][0], sign * matrix[2][1])
        x, y, z = pose.shift
        # Across: along the common normal. Behind: along the far axis, from what is left at right angles to both.
        across = combined(scaled(direction[0], x), scaled(direction[1], y))
        behind = combined(scaled(direction[1] / size, x), scaled(-direction[0] / size, y))
        before = combined(z, scaled(-matrix[2][2], behind))
        angles = (first, MP.atan2(size, matrix[2][2]), last)
        yield _link(pose, angles, (before, across, behind), (WHICH,))


def _parallel(pose: Pose, values: Values) -> Iterator[Link]:
    matrix, (x, y, z) = pose.rotation, pose.shift
    flipped = matrix[2][2] < 0
    whole = MP.atan2(matrix[1][0], matrix[0][0])
    twist = MP.pi if flipped else MP.mpf(0)
    free: tuple[str, ...] = () if values.is_zero(z) else (ALONG,)
    for first, across in _normals(x, y, values):
        options = [first]
        if first is None:
            options = [whole, MP.mpf(0)]
            free = (*free, ABOUT) if not is_small(whole) and ABOUT not in free else free
        for turn in options:
            last = _difference(whole, turn, algebraic=pose.algebraic, flipped=flipped)
            for near, far in ((z, {}), ({}, scaled(-1, z) if flipped else z)):
                yield _link(pose, (turn, twist, last), (near, across, far), free)


def _difference(whole: Any, turn: Any, *, algebraic: bool, flipped: bool) -> ExactValue:
    """Return the turn behind parallel axes: a sum of two angles with an exact form has one too."""
    parts = [identified_angle(_between(angle), algebraic=algebraic) for angle in (whole, turn)]
    left, right = (parts[1], parts[0]) if flipped else parts
    turned = kept_turn(total(left.expression, negate(right.expression)))
    return ExactValue(turned, left.exact and right.exact)


def _normals(x: Form, y: Form, values: Values) -> Iterator[tuple[Any, Form]]:
    """Return the directions of the normal of parallel axes, and the distance along it; None where any will do."""
    if values.is_zero(x) and values.is_zero(y):
        yield None, {}
    elif values.is_zero(y):
        yield MP.mpf(0), x
        yield +MP.pi, scaled(-1, x)
    elif values.is_zero(x):
        yield MP.pi / 2, y
        yield -MP.pi / 2, scaled(-1, y)
    else:
        if values.varies(x) or values.varies(y):
            raise NotNumeric
        east, north = values.length(x), values.length(y)
        yield MP.atan2(north, east), {ONE: MP.hypot(east, north)}
        yield MP.atan2(-north, -east), {ONE: -MP.hypot(east, north)}


def _link(pose: Pose, angles: tuple[Any, Any, Any], shifts: tuple[Form, Form, Form], free: tuple[str, ...]) -> Link:
    turns = [
        angle if isinstance(angle, ExactValue) else identified_angle(_between(angle), algebraic=pose.algebraic)
        for angle in angles
    ]
    moved = [expression_of(shift, algebraic=pose.algebraic) for shift in shifts]
    exact = all(each.exact for each in (*turns, *moved))
    first, middle, last = (Screw(turn.expression, shift.expression) for turn, shift in zip(turns, moved, strict=True))
    return Link(((first, middle),), last, exact, free)


def _between(angle: Any) -> Any:
    """Return an angle between -180 and 180 degrees, the latter included."""
    angle = angle - 2 * MP.pi * MP.nint(angle / (2 * MP.pi))
    return +MP.pi if is_small(angle + MP.pi) else angle


def step_list(screw: Screw, axis: str) -> list[Step]:
    """Return a screw as elementary transforms."""
    found = [Step(StepKind(f"R{axis}"), screw.turn), Step(StepKind(f"T{axis}"), screw.shift)]
    return [step for step in found if step.value != ZERO]


_FURTHER_ROW = 10.0
_OUTSIDE = 1.0
"""What an entry costs more in base or tool than in the table."""
_SIGN = 0.05


@lru_cache(maxsize=4096)
def cost(screw: Screw, *, outside: bool = False) -> float:
    """Return how much there is to read in two entries: zeros cost nothing, quarter turns less than other angles."""
    found = _SIGN * (_is_negative(screw.turn) + _is_negative(screw.shift))
    if screw.turn != ZERO:
        share = terms(screw.turn)
        quarters = set(share) == {PI} and (2 * share[PI]).denominator == 1
        found += (2.0 if quarters else 3.0) + outside * _OUTSIDE
    if screw.shift != ZERO:
        found += 2.0 + outside * _OUTSIDE
    return found


def _is_negative(expression: Expression) -> bool:
    first = expression.factors[0] if isinstance(expression, Product) else expression
    return isinstance(first, Number) and first.value < 0


@lru_cache(maxsize=4096)
def link_cost(link: Link) -> float:
    """Return what a transform adds by itself, wherever its ends go."""
    inside = sum(cost(across) for _, across in link.pairs) + sum(cost(along) for along, _ in link.pairs[1:])
    return inside + _FURTHER_ROW * (len(link.pairs) - 1)


def entry_cost(link: Link, *, modified: bool) -> float:
    """Rate the transform before the first joint: its first screw, and its screw about x, may lie outside."""
    first, across = link.pairs[0]
    return cost(first, outside=True) + (0.0 if modified else cost(across, outside=True) - cost(across))


def tail_cost(link: Link, *, modified: bool) -> float:
    """Return what the transform behind the last joint adds."""
    _, across = link.pairs[0]
    return cost(link.last, outside=True) + (cost(across, outside=True) - cost(across) if modified else 0.0)


def choose(options: Sequence[Sequence[Link]], *, modified: bool) -> tuple[Link, ...]:
    """Choose the ways along a path that leave least to read, the first among equals.

    The entries of a row depend on the transform before its joint and on the one behind it, so this is a shortest path.

    Args:
        options: For the transform before the first joint, those between joints, and the one behind the last.
        modified: Whether the rows are modified ones; it decides what lies outside of the table.
    """
    best: list[tuple[float, tuple[Link, ...]]] = [
        (entry_cost(link, modified=modified) + link_cost(link), (link,)) for link in options[0]
    ]
    for place, ways in enumerate(options[1:], start=1):
        last = place == len(options) - 1
        found: list[tuple[float, tuple[Link, ...]]] = []
        for link in ways:
            own = link_cost(link) + (tail_cost(link, modified=modified) if last else 0.0)
            sums = [spent + cost(path[-1].last + link.pairs[0][0]) for spent, path in best]
            index = min(range(len(sums)), key=lambda i: (round(sums[i], 6), i))
            found.append((sums[index] + own, (*best[index][1], link)))
        best = found
    return min(best, key=lambda each: round(each[0], 6))[1]
