"""The way between two frames of a robot, as one sequence of elementary transforms."""

from __future__ import annotations

import itertools

from kinegen.errors import KinegenError
from kinegen.robot.model import ROOT, TOOL, WRIST, Robot
from kinegen.symbolic.transforms import Elementary, Values, inverse, row_transforms, step_transforms

FrameName = str | int
"""A frame by name; or by number: i is the frame of row i, 0 the one after the robot's fixed base transform."""

_ORIGIN = "0"


def transforms_between(robot: Robot, start: FrameName, end: FrameName, values: Values) -> tuple[Elementary, ...]:
    """The elementary transforms that lead from one frame to another, through their nearest common ancestor.

    Args:
        robot: The robot.
        start: Frame in which the result is expressed.
        end: Frame that the result reaches.
        values: A sympy value for each name of the file.

    Returns:
        Turns and shifts, left to right: their product is `start_T_end`.

    Raises:
        KinegenError: If a frame does not exist; the message lists those that do.
    """
    return tuple(step for link in links_between(robot, start, end, values) for step in link)


def links_between(robot: Robot, start: FrameName, end: FrameName, values: Values) -> tuple[tuple[Elementary, ...], ...]:
    """The same, link by link: one sequence for each frame on the way."""
    up = _ancestry(robot, _resolve(robot, start))
    down = _ancestry(robot, _resolve(robot, end))
    while up and down and up[0] == down[0]:
        up, down = up[1:], down[1:]
    climb = [tuple(inverse(step) for step in reversed(_link(robot, name, values))) for name in reversed(up)]
    return (*climb, *(_link(robot, name, values) for name in down))


def frames_between(robot: Robot, start: FrameName, end: FrameName) -> tuple[tuple[str, str], ...]:
    """The links on the way between two frames, in order, each as the frame it starts from and the frame it reaches.

    Args:
        robot: The robot.
        start: Frame from which the way leads.
        end: Frame to which it leads.

    Returns:
        Pairs of parent and child, also where the way climbs from a child to its parent; the frame after the fixed base
        transform is called 0.

    Raises:
        KinegenError: If a frame does not exist.
    """
    up = [robot.root, *_ancestry(robot, _resolve(robot, start))]
    down = [robot.root, *_ancestry(robot, _resolve(robot, end))]
    while len(up) > 1 and len(down) > 1 and up[1] == down[1]:
        up, down = up[1:], down[1:]
    climbed = list(itertools.pairwise(up))[::-1]
    return (*climbed, *itertools.pairwise(down))


def _resolve(robot: Robot, frame: FrameName) -> str:
    text = str(frame)
    if text.isdecimal() and int(text) <= len(robot.rows):
        return robot.rows[int(text) - 1].name if int(text) else _ORIGIN
    if text == WRIST and not robot.is_tree and text not in robot.frame_names:
        return robot.leaves[0] if robot.rows else _ORIGIN
    known = (robot.root, *robot.frame_names)
    if text not in known:
        numbers = f"0 to {len(robot.rows)}"
        names = ", ".join(name for name in known if name != ROOT)
        raise KinegenError(f"unknown frame '{text}' (expected {names}, or a number from {numbers})")
    return text


def _ancestry(robot: Robot, name: str) -> list[str]:
    """The frames from below the root down to `name`; the root itself is left out."""
    root = robot.root
    parents = {row.name: _ORIGIN if row.parent == root else row.parent for row in robot.rows}
    parents[_ORIGIN] = root
    if not robot.is_tree:
        parents[TOOL] = robot.leaves[0] if robot.rows else _ORIGIN
    for frame in robot.frames:
        parents[frame.name] = _resolve(robot, frame.parent)
    path: list[str] = []
    while name != root:
        path.append(name)
        name = parents[name]
    return path[::-1]


def _link(robot: Robot, name: str, values: Values) -> tuple[Elementary, ...]:
    """The transforms from a frame's parent to the frame."""
    if name == _ORIGIN:
        return step_transforms(robot.base, values)
    if name == TOOL:
        return step_transforms(robot.tool, values)
    for row in robot.rows:
        if row.name == name:
            return row_transforms(row, values)
    steps = next(frame.steps for frame in robot.frames if frame.name == name)
    return step_transforms(steps, values)
