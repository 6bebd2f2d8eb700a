"""Machine tools as LinuxCNC moves them: three slides that X, Y and Z are solved for, and joints that are words.

In: a robot with a workpiece and a tool. Out: a `Mill`, or the reason why it is none. With every other joint at its
word, the tip of the tool is an affine function of the slides, so that any machine with three independent slides is
solved by one system of three equations: machines with four and five axes, and those with a quill.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import combinations, permutations

import numpy as np
from numpy.typing import NDArray

from kinegen.backends.controllers.controller import ACTUATORS, Controller
from kinegen.backends.controllers.machine import require_readings, samples
from kinegen.errors import KinegenError
from kinegen.model.dh_conversion.elementary_transforms import seen_chain
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import TOOL, JointType, Robot
from kinegen.support.dataclass import dataclass
from kinegen.verify import reference

_SLIDES, _TURNS, _QUILLS = "XYZ", "ABC", "UVW"
WORDS = _SLIDES + _TURNS + _QUILLS
"""The words of LinuxCNC, in its order."""

WORKPIECE = "workpiece"
"""The frame on the base of a chain from which its tool is seen; the base itself without it."""

_WORK_NAMES = ("work", "part", "table", "stock", "plate")
_TOOL_NAMES = ("tool", "cutter", "spindle", "nozzle", "mill", "torch", "probe")
_SAME = 1e-9
_FLAT = 1e-3
"""Volume between three unit directions below which they count as being in one plane."""

Rates = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Mill:
    """A machine tool.

    `tool`: the frame of the tool. `workpiece`: the frame of the workpiece; empty for the base of a chain. `letters`:
    the word of each joint of the joint vector. `slides`: places of the joints of X, Y and Z in the joint vector.
    `order`: places of all joints in the joint vector, in LinuxCNC's order: that of their words. `towards_holder`:
    whether the tool's z axis leads from its tip to its holder, as in G-code. `driven`: whether it has actuators.
    """

    tool: str
    workpiece: str
    letters: tuple[str, ...]
    slides: tuple[int, ...]
    order: tuple[int, ...]
    towards_holder: bool
    driven: bool

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """The outputs that its module calls: the pose, the pose with its Jacobian, and those of its actuators."""
        frame = self.tool if self.workpiece else ""
        return (
            Quantity(Kind.POSE, frame=frame, seen_from=self.workpiece),
            Quantity(Kind.FK_JACOBIAN, frame=frame, seen_from=self.workpiece),
            *(ACTUATORS if self.driven else ()),
        )


def mill_for(robot: Robot, *, solved: bool) -> Mill | None:
    """Return the machine tool that a robot is for LinuxCNC, or None for an arm.

    `solved`: whether it has a closed-form inverse, so that it may be an arm. Raises KinegenError if it is neither an
    arm nor a machine tool, with the reason.
    """
    found = _found(robot, solved=solved)
    if isinstance(found, Mill):
        require_readings(robot, Controller.LINUXCNC)
        return found
    if robot.is_tree:
        reason = f"it has {len(robot.tips)} tips, and is not a machine tool: {found}"
    elif not solved and _has_slides(robot):
        reason = f"it has no closed-form inverse, and is not a machine tool: {found}"
    else:
        return None
    raise KinegenError(f"no LinuxCNC package for {robot.name}: {reason}", robot.source)


def _has_slides(robot: Robot) -> bool:
    """Return whether it has enough prismatic joints for a machine tool, and others."""
    count = sum(variable.type is JointType.PRISMATIC for variable in robot.variables)
    return len(_SLIDES) <= count < robot.dof


@lru_cache(maxsize=32)
def _found(robot: Robot, *, solved: bool) -> Mill | str:
    """Return the machine tool, or the reason why there is none."""
    if not _has_slides(robot):
        return "that has three prismatic joints, and others"
    if solved and not robot.is_tree and _is_arm(robot):
        return "it is an arm"
    frames = _frames(robot)
    if isinstance(frames, str):
        return frames
    tool, workpiece = frames
    way = seen_chain(robot, tool, workpiece) if workpiece else robot
    return _moved(robot, way, tool, workpiece)


def _is_arm(robot: Robot) -> bool:
    """Return whether a chain with a closed form is moved as an arm: six joints, or four that keep the tool's tilt."""
    if robot.dof != 4:
        return robot.dof == len(_SLIDES + _TURNS)
    poses = np.array([reference.pose(robot, [q])[0, 0] for q in samples(robot)])
    return bool(np.ptp(poses[:, 2, :3], axis=0).max() < _SAME)


def _frames(robot: Robot) -> tuple[str, str] | str:
    """Return the frames of tool and workpiece."""
    if not robot.is_tree:
        links = robot.frame_links
        return TOOL, WORKPIECE if links.get(WORKPIECE) == robot.root else ""
    if len(robot.tips) != 2:
        return "a machine tool has two, workpiece and tool"
    pairs = list(permutations(robot.tips, 2))
    named = [
        (tool, work)
        for tool, work in pairs
        if (_is_named(tool, _TOOL_NAMES) or _is_named(work, _WORK_NAMES))
        and not (_is_named(tool, _WORK_NAMES) or _is_named(work, _TOOL_NAMES))
    ]
    if len(named) == 1:
        return named[0]
    # Seen from the tool, a table that turns about its own z axis keeps the direction of that.
    first, second = (_tilting(seen_chain(robot, *pair)) for pair in pairs)
    if first == second:
        return f"which of {' and '.join(robot.tips)} is the tool is not clear; call the other one {WORKPIECE}"
    return pairs[first < second]


