"""URDF text -> `LinkTree`, and the `Robot` that it assembles to.

A joint leads from its parent link to its child link by `T(xyz) Rz(yaw) Ry(pitch) Rx(roll)`, and then moves about or
along `axis`, given in the frame of the child. Lengths are metres and angles radians. Meshes are never opened.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

from kinegen.errors import quote
from kinegen.io import xml
from kinegen.io.format import Imported, ReadOptions
from kinegen.io.link_tree.assemble import assemble
from kinegen.io.link_tree.records import Joint, Link, LinkTree, Mimic, Motion
from kinegen.io.link_tree.values import Values
from kinegen.io.messages import fail
from kinegen.model.expression_parser import Expression, Number
from kinegen.model.robot import Step, StepKind

_TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
_REFUSED = "kinegen takes joints with one axis: start below it with --base {child}, or make it fixed"
_X_AXIS = (Fraction(1), Fraction(0), Fraction(0))


def read(data: bytes, path: Path, options: ReadOptions) -> Imported:
    """Read a URDF file, whose name is that of a robot without one."""
    return assemble(link_tree(xml.parse(data), path.stem, options.snap), path.name, options)


def link_tree(root: xml.Element, name: str, snap: float | None) -> LinkTree:
    """Take links and joints from the root element; `name` is for a robot without one."""
    if root.tag != "robot":
        fail(f"the root element is <{xml.name_of(root)}>; a URDF file has <robot>", root.line)
    values = Values(snap)
    links = tuple(Link(xml.needed(link, "name"), link.line) for link in xml.children(root, "link"))
    joints = tuple(_joint(element, values) for element in xml.children(root, "joint"))
    given = str(root.get("name", "")).strip()
    notes = () if given else (f"<robot> has no name, so the robot is named after the file: {name}",)
    return LinkTree(given or name, links, joints, tuple(values.suspects), (*notes, *_left_over(root)))


def _left_over(root: xml.Element) -> Iterator[str]:
    """Return a note for each element of xacro that was never expanded."""
    for element in root.iter():
        if element.tag.startswith("xacro:"):
            yield f"line {element.line}: <{xml.name_of(element)}> was left out; a file named .xacro is expanded"


def _joint(element: xml.Element, values: Values) -> Joint:
    name = xml.needed(element, "name")
    line = element.line
    with values.of(name, f"joint {quote(name)}", line):
        kind = xml.word(element, "type", _TYPES)
        parent, child = (_link(element, role) for role in ("parent", "child"))
        if parent == child:
            fail(f"parent and child are the same link {quote(child)}")
        origin = _origin(xml.only(element, "origin"), values)
        # A joint without one axis is kept as fixed, and refused where a part has it.
        if kind in ("floating", "planar"):
            refused = f"is {kind}; {_REFUSED.format(child=child)}"
            return Joint(name, line, Motion.FIXED, parent, child, origin, refused=refused)
        motion = Motion(kind)
        if motion is Motion.FIXED:
            return Joint(name, line, motion, parent, child, origin)
        # Without an axis it is x, as the format says; a follower may lack limits.
        axis = xml.only(element, "axis")
        mimic = _mimic(xml.only(element, "mimic"), values)
        return Joint(
            name,
            line,
            motion,
            parent,
            child,
            origin,
            axis=_X_AXIS if axis is None else _axis(axis, values),
            limits=None if motion is Motion.CONTINUOUS else _limits(element, values, optional=mimic is not None),
            mimic=mimic,
        )


def _link(element: xml.Element, role: str) -> str:
    found = xml.only(element, role)
    if found is None:
        fail(f"<{role}> is missing")
    return xml.needed(found, "link")


def _origin(element: xml.Element | None, values: Values) -> tuple[Step, ...]:
    if element is None:
        return ()
    with values.at(element.line):
        x, y, z = values.lengths(element.get("xyz", "0 0 0"), "xyz")
        texts = values.words(element.get("rpy", "0 0 0"), 3, "rpy")
        roll, pitch, yaw = (values.angle(text, f"rpy[{i}]") for i, text in enumerate(texts))
    shifts = (
        Step(kind, Number(value))
        for kind, value in zip((StepKind.TX, StepKind.TY, StepKind.TZ), (x, y, z), strict=True)
    )
    turns = (Step(StepKind.RZ, yaw), Step(StepKind.RY, pitch), Step(StepKind.RX, roll))
    return (*shifts, *turns)


def _axis(element: xml.Element, values: Values) -> tuple[Fraction, Fraction, Fraction]:
    with values.at(element.line):
        return values.direction(xml.needed(element, "xyz"), "axis")


def _limits(element: xml.Element, values: Values, *, optional: bool) -> tuple[Expression, Expression] | None:
    limit = xml.only(element, "limit")
    if limit is None:
        if optional:
            return None
        fail("<limit> is missing; give lower and upper, or make a revolute joint continuous")
    with values.at(limit.line):
        return values.bound(limit.get("lower", "0"), "lower"), values.bound(limit.get("upper", "0"), "upper")


def _mimic(element: xml.Element | None, values: Values) -> Mimic | None:
    if element is None:
        return None
    with values.at(element.line):
        master = xml.needed(element, "joint")
        multiplier = values.printed(element.get("multiplier", "1"), "multiplier").value
        return Mimic(master, multiplier, values.angle(element.get("offset", "0"), "offset"))
