"""`LinkTree` -> `Robot`: a row for each joint that moves, a named frame for each link that does not.

A row is an elementary sequence: the fixed transforms since the row above, the motion, what follows it. Its frame is
that of the child link. In a chain the tip is the tool; in a tree tips are marked frames, or rows.
"""

from __future__ import annotations

from kinegen.errors import printable, quote
from kinegen.io.format import Imported, ReadOptions, Report
from kinegen.io.link_tree.numbers import findings
from kinegen.io.link_tree.records import Joint, LinkTree, Motion, motion, simplified
from kinegen.io.link_tree.structure import Followers, Identifiers, Part, find_part
from kinegen.io.messages import fail, within
from kinegen.io.robot_file.keys import MAX_FRAMES, MAX_ROWS, MAX_STEPS
from kinegen.model.expression_parser import Expression, ExpressionError, add, linear, names
from kinegen.model.expression_values import checked_value, is_zero, join
from kinegen.model.robot import BASE, TOOL, Convention, Frame, JointType, JointVariable, Robot, Row, Step, Units
from kinegen.support.dataclass import dataclass

_TYPES = {
    Motion.REVOLUTE: JointType.REVOLUTE,
    Motion.CONTINUOUS: JointType.REVOLUTE,
    Motion.PRISMATIC: JointType.PRISMATIC,
}


@dataclass(frozen=True, slots=True)
class _Place:
    """The place of a link, fixed to the frame of a row, or of the base."""

    row: str
    steps: tuple[Step, ...]


@dataclass(frozen=True, slots=True)
class _Body:
    """The robot as far as joints decide it."""

    rows: tuple[Row, ...]
    variables: tuple[JointVariable, ...]
    places: dict[str, _Place]
    notes: tuple[str, ...]

    @property
    def leaves(self) -> tuple[str, ...]:
        """Rows that no other row follows."""
        parents = {row.parent for row in self.rows}
        return tuple(row.name for row in self.rows if row.name not in parents)


def assemble(tree: LinkTree, source: str, options: ReadOptions) -> Imported:
    """Make the robot of the part of a tree that the options choose."""
    part = find_part(tree, options.base, options.tips)
    identifiers = Identifiers()
    own = identifiers.give("robot", tree.name, "robot")
    # A renamed joint never takes the name of another link or joint.
    written = frozenset(link.name for link in tree.links) | frozenset(joint.name for joint in tree.joints)
    known = Identifiers(identifiers.renamed, written)
    body = _body(part, known, Followers(tree, part))
    if not body.rows:
        why = f"no joint moves between link {quote(part.base)} and its tips, so there is nothing to compute"
        fail(why + _elsewhere(tree))
    # Links that no joint moves become named frames of the row that carries them.
    tips, notes = _tips(part, body)
    frames, tool, links = _frames(part, body, tips, known, {link.name: link.line for link in tree.links})
    robot = Robot(
        name=own,
        description="",
        convention=Convention.STANDARD,
        units=Units("m", "deg" if tree.degrees else "rad"),
        parameters=(),
        variables=body.variables,
        rows=body.rows,
        base=(),
        tool=tool,
        frames=frames,
        source=printable(source),
        digest="",
        links=links,
    )
    report = Report(
        findings(tree, part),
        tuple(known.renamed),
        (*tree.notes, *part.notes, *body.notes, *notes, *_root_notes(links)),
        links,
    )
    return Imported(robot, report)


def _elsewhere(tree: LinkTree) -> str:
    """Return the links on which joints move, for the message that none moves in a part."""
    moving = [joint for joint in tree.joints if joint.motion is not Motion.FIXED]
    carried = {joint.child for joint in moving}
    above = {joint.child: joint.parent for joint in tree.joints}
    found = []
    for joint in moving:
        link = joint.parent
        while link in above and link not in carried:
            link = above[link]
        if link not in carried:
            found.append(joint.parent)
    names = list(dict.fromkeys(found))
    if not names:
        return ""
    more = ", ..." if len(names) > 4 else ""
    return f"; joints move on {', '.join(map(quote, names[:4]))}{more}, which --base takes"


def _body(part: Part, known: Identifiers, followers: Followers) -> _Body:
    """Return the rows with their variables, and where each link is."""
    # Names first, since a joint may follow one that stands below it.
    for joint in part.joints:
        if joint.motion is not Motion.FIXED and not followers.is_still(joint):
            followers.identifiers[joint.name] = known.give("joint", joint.name, "joint")
    # A joint that does not move is folded into the transform of the next one.
    places = {part.base: _Place(BASE, ())}
    rows: list[Row] = []
    variables: list[JointVariable] = []
    notes: list[str] = []
    for joint in part.joints:
        place = places[joint.parent]
        with within(f"joint {quote(joint.name)}", joint.line):
            if joint.name not in followers.identifiers:
                still = motion_of(joint, followers)
                fixed = simplified((*place.steps, *joint.origin, *still, *joint.after))
                places[joint.child] = _Place(place.row, _bounded(fixed))
                continue
            row = _row(joint, place, followers, len(rows) + 1)
            if row.variable is not None:
                variables.append(_variable(joint, row, len(variables), notes))
        rows.append(row)
        places[joint.child] = _Place(row.name, ())
    if len(rows) > MAX_ROWS:
        fail(f"{len(rows)} joints move (at most {MAX_ROWS}); choose a part with --base and --tip")
    return _Body(tuple(rows), tuple(variables), places, tuple(notes))


