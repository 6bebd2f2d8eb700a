"""The kernels of a page: the programs of a robot, and the JavaScript that the emitter prints of them."""

from __future__ import annotations

import re

from kinegen.emit.javascript.module import emit_javascript
from kinegen.emit.kernels import Kernels
from kinegen.errors import KinegenError
from kinegen.outputs import Kind, Quantity
from kinegen.pipeline import lower_robot
from kinegen.robot.model import Robot

NEEDED = (Quantity.POSE, Quantity.FRAMES, Quantity(Kind.JACOBIAN))
"""What every page evaluates."""

_EXPORT = re.compile(r"^export (?=(?:const|function) (\w+))", re.MULTILINE)


def page_kernels(robot: Robot, outputs: tuple[Quantity, ...] = ()) -> Kernels:
    """The programs of a page.

    Args:
        robot: The robot.
        outputs: Quantities that a user asks for; an inverse and those of actuators are added where there are any.

    Returns:
        The robot with its programs, each quantity once.

    Raises:
        KinegenError: If a quantity that was asked for does not exist, or is a search, for which there is no JavaScript.
    """
    wanted = dict.fromkeys((*NEEDED, *outputs))
    wanted |= dict.fromkeys(quantity for quantity in _possible(robot) if quantity not in wanted)
    if any(quantity.kind is Kind.NUMERIC_INVERSE for quantity in wanted):
        raise KinegenError("numeric_inverse is not an output of a page, which has its own search", robot.source)
    if any(quantity.kind is Kind.INVERSE_TRACKER for quantity in wanted):
        raise KinegenError("inverse_tracker is not an output of a page: it is in C and Python alone", robot.source)
    if any(quantity.kind is Kind.COMPLETE_INVERSE for quantity in wanted):
        raise KinegenError("complete_inverse is not an output of a page: it is in C and Python alone", robot.source)
    if any(quantity.kind is Kind.REDUNDANCY_RANGE for quantity in wanted):
        raise KinegenError("redundancy_range is not an output of a page: it is in C and Python alone", robot.source)
    if robot.redundancy and Quantity(Kind.INVERSE) in wanted:
        reason = f"a page has no input for the redundancy ({robot.redundancy}); it searches for joint values"
        raise KinegenError(f"inverse: {reason}", robot.source)
    return lower_robot(robot, tuple(wanted))


def _possible(robot: Robot) -> list[Quantity]:
    """The quantities that only some robots have."""
    from kinegen.symbolic.inverse.family import Family
    from kinegen.symbolic.inverse.recognise import recognise

    family = None if robot.redundancy else recognise(robot)
    # That of an arm which is only nearly of a family has too many statements for a page.
    has_inverse = isinstance(family, Family) and family.defect is None
    found = [Quantity(Kind.INVERSE)] if has_inverse else []
    if robot.actuators.readings:
        found.append(Quantity(Kind.ACTUATORS_TO_JOINTS))
        back = Quantity(Kind.JOINTS_TO_ACTUATORS)
        try:
            lower_robot(robot, (back,))
        except KinegenError:
            return found
        found.append(back)
    return found


def kernel_script(kernels: Kernels) -> str:
    """The module of a robot as one expression of a classic script: an object with what the module exports.

    Args:
        kernels: The robot and its programs.
    """
    module = emit_javascript(kernels)[f"{kernels.robot.name}.js"]
    exported = _EXPORT.findall(module)
    return f"(() => {{\n{_EXPORT.sub('', module)}\nreturn {{ {', '.join(exported)} }};\n}})()"
