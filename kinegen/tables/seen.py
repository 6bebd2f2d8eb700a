"""The way from one frame of a robot to another as a robot of its own, a chain.

In: a robot and two frames, such as a workpiece on a turntable and a tool. Out: a chain whose base is the first frame
and whose tool is the second, with the joint vector of the whole robot. Rows on the way from the first frame towards the
base are climbed: each becomes the sequence that undoes it. Joints that move both frames alike, or neither, are in the
joint vector and move nothing.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

from kinegen.errors import KinegenError
from kinegen.outputs import Quantity
from kinegen.robot.actuators.model import NO_ACTUATORS
from kinegen.robot.model import ROOT, TOOL, Convention, Robot, Row, root_name
from kinegen.tables.steps import Steps, inverse, row_steps

_BASE = ""
"""The frame after the fixed base transform, which no file can name."""

Link = tuple[Row | None, Steps]
"""A row or None, and the transform from the frame before to the frame after."""


@lru_cache(maxsize=32)
def chain_of(robot: Robot, quantity: Quantity) -> Robot:
    """The chain for which a quantity is computed: the robot itself, or the way between the frames of the quantity.

    Args:
        robot: The robot.
        quantity: The quantity.

    Raises:
        KinegenError: If there is no such frame; the message lists those that there are.
    """
    return seen_chain(robot, quantity.frame, quantity.seen_from) if quantity.frame else robot


def seen_chain(robot: Robot, frame: str, seen_from: str = "") -> Robot:
    """A chain from one frame to another.

    Args:
        robot: The robot.
        frame: The frame that becomes the tool.
        seen_from: The frame that becomes the base; the base of the robot if it is empty.

    Returns:
        A robot of one tip with the joint vector, the parameters and the redundancy of the other one.

    Raises:
        KinegenError: If there is no such frame; the message lists those that there are.
    """
    up, down = _path(robot, seen_from or robot.root), _path(robot, frame)
    while up and down and up[0] == down[0]:
        up, down = up[1:], down[1:]
    links = [*(_climbed(_link(robot, name)) for name in reversed(up)), *(_link(robot, name) for name in down)]
    moving = [place for place, (row, _) in enumerate(links) if row is not None]
    first, last = (moving[0], moving[-1] + 1) if moving else (len(links), len(links))
    rows = [row for row, _ in links[first:last] if row is not None]
    parents = (root_name(row.name for row in rows), *(row.name for row in rows))
    return replace(
        robot,
        rows=tuple(
            replace(row, parent=parent, number=number)
            for number, (row, parent) in enumerate(zip(rows, parents, strict=False), 1)
        ),
        base=_joined(links[:first]),
        tool=_joined(links[last:]),
        frames=(),
        actuators=NO_ACTUATORS,
    )


def _path(robot: Robot, name: str) -> list[str]:
    """The frames from below the root down to one of them; the root itself is left out."""
    root = robot.root
    parents = {_BASE: root} | {row.name: _BASE if row.parent == root else row.parent for row in robot.rows}
    last = robot.rows[-1].name if robot.rows else _BASE
    if not robot.is_tree:
        parents[TOOL] = last
    for frame in robot.frames:
        parents[frame.name] = frame.parent if frame.parent in (*parents, root) else last
    if name not in (root, *parents) or name == _BASE:
        known = ", ".join(each for each in (root, *robot.frame_names) if each != ROOT)
        raise KinegenError(f"unknown frame '{name}' (expected {known})", robot.source)
    path: list[str] = []
    while name != root:
        path.append(name)
        name = parents[name]
    return path[::-1]


def _link(robot: Robot, name: str) -> Link:
    """The transform from the parent of a frame to the frame."""
    if name == _BASE:
        return None, robot.base
    if name == TOOL and not robot.is_tree:
        return None, robot.tool
    row = next((row for row in robot.rows if row.name == name), None)
    if row is not None:
        return row, ()
    return None, next(frame.steps for frame in robot.frames if frame.name == name)


def _climbed(link: Link) -> Link:
    """The same from the frame to its parent."""
    row, steps = link
    if row is None:
        return None, inverse(steps)
    undone = inverse(row_steps(row))
    return replace(row, convention=Convention.ETS, steps=undone, alpha=None, a=None, d=None, theta=None, beta=None), ()


def _joined(links: list[Link]) -> Steps:
    return tuple(step for _, steps in links for step in steps)
