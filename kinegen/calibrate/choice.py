"""The words of `--fit` -> names of what is varied: entries, parameters of the file, and numbers of base and tool."""

from __future__ import annotations

import difflib
from dataclasses import dataclass

from kinegen.calibrate.options import BASE_WORD, TABLE, TOOL_WORD
from kinegen.errors import KinegenError, quote
from kinegen.robot.entries import ROW_ENTRIES
from kinegen.robot.expressions import names
from kinegen.robot.model import TOOL, WRIST, Convention, Robot, Row, Step

MOUNT_NUMBERS = ("x", "y", "z", "rx", "ry", "rz")
"""The numbers of base and tool: a shift, and a rotation vector, of the correction to what the file says."""

BASE_NAMES = tuple(f"base_{number}" for number in MOUNT_NUMBERS)
TOOL_NAMES = tuple(f"tool_{number}" for number in MOUNT_NUMBERS)


@dataclass(frozen=True, slots=True)
class Choice:
    """What is varied.

    Attributes:
        parameters: Parameters of the file, in its order.
        entries: Entries of the table, as row and key, in the order of the table; beta only where a row has one.
        twists: Rows whose second twist is wanted too, if they are between nearly parallel axes.
        base: Names of the varied numbers of the base.
        tool: Names of the varied numbers of the tool.
    """

    parameters: tuple[str, ...]
    entries: tuple[tuple[str, str], ...]
    twists: tuple[str, ...]
    base: tuple[str, ...]
    tool: tuple[str, ...]


def choose(robot: Robot, words: tuple[str, ...], frame: str = "") -> Choice:
    """Find out what the words of `--fit` mean.

    Args:
        robot: The robot.
        words: Kinds of entries (`theta`), `base`, `tool`, or names of entries, parameters or single numbers.
        frame: The measured frame; empty for the tool.

    Returns:
        The choice, in the order of the file, whatever the order of the words.

    Raises:
        KinegenError: If a word means nothing, nothing is varied, or there is no such frame.
    """
    frame = measured_frame(robot, frame)
    own = tuple(parameter.name for parameter in robot.parameters)
    rows = [row for row in robot.rows if moves(robot, row, frame)]
    every = [(row, key) for row in rows for key in ROW_ENTRIES[row.convention]]
    entries = {f"{key}_{row.name}": (row.name, key) for row, key in every}
    known = (*TABLE, BASE_WORD, TOOL_WORD, *own, *entries, *BASE_NAMES, *TOOL_NAMES)
    for word in words:
        if word not in known:
            raise KinegenError(f"--fit {quote(word)} names nothing {_expected(word, known)}")
    wanted = frozenset(words)
    # A second twist goes with alpha, as the first one.
    kinds = wanted | ({"beta"} if "alpha" in wanted else set())
    picked = tuple(
        place for name, place in entries.items() if (name in wanted and name not in own) or place[1] in kinds
    )
    choice = Choice(
        parameters=tuple(name for name in own if name in wanted),
        entries=picked,
        twists=tuple(row for row, key in picked if key == "alpha"),
        base=tuple(name for name in BASE_NAMES if name in wanted or BASE_WORD in wanted),
        tool=tuple(name for name in TOOL_NAMES if name in wanted or TOOL_WORD in wanted),
    )
    _check(robot, choice, words, frame)
    return choice


def measured_frame(robot: Robot, frame: str) -> str:
    """The frame that was measured; empty for the tool.

    Raises:
        KinegenError: If there is no such frame, or there are several tips and none is named.
    """
    if frame == TOOL and not robot.is_tree:
        return ""
    if frame and frame not in robot.frame_names:
        raise KinegenError(f"there is no frame '{frame}' (expected {', '.join(robot.frame_names)})")
    if not frame and robot.is_tree:
        raise KinegenError(f"{robot.name} has {len(robot.tips)} tips; name one with --frame ({', '.join(robot.tips)})")
    return frame


def moves(robot: Robot, row: Row, frame: str) -> bool:
    """Whether a row is between the base and the measured frame."""
    links, parents = robot.frame_links, {each.name: each.parent for each in robot.rows}
    last = robot.rows[-1].name if robot.rows else ""
    link = links.get(frame, frame)
    link = link if link in parents else last if link in ("", TOOL, WRIST) else ""
    while link in parents:
        if link == row.name:
            return True
        link = parents[link]
    return False


def _check(robot: Robot, choice: Choice, words: tuple[str, ...], frame: str) -> None:
    if not (choice.parameters or choice.entries or choice.base or choice.tool):
        instead = "name parameters of the file"
        if all(row.convention is Convention.ETS for row in robot.rows):
            instead += ", or make a table first (kinegen convert FILE -o OUT.yaml --convention standard)"
        raise KinegenError(f"--fit {','.join(words)} varies nothing: the table has no such entries; {instead}")
    for name, steps, varied in ((BASE_WORD, robot.base, choice.base), (TOOL_WORD, robot.tool, choice.tool)):
        inside = _names(steps)
        if varied and inside:
            raise KinegenError(
                f"{name} is made of parameters here; name them instead of {name} (--fit {','.join(inside)})"
            )
    if choice.tool and frame:
        raise KinegenError(f"frame '{frame}' was measured, which the tool does not move; leave tool out of --fit")


def _names(steps: tuple[Step, ...]) -> list[str]:
    return list(dict.fromkeys(name for step in steps for name in names(step.value)))


def _expected(word: str, known: tuple[str, ...]) -> str:
    near = difflib.get_close_matches(word, known, n=1)
    hint = f"; did you mean {near[0]}?" if near else ""
    return f"(expected {', '.join(TABLE)}, base, tool, an entry such as theta_elbow, or a parameter of the file{hint})"
