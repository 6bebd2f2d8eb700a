"""The inverse that follows a path: the numbers of its C text, which every controller's glue calls.

What it adds to the solution nearest to the present joints: at a singularity, where the target leaves joints open, they
keep their values; and a short step never moves a joint far.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from kinegen.emit.controllers.machine import Machine
from kinegen.emit.kernels import Kernels, provenance
from kinegen.emit.nearest import NAME
from kinegen.emit.reals import Real
from kinegen.naming import c_file, function, guard, macro, prefix
from kinegen.outputs import POSE_AND_JACOBIAN, Quantity

_AMOUNTS = {Real.DOUBLE: ("3e-8", "3e-6"), Real.FLOAT: ("3e-5", "3e-4")}
"""How far a target may be moved to keep joints that it leaves open, in radians or parts of the reach: the least that is
surely beyond the thresholds of the kernels, and the most that no machine notices."""

_SINGULAR = {Real.DOUBLE: "1e-9", Real.FLOAT: "1e-5"}
"""Product of squared sines between the columns of the Jacobian below which a joint vector counts as singular."""

_LEAP = "0.2"
"""A joint that moves further than so many radians, or such a part of the reach, may have leapt."""

_SHORT = "0.02"
"""A step of the tool that is shorter than this, in radians and parts of the reach, must not make a joint leap."""


@dataclass(frozen=True, slots=True)
class Follow:
    """What `controllers/_follow.*.jinja` are given, as `f`.

    Attributes:
        name: The function.
        header: Its header.
        source: Its source.
        guard: Include guard of the header.
        kernel: Header of the kernels.
        provenance: What the files were made from.
        real: Number type.
        dof: Macro of the number of joints.
        upper: What macros begin with.
        fk: The pose.
        fk_jacobian: The pose with its Jacobian.
        nearest: The solution nearest to a joint vector.
        rows: Rows of the Jacobian that count: 3 for a position, 6 for a pose.
        scales: For each joint what a radian, or the reach, is in its variable.
        reach: The reach.
        amounts: How far targets are moved at singularities.
        singular: What counts as singular.
        leap: What counts as a leap.
        short: What counts as a short step.
        zero: 0 as a number of the type.
        one: 1 likewise.
        half: 1/2 likewise.
        tiny: What a squared length is taken for zero below.
        length: The length unit.
    """

    name: str
    header: str
    source: str
    guard: str
    kernel: str
    provenance: str
    real: str
    dof: str
    upper: str
    fk: str
    fk_jacobian: str
    nearest: str
    rows: int
    scales: tuple[str, ...]
    reach: str
    amounts: tuple[str, ...]
    singular: str
    leap: str
    short: str
    zero: str
    one: str
    half: str
    tiny: str
    length: str


def follow_of(kernels: Kernels, machine: Machine, real: Real) -> Follow:
    """The numbers of one arm.

    Args:
        kernels: The robot and its programs.
        machine: The arm as a controller sees it.
        real: The number type.
    """
    robot = kernels.robot.name
    stem = prefix(robot, real)

    def number(text: str) -> str:
        return real.literal(Fraction(text))

    reach = real.literal(Fraction(machine.reach))
    header = f"{stem}_follow.h"
    return Follow(
        name=f"{stem}_follow",
        header=header,
        source=f"{stem}_follow.c",
        guard=guard(header),
        kernel=c_file(robot, "h", real),
        provenance=provenance(kernels.robot),
        real=real.value,
        dof=macro(robot, "DOF"),
        upper=stem.upper(),
        fk=function(robot, Quantity.POSE.function, real),
        fk_jacobian=function(robot, POSE_AND_JACOBIAN.function, real),
        nearest=function(robot, NAME, real),
        rows=3 if machine.coordinates == "XYZ" else 6,
        scales=tuple(number("1") if joint.turns else reach for joint in machine.joints),
        reach=reach,
        amounts=tuple(map(number, _AMOUNTS[real])),
        singular=number(_SINGULAR[real]),
        leap=number(_LEAP),
        short=number(_SHORT),
        zero=number("0"),
        one=number("1"),
        half=number("0.5"),
        tiny=number("1e-30"),
        length=kernels.robot.units.length,
    )
