"""Joints that follow others: chains of them are resolved to the joint that has a variable of its own."""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction

from kinegen.errors import quote
from kinegen.formats.links.structure import Part
from kinegen.formats.links.tree import Joint, LinkTree, Motion
from kinegen.formats.messages import fail
from kinegen.robot.expressions import ZERO, Expression, Name, Number, add, multiply


@dataclass
class Followers:
    """Finds the value of a joint in terms of variables.

    Attributes:
        identifiers: The name of each joint that moves, filled in before values are asked for.
    """

    tree: LinkTree
    part: Part
    identifiers: dict[str, str] = field(default_factory=dict)

    def is_still(self, joint: Joint) -> bool:
        """Whether a joint follows a constant: some multiplier on the way is zero."""
        return joint.mimic is not None and not self._resolved(joint)[0]

    def value(self, joint: Joint) -> Expression:
        """The value of a joint: its own variable, or what it makes of another one."""
        if joint.mimic is None:
            return Name(self.identifiers[joint.name])
        factor, master, offset = self._resolved(joint)
        if not factor:
            return offset
        return add(multiply(Number(factor), Name(self.identifiers[master])), offset)

    def _resolved(self, joint: Joint) -> tuple[Fraction, str, Expression]:
        """`factor * master + offset` for a joint that follows, whatever is between the two."""
        joints = {each.name: each for each in self.tree.joints}
        inside = {each.name for each in self.part.joints}
        factor, seen, current = Fraction(1), {joint.name}, joint
        offset: Expression = ZERO
        while current.mimic is not None:
            mimic = current.mimic
            offset = add(offset, multiply(Number(factor), mimic.offset))
            factor *= mimic.multiplier
            if not mimic.master:
                return Fraction(0), "", offset
            name = f"joint {quote(joint.name)}"
            if mimic.master in seen:
                fail(f"{name}: the joints that it mimics form a cycle", joint.line)
            if mimic.master not in joints:
                fail(f"{name}: it mimics joint {quote(mimic.master)}, which is not in the file", joint.line)
            current = joints[mimic.master]
            if current.name not in inside and factor:
                remedy = "add a link below that joint with --tip"
                fail(
                    f"{name}: it mimics joint {quote(current.name)}, which is not in the chosen part; {remedy}",
                    joint.line,
                )
            if current.motion is Motion.FIXED:
                fail(f"{name}: it mimics joint {quote(current.name)}, which is fixed", joint.line)
            seen.add(current.name)
        return factor, current.name, offset
