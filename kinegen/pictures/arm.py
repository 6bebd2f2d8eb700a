"""One posture on paper: links, joint symbols, base and gripper.

Symbols of joints whose axes meet would cover each other, as in a spherical wrist. They are moved along their axes, the
first one towards the link before and the last one towards the link behind, as textbooks draw them.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from kinegen.pictures.marks import ARM, INK, LINK, SLIDE, Area, Mark, Stroke, Words, paler
from kinegen.pictures.sides import FloatArray, View
from kinegen.pictures.skeleton import Joint, Link, Skeleton
from kinegen.pictures.solids import LONG, gripper, ground, symbol

_ALONG = 0.9
"""Cosine from which two directions count as one."""

_APART = 2.5
"""Distance between neighbouring symbols, in halves of their length."""


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """A joint with the place of its symbol."""

    joint: Joint
    centre: FloatArray


def symbol_radius(skeletons: tuple[Skeleton, ...], size: float) -> float:
    """A size of joint symbols that suits the links.

    Args:
        skeletons: The postures.
        size: Length of the longer side of the robot as seen, in its length unit.
    """
    lengths = [link.length for skeleton in skeletons for link in skeleton.links if link.length > 1e-3 * size]
    usual = 0.16 * float(np.median(lengths)) if lengths else size
    return float(min(0.03 * size, max(usual, 0.009 * size)))


def bodies(skeleton: Skeleton, radius: float) -> tuple[Body, ...]:
    """Where the symbols of all joints are."""
    half = LONG * radius
    groups: list[list[Joint]] = []
    for joint in skeleton.joints:
        near = [group for group in groups if np.linalg.norm(group[0].point - joint.point) < half]
        near[0].append(joint) if near else groups.append([joint])
    return tuple(body for group in groups for body in _spread(group, skeleton, half))


def _spread(group: list[Joint], skeleton: Skeleton, half: float) -> Iterator[Body]:
    """Joints at one point, beside each other."""
    if len(group) == 1:
        yield Body(group[0], group[0].point)
        return
    point = group[0].point
    before, behind = _ways(point, skeleton, half)
    taken = np.zeros((0, 3))
    for number, joint in enumerate(group):
        wishes = [np.zeros(3), *(sign * _APART * half * joint.axis for sign in (-1.0, 1.0, -2.0, 2.0))]
        if number == 0 and abs(float(joint.axis @ before)) > _ALONG:
            wishes.insert(0, _APART * half * before)
        if number == len(group) - 1 and abs(float(joint.axis @ behind)) > _ALONG:
            wishes.insert(0, _APART * half * behind)
        gaps = [float(np.min(np.linalg.norm(taken - wish, axis=1), initial=9 * half)) for wish in wishes]
        chosen = next((wish for wish, gap in zip(wishes, gaps, strict=True) if gap > 1.9 * half), wishes[-1])
        taken = np.vstack([taken, chosen])
        yield Body(joint, point + chosen)


def _ways(point: FloatArray, skeleton: Skeleton, half: float) -> tuple[FloatArray, FloatArray]:
    """Unit vectors towards the link before a point and the one behind it."""
    root = next(iter(skeleton.frames.values()))
    before = -root[:3, 2]
    behind = skeleton.frames[skeleton.tips[0]][:3, 2]
    for link in reversed(skeleton.links):
        if np.linalg.norm(link.end - point) < half < link.length:
            before = (link.start - link.end) / link.length
            break
    for link in skeleton.links:
        if np.linalg.norm(link.start - point) < half < link.length:
            behind = (link.end - link.start) / link.length
            break
    return before, behind


def draw_arm(skeleton: Skeleton, radius: float, view: View, suffix: str = "") -> Iterator[Mark]:
    """The marks of one posture.

    Args:
        skeleton: The posture.
        radius: Size of a joint symbol, in the length unit of the robot.
        view: The projection.
        suffix: What is put behind identifiers, to tell postures apart.
    """
    placed = bodies(skeleton, radius)
    for number, link in enumerate(skeleton.links):
        yield from _link(link, radius, view, f"link-{number + 1}{suffix}")
    for body in placed:
        if np.linalg.norm(body.centre - body.joint.point) > 0.1 * radius:
            ends = np.array([body.joint.point, body.centre])
            yield Stroke(
                view.place(ends), LINK, _thick(radius, view), ARM, view.depth(ends) - 4.0 * radius * view.scale
            )
        yield from symbol(body.joint, body.centre, radius, view, f"joint-{body.joint.name}{suffix}")
    yield from _base(skeleton, placed, radius, view)
    yield from _ends(skeleton, placed, radius, view)


def _thick(radius: float, view: View) -> float:
    return max(1.2, 0.75 * radius * view.scale)


def _link(link: Link, radius: float, view: View, name: str) -> Iterator[Mark]:
    """A link in pieces, each with a depth of its own, so that it passes behind what is before it."""
    width = _thick(radius, view) * (0.6 if link.sliding else 1.0)
    colour = SLIDE if link.sliding else LINK
    inside = min(1.2 * radius / link.length, 0.5)
    pieces = int(np.clip((1 - 2 * inside) * link.length / (2 * radius), 1, 8))
    shares = [0.0, *np.linspace(inside, 1 - inside, pieces + 1), 1.0]
    for number, (low, high) in enumerate(itertools.pairwise(shares)):
        ends = link.start + np.outer([low, high], link.end - link.start)
        # The ends are inside joints, whose symbols hide them; elsewhere a link hides what is farther than its width.
        below = 4.0 if number in (0, len(shares) - 2) else 1.0
        depth = view.depth(ends) - below * radius * view.scale
        yield Stroke(view.place(ends), colour, width, ARM, depth, name="" if number else name)


def _base(skeleton: Skeleton, placed: tuple[Body, ...], radius: float, view: View) -> Iterator[Mark]:
    """The plate below the root frame; below a symbol that is there, with a pillar between."""
    root = next(iter(skeleton.frames.values()))
    below = [float((body.centre - root[:3, 3]) @ root[:3, 2]) for body in placed if _is_over(body, root, radius)]
    lowest = min(below, default=0.0)
    foot = 2.6 * LONG * radius - lowest if lowest < 2 * LONG * radius and below else 0.0
    yield from ground(root[:3, 3], root[:3, :3], foot, radius, view)


def _is_over(body: Body, root: FloatArray, radius: float) -> bool:
    offset = body.centre - root[:3, 3]
    return bool(np.linalg.norm(offset - (offset @ root[:3, 2]) * root[:3, 2]) < 2 * radius)


def _ends(skeleton: Skeleton, placed: tuple[Body, ...], radius: float, view: View) -> Iterator[Mark]:
    """A gripper at the tool of a chain, dots at the tips of a tree."""
    if len(skeleton.tips) > 1:
        for name in skeleton.tips:
            point = skeleton.frames[name][:3, 3]
            angles = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
            ring = view.place(point) + 0.4 * radius * view.scale * np.column_stack([np.cos(angles), np.sin(angles)])
            yield Area(ring, INK, INK, 0.0, depth=view.depth(point) + 2 * radius * view.scale, name=f"tip-{name}")
        return
    frame = skeleton.frames[skeleton.tips[0]]
    tip, along = frame[:3, 3], frame[:3, 2]
    covered = [body for body in placed if np.linalg.norm(body.joint.point - tip) < LONG * radius]
    last = next((link for link in reversed(skeleton.links) if np.linalg.norm(link.end - tip) < radius), None)
    if covered:
        # The tip is inside the symbols of the wrist: the gripper is outside them.
        past = max(0.0, *(float((body.centre - tip) @ along) for body in covered))
        outside = tip + (past + (LONG + 2.0) * radius) * along
        depth = view.depth([tip, outside]) - 4.0 * radius * view.scale
        yield Stroke(view.place([tip, outside - 1.5 * radius * along]), LINK, _thick(radius, view), ARM, depth)
        tip = outside
    elif last is not None and last.length > 2 * radius:
        along = (last.end - last.start) / last.length
    yield from gripper(tip, along, _finger_line(frame, along, view), radius, view)


def _finger_line(frame: FloatArray, along: FloatArray, view: View) -> FloatArray:
    """The axis of a frame, at right angles to the fingers, that is seen best; y where both are."""
    axes = [axis - (axis @ along) * along for axis in (frame[:3, 1], frame[:3, 0])]
    sizes = [float(np.linalg.norm(axis)) for axis in axes]
    seen = [float(np.linalg.norm(axis - (axis @ view.towards) * view.towards)) for axis in axes]
    best = axes[0] if sizes[1] < 0.1 or (sizes[0] > 0.1 and (seen[0] > 0.5 or seen[0] >= seen[1])) else axes[1]
    return np.asarray(best / np.linalg.norm(best))


def pale(mark: Mark) -> Mark:
    """A mark of a further posture, in colours near that of the paper."""
    if isinstance(mark, Words):
        return replace(mark, colour=paler(mark.colour))
    if isinstance(mark, Stroke):
        return replace(mark, colour=paler(mark.colour))
    return replace(mark, colour=paler(mark.colour), edge=paler(mark.edge))
