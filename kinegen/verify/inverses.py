"""What tries an inverse of a package, closed or searched, and what the trial comes to as comparisons."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType

from kinegen.outputs import COMPLETE_INVERSE, INVERSE_TRACKER, NUMERIC_INVERSE, REDUNDANCY_RANGE, Kind, Quantity
from kinegen.robot.extent import reach
from kinegen.robot.model import TOOL, Robot
from kinegen.symbolic.inverse.derive import family_of, size_of
from kinegen.tables.seen import chain_of
from kinegen.verify.comparison import Comparison
from kinegen.verify.complete import Completed, complete_line, try_complete
from kinegen.verify.inverse import Trial, counts_line, try_inverse
from kinegen.verify.machine import try_machine
from kinegen.verify.ranges import Ranged, ranges_line, try_ranges
from kinegen.verify.search import Search, search_line, try_search
from kinegen.verify.tracker import Tracked, tracker_line, try_tracker

Values = tuple[float, ...] | None

Attempt = Callable[[Robot, ModuleType, Quantity, str, Values], tuple[list[Comparison], str]]
"""Tries an output of one number type, with other values of the runtime parameters or those of the file. Returns the
comparisons, and in words how much was tried."""


def attempt_of(quantity: Quantity) -> Attempt:
    """What tries an output."""
    return _ATTEMPTS.get(quantity, _solve)


def _solve(
    robot: Robot, package: ModuleType, quantity: Quantity, real: str, values: Values
) -> tuple[list[Comparison], str]:
    attempt = try_machine if quantity.kind is Kind.AXIS_INVERSE else try_inverse
    trials = attempt(robot, package, quantity, real, values)
    told = counts_line(max(trials, key=lambda trial: trial.poses))
    return [inverse_comparison(robot, quantity, trial, real) for trial in trials], told


def inverse_comparison(robot: Robot, quantity: Quantity, trial: Trial, real: str) -> Comparison:
    """What a trial of an inverse comes to."""
    chain = chain_of(robot, quantity)
    size = reach(robot) if quantity.kind is Kind.AXIS_INVERSE else size_of(chain, family_of(chain))
    return Comparison(
        target=f"{trial.target}, there and back",
        quantity=quantity,
        poses=trial.poses,
        position_error=trial.position_error,
        rotation_error=trial.rotation_error,
        position_tolerance=trial.accepted * size,
        rotation_tolerance=trial.accepted,
        worst=trial.worst,
        frame=quantity.way or TOOL,
        real=real,
    )


def _search(
    robot: Robot, package: ModuleType, quantity: Quantity, real: str, values: Values
) -> tuple[list[Comparison], str]:
    found = try_search(robot, package, real, values)
    told = search_line(found[0], robot.units.length)
    return [_comparison(each, "search", quantity, real, each.targets, each.frame) for each in found], told


def _complete(
    robot: Robot, package: ModuleType, quantity: Quantity, _real: str, _values: Values
) -> tuple[list[Comparison], str]:
    found = try_complete(robot, package)
    told = complete_line(found[0])
    return [_comparison(each, "all solutions", quantity, "double", each.targets) for each in found], told


def _range(
    robot: Robot, package: ModuleType, quantity: Quantity, real: str, _values: Values
) -> tuple[list[Comparison], str]:
    found = try_ranges(robot, package, real)
    told = ranges_line(found[0])
    return [_comparison(each, "nearest of all", quantity, real, each.targets) for each in found], told


def _track(
    robot: Robot, package: ModuleType, quantity: Quantity, real: str, values: Values
) -> tuple[list[Comparison], str]:
    found = try_tracker(robot, package, real, values)
    told = tracker_line(found[0])
    return [_comparison(each, "along paths", quantity, real, each.steps) for each in found], told


_ATTEMPTS: dict[Quantity, Attempt] = {
    NUMERIC_INVERSE: _search,
    COMPLETE_INVERSE: _complete,
    REDUNDANCY_RANGE: _range,
    INVERSE_TRACKER: _track,
}
"""What tries an output without a program."""


def _comparison(
    tried: Search | Completed | Ranged | Tracked,
    words: str,
    quantity: Quantity,
    real: str,
    poses: int,
    frame: str = TOOL,
) -> Comparison:
    """What the trial of an output without a program comes to."""
    return Comparison(
        target=f"{tried.target}, {words}",
        quantity=quantity,
        poses=poses,
        position_error=tried.position_error,
        rotation_error=tried.rotation_error,
        position_tolerance=tried.position_tolerance,
        rotation_tolerance=tried.rotation_tolerance,
        worst=tried.worst,
        frame=frame,
        real=real,
    )
