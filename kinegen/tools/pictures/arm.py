"""Draws one posture on paper: links, joint symbols as textbooks draw them, base and gripper.

Symbols of joints whose axes meet would cover each other, as in a spherical wrist. They are moved along their axes, the
first one towards the link before and the last one towards the link behind, as textbooks draw them.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from kinegen.model.robot import JointType
from kinegen.support.dataclass import dataclass
from kinegen.tools.pictures.postures import Joint, Link, Skeleton
from kinegen.tools.pictures.projection import (
    ARM,
    BEHIND,
    BODY,
    CAP,
    EDGE,
    FOLLOWER,
    GROUND,
    INK,
    LINK,
    SCREW,
    SLIDE,
    Area,
    FloatArray,
    Mark,
    Stroke,
    View,
    Words,
    hull,
    paler,
)

LONG = 1.25
"""Half the length of a joint symbol, in radii."""

_CIRCLE = 48
_THREADS = 3


def crossing(axis: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two unit vectors at right angles to a unit vector and to each other."""
    helper = np.eye(3)[int(np.argmin(np.abs(axis)))]
    first = np.cross(axis, helper)
    first = first / np.linalg.norm(first)
    return first, np.cross(axis, first)


def symbol(joint: Joint, centre: FloatArray, radius: float, view: View, name: str) -> tuple[Mark, ...]:
    """Yield the symbol of a joint, at a centre on or beside its axis."""
    if joint.type is JointType.PRISMATIC:
        return _box(centre, joint, radius, view, name)
    return _cylinder(centre, joint, radius, view, name)


def _cylinder(centre: FloatArray, joint: Joint, radius: float, view: View, name: str) -> tuple[Mark, ...]:
    u, v = crossing(joint.axis)
    angles = np.linspace(0.0, 2.0 * math.pi, _CIRCLE, endpoint=False)
    ring = radius * (np.outer(np.cos(angles), u) + np.outer(np.sin(angles), v))
    half = LONG * radius * joint.axis
    ends = (centre + half + ring, centre - half + ring)
    near = ends[0] if float(joint.axis @ view.towards) >= 0 else ends[1]
    colour = _colour(joint)
    depth = view.depth(centre)
    marks: list[Mark] = [Area(hull(view.place(np.concatenate(ends))), colour, depth=depth, name=name)]
    if joint.type is JointType.SCREW:
        marks += _threads(centre, joint.axis, radius, view, depth)
    # An end that is seen edge-on has no area.
    if abs(float(joint.axis @ view.towards)) > 0.02:
        marks.append(Area(view.place(near), CAP, depth=depth + 1e-3))
    return tuple(marks)


def _threads(centre: FloatArray, axis: FloatArray, radius: float, view: View, depth: float) -> Iterator[Mark]:
    """Yield the part of a helix that is on the side of the viewer."""
    u, v = crossing(axis)
    turns = np.linspace(0.0, _THREADS * 2.0 * math.pi, _THREADS * _CIRCLE)
    outward = np.outer(np.cos(turns), u) + np.outer(np.sin(turns), v)
    along = np.outer(np.linspace(-LONG, LONG, len(turns)), axis)
    seen = outward @ view.towards > 0
    for run in np.split(np.arange(len(turns)), np.flatnonzero(np.diff(seen)) + 1):
        if seen[run[0]] and len(run) > 1:
            yield Stroke(view.place(centre + radius * (outward + along)[run]), EDGE, 0.7, depth=depth + 5e-4)


def _box(centre: FloatArray, joint: Joint, radius: float, view: View, name: str) -> tuple[Mark, ...]:
    u, v = crossing(joint.axis)
    sides = (1.3 * LONG * radius * joint.axis, 0.85 * radius * u, 0.85 * radius * v)
    depth, colour = view.depth(centre), _colour(joint)
    marks: list[Mark] = []
    for number, side in enumerate(sides):
        # Only sides that face the viewer are drawn, so no face covers another.
        facing = float(side @ view.towards)
        if abs(facing) < 0.02 * float(np.linalg.norm(side)):
            continue
        out = math.copysign(1.0, facing) * side
        a, b = sides[(number + 1) % 3], sides[(number + 2) % 3]
        corners = centre + out + np.array([a + b, a - b, -a - b, -a + b])
        face = Area(view.place(corners), CAP if number == 0 else colour, depth=depth)
        marks.append(replace(face, name=name) if not marks else face)
    return tuple(marks)


def _colour(joint: Joint) -> str:
    if joint.follows:
        return FOLLOWER
    return SCREW if joint.type is JointType.SCREW else BODY


def ground(top: FloatArray, frame: FloatArray, foot: float, radius: float, view: View) -> Iterator[Mark]:
    """Yield a pillar below a point, against z of the root frame (3, 3), and the hatched plate on which it is fixed."""
    bottom = top - foot * frame[:, 2]
    wide = 2.6 * radius
    if foot > 0:
        yield Stroke(view.place([top, bottom]), INK, 2.4, BEHIND, 1.0)
    # A plate that is seen from its edge is a line.
    if abs(float(frame[:, 2] @ view.towards)) < 0.12:
        yield from _edge(bottom, frame, wide, view)
        return
    plate = bottom + wide * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) @ frame[:, :2].T
    yield Area(view.place(plate), GROUND, layer=BEHIND, name="base")
    # Hatching in the plane of the plate, clipped to its square.
    for shift in np.linspace(-2.0, 2.0, 13)[1:-1]:
        low, high = max(-1.0, shift - 1.0), min(1.0, shift + 1.0)
        ends = wide * np.array([[low, shift - low], [high, shift - high]])
        yield Stroke(view.place(bottom + ends @ frame[:, :2].T), EDGE, 0.45, BEHIND, 0.5)