def _tilting(way: Robot) -> int:
    """Return how many joints change the direction of the tool's z axis."""
    here = np.array(list(samples(way)))
    axes = np.array([reference.pose(way, [q])[0, 0, :3, 2] for q in here])
    rates = reference.Kinematics(way, here).jacobian(TOOL)[:, 3:]
    return int((np.abs(np.cross(rates, axes[:, :, None], axis=1)).max(axis=(0, 1)) > _SAME).sum())


def _is_named(name: str, words: tuple[str, ...]) -> bool:
    return any(word in name.lower() for word in words)


def _moved(robot: Robot, way: Robot, tool: str, workpiece: str) -> Mill | str:
    """Return the machine between two frames, from the velocities of the tool at samples of the joints."""
    zero = np.zeros((1, robot.dof))
    here = np.array(list(samples(way)))
    slides = [variable.index for variable in way.variables if variable.type is JointType.PRISMATIC]
    there = here.copy()
    there[:, slides] = here[::-1, slides]
    rates = reference.Kinematics(way, np.vstack([zero, here])).jacobian(TOOL)
    if reason := _defect(robot, rates, reference.Kinematics(way, np.vstack([zero, there])).jacobian(TOOL), slides):
        return reason
    chosen = _solved(robot, rates, slides)
    if not chosen:
        return "no three of its prismatic joints are independent wherever the others are"
    others = [place for place in range(robot.dof) if place not in chosen]
    letters: dict[int, str] = {}
    for words, places, part in (
        (_SLIDES, list(chosen), slice(0, 3)),
        (_TURNS, [place for place in others if place not in slides], slice(3, 6)),
        (_QUILLS, [place for place in others if place in slides], slice(0, 3)),
    ):
        if len(places) > len(words):
            return f"{len(places)} joints would have to share the words {', '.join(words)}"
        letters |= _lettered(robot, words, places, rates[0, part])
    return Mill(
        tool=tool,
        workpiece=workpiece,
        letters=tuple(letters[place] for place in range(robot.dof)),
        slides=tuple(sorted(chosen, key=letters.__getitem__)),
        order=tuple(sorted(letters, key=lambda place: WORDS.index(letters[place]))),
        towards_holder=bool(reference.pose(way, zero)[0, 0][2, 2] > -0.5),
        driven=bool(robot.actuators.readings),
    )


def _defect(robot: Robot, rates: Rates, moved: Rates, slides: Sequence[int]) -> str:
    """Why the tip is no affine function of the slides, from the rates at two values of these; nothing where it is."""
    for variable in robot.variables:
        column = rates[:, :, variable.index]
        if variable.type is JointType.SCREW:
            return f"joint {variable.name} is a screw"
        if not column.any():
            return f"joint {variable.name} is not between workpiece and tool"
        if variable.index in slides and (
            np.abs(column[:, 3:]).max() > _SAME or np.abs(column - moved[:, :, variable.index]).max() > _SAME
        ):
            return f"joint {variable.name} does not move the tool along a straight line"
    return ""


def _solved(robot: Robot, rates: Rates, slides: Sequence[int]) -> tuple[int, ...]:
    """Return the three slides that X, Y and Z are solved for: the first independent ones, those of such names first."""
    names = [variable.name.lower() for variable in robot.variables]
    ranked = sorted(slides, key=lambda place: names[place][0] not in _SLIDES.lower())
    for chosen in combinations(ranked, len(_SLIDES)):
        columns = rates[:, :3, list(chosen)]
        volumes = np.linalg.det(columns / np.linalg.norm(columns, axis=1, keepdims=True))
        if np.abs(volumes).min() > _FLAT and np.ptp(volumes) < _SAME:
            return chosen
    return ()


def _lettered(robot: Robot, words: str, places: Sequence[int], rates: Rates) -> dict[int, str]:
    """Return the word of each joint: that with which its name begins, else the free one next to its direction.

    `words`: the words to choose from, those along or about x, y and z. `rates`: their directions, (3, joints).
    """
    named = {place: letter for place, letter in _begins(robot, places) if letter in words}
    if len(set(named.values())) < len(named):
        named = {}
    left = [place for place in places if place not in named]
    free = [number for number, word in enumerate(words) if word not in named.values()]
    best = max(
        permutations(free, len(left)),
        key=lambda chosen: sum(abs(rates[number, place]) for number, place in zip(chosen, left, strict=True)),
    )
    return named | {place: words[number] for number, place in zip(best, left, strict=True)}


def _begins(robot: Robot, places: Sequence[int]) -> Iterator[tuple[int, str]]:
    """Yield joints whose names begin with one letter by itself, such as `a`, `a_axis` and `C1`."""
    for place in places:
        name = robot.variables[place].name
        if not name[1:2].isalpha():
            yield place, name[0].upper()
