"""Orientations of MJCF in all their spellings, and equalities that make a joint follow another one."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from fractions import Fraction

from kinegen.errors import quote
from kinegen.io import xml
from kinegen.io.link_tree.records import ROTATIONS, Joint, Mimic, Motion, Vector, motion, root, simplified
from kinegen.io.link_tree.values import Values
from kinegen.io.messages import expected, fail
from kinegen.model.expression_parser import ZERO, Expression, Number, add, arc_tangent, multiply, negate
from kinegen.model.robot import Step, StepKind
from kinegen.support.dataclass import dataclass

FORMS = ("quat", "axisangle", "euler", "xyaxes", "zaxis")


@dataclass(frozen=True, slots=True)
class Compiler:
    """The attributes of the element `compiler` that readers need.

    Attributes:
        eulerseq: Axes of the Euler angles, one letter each; capital letters are axes that stay.
        autolimits: Whether a range alone limits a joint.
    """

    degrees: bool = True
    eulerseq: str = "xyz"
    autolimits: bool = True


def read_compiler(top: xml.Element) -> Compiler:
    """Read the compiler elements of a model; the last one to say something is right."""
    found = Compiler()
    for element in xml.children(top, "compiler"):
        degrees, sequence, limits = found.degrees, found.eulerseq, found.autolimits
        if "angle" in element.attrib:
            degrees = xml.word(element, "angle", ("degree", "radian")) == "degree"
        if "eulerseq" in element.attrib:
            sequence = xml.needed(element, "eulerseq")
            if len(sequence) != 3 or not set(sequence.lower()) <= set("xyz"):
                fail(f"eulerseq: {quote(sequence)} is not three of the letters x, y, z", element.line)
        if "autolimits" in element.attrib:
            limits = xml.word(element, "autolimits", ("true", "false")) == "true"
        if element.get("coordinate", "local") != "local":
            fail("coordinate: global coordinates are not supported; save the model with local ones", element.line)
        found = Compiler(degrees, sequence, limits)
    return found


def orientation(element: xml.Element, compiler: Compiler, values: Values) -> tuple[Step, ...]:
    """Return the rotation of a body or frame, whichever way it is written."""
    given = [form for form in FORMS if form in element.attrib]
    if len(given) > 1:
        fail(f"{given[0]} and {given[1]} exclude each other")
    if not given:
        return ()
    text = str(element.get(given[0], ""))
    match given[0]:
        case "quat":
            return values.quaternion(text, "quat")
        case "axisangle":
            *axis, angle = values.words(text, 4, "axisangle")
            turned = values.angle(angle, "axisangle[3]", degrees=compiler.degrees)
            return motion(values.direction(" ".join(axis), "axisangle"), turned, turns=True)
        case "euler":
            return _euler(values.words(text, 3, "euler"), compiler, values)
        case "zaxis":
            return _z_axis(values.direction(text, "zaxis"))
        case _:
            words = values.words(text, 6, "xyaxes")
            x, y = (values.direction(" ".join(part), "xyaxes") for part in (words[:3], words[3:]))
            return _two_axes(x, y)


def _euler(words: tuple[str, ...], compiler: Compiler, values: Values) -> tuple[Step, ...]:
    """Turn about axes that move along for small letters, about those that stay for capital letters."""
    steps: tuple[Step, ...] = ()
    for i, (letter, text) in enumerate(zip(compiler.eulerseq, words, strict=True)):
        value = values.angle(text, f"euler[{i}]", degrees=compiler.degrees)
        step = Step(ROTATIONS["xyz".index(letter.lower())], value)
        steps = (*steps, step) if letter.islower() else (step, *steps)
    return simplified(steps)


def _z_axis(axis: Vector) -> tuple[Step, ...]:
    """Return the shortest turn that takes z to an axis."""
    x, y, z = axis
    if not x and not y:
        return () if z > 0 else (Step(StepKind.RX, arc_tangent(ZERO, Number(z))),)
    return motion((-y, x, Fraction(0)), arc_tangent(root(x * x + y * y), Number(z)), turns=True)


def _two_axes(x: Vector, y: Vector) -> tuple[Step, ...]:
    """Return the rotation with its x axis along x and its y axis as near to y as that allows."""
    square = sum((part * part for part in x), Fraction(0))
    share = sum((a * b for a, b in zip(x, y, strict=True)), Fraction(0)) / square
    y1, y2, y3 = (b - share * a for a, b in zip(x, y, strict=True))
    x1, x2, x3 = x
    z3 = x1 * y2 - x2 * y1
    if not any((y1, y2, y3)):
        fail("xyaxes: the two axes are parallel")
    if not x1 and not x2:
        yaw = arc_tangent(Number(-y1), Number(y2))
        return simplified((Step(StepKind.RZ, yaw), Step(StepKind.RY, arc_tangent(Number(-x3), ZERO))))
    flat = root(x1 * x1 + x2 * x2)
    roll = arc_tangent(multiply(root(square), Number(y3)), Number(z3)) if y3 or z3 < 0 else ZERO
    pitch = arc_tangent(Number(-x3), flat) if x3 else ZERO
    return simplified(
        (Step(StepKind.RZ, arc_tangent(Number(x2), Number(x1))), Step(StepKind.RY, pitch), Step(StepKind.RX, roll))
    )


_LOOPS = ("connect", "weld")
_LINEAR = "it follows {} by a polynomial that is not linear; kinegen takes linear followers: remove the equality"


def with_equalities(
    root: xml.Element,
    joints: tuple[Joint, ...],
    above: Mapping[str, str],
    mocap: Collection[str],
    sites: Mapping[str, str],
    values: Values,
) -> tuple[tuple[Joint, ...], tuple[str, ...]]:
    """Return the joints with the equalities of a model applied, and notes on what was left out.

    `above` has the last joint above each body, `mocap` the bodies moved from outside, whose welds close no loop, and
    `sites` the body of each site.
    """
    known = {joint.name: joint for joint in joints}
    notes: list[str] = []
    for element in (child for each in xml.children(root, "equality") for child in each):
        if element.get("active", "true") == "false":
            continue
        if element.tag == "joint":
            follower = _follower(element, known, values)
            known[follower.name] = follower
        elif element.tag in _LOOPS:
            _refuse_loop(element, _bodies(element, sites), known, above, mocap, notes)
        else:
            notes.append(f"line {element.line}: the equality <{xml.name_of(element)}> is left out")
    return tuple(known[joint.name] for joint in joints), tuple(notes)


def _follower(element: xml.Element, known: Mapping[str, Joint], values: Values) -> Joint:
    names = [xml.needed(element, "joint1"), str(element.get("joint2", ""))]
    for name in names:
        if name and name not in known:
            fail(f"equality: there is no joint {quote(name)} {expected(name, known)}", element.line)
    joint = known[names[0]]
    with values.of(names[0], f"equality of joint {quote(names[0])}", element.line):
        if joint.mimic is not None:
            fail("a joint can follow only one other joint")
        words = str(element.get("polycoef", "0 1 0 0 0")).split()
        coefficients = [values.printed(word, "polycoef").value for word in words] + [Fraction(0)] * 5
        if len(words) > 5:
            fail("polycoef: expected at most 5 numbers")
        if any(coefficients[2:]):
            fail(_LINEAR.format(quote(names[1])))
        if joint.motion is Motion.FIXED:
            fail("the joint does not move about one axis")
    constant = Number(coefficients[0])
    if not names[1]:
        return replace(joint, mimic=Mimic("", Fraction(0), add(constant, negate(joint.zero))))
    # Polynomials count from the reference of each joint: q1 - ref1 = c0 + c1*(q2 - ref2).
    master = multiply(Number(coefficients[1]), known[names[1]].zero)
    offset: Expression = add(constant, master, negate(joint.zero))
    return replace(joint, mimic=Mimic(names[1], coefficients[1], offset))


def _bodies(element: xml.Element, sites: Mapping[str, str]) -> list[str]:
    """Return the bodies that an equality holds together, by their names or by those of their sites."""
    found = [str(element.get(key, "")) for key in ("body1", "body2")]
    for name in (str(element.get(key, "")) for key in ("site1", "site2")):
        if name and name not in sites:
            fail(f"equality: there is no site {quote(name)} {expected(name, sites)}", element.line)
        found += [sites[name]] if name else []
    return found


def _refuse_loop(
    element: xml.Element,
    bodies: list[str],
    known: dict[str, Joint],
    above: Mapping[str, str],
    mocap: Collection[str],
    notes: list[str],
) -> None:
    """Mark the joints of the loop that an equality closes, so that parts with one of them are refused.

    They are those on the ways from both bodies to where these meet, which is the world if one body is not named.
    """
    kind, line = xml.name_of(element), element.line
    if any(body in mocap for body in bodies):
        notes.append(f"line {line}: the {kind} to a mocap body is left out")
        return
    held = [body for body in bodies if body in above]
    if not held:
        fail(f"equality: <{kind}> names no body of the model", line)
    first, second = (_way_down(known, above.get(body, "")) for body in (*held, "")[:2])
    names = " and ".join(map(quote, held)) if len(held) > 1 else f"{quote(held[0])} and the world"
    why = f"is in the loop that <{kind}> on line {line} closes between bodies {names}"
    for name in {**dict.fromkeys(first), **dict.fromkeys(second)}:
        joint = known[name]
        if (name in first) != (name in second) and joint.motion is not Motion.FIXED:
            known[name] = replace(
                joint, refused=f"{why}; closed loops cannot be carried: remove it, or name other tips"
            )


def _way_down(known: Mapping[str, Joint], name: str) -> list[str]:
    """Return the names of a joint and of those that carry it."""
    above = {joint.child: joint for joint in known.values()}
    joint, names = known.get(name), list[str]()
    while joint is not None:
        names.append(joint.name)
        joint = above.get(joint.parent)
    return names
