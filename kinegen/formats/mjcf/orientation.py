"""Orientations in MJCF: quaternions, axis and angle, Euler angles in any order, two axes, one axis."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from kinegen.errors import quote
from kinegen.formats import xml
from kinegen.formats.links.rotations import ROTATIONS, Vector, motion, root, simplified
from kinegen.formats.links.values import Values
from kinegen.formats.messages import fail
from kinegen.robot.expressions import ZERO, Number, arc_tangent, multiply
from kinegen.robot.model import Step, StepKind

FORMS = ("quat", "axisangle", "euler", "xyaxes", "zaxis")


@dataclass(frozen=True, slots=True)
class Compiler:
    """What the element `compiler` says.

    Attributes:
        degrees: Whether angles are degrees.
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
                fail(f"eulerseq: {quote(sequence)} is not three of the letters x, y, z", xml.line(element))
        if "autolimits" in element.attrib:
            limits = xml.word(element, "autolimits", ("true", "false")) == "true"
        if element.get("coordinate", "local") != "local":
            fail("coordinate: global coordinates are not supported; save the model with local ones", xml.line(element))
        found = Compiler(degrees, sequence, limits)
    return found


def orientation(element: xml.Element, compiler: Compiler, values: Values) -> tuple[Step, ...]:
    """The rotation of a body or frame, whichever way it is written."""
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
    """Small letters turn about axes that move along, capital letters about those that stay."""
    steps: tuple[Step, ...] = ()
    for i, (letter, text) in enumerate(zip(compiler.eulerseq, words, strict=True)):
        value = values.angle(text, f"euler[{i}]", degrees=compiler.degrees)
        step = Step(ROTATIONS["xyz".index(letter.lower())], value)
        steps = (*steps, step) if letter.islower() else (step, *steps)
    return simplified(steps)


def _z_axis(axis: Vector) -> tuple[Step, ...]:
    """The shortest turn that takes z to an axis."""
    x, y, z = axis
    if not x and not y:
        return () if z > 0 else (Step(StepKind.RX, arc_tangent(ZERO, Number(z))),)
    return motion((-y, x, Fraction(0)), arc_tangent(root(x * x + y * y), Number(z)), turns=True)


def _two_axes(x: Vector, y: Vector) -> tuple[Step, ...]:
    """The rotation with its x axis along x and its y axis as near to y as that allows."""
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
