"""Two robots compared, frame by frame: by proof where their screws are the same, else by the greatest difference."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from kinegen.errors import KinegenError
from kinegen.model.robot import TOOL, Convention, Robot
from kinegen.model.variants import link_of
from kinegen.support.dataclass import dataclass
from kinegen.tools.compare.fit import Fit, Side, fit
from kinegen.tools.compare.frame_differences import (
    Box,
    Describer,
    FloatArray,
    Poser,
    box_of,
    distances,
    poses,
    samples,
    worst,
)

TOLERANCE = 1e-9
"""Metres and radians up to which frames are the same where there is no proof."""

FACTORS = {1000.0: "millimetres", 100.0: "centimetres", 25.4: "inches with millimetres", 39.37007874015748: "inches"}
"""Factors between two files that should be in one unit."""


FITTED = "signs and zeros were fitted"
"""Why frames of rows do not decide then: they turn with a joint whose direction or zero is another one."""


@dataclass(frozen=True, slots=True)
class Difference:
    """A frame of both robots, and the greatest differences with their joint vectors, in metres and radians.

    Attributes:
        proved: Whether the poses are the same for every joint vector, by proof.
        decides: Whether the frame decides if the robots are the same: tips and named frames do, and the frames of
            rows where both robots have one convention and no sign or zero was fitted.
        reason: Why it does not; empty if it does.
    """

    first: str
    second: str
    proved: bool
    distance: float
    distance_at: tuple[float, ...]
    angle: float
    angle_at: tuple[float, ...]
    decides: bool
    reason: str


@dataclass(frozen=True, slots=True)
class Comparison:
    """The frames that two robots have in common, and those that only one has.

    Attributes:
        same: Whether all frames that decide are the same, by proof or within the tolerance.
        signs: 1, or -1 where a joint of the second robot has the other direction.
        offsets: What is added to give the joint of the second robot, in radians and metres.
    """

    same: bool
    proved: bool
    tolerance: float
    joints: tuple[tuple[str, str], ...]
    signs: tuple[int, ...]
    offsets: tuple[float, ...]
    differences: tuple[Difference, ...]
    only_first: tuple[str, ...]
    only_second: tuple[str, ...]
    notes: tuple[str, ...]


def compare(first: Robot, second: Robot, *, fit_offsets: bool = False, tolerance: float = TOLERANCE) -> Comparison:
    """Compare two robots.

    Args:
        first: A robot; its limits are the joint box.
        second: Another one, in any convention and unit.
        fit_offsets: Whether signs and zero offsets of the joints are found; otherwise joints are as they are.
        tolerance: Metres and radians up to which frames are the same where there is no proof.

    Raises:
        KinegenError: If they have different numbers or types of joints, or no tip in common.
    """
    joints, notes = _joints(first, second, by_place=fit_offsets)
    _check_types(first, second, joints)
    pairs, only_first, only_second = _frames(first, second)
    order = [[v.name for v in first.variables].index(a) for _, a in _by_second(second, joints)]
    signs, offsets = np.ones(len(order)), np.zeros(len(order))
    # Signs and zeros are fitted to tips before frames are compared.
    if fit_offsets:
        fitted = _fitted(first, second, pairs)
        signs, offsets = np.array(fitted.signs, dtype=float), np.array(fitted.offsets)
        notes += _fit_notes(second, fitted)
    plain = not fit_offsets or (set(signs) <= {1.0} and not offsets.any())
    # With fitted zeros the frames of rows turn, which says nothing of the robots.
    if not plain:
        rows = {row.name for robot in (first, second) for row in robot.rows}
        fixed = {name for pair in _tips(first, second) for name in pair}
        pairs = [(a, b, reason or (FITTED if a in rows and a not in fixed else "")) for a, b, reason in pairs]
    box = box_of(first)
    describers = Describer(first, {a: a for a, _ in joints}), Describer(second, {b: a for a, b in joints})
    posers = (
        Poser(first, list(range(len(order))), np.ones(len(order)), np.zeros(len(order))),
        Poser(second, order, signs, offsets),
    )
    # Equal joint vectors for all frames, whose poses are computed once.
    q = samples(box)
    differences = [_difference(pair, describers if plain else None, posers, box, q) for pair in pairs]
    decisive = [each for each in differences if each.decides]
    same = all(each.proved or max(each.distance, each.angle) <= tolerance for each in decisive)
    # A factor between all lengths is one mistake, and gets one line.
    if not same:
        notes += _scale_notes(first, second, pairs[0][:2], box, order, tolerance)
    return Comparison(
        same=same,
        proved=all(each.proved for each in decisive),
        tolerance=tolerance,
        joints=joints,
        signs=tuple(int(each) for each in signs),
        offsets=tuple(float(each) for each in offsets),
        differences=tuple(differences),
        only_first=only_first,
        only_second=only_second,
        notes=tuple(notes),
    )


def _difference(
    pair: tuple[str, str, str],
    describers: tuple[Describer, Describer] | None,
    posers: tuple[Poser, Poser],
    box: Box,
    q: FloatArray,
) -> Difference:
    """Return the difference of two frames: nothing by proof, or the greatest that was found from joint vectors q."""
    one, other, reason = pair
    if describers and describers[0].motions(one).same(describers[1].motions(other)):
        return Difference(one, other, True, 0.0, (), 0.0, (), not reason, reason)

    def apart(at: FloatArray) -> FloatArray:
        return distances(posers[0](one, at), posers[1](other, at))

    found = worst(apart, box, q, search=not reason)
    greatest = found.distance, found.distance_at, found.angle, found.angle_at
    return Difference(one, other, False, *greatest, not reason, reason)


def _joints(first: Robot, second: Robot, *, by_place: bool) -> tuple[tuple[tuple[str, str], ...], list[str]]:
    """Return the joints that belong together: by name where both have the same names, else by their place."""
    left, right = ([variable.name for variable in robot.variables] for robot in (first, second))
    if len(left) != len(right):
        raise KinegenError(
            f"{first.name} has {len(left)} joint variables and {second.name} has {len(right)}: they are not the same "
            "robot"
        )
    if not left:
        return (), []
    # Names identify joints unless zeros are fitted, which takes the order along the arm.
    if sorted(left) == sorted(right) and not by_place:
        notes = [] if left == right else ["the joints are in another order; they are matched by name"]
        return tuple((name, name) for name in left), notes
    notes = [] if left == right else ["the joints have other names; they are matched by their index"]
    return tuple(zip(left, right, strict=True)), notes


def _by_second(second: Robot, joints: tuple[tuple[str, str], ...]) -> list[tuple[str, str]]:
    """Return the joints in the order of the second robot: its name, and that of the first."""
    first_of = {b: a for a, b in joints}
    return [(variable.name, first_of[variable.name]) for variable in second.variables]


def _check_types(first: Robot, second: Robot, joints: tuple[tuple[str, str], ...]) -> None:
    left = {each.name: each.type for each in first.variables}
    right = {each.name: each.type for each in second.variables}
    for a, b in joints:
        if left[a] is not right[b]:
            raise KinegenError(
                f"joint {a} of {first.name} is {left[a]}, joint {b} of {second.name} is {right[b]}: they are not the "
                "same robot"
            )


def _tips(first: Robot, second: Robot) -> list[tuple[str, str]]:
    """Return the tips that belong together."""
    if first.is_tree == second.is_tree is False:
        return [(_ends(first, second)[0], _ends(second, first)[0])]
    if len(first.tips) == len(second.tips) == 1:
        return [(first.tips[0], second.tips[0])]
    return _paired(first, second, _ends(first, second), _ends(second, first))


def _ends(robot: Robot, other: Robot) -> list[str]:
    """Return the tips; where several links end a file at one row, that of them which is a tip of the other file."""
    named, theirs = link_of(robot), set(_tip_links(other).values())
    ends = []
    for tip, link in _tip_links(robot).items():
        row = robot.rows[-1].name if tip == TOOL and TOOL not in named and robot.rows else tip
        on_it = (frame for frame, where in robot.frame_links.items() if where == row and named.get(frame) in theirs)
        ends.append(tip if link in theirs else next(on_it, tip))
    return ends


def _tip_links(robot: Robot) -> dict[str, str]:
    """Return the link of each tip; of a tool that is none the last row's, and nothing where the file has no links."""
    named = link_of(robot)
    last = named.get(robot.rows[-1].name, "") if robot.rows else ""
    return {tip: named.get(tip, last if tip == TOOL else "") for tip in robot.tips}


