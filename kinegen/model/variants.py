"""Robots made from another one: its digest, another redundancy, fewer tips, links on frames of other names."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from enum import Enum
from fractions import Fraction

from kinegen.errors import KinegenError, RobotFileError, printable, quote
from kinegen.model.expression_parser import Expression, names
from kinegen.model.robot import BASE, TOOL, JointType, Robot, Row, Step

_LEFT_OUT = frozenset({"line", "source", "digest", "made_of", "chosen", "version", "links"})
_LENGTH = 16


def digest(robot: Robot) -> str:
    """Return the first hexadecimal digits of a SHA-256 over the robot's content."""
    text = json.dumps(_plain(robot), ensure_ascii=True, separators=(",", ":"))
    return hashlib.sha256(text.encode("ascii")).hexdigest()[:_LENGTH]


def _plain(value: object) -> object:
    """Make lists of records that begin with their type, so that no two of them look alike."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = (field for field in dataclasses.fields(value) if field.name not in _LEFT_OUT)
        found = ((getattr(value, field.name), field.default) for field in fields)
        # A key that the format got later, such as a redundancy, leaves the hash of robots without it as it was.
        return [type(value).__name__, *(_plain(each) for each, usual in found if each != usual)]
    if isinstance(value, tuple):
        return [_plain(part) for part in value]
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Fraction):
        return str(value)
    return value


def expressions_in(part: object) -> Iterator[Expression]:
    """Go through the expressions in a record or a tuple, however deep."""
    if isinstance(part, Expression):
        yield part
    elif isinstance(part, tuple):
        for each in part:
            yield from expressions_in(each)
    elif dataclasses.is_dataclass(part):
        for field in dataclasses.fields(part):
            yield from expressions_in(getattr(part, field.name))


def used_names(robot: Robot) -> frozenset[str]:
    """Return the names that stand anywhere in the table, the fixed transforms and the actuators."""
    parts = (robot.rows, robot.base, robot.tool, robot.frames, robot.actuators)
    return frozenset(name for each in expressions_in(parts) for name in names(each))


ARM_ANGLE = "arm_angle"
"""The angle of the elbow about the line from the shoulder to the wrist."""

JOINTS = 7
"""Six joints reach a pose; one more is what is given."""


def with_redundancy(robot: Robot, names: str | Iterable[str]) -> Robot:
    """Choose what an inverse is given besides the pose.

    Args:
        names: Names of joints in the order in which their values are given, or `ARM_ANGLE`; in one text with commas, or
            one by one.

    Returns:
        The robot with that choice; whether there is a closed form with it is not known here.

    Raises:
        RobotFileError: If the robot has no such joint or too few joints, or no arm angle can be given.
    """
    text = joined(names.split(",") if isinstance(names, str) else names)
    check_redundancy(robot, text)
    found = replace(robot, redundancy=text)
    return replace(found, digest=digest(found))


def with_strict_limits(robot: Robot) -> Robot:
    """Return the robot whose inverses call nothing valid that is beyond a limit, by rounding either."""
    found = replace(robot, strict_limits=True)
    return replace(found, digest=digest(found))


def joined(names: Iterable[str]) -> str:
    """Return names as `Robot.redundancy` has them: with commas, without blanks."""
    return ",".join(name.strip() for name in names)


def check_redundancy(robot: Robot, text: str) -> None:
    """Refuse a choice, spelled as in `Robot.redundancy`, that no robot of this kind can have."""
    names, known = text.split(","), [variable.name for variable in robot.variables]
    for place, name in enumerate(names):
        if name not in (*known, ARM_ANGLE):
            expected = f"{', '.join(known)} or {ARM_ANGLE}"
            raise RobotFileError(f"redundancy: there is no joint {quote(name)} (expected {expected})")
        if name in names[:place]:
            raise RobotFileError(f"redundancy: joint {quote(name)} is named twice")
    if ARM_ANGLE in names and ARM_ANGLE not in known:
        _check_arm_angle(robot, names)
    elif len(names) >= robot.dof:
        raise RobotFileError("redundancy: all joints are given, so that none is left to solve for")


def _check_arm_angle(robot: Robot, names: list[str]) -> None:
    if len(names) > 1:
        raise RobotFileError(f"redundancy: {ARM_ANGLE} is given alone, without joints")
    if robot.is_tree:
        raise RobotFileError(f"redundancy: {ARM_ANGLE} is for robots with one tip, this has {len(robot.tips)}")
    if robot.dof != JOINTS:
        count = f"{robot.dof} joint variable{'s' * (robot.dof != 1)}"
        raise RobotFileError(f"redundancy: the robot has {count}, expected {JOINTS} for {ARM_ANGLE}")


def given_units(robot: Robot) -> tuple[tuple[str, str], ...]:
    """Return each joint, or the arm angle, that the inverse is given, with the unit of its value."""
    shifts = {each.name for each in robot.variables if each.type is JointType.PRISMATIC}
    return tuple((name, robot.units.length if name in shifts else "rad") for name in robot.given)


def with_tips(robot: Robot, wanted: Sequence[str]) -> Robot:
    """Keep what leads to some frames of a tree.

    Args:
        robot: A tree.
        wanted: Names of tips, of other named frames or of rows. One makes an arm, whose tool is that frame.

    Returns:
        The robot with the rows on the way, their joint variables, the named frames on them and on the base, and the
        parameters that are still used.

    Raises:
        RobotFileError: If there is no such frame, the robot has one tip, a row follows a joint that is not kept, or
            actuators drive the joints.
    """
    if not robot.is_tree:
        raise RobotFileError("--tip is for robots with several tips, and this one has one, its tool")
    if robot.actuators.readings:
        raise RobotFileError("--tip does not divide actuators; outputs of one frame are called as in pose@FRAME")
    # A frame stands for the row that it is on.
    links = robot.frame_links
    known = {row.name: row.name for row in robot.rows}
    known |= {name: link for name, link in links.items() if link != robot.root}
    for name in wanted:
        if name not in known:
            raise RobotFileError(f"--tip: there is no frame {quote(name)} (expected {', '.join(robot.tips)})")
    rows = _rows_to(robot, {known[name] for name in wanted})
    own = {row.name for row in rows}
    _check_followers(robot, rows, own)
    frames = tuple(each for each in robot.frames if links[each.name] in (*own, robot.root))
    # Rows and joints that are left are numbered again.
    found = replace(
        robot,
        rows=tuple(replace(row, number=number) for number, row in enumerate(rows, start=1)),
        variables=tuple(
            replace(each, index=index)
            for index, each in enumerate(each for each in robot.variables if each.name in own)
        ),
        frames=tuple(replace(each, tip=False) for each in frames),
        redundancy=robot.redundancy if set(robot.given) <= own else "",
        links=tuple((link, frame) for link, frame in robot.links if frame in own | {each.name for each in frames}),
    )
    # Several frames stay tips; one becomes the tool of an arm.
    if found.is_tree:
        found = replace(found, frames=tuple(replace(each, tip=each.name in wanted) for each in frames))
    else:
        # The frame that was asked for on the last row is the tool.
        last = next((name for name in wanted if known[name] == rows[-1].name), rows[-1].name)
        found = replace(found, tool=_steps_to(robot, last))
    # Parameters that only cut-off rows used go with them.
    used = used_names(found)
    found = replace(found, parameters=tuple(each for each in robot.parameters if each.name in used))
    return replace(found, digest=digest(found))


def _rows_to(robot: Robot, ends: Iterable[str]) -> tuple[Row, ...]:
    """Return the rows from the base to some of them, in the order of the table."""
    kept = set(ends)
    for row in reversed(robot.rows):  # parents stand before their children
        if row.name in kept:
            kept.add(row.parent)
    return tuple(row for row in robot.rows if row.name in kept)


def _check_followers(robot: Robot, rows: Iterable[Row], own: set[str]) -> None:
    joints = {each.name for each in robot.variables} - own
    for row in rows:
        lost = [name for each in expressions_in(row) for name in names(each) if name in joints]
        if lost:
            raise RobotFileError(f"--tip: joint {row.number} ({row.name}) follows joint {lost[0]}, which is cut off")


def _steps_to(robot: Robot, name: str) -> tuple[Step, ...]:
    """Return the steps from the row that a named frame is on to the frame; none for a row."""
    frame = next((each for each in robot.frames if each.name == name), None)
    return (*_steps_to(robot, frame.parent), *frame.steps) if frame else ()


def frame_named(robot: Robot, name: str) -> str:
    """Return the frame that the name of a link or frame means; `name` itself, known or not, if no link has it.

    One word may be both. A name never means another frame than in the file: a link comes before `base` and `wrist`.

    Raises:
        KinegenError: If a link and a joint, or the tool, have the name, in two places.
    """
    frame = dict(robot.links).get(name, name)
    rows = [row.name for row in robot.rows]
    if frame != name and name in (*rows, *robot.tips):
        # The link of the last joint of a chain may be its tool, and the other way round.
        named = link_of(robot)
        one_place = (TOOL, rows[-1]) if name in (TOOL, rows[-1]) and not robot.tool else ()
        own = next((f"on link {quote(named[each])}" for each in (name, *one_place) if each in named), "another one")
        what = "joint" if name in rows else "tool"
        raise KinegenError(
            f"{quote(name)} is a link of the file and a {what}: the link is frame {quote(frame)}, and the {what} is "
            f"{own}; name the one that is meant",
            robot.source,
        )
    return frame


def require_frames(robot: Robot, output: str, names: Iterable[str]) -> None:
    """Refuse an output, by its name in messages, that names a link: functions are named after frames.

    A joint is its frame, also where a link has the same name.
    """
    links, rows = dict(robot.links), {row.name for row in robot.rows}
    for name in names:
        frame = links.get(name, name)
        if name not in rows and frame != name:
            raise KinegenError(
                f"{output}: functions are named after frames, and link {quote(name)} of the file is frame "
                f"{quote(frame)}; write that",
                robot.source,
            )


def link_of(robot: Robot) -> dict[str, str]:
    """Return the link of each frame that has one; of several links, the first."""
    return {frame: link for link, frame in reversed(robot.links)}


def root_label(robot: Robot) -> str:
    """Return what printouts call the root: its link where another link of the file is called base."""
    is_other = dict(robot.links).get(BASE, robot.root) != robot.root
    return printable(link_of(robot).get(robot.root, "root")) if is_other else BASE


def with_frames_renamed(robot: Robot, names: Mapping[str, str]) -> Robot:
    """Return the robot with its links on frames of new names; links of frames that have none are left out."""
    there = {robot.root, *robot.frame_names}
    moved = tuple((link, names.get(frame, frame)) for link, frame in robot.links)
    return replace(robot, links=tuple((link, frame) for link, frame in moved if frame in there))