def motion_of(joint: Joint, followers: Followers) -> tuple[Step, ...]:
    """Return the steps of a joint that move, or would move if it did not follow a constant."""
    if joint.motion is Motion.FIXED:
        return ()
    turns = joint.motion is not Motion.PRISMATIC
    return motion(joint.axis, add(followers.value(joint), joint.zero), turns=turns)


def _row(joint: Joint, place: _Place, followers: Followers, number: int) -> Row:
    name = followers.identifiers[joint.name]
    # The frame of the row is that of the child link, whatever fixed transforms are before it.
    found = simplified((*place.steps, *joint.origin, *motion_of(joint, followers), *joint.after))
    steps = tuple(Step(step.kind, _in_order(step.value)) for step in found)
    kind = JointType.FOLLOWER if joint.mimic else _TYPES[joint.motion]
    return Row(
        name=name,
        number=number,
        parent=place.row,
        convention=Convention.ETS,
        alpha=None,
        a=None,
        d=None,
        theta=None,
        beta=None,
        steps=_bounded(steps),
        type=kind,
        variable=None if joint.mimic else name,
        line=joint.line,
    )


def _in_order(value: Expression) -> Expression:
    """Return a linear function with its variables first and its constant last, as in a robot file."""
    variables = names(value)
    return join(*linear(value, frozenset(variables))) if variables else value


def _bounded(steps: tuple[Step, ...]) -> tuple[Step, ...]:
    if len(steps) > MAX_STEPS:
        fail(f"more than {MAX_STEPS} elementary transforms lie between two joints")
    return steps


def _variable(joint: Joint, row: Row, index: int, notes: list[str]) -> JointVariable:
    limits = joint.limits
    if limits is not None:
        try:
            low, high = (checked_value(limit, {}) for limit in limits)
        except ExpressionError:
            notes.append(f"joint {quote(joint.name)}: its limits are too large to mean anything; it has none now")
            return JointVariable(row.name, index, row.type, None, joint.line)
        if low > high:
            fail("the lower limit exceeds the upper limit")
        if is_zero(low - high):
            notes.append(f"joint {quote(joint.name)}: its limits are equal, so they are left out")
            limits = None
        elif row.type is JointType.REVOLUTE and max(-low, high) > 100_000:
            notes.append(f"joint {quote(joint.name)}: its limits are beyond 1e5 rad, so they are left out")
            limits = None
    return JointVariable(row.name, index, row.type, limits, joint.line)


def _tips(part: Part, body: _Body) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the links that are tips, and how they were chosen."""
    if part.tips:
        return part.tips, ()
    parents = {joint.parent for joint in part.joints}
    ends: dict[str, list[str]] = {leaf: [] for leaf in body.leaves}
    for link in part.links:
        place = body.places[link]
        if link not in parents and place.row in ends:
            ends[place.row].append(link)
    chosen = [links[0] for links in ends.values() if len(links) == 1]
    notes = [
        f"the tip of joint {quote(leaf)} is its own link, since {len(links)} links end there "
        f"({', '.join(map(quote, links[:4]))}{', ...' if len(links) > 4 else ''}); --tip chooses one"
        for leaf, links in ends.items()
        if len(links) > 1
    ]
    return tuple(chosen), tuple(notes)


def _root_notes(links: tuple[tuple[str, str], ...]) -> tuple[str, ...]:
    """Return what the root is called, where another link has the name that it has in every robot."""
    frame = dict(links).get(BASE, BASE)
    if frame == BASE:
        return ()
    return (f"the root link {quote(links[0][0])} is frame {BASE} of the robot; link '{BASE}' is frame {frame}",)


def _frames(
    part: Part, body: _Body, tips: tuple[str, ...], known: Identifiers, lines: dict[str, int]
) -> tuple[tuple[Frame, ...], tuple[Step, ...], tuple[tuple[str, str], ...]]:
    """Return the named frames, the tool, and the frame of each link."""
    last, tree = body.rows[-1].name, len(body.leaves) > 1
    # A chain has one tip, its tool; the links of trees keep their names.
    tool_link = None if tree else next((tip for tip in tips if body.places[tip].row == last), None)
    # The first link without a further transform is the frame of its row.
    row_of = {place.row: link for link, place in reversed(body.places.items()) if not place.steps}
    links, frames = [(part.base, BASE)], []
    children = {joint.child: joint for joint in part.joints}
    for link in part.links[1:]:
        place = body.places[link]
        moved = children[link].motion is not Motion.FIXED and row_of.get(place.row) == link
        if link == tool_link:
            links.append((link, TOOL))
        elif moved:
            links.append((link, place.row))
        else:
            name = known.give("frame", link, "link")
            is_tip = tree and link in tips and place.row != BASE
            frames.append(Frame(name, place.row, place.steps, lines[link], is_tip))
            links.append((link, name))
    if len(frames) > MAX_FRAMES:
        fail(f"{len(frames)} links are fixed to others (at most {MAX_FRAMES}); choose a part with --base and --tip")
    return tuple(frames), body.places[tool_link].steps if tool_link else (), tuple(links)