def _paired(first: Robot, second: Robot, lefts: Sequence[str], rights: Sequence[str]) -> list[tuple[str, str]]:
    """The frames that belong together, in the order of the first: by their links, by name, by a link and a name."""
    links = link_of(first), link_of(second)
    rows = {row.name for row in first.rows} & {row.name for row in second.rows}
    found: dict[str, str] = {}

    def pair(left: Mapping[str, str], right: Mapping[str, str]) -> None:
        free = {key: name for name, key in right.items() if name in rights and name not in found.values()}
        found.update(
            {name: free[key] for name, key in left.items() if name in lefts and name not in found and key in free}
        )

    pair(*links)
    # One name for two links of the files is a name that kinegen gave; that of a row is one of the files.
    same = [{name: name for name in names} for names in (lefts, rights)]
    if first.links and second.links:
        same = [{name: name for name in names if name in rows} for names in same]
    pair(*same)
    pair(*({name: own.get(name, name) for name in names} for own, names in zip(links, (lefts, rights), strict=True)))
    return [(name, found[name]) for name in lefts if name in found]


def _frames(first: Robot, second: Robot) -> tuple[list[tuple[str, str, str]], tuple[str, ...], tuple[str, ...]]:
    """Return the frames to compare, and why each does not decide, empty where it does; tips first."""
    tips = _tips(first, second)
    if not tips:
        raise KinegenError(f"{first.name} and {second.name} have no tip of one name in common")
    # Tips decide; the frames of rows do only where both robots have one convention.
    rows = [{row.name: row.convention for row in robot.rows} for robot in (first, second)]
    pairs = [(a, b, "") for a, b in tips]
    left, right = (
        [name for name in robot.frame_names if name not in {tip[place] for tip in tips}]
        for place, robot in enumerate((first, second))
    )
    both = _paired(first, second, left, right)
    pairs += [(a, b, _reason(rows[0].get(a), rows[1].get(b))) for a, b in both]
    only = [
        tuple(n for n in names if n not in {pair[place] for pair in both}) for place, names in enumerate((left, right))
    ]
    return pairs, only[0], only[1]


