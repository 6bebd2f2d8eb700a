"""MJCF text -> `Robot`.

A body is at `pos` with its orientation in the body around it. Its joints act one after the other about or along axes in
the frame of the body, each through its own `pos`. Lengths are metres; angles are degrees unless the compiler element
says otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from kinegen.errors import quote
from kinegen.formats import xml
from kinegen.formats.format import Imported, ReadOptions
from kinegen.formats.links.assemble import assemble
from kinegen.formats.links.rotations import inverse, shift
from kinegen.formats.links.tree import Joint, Link, LinkTree, Motion
from kinegen.formats.links.values import Values
from kinegen.formats.messages import fail
from kinegen.formats.mjcf.defaults import Defaults, read_defaults
from kinegen.formats.mjcf.equality import with_equalities
from kinegen.formats.mjcf.includes import included
from kinegen.formats.mjcf.orientation import Compiler, orientation, read_compiler
from kinegen.robot.expressions import ZERO, Expression, negate
from kinegen.robot.model import Step

WORLD = "world"
_MOTIONS = {"hinge": Motion.REVOLUTE, "slide": Motion.PRISMATIC}
_TYPES = (*_MOTIONS, "ball", "free")
_MAKERS = ("replicate", "composite", "flexcomp", "attach")
"""Elements that make bodies when MuJoCo compiles the model."""

_JOINTS = ("joint", "freejoint")


def read(data: bytes, path: Path, options: ReadOptions) -> Imported:
    """Read an MJCF file.

    Args:
        data: The text.
        path: Its file; includes are searched beside it.
        options: Base, tips, how far numbers snap, and folders from which files may be included.

    Raises:
        RobotFileError: At the first defect.
    """
    root = xml.parse(data)
    if root.tag != "mujoco":
        fail(f"the root element is <{xml.name_of(root)}>; an MJCF file has <mujoco>", xml.line(root))
    root = included(root, path, tuple(Path(folder) for _, folder in options.packages))
    return assemble(link_tree(root, path.stem, options.snap), path.name, options)


def link_tree(root: xml.Element, name: str, snap: float | None) -> LinkTree:
    """Everything that the reader needs of a model.

    Args:
        root: The element at the top, without includes.
        name: What the robot is called if the file does not say.
        snap: As in `ReadOptions`.
    """
    compiler = read_compiler(root)
    walk = _Walk(compiler, read_defaults(root), Values(snap))
    for world in xml.children(root, "worldbody"):
        walk.contents(world, WORLD, (), "")
    joints, notes = with_equalities(root, tuple(walk.joints), walk.above, walk.mocap, walk.values)
    given = str(root.get("model", "")).strip()
    links = (Link(WORLD, xml.line(root)), *walk.links)
    return LinkTree(given or name, links, joints, tuple(walk.values.suspects), notes, degrees=compiler.degrees)


@dataclass
class _Walk:
    """Goes through the bodies and gathers links and joints.

    Attributes:
        compiler: Units and order of angles.
        defaults: What joints have that do not say it themselves.
        values: Reads numbers.
        links: One for each body, and one between the joints of a body that has several.
        joints: One for each joint, and a fixed one for a body without.
        above: The last joint above each body.
        mocap: Bodies that are moved from outside.
    """

    compiler: Compiler
    defaults: Defaults
    values: Values
    links: list[Link] = field(default_factory=list)
    joints: list[Joint] = field(default_factory=list)
    above: dict[str, str] = field(default_factory=dict)
    mocap: set[str] = field(default_factory=set)

    def contents(self, element: xml.Element, body: str, place: tuple[Step, ...], kind: str) -> None:
        """Read what is in a body, or in a frame inside it.

        Args:
            element: The body or frame.
            body: Name of the body.
            place: From the body to the frame.
            kind: Default class of joints.
        """
        for child in element:
            tag = child.tag if isinstance(child.tag, str) else ""
            if tag in _MAKERS:
                fail(
                    f"<{tag}> makes bodies when MuJoCo compiles the model; save the compiled model and read that",
                    xml.line(child),
                )
            if tag == "frame":
                if next(xml.children(child, *_JOINTS), None) is not None:
                    fail("a joint in a <frame> is not supported; write it in the frame of the body", xml.line(child))
                with self.values.of("", f"frame {quote(child.get('name', ''))}", xml.line(child)):
                    inside = (*place, *self._place(child))
                self.contents(child, body, inside, str(child.get("childclass", kind)))
            if tag == "body":
                self._body(child, body, place, str(child.get("childclass", kind)))

    def _body(self, element: xml.Element, parent: str, place: tuple[Step, ...], kind: str) -> None:
        line = xml.line(element)
        name = str(element.get("name", "")).strip() or f"body_{len(self.links) + 1}"
        joints = list(xml.children(element, *_JOINTS))
        names = [str(joint.get("name", "")).strip() or _usual(name, i, len(joints)) for i, joint in enumerate(joints)]
        with self.values.of(names[0] if names else f"{name} (fixed)", f"body {quote(name)}", line):
            place = (*place, *self._place(element))
        if not joints:
            names = [f"{name} (fixed)"]
            self.joints.append(Joint(names[0], line, Motion.FIXED, parent, name, place))
        for i, joint in enumerate(joints):
            child = name if i + 1 == len(joints) else f"{name} after {names[i]}"
            if child != name:
                self.links.append(Link(child, xml.line(joint)))
            self.joints.append(self._joint(joint, names[i], parent, child, place, kind))
            parent, place = child, ()
        self.links.append(Link(name, line))
        self.above[name] = names[-1]
        if element.get("mocap") == "true":
            self.mocap.add(name)
        self.contents(element, name, (), kind)

    def _place(self, element: xml.Element) -> tuple[Step, ...]:
        position = shift(self.values.lengths(element.get("pos", "0 0 0"), "pos"))
        return (*position, *orientation(element, self.compiler, self.values))

    def _joint(
        self, element: xml.Element, name: str, parent: str, child: str, place: tuple[Step, ...], kind: str
    ) -> Joint:
        line = xml.line(element)
        with self.values.of(name, f"joint {quote(name)}", line):
            found = self.defaults.joint(element, kind)
            if element.tag == "freejoint" or found.get("type", "hinge") in ("free", "ball"):
                how = "a ball joint" if found.get("type") == "ball" else "free"
                remedy = f"kinegen takes joints with one axis: start below it with --base '{child}'"
                return Joint(name, line, Motion.FIXED, parent, child, place, refused=f"is {how}; {remedy}")
            motion = _MOTIONS.get(found.get("type", "hinge"))
            if motion is None:
                fail(f"unknown type {quote(found['type'])} (expected {', '.join(_TYPES)})")
            anchor = shift(self.values.lengths(found.get("pos", "0 0 0"), "pos"))
            axis = self.values.direction(found.get("axis", "0 0 1"), "axis")
            degrees = self.compiler.degrees and motion is Motion.REVOLUTE
            zero = self._zero(found.get("ref", "0"), degrees=degrees, turns=motion is Motion.REVOLUTE)
            limits = self._limits(found, degrees=degrees)
        return Joint(
            name, line, motion, parent, child, (*place, *anchor), axis, limits, zero=zero, after=inverse(anchor)
        )

    def _zero(self, text: str, *, degrees: bool, turns: bool) -> Expression:
        if turns:
            return negate(self.values.angle(text, "ref", degrees=degrees))
        return negate(self.values.bound(text, "ref")) if self.values.length(text, "ref") else ZERO

    def _limits(self, found: dict[str, str], *, degrees: bool) -> tuple[Expression, Expression] | None:
        limited = found.get("limited", "auto")
        if limited == "false" or (limited == "auto" and ("range" not in found or not self.compiler.autolimits)):
            return None
        if "range" not in found:
            fail("it is limited and has no range")
        low, high = self.values.words(found["range"], 2, "range")
        if low == high == "0":
            return None
        return self.values.bound(low, "range[0]", degrees=degrees), self.values.bound(high, "range[1]", degrees=degrees)


def _usual(body: str, place: int, count: int) -> str:
    return f"{body}_joint{place + 1 if count > 1 else ''}"
