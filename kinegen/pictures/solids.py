"""Joint symbols as textbooks draw them: cylinders for revolute joints, boxes for prismatic ones, a plate for the base.

In: points and directions in space, sizes in the length unit of the robot. Out: marks on paper.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from kinegen.pictures.marks import (
    ARM,
    BEHIND,
    BODY,
    CAP,
    EDGE,
    FOLLOWER,
    GROUND,
    INK,
    SCREW,
    Area,
    Mark,
    Stroke,
    hull,
)
from kinegen.pictures.sides import FloatArray, View
from kinegen.pictures.skeleton import Joint
from kinegen.robot.model import JointType

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
    """The symbol of a joint.

    Args:
        joint: The joint.
        centre: Where the symbol is, on or beside the axis.
        radius: Its size, in the length unit of the robot.
        view: The projection.
        name: Identifier in an SVG file.
    """
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
    """The part of a helix that is on the side of the viewer."""
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
    """A pillar below a point, and the hatched plate on which it is fixed.

    Args:
        top: Where the pillar begins.
        frame: Shape (3, 3), the directions of the root frame; the pillar goes against its z.
        foot: Length of the pillar.
        radius: Size of a joint symbol.
        view: The projection.
    """
    bottom = top - foot * frame[:, 2]
    wide = 2.6 * radius
    if foot > 0:
        yield Stroke(view.place([top, bottom]), INK, 2.4, BEHIND, 1.0)
    if abs(float(frame[:, 2] @ view.towards)) < 0.12:
        yield from _edge(bottom, frame, wide, view)
        return
    plate = bottom + wide * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) @ frame[:, :2].T
    yield Area(view.place(plate), GROUND, layer=BEHIND, name="base")
    for shift in np.linspace(-2.0, 2.0, 13)[1:-1]:
        low, high = max(-1.0, shift - 1.0), min(1.0, shift + 1.0)
        ends = wide * np.array([[low, shift - low], [high, shift - high]])
        yield Stroke(view.place(bottom + ends @ frame[:, :2].T), EDGE, 0.45, BEHIND, 0.5)


def _edge(bottom: FloatArray, frame: FloatArray, wide: float, view: View) -> Iterator[Mark]:
    """A plate that is seen from its edge: a line with hatching on its far side."""
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
    """Two fingers whose ends are beside the tip.

    Args:
        tip: The point between the ends of the fingers.
        along: Unit vector, the direction in which they reach.
        across: Unit vector from one to the other.
        radius: Size of a joint symbol.
        view: The projection.
    """
    wrist = tip - 1.5 * radius * along
    for sign in (-1.0, 1.0):
        side = sign * 0.85 * radius * across
        path = view.place([wrist, wrist + side, tip + side])
        yield Stroke(path, INK, 1.8, ARM, view.depth(wrist), name="tip" if sign < 0 else "")
