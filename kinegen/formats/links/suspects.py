"""How far each number that is nearly something else moves a tip: an upper bound, by lengths along the chain."""

from __future__ import annotations

from kinegen.formats.links.structure import Part
from kinegen.formats.links.tree import Joint, LinkTree, Motion
from kinegen.formats.report import Finding
from kinegen.robot.expressions import Expression, evaluate
from kinegen.robot.floats import FLOATS
from kinegen.robot.model import Step


def findings(tree: LinkTree, part: Part) -> tuple[Finding, ...]:
    """The findings about the joints of a part, in the order of the file."""
    arms = _arms(part)
    found = [suspect for suspect in tree.suspects if suspect.joint in arms]
    return tuple(
        Finding(
            suspect.line,
            suspect.where,
            suspect.text,
            suspect.exact,
            suspect.digits,
            # An axis that tilts moves what it turns twice: once before the turn, once after it.
            suspect.gap * (arms[suspect.joint] * (2 if "axis" in suspect.where else 1) if suspect.turns else 1.0),
            suspect.changed,
        )
        for suspect in sorted(found, key=lambda each: each.line)
    )


def _arms(part: Part) -> dict[str, float]:
    """An upper bound on the distance from each joint to the tips behind it, by name of the joint."""
    beyond: dict[str, float] = dict.fromkeys(part.links, 0.0)
    # A slide without limits moves as far as the robot is long, like in every proof.
    usual = sum(_length((*joint.origin, *joint.after)) for joint in part.joints) or 1.0
    arms: dict[str, float] = {}
    for joint in reversed(part.joints):
        arms[joint.name] = _stroke(joint, usual) + _length(joint.after) + beyond[joint.child]
        beyond[joint.parent] = max(beyond[joint.parent], arms[joint.name] + _length(joint.origin))
    return arms


def _length(steps: tuple[Step, ...]) -> float:
    return sum(abs(_float(step.value)) for step in steps if not step.kind.is_rotation)


def _stroke(joint: Joint, usual: float) -> float:
    if joint.motion is not Motion.PRISMATIC:
        return 0.0
    if joint.limits is None:
        return usual
    return max(abs(_float(limit)) for limit in joint.limits)


def _float(expression: Expression) -> float:
    return float(evaluate(expression, {}, FLOATS))