def _reason(first: Convention | None, second: Convention | None) -> str:
    """Why the frame of a row does not decide: each convention has its own place for it."""
    if Convention.ETS in (first, second) and {first, second} <= {Convention.ETS, None}:
        return "rows without a convention put their frames anywhere"
    return "another convention" if first is not second else ""


def _fitted(first: Robot, second: Robot, pairs: list[tuple[str, str, str]]) -> Fit:
    one, other = pairs[0][:2]
    sides = [
        Side(robot, frame, Describer(robot, {each.name: each.name for each in robot.variables}).motions(frame))
        for robot, frame in ((first, one), (second, other))
    ]
    found = fit(sides[0], sides[1])
    if found is None:
        raise KinegenError(
            f"no signs and zero offsets bring the joint axes of {second.name} onto those of {first.name}: the axes are "
            "in other places"
        )
    return found


def _fit_notes(second: Robot, found: Fit) -> list[str]:
    names = [variable.name for variable in second.variables]
    turned = [name for name, sign in zip(names, found.signs, strict=True) if sign < 0]
    notes = [f"opposite direction: {', '.join(turned)}"] if turned else []
    return notes + ([] if turned or any(found.offsets) else ["no joint has another sign or zero"])


def _scale_notes(
    first: Robot, second: Robot, tip: tuple[str, str], box: Box, order: list[int], tolerance: float
) -> list[str]:
    """Tell whether one robot is the other with lengths in another unit, as where a file has the wrong one."""
    q = np.random.default_rng(3).uniform(box.low, box.high, (64, len(box.low)))
    left, right = poses(first, tip[0], q), poses(second, tip[1], q[:, order])
    for factor, words in FACTORS.items():
        for a, b, name in ((left, right, second.name), (right, left, first.name)):
            scaled = b.copy()
            scaled[:, :3, 3] /= factor
            if float(distances(a, scaled).max()) <= 1000 * tolerance:
                return [f"all lengths of {name} are {factor:.6g} times those of the other: is it in {words}?"]
    return []
