"""Two robots compared, frame by frame: by proof where their screws are the same, else by the greatest difference."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kinegen.compare.differ import Box, FloatArray, Poser, box_of, distances, poses, samples, worst
from kinegen.compare.fit import Fit, Side, fit
from kinegen.compare.motions import Describer
from kinegen.errors import KinegenError
from kinegen.robot.model import TOOL, Convention, Robot

TOLERANCE = 1e-9
"""Metres and radians up to which frames are the same where there is no proof."""

FACTORS = {1000.0: "millimetres", 100.0: "centimetres", 25.4: "inches with millimetres", 39.37007874015748: "inches"}
"""What a factor between two files that should be in one unit looks like."""


@dataclass(frozen=True, slots=True)
class Difference:
    """One frame of both robots.

    Attributes:
        first: Its name in the first robot.
        second: Its name in the second robot.
        proved: Whether the poses are the same for every joint vector, by proof.
        distance: The greatest distance that was found, in metres; 0 with a proof.
        distance_at: Joint vector of the first robot there, in radians and metres.
        angle: The greatest turn that was found, in radians.
        angle_at: Joint vector there.
        decides: Whether the frame decides if the robots are the same: tips and named frames do, and the frames of
            rows where both robots have one convention.
    """

    first: str
    second: str
    proved: bool
    distance: float
    distance_at: tuple[float, ...]
    angle: float
    angle_at: tuple[float, ...]
    decides: bool


@dataclass(frozen=True, slots=True)
class Comparison:
    """What two robots have in common.

    Attributes:
        same: Whether all frames that decide are the same, by proof or within the tolerance.
        proved: Whether all of them are by proof.
        tolerance: Metres and radians.
        joints: Names of the joints in both robots, in the order of the first.
        signs: 1, or -1 where a joint of the second robot has the other direction.
        offsets: What is added to give the joint of the second robot, in radians and metres.
        differences: One for each frame that both have.
        only_first: Frames of the first robot alone.
        only_second: Frames of the second robot alone.
        notes: Remarks, a line each.
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
    if fit_offsets:
        fitted = _fitted(first, second, pairs)
        signs, offsets = np.array(fitted.signs, dtype=float), np.array(fitted.offsets)
        notes += _fit_notes(second, fitted)
    plain = not fit_offsets or (set(signs) <= {1.0} and not offsets.any())
    box = box_of(first)
    describers = Describer(first, {a: a for a, _ in joints}), Describer(second, {b: a for a, b in joints})
    posers = (
        Poser(first, list(range(len(order))), np.ones(len(order)), np.zeros(len(order))),
        Poser(second, order, signs, offsets),
    )
    q = samples(box)
    differences = [_difference(pair, describers if plain else None, posers, box, q) for pair in pairs]
    decisive = [each for each in differences if each.decides]
    same = all(each.proved or max(each.distance, each.angle) <= tolerance for each in decisive)
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
    pair: tuple[str, str, bool],
    describers: tuple[Describer, Describer] | None,
    posers: tuple[Poser, Poser],
    box: Box,
    q: FloatArray,
) -> Difference:
    """What there is between two frames: nothing by proof, or the greatest difference found from joint vectors q."""
    one, other, decides = pair
    if describers and describers[0].motions(one).same(describers[1].motions(other)):
        return Difference(one, other, True, 0.0, (), 0.0, (), decides)

    def apart(at: FloatArray) -> FloatArray:
        return distances(posers[0](one, at), posers[1](other, at))

    found = worst(apart, box, q, search=decides)
    return Difference(one, other, False, found.distance, found.distance_at, found.angle, found.angle_at, decides)


def _joints(first: Robot, second: Robot, *, by_place: bool) -> tuple[tuple[tuple[str, str], ...], list[str]]:
    """The joints that belong together: by name where both have the same names, else by their place."""
    left, right = ([variable.name for variable in robot.variables] for robot in (first, second))
    if len(left) != len(right):
        raise KinegenError(
            f"{first.name} has {len(left)} joint variables and {second.name} has {len(right)}: they are not the same "
            "robot"
        )
    if not left:
        return (), []
    if sorted(left) == sorted(right) and not by_place:
        notes = [] if left == right else ["the joints are in another order; they are matched by name"]
        return tuple((name, name) for name in left), notes
    notes = [] if left == right else ["the joints have other names; they are matched by their place"]
    return tuple(zip(left, right, strict=True)), notes


def _by_second(second: Robot, joints: tuple[tuple[str, str], ...]) -> list[tuple[str, str]]:
    """The joints in the order of the second robot: its name, and that of the first."""
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


def _frames(first: Robot, second: Robot) -> tuple[list[tuple[str, str, bool]], tuple[str, ...], tuple[str, ...]]:
    """The frames to compare, and whether each decides; tips first."""
    if first.is_tree == second.is_tree is False:
        tips = [(TOOL, TOOL)]
    elif len(first.tips) == len(second.tips) == 1:
        tips = [(first.tips[0], second.tips[0])]
    else:
        tips = [(tip, tip) for tip in first.tips if tip in second.tips]
    if not tips:
        raise KinegenError(f"{first.name} and {second.name} have no tip of one name in common")
    rows = [{row.name: row.convention for row in robot.rows} for robot in (first, second)]
    pairs = [(a, b, True) for a, b in tips]
    used = {a for a, _ in tips}
    others = set(second.frame_names)
    for name in first.frame_names:
        if name in others and name not in used:
            placed = rows[0].get(name), rows[1].get(name)
            # Each convention has its own place for the frame of a row.
            decides = placed == (None, None) or (placed[0] is placed[1] and placed[0] is not Convention.ETS)
            pairs.append((name, name, decides))
    shared = {a for a, _, _ in pairs}
    only = [tuple(n for n in a.frame_names if n not in shared) for a in (first, second)]
    return pairs, only[0], only[1]


def _fitted(first: Robot, second: Robot, pairs: list[tuple[str, str, bool]]) -> Fit:
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
    """Whether one robot is the other with lengths in another unit, as where a file has the wrong one."""
    q = np.random.default_rng(3).uniform(box.low, box.high, (64, len(box.low)))
    left, right = poses(first, tip[0], q), poses(second, tip[1], q[:, order])
    for factor, words in FACTORS.items():
        for a, b, name in ((left, right, second.name), (right, left, first.name)):
            scaled = b.copy()
            scaled[:, :3, 3] /= factor
            if float(distances(a, scaled).max()) <= 1000 * tolerance:
                return [f"all lengths of {name} are {factor:.6g} times those of the other: is it in {words}?"]
    return []