def _edge(bottom: FloatArray, frame: FloatArray, wide: float, view: View) -> Iterator[Mark]:
    """Yield a plate that is seen from its edge: a line with hatching on its far side."""
    middle = view.place(bottom)
    down = view.place(-frame[:, 2])
    down = down / math.hypot(*down)
    along = np.array([-down[1], down[0]])
    size = wide * view.scale
    yield Stroke(np.array([middle - size * along, middle + size * along]), INK, 1.4, BEHIND, 1.0, name="base")
    step = size / 4.5
    for place in np.arange(-size + step, size + step / 2, step):
        start = middle + place * along
        yield Stroke(np.array([start, start + step * (down - along)]), EDGE, 0.6, BEHIND, 0.5)


def gripper(tip: FloatArray, along: FloatArray, across: FloatArray, radius: float, view: View) -> Iterator[Mark]:
    """Yield two fingers whose ends are beside the tip; unit vectors say where they reach, and from one to the other."""
    wrist = tip - 1.5 * radius * along
    for sign in (-1.0, 1.0):
        side = sign * 0.85 * radius * across
        path = view.place([wrist, wrist + side, tip + side])
        yield Stroke(path, INK, 1.8, ARM, view.depth(wrist), name="tip" if sign < 0 else "")


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
    """Return a size of joint symbols that suits the links; `size` is that of the longer side of the robot as seen."""
    lengths = [link.length for skeleton in skeletons for link in skeleton.links if link.length > 1e-3 * size]
    usual = 0.16 * float(np.median(lengths)) if lengths else size
    return float(min(0.03 * size, max(usual, 0.009 * size)))


def bodies(skeleton: Skeleton, radius: float) -> tuple[Body, ...]:
    """Return where the symbols of all joints are."""
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
    # The first symbol stays towards the link before, the last towards the link behind.
    before, behind = _ways(point, skeleton, half)
    taken = np.zeros((0, 3))
    for number, joint in enumerate(group):
        wishes = [np.zeros(3), *(sign * _APART * half * joint.axis for sign in (-1.0, 1.0, -2.0, 2.0))]
        if number == 0 and abs(float(joint.axis @ before)) > _ALONG:
            wishes.insert(0, _APART * half * before)
        if number == len(group) - 1 and abs(float(joint.axis @ behind)) > _ALONG:
            wishes.insert(0, _APART * half * behind)
        # A place counts if its symbol does not touch those that have one.
        gaps = [float(np.min(np.linalg.norm(taken - wish, axis=1), initial=9 * half)) for wish in wishes]
        chosen = next((wish for wish, gap in zip(wishes, gaps, strict=True) if gap > 1.9 * half), wishes[-1])
        taken = np.vstack([taken, chosen])
        yield Body(joint, point + chosen)


def _ways(point: FloatArray, skeleton: Skeleton, half: float) -> tuple[FloatArray, FloatArray]:
    """Unit vectors towards the link before a point and the one behind it."""
    root = next(iter(skeleton.frames.values()))
    before = -root[:3, 2]
    behind = skeleton.frames[skeleton.tips[0]][:3, 2]
    # The link that ends here, and then the one that begins here; short ones lead nowhere.
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
    """Yield the marks of one posture; a suffix behind identifiers tells postures apart."""
    placed = bodies(skeleton, radius)
    for number, link in enumerate(skeleton.links):
        yield from _link(link, radius, view, f"link-{number + 1}{suffix}")
    for body in placed:
        # A symbol that was moved along its axis keeps a line to its place.
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
    """Yield a link in pieces, each with a depth of its own, so that it passes behind what is before it."""
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
    """Yield the plate below the root frame; below a symbol that is there, with a pillar between."""
    root = next(iter(skeleton.frames.values()))
    below = [float((body.centre - root[:3, 3]) @ root[:3, 2]) for body in placed if _is_over(body, root, radius)]
    lowest = min(below, default=0.0)
    foot = 2.6 * LONG * radius - lowest if lowest < 2 * LONG * radius and below else 0.0
    yield from ground(root[:3, 3], root[:3, :3], foot, radius, view)


def _is_over(body: Body, root: FloatArray, radius: float) -> bool:
    offset = body.centre - root[:3, 3]
    return bool(np.linalg.norm(offset - (offset @ root[:3, 2]) * root[:3, 2]) < 2 * radius)


def _ends(skeleton: Skeleton, placed: tuple[Body, ...], radius: float, view: View) -> Iterator[Mark]:
    """Yield a gripper at the tool of a chain, dots at the tips of a tree."""
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
    """Return the axis of a frame, at right angles to the fingers, that is seen best; y where both are."""
    axes = [axis - (axis @ along) * along for axis in (frame[:3, 1], frame[:3, 0])]
    sizes = [float(np.linalg.norm(axis)) for axis in axes]
    seen = [float(np.linalg.norm(axis - (axis @ view.towards) * view.towards)) for axis in axes]
    best = axes[0] if sizes[1] < 0.1 or (sizes[0] > 0.1 and (seen[0] > 0.5 or seen[0] >= seen[1])) else axes[1]
    return np.asarray(best / np.linalg.norm(best))


def pale(mark: Mark) -> Mark:
    """Return a mark of a further posture, in colours near that of the paper."""
    if isinstance(mark, Words):
        return replace(mark, colour=paler(mark.colour))
    if isinstance(mark, Stroke):
        return replace(mark, colour=paler(mark.colour))
    return replace(mark, colour=paler(mark.colour), edge=paler(mark.edge))
