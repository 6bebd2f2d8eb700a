"""MJCF text -> `Robot`: bodies inside bodies with their joints, default classes and included files.

A body is at `pos` with its orientation in the body around it. Its joints act one after the other about or along axes in
the frame of the body, each through its own `pos`. Lengths are metres; angles are degrees unless the compiler element
says otherwise. Geometry and dynamics are left aside.
"""

from __future__ import annotations

import os
from dataclasses import field
from pathlib import Path

from kinegen.errors import RobotFileError, quote
from kinegen.io import xml
from kinegen.io.format import Imported, ReadOptions
from kinegen.io.link_tree.assemble import assemble
from kinegen.io.link_tree.records import Joint, Link, LinkTree, Motion, inverse, shift
from kinegen.io.link_tree.values import Values
from kinegen.io.messages import expected, fail
from kinegen.io.mjcf_elements import Compiler, orientation, read_compiler, with_equalities
from kinegen.model.expression_parser import ZERO, Expression, negate
from kinegen.model.robot import Step
from kinegen.support.dataclass import dataclass

MAX_FILES = 64


def included(root: xml.Element, path: Path, folders: tuple[Path, ...]) -> xml.Element:
    """Put the contents of other files in place of the elements that name them.

    Files come from the folder of the model, from below it, or from folders that the user names; no other is opened.
    """
    if root.tag == "include":
        fail("<include> cannot be the root element", root.line)
    _Includes(path, folders).expand(root, 1)
    return root


class _Includes:
    """The files of one model, and how large they are together."""

    def __init__(self, path: Path, folders: tuple[Path, ...]) -> None:
        self._allowed = tuple(folder.resolve() for folder in (path.absolute().parent, *folders))
        self._seen = {_named(path.absolute())}
        self._bytes = 0

    def expand(self, parent: xml.Element, depth: int) -> None:
        """Put contents in place of the includes below an element, in the order of the file."""
        xml.accept_depth(parent, depth)
        place = 0
        while place < len(parent.children):
            child = parent.children[place]
            if child.tag == "include":
                # What takes its place may include in turn.
                parent.children[place : place + 1] = self._contents(child)
            else:
                self.expand(child, depth + 1)
                place += 1

    def _contents(self, found: xml.Element) -> list[xml.Element]:
        name, line = xml.needed(found, "file"), found.line
        file = _find(name, self._allowed, line)
        # As in MuJoCo, links to one file are several files: left and right fingers share their contents.
        if _named(file) in self._seen or len(self._seen) > MAX_FILES:
            fail(f"{quote(name)} is included twice, or there are more than {MAX_FILES} files", line)
        self._seen.add(_named(file))
        self._bytes += file.stat().st_size
        if self._bytes > xml.MAX_BYTES:
            fail(f"with the included file {quote(name)}, the files are too large for a robot", line)
        return _contents(file, name, line)


def _named(file: Path) -> str:
    return os.path.normpath(file)


def _find(name: str, allowed: tuple[Path, ...], line: int) -> Path:
    """Find a file in the first folder that has it; links are followed to see whether they lead elsewhere."""
    places = [(folder / name, (folder / name).resolve()) for folder in allowed]
    inside = [
        file for file, real in places if any(real.is_relative_to(folder) for folder in allowed) and real.is_file()
    ]
    if not inside:
        remedy = "name its folder with --package-path NAME=DIR"
        fail(f"the included file {quote(name)} is not in the folder of the model; {remedy}", line)
    return inside[0]


def _contents(file: Path, name: str, line: int) -> list[xml.Element]:
    try:
        top = xml.parse(file.read_bytes())
    except RobotFileError as error:
        fail(f"included file {quote(name)}: {error.message}", line)
    for element in top.iter():
        # Its lines are those of another file.
        element.line = 0
    return top.children


_MAIN = "main"


@dataclass(frozen=True, slots=True)
class Defaults:
    """The attributes of a joint in each class, those of the classes around it included."""

    classes: dict[str, dict[str, str]]

    def joint(self, element: xml.Element, kind: str) -> dict[str, str]:
        """Return all attributes of a joint; `kind` is the class of the body around it, empty for the main one."""
        name = str(element.get("class", kind)) or _MAIN
        if name not in self.classes and name != _MAIN:
            fail(f"there is no default class {quote(name)} {expected(name, self.classes)}", element.line)
        own = {str(key): str(value) for key, value in element.attrib.items()}
        return {**self.classes.get(name, {}), **own}


def read_defaults(root: xml.Element) -> Defaults:
    """Read all default classes of a model."""
    classes: dict[str, dict[str, str]] = {_MAIN: {}}
    # Parents first: a class inherits what the classes around it say.
    waiting = [(element, _MAIN) for element in xml.children(root, "default")]
    tops = {id(element) for element, _ in waiting}
    while waiting:
        element, parent = waiting.pop(0)
        is_top = id(element) in tops
        name = str(element.get("class", _MAIN if is_top else ""))
        if not name:
            fail("a <default> inside another one needs a class", element.line)
        found = dict(classes.get(parent, {}))
        for joint in xml.children(element, "joint"):
            found |= {str(key): str(value) for key, value in joint.attrib.items()}
        classes[name] = {**classes.get(name, {}), **found}
        if is_top:
            classes[_MAIN] = classes[name]
        waiting += [(child, name) for child in xml.children(element, "default")]
    return Defaults(classes)


WORLD = "world"
_MOTIONS = {"hinge": Motion.REVOLUTE, "slide": Motion.PRISMATIC}
_TYPES = (*_MOTIONS, "ball", "free")
_MAKERS = ("replicate", "composite", "flexcomp", "attach")
"""Elements that make bodies when MuJoCo compiles the model."""

