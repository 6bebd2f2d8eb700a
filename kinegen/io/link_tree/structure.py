"""The tree in a list of links and joints: its part between a base and tips, followers, and names as identifiers.

In: a `LinkTree`. Out: the joints of the wanted part, parents first. Every defect is one line.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import field
from fractions import Fraction

from kinegen.errors import KinegenError, quote
from kinegen.io.link_tree.records import Joint, Link, LinkTree, Motion
from kinegen.io.messages import expected, fail
from kinegen.model.expression_parser import ZERO, Expression, Name, Number, add, multiply
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import MAX_NAME, check_name

MAX_LINKS = 5000
_LOOSE = "joint {} has no axis and carries no joint that moves, so link {} is left out, with what is on it"


@dataclass(frozen=True, slots=True)
class Part:
    """The part of a tree that becomes a robot.

    Attributes:
        tips: The links that were asked for as tips.
        joints: In depth-first order, those of one link in the order of the file.
        notes: What was left out, one sentence each.
    """

    base: str
    tips: tuple[str, ...]
    joints: tuple[Joint, ...]
    notes: tuple[str, ...] = ()

    @property
    def links(self) -> tuple[str, ...]:
        """Names of the links, the base first."""
        return (self.base, *(joint.child for joint in self.joints))


def find_part(tree: LinkTree, base: str, tips: tuple[str, ...]) -> Part:
    """Check that the links form one tree, and take the part below the base that leads to the tips.

    Without a base it is the root; without tips all ends are.
    """
    lines = _unique(tree)
    above = _parents(tree, lines)
    root = _root(tree, above)
    names = tuple(lines)
    for name, option in ((base, "--base"), *((tip, "--tip") for tip in tips)):
        if name and name not in lines:
            moved = next((f"; joint {quote(name)} moves {each.child}" for each in tree.joints if each.name == name), "")
            fail(f"{option}: there is no link {quote(name)}{moved} {expected(name, names)}")
    # Take what is below the base, and of that the ways to the tips.
    start = base or root
    below: dict[str, list[Joint]] = {}
    for joint in tree.joints:
        below.setdefault(joint.parent, []).append(joint)
    joints = tuple(_walk(start, below))
    inside = {start, *(joint.child for joint in joints)}
    for tip in tips:
        if tip not in inside:
            fail(f"--tip: link {quote(tip)} is not below the base {quote(start)}")
    if tips:
        wanted = _ancestors(tips, above, start)
        joints = tuple(joint for joint in joints if joint.child in wanted)
    # Free objects beside the robot are left out with all that they carry.
    loose = () if tips else _loose(start, joints)
    if loose:
        lost = {joint.child for joint in loose}
        lost |= {each.child for joint in loose for each in _walk(joint.child, below)}
        joints = tuple(joint for joint in joints if joint.child not in lost)
    for joint in joints:
        if joint.refused:
            fail(f"joint {quote(joint.name)} {joint.refused}", joint.line)
    return Part(start, tips, joints, tuple(_LOOSE.format(quote(each.name), quote(each.child)) for each in loose))


def _loose(start: str, joints: tuple[Joint, ...]) -> tuple[Joint, ...]:
    """Find free objects beside a robot: bodies on the base whose joint has no axis, with nothing that moves on them."""
    moving = {joint.child for joint in joints if joint.motion is not Motion.FIXED}
    if not moving:
        return ()
    children = {joint.child: joint.parent for joint in joints}
    carried: set[str] = set()
    for link in moving:
        while link in children and link not in carried:
            carried.add(link)
            link = children[link]  # noqa: PLW2901 - the way up
    is_free = (each for each in joints if each.refused and each.motion is Motion.FIXED)
    return tuple(each for each in is_free if each.parent == start and each.child not in carried)


def _unique(tree: LinkTree) -> dict[str, int]:
    """Return the line of each link; every name of a link or joint is there once."""
    if len(tree.links) > MAX_LINKS:
        fail(f"the file has more than {MAX_LINKS} links")
    _once("joint", tree.joints)
    seen = _once("link", tree.links)
    if not seen:
        fail("the file has no links")
    return seen


def _once(kind: str, entries: Sequence[Link | Joint]) -> dict[str, int]:
    """Return the line of each entry by its name."""
    seen: dict[str, int] = {}
    for entry in entries:
        if entry.name in seen:
            fail(f"{kind} {quote(entry.name)} occurs twice (first on line {seen[entry.name]})", entry.line)
        seen[entry.name] = entry.line
    return seen


def _parents(tree: LinkTree, lines: dict[str, int]) -> dict[str, Joint]:
    """Return the joint above each link but the root."""
    above: dict[str, Joint] = {}
    for joint in tree.joints:
        for role, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in lines:
                fail(f"joint {quote(joint.name)}: there is no {role} link {quote(link)}", joint.line)
        if joint.child in above:
            other = above[joint.child]
            fail(
                f"link {quote(joint.child)} is the child of joint {quote(other.name)} (line {other.line}) and of joint "
                f"{quote(joint.name)}; closed loops cannot be carried: remove one of the two joints",
                joint.line,
            )
        above[joint.child] = joint
    return above


def _root(tree: LinkTree, above: dict[str, Joint]) -> str:
    roots = [link for link in tree.links if link.name not in above]
    if not roots:
        one = tree.joints[0]
        fail(f"the joints form a cycle, so there is no root link (one of them is {quote(one.name)})", one.line)
    if len(roots) > 1:
        first, second = roots[:2]
        fail(
            f"the links {quote(first.name)} (line {first.line}) and {quote(second.name)} both have no parent; a robot "
            "has one root link",
            second.line,
        )
    # Go up from each link; a way that meets itself before the root is a cycle.
    ancestry: dict[str, bool] = {roots[0].name: True}
    for link in tree.links:
        path: list[str] = []
        name = link.name
        while name not in ancestry:
            path.append(name)
            ancestry[name] = False
            name = above[name].parent
        if not ancestry[name]:
            joint = above[name]
            fail(f"the joints above link {quote(name)} form a cycle", joint.line)
        ancestry.update(dict.fromkeys(path, True))
    return roots[0].name


def _walk(start: str, below: dict[str, list[Joint]]) -> Iterator[Joint]:
    """Return all joints below a link, depth first, without recursion: files may nest deeply."""
    waiting = list(reversed(below.get(start, [])))
    while waiting:
        joint = waiting.pop()
        yield joint
        waiting.extend(reversed(below.get(joint.child, [])))


def _ancestors(tips: tuple[str, ...], above: dict[str, Joint], start: str) -> set[str]:
    wanted: set[str] = set()
    for tip in tips:
        name = tip
        while name != start and name not in wanted:
            wanted.add(name)
            name = above[name].parent
    return wanted


@dataclass
class Followers:
    """Finds the value of a joint in terms of variables; `identifiers` is filled in before values are asked for."""

    tree: LinkTree
    part: Part
    identifiers: dict[str, str] = field(default_factory=dict)

    def is_still(self, joint: Joint) -> bool:
        """Tell whether a joint follows a constant: some multiplier on the way is zero."""
        return joint.mimic is not None and not self._resolved(joint)[0]

    def value(self, joint: Joint) -> Expression:
        """Return the value of a joint: its own variable, or what it makes of another one."""
        if joint.mimic is None:
            return Name(self.identifiers[joint.name])
        factor, master, offset = self._resolved(joint)
        if not factor:
            return offset
        return add(multiply(Number(factor), Name(self.identifiers[master])), offset)

    def _resolved(self, joint: Joint) -> tuple[Fraction, str, Expression]:
        """Return `factor * master + offset` for a joint that follows, whatever is between the two."""
        joints = {each.name: each for each in self.tree.joints}
        inside = {each.name for each in self.part.joints}
        # Follow the chain of followers; factors multiply, offsets add up.
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
            # A constant needs no joint; anything else needs its master in the part.
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


_RESERVED = frozenset({"BASE", "TOOL", "WRIST"})


@dataclass
class Identifiers:
    """Gives out identifiers, each once, blind to upper and lower case because macros lose it.

    A name that can be used stays. In any other one, each run of other characters than letters, digits and underscores
    becomes an underscore; what is then a reserved word, or taken, gets `_joint` or `_link`, and then a number.

    Attributes:
        renamed: Names that could not be used as they are, with the names used instead.
        written: Names of the file, which nothing else is renamed to.
    """

    renamed: list[tuple[str, str]] = field(default_factory=list)
    written: frozenset[str] = frozenset()
    _taken: set[str] = field(default_factory=set)

    def give(self, kind: str, name: str, ending: str) -> str:
        """Return an identifier for the name of a `robot`, `joint` or `frame`, with an ending where it is taken."""
        plain = identifier(name) or ending
        tries = [plain, f"{plain[: MAX_NAME - len(ending) - 1].rstrip('_')}_{ending}"]
        tries_end, place = tries[1][: MAX_NAME - 5].rstrip("_"), 1
        while True:
            chosen = tries.pop(0) if tries else f"{tries_end}_{place}"
            is_new = chosen == name or chosen not in self.written
            if is_new and self._is_free(kind, chosen):
                break
            place += not tries
        self._taken.add(chosen.upper())
        if chosen != name:
            self.renamed.append((name, chosen))
        return chosen

    def _is_free(self, kind: str, name: str) -> bool:
        if name.upper() in self._taken or (kind != "robot" and name.upper() in _RESERVED):
            return False
        try:
            check_name(kind, name)
        except KinegenError:
            return False
        return True


def identifier(name: str) -> str:
    """Return a name with everything taken out that no identifier may have; empty if nothing is left."""
    plain = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_")
    if plain[:1].isdigit():
        plain = f"n{plain}"
    return plain[:MAX_NAME].rstrip("_")
