"""How the end of a chain moves, level by level of the folded chain, and how fast its parts turn.

All that is known at a point is how the end moves as seen from there. Rates of turns are exact multiples of the rates of
the joints and their sums are named once: turns that cancel leave nothing, and a link that three parallel joints turn
has the rate of their sum, as its angle is the sum of theirs. The whole level turns what is behind it at one rate.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import field
from functools import reduce

import sympy as sp

from kinegen.derive.annotated_chain import AnnotatedChain, Held, JointScrew, Rates
from kinegen.derive.expressions import LetBindings
from kinegen.derive.folding import NULL, Vector, cross, rotate, scaled, total
from kinegen.derive.transforms import Turn
from kinegen.support.dataclass import dataclass

Spin = tuple[Rates, Rates, Rates]
"""An angular velocity in the axes of a level: for each axis the multiples of the rates of the joints."""


@dataclass(slots=True)
class Link:
    """What stands between two turns of a level: a translation, and slides along which it grows.

    `spin`: how fast the turns in front of it in its level turn it. `turn`: from the axes of the level to those in which
    it is given; None if these are the same. `slides`: how fast each slide grows, and its unit vector.
    """

    spin: Spin
    turn: Turn | None
    piece: Vector = NULL
    slides: list[tuple[Rates, Vector]] = field(default_factory=list)

    def placed(self, vector: Vector) -> Vector:
        """Return a vector in the axes of the level."""
        return vector if self.turn is None else rotate(self.turn.axis, self.turn.angle, vector)

    def brought(self) -> Link:
        """Return the link in the axes of the level."""
        slides = [(rates, self.placed(axis)) for rates, axis in self.slides]
        return Link(self.spin, None, self.placed(self.piece), slides)


def links_of(items: Sequence[Vector | JointScrew | Held], symbols: int) -> tuple[tuple[Link, ...], Spin]:
    """Return what is between the turns of a level, in order, and how fast all turn what is behind the level."""
    links: dict[tuple[Spin, Turn | None], Link] = {}
    spin: Spin = (((sp.S.Zero,) * symbols),) * 3
    for held in items:
        turn = held.turn if isinstance(held, Held) else None
        for item in held.items if isinstance(held, Held) else (held,):
            if isinstance(item, JointScrew) and item.is_turn:
                axis = item.axis if turn is None else rotate(turn.axis, turn.angle, item.axis)
                x, y, z = (_plus(known, along, item.rates) for known, along in zip(spin, axis, strict=True))
                spin = x, y, z
                continue
            link = links.setdefault((spin, turn), Link(spin, turn))
            if isinstance(item, JointScrew):
                link.slides.append((item.rates, item.axis))
            else:
                link.piece = total(link.piece, item)
    return tuple(links.values()), spin


def difference(left: Spin, right: Spin) -> Spin:
    """Return the difference of two angular velocities."""
    x, y, z = (_plus(a, sp.S.NegativeOne, b) for a, b in zip(left, right, strict=True))
    return x, y, z


def _plus(known: Rates, factor: sp.Expr, rates: Rates) -> Rates:
    if factor == 0:
        return known
    return tuple(a if b == 0 else a + factor * b for a, b in zip(known, rates, strict=True))


@dataclass(slots=True)
class Sums:
    """Names sums of multiples of some symbols, each from one that is named already where that is short of one term."""

    bindings: LetBindings
    symbols: Sequence[sp.Expr]
    _named: dict[Rates, sp.Expr] = field(default_factory=dict)
    _shapes: dict[Rates, tuple[sp.Expr, sp.Expr]] = field(default_factory=dict)

    def vector(self, spin: Spin) -> Vector:
        """Return the three sums of a spin."""
        return self.of(spin[0]), self.of(spin[1]), self.of(spin[2])

    def of(self, rates: Rates) -> sp.Expr:
        """Return the sum with some factors; the first of them that is not 0 is made positive."""
        # A sum and its multiples share one name, whatever their sign.
        places = [place for place, rate in enumerate(rates) if rate != 0]
        if not places:
            return sp.S.Zero
        lead = rates[places[0]]
        if lead.is_negative:
            return -self.of(tuple(-rate for rate in rates))
        if rates not in self._named:
            shape = rates if lead == 1 else tuple(rate / lead for rate in rates)
            known, name = self._shapes.get(shape, (lead, None))
            if len(places) == 1:
                name = lead * self.symbols[places[0]]
            elif name is None:
                name = self._new(rates, places)
            else:
                name = lead / known * name
            self._named[rates] = self.bindings.name(name)
            self._shapes.setdefault(shape, (lead, self._named[rates]))
        return self._named[rates]

    def _new(self, rates: Rates, places: Sequence[int]) -> sp.Expr:
        for place in (places[-1], places[0]) if len(places) > _FEW else reversed(places):
            rest = _only(rates, [other for other in places if other != place])
            if len(places) > 2 and (rest in self._named or tuple(-rate for rate in rest) in self._named):
                return self.of(rest) + self.of(_only(rates, [place]))
        known = self.of(_only(rates, places[:1]))
        for place in places[1:-1]:
            known = self.bindings.name(known + self.of(_only(rates, [place])))
        return known + self.of(_only(rates, places[-1:]))


_FEW = 8
"""Sums of more terms are only found in those that are short of their first or last one."""


def _only(rates: Rates, places: Sequence[int]) -> Rates:
    """Return some factors; zeros elsewhere."""
    kept = set(places)
    return tuple(rate if place in kept else sp.S.Zero for place, rate in enumerate(rates))


def active(spins: Iterable[Spin]) -> tuple[int, ...]:
    """Return the axes about which something turns."""
    known = tuple(spins)
    return tuple(axis for axis in range(3) if any(rate != 0 for spin in known for rate in spin[axis]))


@dataclass(frozen=True, slots=True)
class Form:
    """A choice among equal forms, by what they cost.

    Attributes:
        early: Levels whose whole turn is added to the velocities before these are brought to its axes; what only this
            turn needs is then not brought there.
        squared: Whether what is drawn to an axis is a square of the rate times its distance, or the rate times its
            velocity.
        inside: Whether the velocity of a link is found in its own axes, or in those of its level.
        singly: Whether the links of a level pass, each by itself, what is behind it as the turns behind it turn that,
            or all of them as one length.
    """

    early: frozenset[int] = frozenset()
    squared: bool = False
    inside: bool = False
    singly: bool = False

    def __str__(self) -> str:
        levels = ", ".join(map(str, sorted(self.early))) or "none"
        words = [f"turns added early at levels {levels}"]
        words += ["squares of rates"] if self.squared else []
        words += ["links in their own axes"] if self.inside else []
        words += ["links one by one"] if self.singly else []
        return "; ".join(words)


@dataclass(slots=True)
class Walk:
    """The motion of the end of a chain as seen from the point that has been reached, in the axes there.

    Angles and lengths are linear in the joint variables, so their second derivatives are those of the joints, combined.

    `of_end`: whether the velocity is that of the end of the chain; otherwise that of the point of its body that passes
    where the walk is. `lever`: from the point reached to the end. `omega`, `alpha`: angular velocity, angular
    acceleration. `still`: `alpha` without what the turns of the level add.
    """

    bindings: LetBindings
    rates: Sums
    accelerations: Sums
    of_end: bool
    form: Form
    lever: Vector = NULL
    velocity: Vector = NULL
    omega: Vector = NULL
    acceleration: Vector = NULL
    alpha: Vector = NULL
    still: Vector = NULL

    def inwards(self, marked: AnnotatedChain, levels: Sequence[tuple[Sequence[Link], Spin]]) -> None:
        """Walk the whole chain, given what `links_of` finds in its levels."""
        for level in range(len(marked.turns), -1, -1):
            links, whole = levels[level]
            behind = marked.turns[level] if level < len(marked.turns) else None
            self._name_sums(links, whole)
            # About the axis of the turn, the rate is the same on both sides of it.
            early = behind is not None and level in self.form.early and set(active([whole])) <= {behind.axis}
            if early:
                self._whole(whole)
            if behind is not None:
                self._rotate(behind)
            if not early:
                self._whole(whole)
            if self.of_end:
                self._end(links)
            else:
                self._passing(links, whole)

    def _rotate(self, turn: Turn) -> None:
        """Over to the axes before a turn."""

        def back(vector: Vector) -> Vector:
            return self.bindings.vector(rotate(turn.axis, turn.angle, vector))

        self.lever = back(self.lever)
        self.velocity, self.omega = back(self.velocity), back(self.omega)
        self.acceleration, self.alpha = back(self.acceleration), back(self.alpha)
        self.still = back(self.still)

    def _name_sums(self, links: Sequence[Link], whole: Spin) -> None:
        spins = [each.spin for each in links]
        for spin in spins if self.of_end else [difference(whole, each) for each in reversed(spins)]:
            self.rates.vector(spin)
            self.accelerations.vector(spin)

    def _whole(self, whole: Spin) -> None:
        """Turn what is behind a level by all its turns at once."""
        turn, change = self.rates.vector(whole), self.accelerations.vector(whole)
        self.still = self.alpha
        self.alpha = self._sum([self.alpha, cross(turn, self.omega)])
        if not self.of_end:
            self.acceleration = self._sum([self.acceleration, cross(turn, self.velocity)])
            return
        self.alpha, self.omega = self._sum([self.alpha, change]), self._sum([self.omega, turn])
        before, swing = self.velocity, self.bindings.vector(cross(turn, self.lever))
        self.velocity = self._sum([before, swing])
        # With its own swing, the velocity counts twice.
        both = self.bindings.vector(total(before, self.velocity))
        drawn = self._centripetal(turn, self.lever, swing) if before == NULL else cross(turn, both)
        self.acceleration = self._sum([self.acceleration, drawn, cross(change, self.lever)])

    def _end(self, links: Sequence[Link]) -> None:
        """Over to the start of a level, for the velocity of the end: what is between the turns."""
        # The level turns as a whole; what is left is how each link moves in it.
        levers, velocities, accelerations = [self.lever], [self.velocity], [self.acceleration]
        for link in reversed(links):
            spin, swell = self.rates.vector(link.spin), self.accelerations.vector(link.spin)
            levers.append(self.bindings.vector(link.placed(link.piece)))
            inside = self._is_inside(link, link.spin)
            at = link if inside else link.brought()
            piece, along, gain = self._given(at)
            # The velocity of the link itself; with slides, the Coriolis term counts twice.
            swing = self.bindings.vector(cross(spin, piece))
            velocity = self._sum([swing, along])
            drawn = [self._centripetal(spin, piece, swing)]
            if self.form.squared or along == NULL:
                drawn.append(cross(self.bindings.vector(scaled(sp.Integer(2), spin)), along))
            else:
                drawn = [cross(spin, self._sum([velocity, along]))]
            change = [*drawn, cross(swell, piece), gain]
            if inside:
                velocities.append(self.bindings.vector(at.placed(velocity)))
                accelerations.append(self.bindings.vector(at.placed(self._sum(change))))
            else:
                velocities += [swing, along]
                accelerations += change
        self.lever, self.velocity = self._sum(levers), self._sum(velocities)
        self.acceleration = self._sum(accelerations)

    def _is_inside(self, link: Link, *spins: Spin) -> bool:
        return self.form.inside and link.turn is not None and set(active(spins)) <= {link.turn.axis}

    def _given(self, link: Link) -> tuple[Vector, Vector, Vector]:
        """Return the translation of a link, and how fast its slides grow, twice derived, in the axes of the link."""
        rates = [scaled(self.rates.of(rate), axis) for rate, axis in link.slides]
        accelerations = [scaled(self.accelerations.of(rate), axis) for rate, axis in link.slides]
        return self.bindings.vector(link.piece), self._sum(rates), self._sum(accelerations)

    def _passing(self, links: Sequence[Link], whole: Spin) -> None:
        """Over to the start of a level, for the velocity of the point that passes there."""
        velocities, accelerations = [self.velocity], [self.acceleration]
        # Axes about which all turns of the level turn alike are treated once, at the end.
        behind = [difference(whole, link.spin) for link in links]
        axes = active([*behind, *(link.spin for link in links)])
        others = tuple(axis for axis in range(3) if axis not in axes)
        singly = self.form.singly and len(axes) == 1
        moved, drifts = NULL, NULL
        for link, rest in zip(reversed(links), reversed(behind), strict=True):
            # A link that turns about its own axis alone is cheaper in its own axes.
            inside = self._is_inside(link, link.spin, rest)
            at = link if inside else link.brought()
            piece, along, gain = self._given(at)
            spin = self.rates.vector(link.spin)
            seen = self._sum([_part(self.omega, axes), self.rates.vector(rest)])
            swell = self._sum([_part(self.alpha, axes), self.accelerations.vector(rest)])
            swing = self.bindings.vector(cross(spin, piece))
            relative = self._sum([seen, scaled(sp.S.NegativeOne, spin)])
            # What is behind turns as seen from the link: the piece moves it by that, not by its own turn.
            velocity = [cross(piece, seen), along]
            change = [cross(piece, swell), self._carried(spin, piece, seen, swing), gain, cross(along, relative)]
            drift = self._sum([swing, along])
            if inside:
                velocity, change = ([self.bindings.vector(at.placed(self._sum(each)))] for each in (velocity, change))
                drift = self.bindings.vector(at.placed(drift))
            velocities += velocity
            accelerations += change
            moved, drifts = total(moved, self.bindings.vector(link.placed(link.piece))), total(drifts, drift)
            # Along the other axes the piece is passed by itself, as the turns behind it turn it.
            if singly:
                turned = cross(self.rates.vector(rest), _part(self.omega, others))
                swell = self._sum([_part(self.still, others), turned])
                placed = _part(self.bindings.vector(link.placed(link.piece)), others)
                slide = along if not inside else self.bindings.vector(at.placed(along))
                accelerations += [cross(placed, swell), cross(slide, _part(self.omega, others))]
        # About the other axes all pieces turn alike.
        moved, drifts = self.bindings.vector(moved), self.bindings.vector(drifts)
        velocities.append(cross(moved, _part(self.omega, others)))
        passed = _part(moved, axes) if singly else moved
        accelerations.append(cross(passed, _part(self.alpha, others)))
        if not singly:
            accelerations.append(cross(drifts, _part(self.omega, others)))
        self.velocity, self.acceleration = self._sum(velocities), self._sum(accelerations)
        self.alpha = self._sum([self.alpha, self.accelerations.vector(whole)])
        self.omega = self._sum([self.omega, self.rates.vector(whole)])

    def _centripetal(self, spin: Vector, piece: Vector, swing: Vector) -> Vector:
        return self._carried(scaled(sp.S.NegativeOne, spin), piece, spin, scaled(sp.S.NegativeOne, swing))

    def _carried(self, spin: Vector, piece: Vector, seen: Vector, drift: Vector) -> Vector:
        """Return the vector product of the velocity of a piece that is turned, and an angular velocity."""
        axes = [axis for axis in range(3) if spin[axis] != 0 or seen[axis] != 0]
        if not self.form.squared or len(axes) != 1:
            return cross(drift, seen)
        product = self.bindings.name(spin[axes[0]] * seen[axes[0]])
        return scaled(product, _part(piece, tuple(axis for axis in range(3) if axis not in axes)))

    def _sum(self, vectors: Iterable[Vector]) -> Vector:
        return self.bindings.vector(reduce(total, vectors, NULL))


def _part(vector: Vector, axes: Sequence[int]) -> Vector:
    x, y, z = (entry if axis in axes else sp.S.Zero for axis, entry in enumerate(vector))
    return x, y, z