_NO_BODIES = frozenset({"frame", "replicate", "geom", "site", "light", "camera"})
"""What moves nothing, however often it is there."""

_JOINTS = ("joint", "freejoint")


def read(data: bytes, path: Path, options: ReadOptions) -> Imported:
    """Read an MJCF file; includes are searched beside it and in the folders of packages."""
    root = xml.parse(data)
    if root.tag != "mujoco":
        fail(f"the root element is <{xml.name_of(root)}>; an MJCF file has <mujoco>", root.line)
    root = included(root, path, tuple(Path(folder) for _, folder in options.packages))
    return assemble(link_tree(root, path.stem, options), path.name, options)


def link_tree(root: xml.Element, name: str, options: ReadOptions) -> LinkTree:
    """Take links and joints from a model without includes; `name` is for a robot without one.

    With tips, elements that make bodies are left out, since tips are on other ones.
    """
    compiler = read_compiler(root)
    walk = _Walk(compiler, read_defaults(root), Values(options.snap))
    for world in xml.children(root, "worldbody"):
        walk.contents(world, WORLD, (), "")
    for tag, line in walk.makers[:1]:
        if not options.tips:
            fail(
                f"<{tag}> makes bodies when MuJoCo compiles the model; save the compiled model and read that, or name "
                "tips that are on other bodies with --tip",
                line,
            )
    joints, notes = with_equalities(root, tuple(walk.joints), walk.above, walk.mocap, walk.sites, walk.values)
    notes += tuple(f"line {line}: <{tag}> is left out, with the bodies that it makes" for tag, line in walk.makers)
    given = str(root.get("model", "")).strip()
    links = (Link(WORLD, root.line), *walk.links)
    return LinkTree(given or name, links, joints, tuple(walk.values.suspects), notes, degrees=compiler.degrees)


@dataclass
class _Walk:
    """Goes through the bodies and gathers links and joints.

    Attributes:
        links: One for each body, and one between the joints of a body that has several.
        joints: One for each joint, and a fixed one for a body without.
        above: The last joint above each body.
        mocap: Bodies that are moved from outside.
        sites: The body of each site that has a name.
        makers: Elements that make bodies, and their lines.
    """

    compiler: Compiler
    defaults: Defaults
    values: Values
    links: list[Link] = field(default_factory=list)
    joints: list[Joint] = field(default_factory=list)
    above: dict[str, str] = field(default_factory=dict)
    mocap: set[str] = field(default_factory=set)
    sites: dict[str, str] = field(default_factory=dict)
    makers: list[tuple[str, int]] = field(default_factory=list)

    def contents(self, element: xml.Element, body: str, place: tuple[Step, ...], kind: str) -> None:
        """Read what is in a body, or in a frame inside it.

        `place` leads from the body to the frame; `kind` is the default class of joints.
        """
        for child in element:
            tag = child.tag
            if tag in _MAKERS and not _repeats_shapes(child):
                self.makers.append((tag, child.line))
            if tag == "frame":
                if next(xml.children(child, *_JOINTS), None) is not None:
                    fail("a joint in a <frame> is not supported; write it in the frame of the body", child.line)
                with self.values.of("", f"frame {quote(child.get('name', ''))}", child.line):
                    inside = (*place, *self._place(child))
                self.contents(child, body, inside, str(child.get("childclass", kind)))
            if tag == "site" and child.get("name"):
                self.sites[str(child.get("name"))] = body
            if tag == "body":
                self._body(child, body, place, str(child.get("childclass", kind)))

    def _body(self, element: xml.Element, parent: str, place: tuple[Step, ...], kind: str) -> None:
        line = element.line
        name = str(element.get("name", "")).strip() or f"body_{len(self.links) + 1}"
        joints = list(xml.children(element, *_JOINTS))
        names = [str(joint.get("name", "")).strip() or _usual(name, i, len(joints)) for i, joint in enumerate(joints)]
        with self.values.of(names[0] if names else f"{name} (fixed)", f"body {quote(name)}", line):
            place = (*place, *self._place(element))
        # A body without joints is fixed to the one around it.
        if not joints:
            names = [f"{name} (fixed)"]
            self.joints.append(Joint(names[0], line, Motion.FIXED, parent, name, place))
        # Between several joints of one body there are links that the file does not name.
        for i, joint in enumerate(joints):
            child = name if i + 1 == len(joints) else f"{name} after {names[i]}"
            if child != name:
                self.links.append(Link(child, joint.line))
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
        line = element.line
        with self.values.of(name, f"joint {quote(name)}", line):
            found = self.defaults.joint(element, kind)
            # A joint without one axis is kept as fixed, and refused where a part has it.
            if element.tag == "freejoint" or found.get("type", "hinge") in ("free", "ball"):
                how = "a ball joint" if found.get("type") == "ball" else "free"
                remedy = f"kinegen takes joints with one axis: start below it with --base '{child}'"
                return Joint(name, line, Motion.FIXED, parent, child, place, refused=f"is {how}; {remedy}")
            motion = _MOTIONS.get(found.get("type", "hinge"))
            if motion is None:
                fail(f"unknown type {quote(found['type'])} (expected {', '.join(_TYPES)})")
            # The joint is at its own pos in the body; what follows it leads back to the frame of the body.
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


def _repeats_shapes(element: xml.Element) -> bool:
    inside = (each.tag for each in element.iter())
    return element.tag == "replicate" and _NO_BODIES.issuperset(inside)


def _usual(body: str, place: int, count: int) -> str:
    return f"{body}_joint{place + 1 if count > 1 else ''}"
