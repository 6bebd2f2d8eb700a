"""Equalities of MJCF: a joint that follows another one becomes a follower; what closes a loop is refused."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from fractions import Fraction

from kinegen.errors import quote
from kinegen.formats import xml
from kinegen.formats.links.tree import Joint, Mimic, Motion
from kinegen.formats.links.values import Values
from kinegen.formats.messages import expected, fail
from kinegen.robot.expressions import Expression, Number, add, multiply, negate

_LOOPS = ("connect", "weld")
_LINEAR = "it follows {} by a polynomial that is not linear; kinegen takes linear followers: remove the equality"


def with_equalities(
    root: xml.Element,
    joints: tuple[Joint, ...],
    above: Mapping[str, str],
    mocap: Collection[str],
    values: Values,
) -> tuple[tuple[Joint, ...], tuple[str, ...]]:
    """Apply the equalities of a model.

    Args:
        root: The element at the top.
        joints: The joints so far.
        above: The last joint above each body.
        mocap: Bodies that are moved from outside, whose welds close no loop.
        values: Reads numbers.

    Returns:
        The joints, and notes on what was left out.
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
            _refuse_loop(element, known, above, mocap, notes)
        elif isinstance(element.tag, str):
            notes.append(f"line {xml.line(element)}: the equality <{xml.name_of(element)}> is left out")
    return tuple(known[joint.name] for joint in joints), tuple(notes)


def _follower(element: xml.Element, known: Mapping[str, Joint], values: Values) -> Joint:
    names = [xml.needed(element, "joint1"), str(element.get("joint2", ""))]
    for name in names:
        if name and name not in known:
            fail(f"equality: there is no joint {quote(name)} {expected(name, known)}", xml.line(element))
    joint = known[names[0]]
    with values.of(names[0], f"equality of joint {quote(names[0])}", xml.line(element)):
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


def _refuse_loop(
    element: xml.Element,
    known: dict[str, Joint],
    above: Mapping[str, str],
    mocap: Collection[str],
    notes: list[str],
) -> None:
    """Mark the joint above the body that an equality holds, so that the part with it is refused."""
    bodies = [str(element.get(key, "")) for key in ("body1", "body2")]
    if any(body in mocap for body in bodies):
        notes.append(f"line {xml.line(element)}: the {xml.name_of(element)} to a mocap body is left out")
        return
    held = next((body for body in reversed(bodies) if body in above), None)
    if held is None:
        fail(f"equality: <{xml.name_of(element)}> names no body of the model", xml.line(element))
    joint = known[above[held]]
    why = f"carries body {quote(held)}, which <{xml.name_of(element)}> on line {xml.line(element)} holds elsewhere"
    known[joint.name] = replace(joint, refused=f"{why}; closed loops cannot be carried: remove it, or name other tips")
