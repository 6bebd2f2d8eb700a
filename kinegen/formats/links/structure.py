"""The tree in a list of links and joints: one root, no cycle, and the part between a base and some tips.

In: a `LinkTree`. Out: the joints of the wanted part, parents first. Every defect is one line.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from kinegen.errors import quote
from kinegen.formats.links.tree import Joint, Link, LinkTree
from kinegen.formats.messages import expected, fail

MAX_LINKS = 5000


@dataclass(frozen=True, slots=True)
class Part:
    """The part of a tree that becomes a robot.

    Attributes:
        base: Its root link.
        tips: The links that were asked for as tips.
        joints: In depth-first order, those of one link in the order of the file.
        links: Names of its links, the base first, in the order of the joints.
    """

    base: str
    tips: tuple[str, ...]
    joints: tuple[Joint, ...]

    @property
    def links(self) -> tuple[str, ...]:
        """Names of the links, the base first."""
        return (self.base, *(joint.child for joint in self.joints))


def find_part(tree: LinkTree, base: str, tips: tuple[str, ...]) -> Part:
    """Check the tree and take the wanted part of it.

    Args:
        tree: The whole file.
        base: Name of the new base, or nothing for the root.
        tips: Names of the tips, or nothing for all ends.

    Raises:
        RobotFileError: If it is not a tree, or a name is unknown.
    """
    lines = _unique(tree)
    above = _parents(tree, lines)
    root = _root(tree, above)
    names = tuple(lines)
    for name, option in ((base, "--base"), *((tip, "--tip") for tip in tips)):
        if name and name not in lines:
            fail(f"{option}: there is no link {quote(name)} {expected(name, names)}")
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
    for joint in joints:
        if joint.refused:
            fail(f"joint {quote(joint.name)} {joint.refused}", joint.line)
    return Part(start, tips, joints)


def _unique(tree: LinkTree) -> dict[str, int]:
    """The line of each link; every name of a link or joint is there once."""
    if len(tree.links) > MAX_LINKS:
        fail(f"the file has more than {MAX_LINKS} links")
    _once("joint", tree.joints)
    seen = _once("link", tree.links)
    if not seen:
        fail("the file has no links")
    return seen


def _once(kind: str, entries: Sequence[Link | Joint]) -> dict[str, int]:
    """The line of each entry by its name."""
    seen: dict[str, int] = {}
    for entry in entries:
        if entry.name in seen:
            fail(f"{kind} {quote(entry.name)} occurs twice (first on line {seen[entry.name]})", entry.line)
        seen[entry.name] = entry.line
    return seen


def _parents(tree: LinkTree, lines: dict[str, int]) -> dict[str, Joint]:
    """The joint above each link but the root."""
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
    """All joints below a link, depth first, without recursion: files may nest deeply."""
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
