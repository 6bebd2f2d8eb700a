"""Which robots cannot have the ranges of a redundancy, and why."""

from __future__ import annotations

from kinegen.errors import KinegenError
from kinegen.robot.model import JointType, Robot


def refusal(robot: Robot) -> str:
    """Why a robot cannot have the ranges; empty if it can."""
    if not robot.redundancy:
        return "its inverse takes the pose alone; redundancy (in the file, or --redundancy) names what else it is given"
    if len(robot.given) > 1:
        return f"its inverse is given {len(robot.given)} values ({robot.redundancy}), and the ranges are those of one"
    if robot.is_tree:
        return "it has several tips"
    if robot.runtime_parameters:
        return f"{robot.runtime_parameters[0].name} is a runtime parameter, and the search takes lengths as they are"
    for variable in robot.variables:
        is_endless = variable.type is JointType.PRISMATIC and variable.limits is None
        if variable.name == robot.redundancy and is_endless:
            return f"joint {variable.name} has no limits, so that its range has no end"
    return ""


def refused(robot: Robot, reason: str) -> KinegenError:
    """The error for a robot without the ranges."""
    return KinegenError(f"no redundancy range for {robot.name}: {reason}", robot.source)
