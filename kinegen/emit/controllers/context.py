"""What the templates of controllers are given: finished strings."""

from __future__ import annotations

import re
from dataclasses import dataclass
from fractions import Fraction
from xml.sax.saxutils import escape

from kinegen.emit.controllers.controller import Controller
from kinegen.emit.controllers.follow import Follow, follow_of
from kinegen.emit.controllers.machine import Machine, machine_of
from kinegen.emit.kernels import Kernels, joint_lines, provenance
from kinegen.emit.reals import Real
from kinegen.naming import c_file, comment_text, macro, prefix, selftest_file, vectors_file

_UNLIMITED = 1e6
"""A limit, in degrees or millimetres, for a joint that the file gives none."""


@dataclass(frozen=True, slots=True)
class ControlledJoint:
    """A joint as templates print it; numbers are in machine units but where `scale` leads out of them."""

    index: int
    name: str
    turns: bool
    unit: str
    scale: str
    kind: str
    low: str
    high: str
    home: str
    home_kernel: str
    home_float: str


@dataclass(frozen=True, slots=True)
class ControllerContext:
    """What every template of a controller is given, as `m`.

    Attributes:
        name: The robot.
        upper: Its name in macros.
        version: Its version.
        provenance: What the files were made from.
        description: The line of the robot file.
        markdown: The same for Markdown.
        title: The controller.
        real: Number type of the kernels.
        prefix: What C names of the kernels begin with.
        dof: Macro of the number of joints.
        header: Header of the kernels.
        sources: C sources besides the glue.
        objects: What the compiler makes of the sources of the kernel.
        selftests: Files of the self-test.
        selftest: The program that runs it.
        follow: The inverse that follows a path.
        joints: The joints.
        joint_lines: The joint vector in words.
        coordinates: Axes of the world.
        words: Their places in it, counting x, y, z, a, b, c.
        length: The file's length unit.
        xml: The description for XML.
        millimetres: Millimetres in it, as a literal.
        metres: Metres in it, as a literal.
        tilt: Angles a and b of the tool in radians, as literals.
        reach: The reach in millimetres.
        home: x, y, z of the tool at home in millimetres.
        step: About a twentieth of the reach in millimetres, for moves of the example.
        half_step: Half of it.
        feed: A feed in millimetres a minute at which that takes one and a half seconds.
    """

    name: str
    upper: str
    version: str
    provenance: str
    description: str
    markdown: str
    title: str
    real: str
    prefix: str
    dof: str
    header: str
    sources: tuple[str, ...]
    objects: tuple[str, ...]
    selftests: tuple[str, ...]
    selftest: str
    follow: Follow
    joints: tuple[ControlledJoint, ...]
    joint_lines: tuple[str, ...]
    coordinates: str
    words: tuple[int, ...]
    length: str
    xml: str
    millimetres: str
    metres: str
    tilt: tuple[str, str]
    reach: str
    home: tuple[str, ...]
    step: str
    half_step: str
    feed: str


def controller_context(kernels: Kernels, controller: Controller) -> ControllerContext:
    """Everything the templates lay out.

    Args:
        kernels: The robot and its programs.
        controller: Who moves it.

    Raises:
        KinegenError: If no such controller can move it.
    """
    robot, real = kernels.robot, controller.reals[0]
    machine = machine_of(kernels, controller)
    follow = follow_of(kernels, machine, real)
    step = float(f"{machine.reach * machine.millimetres / 20:.1g}")
    return ControllerContext(
        name=robot.name,
        upper=robot.name.upper(),
        version=robot.release,
        provenance=provenance(robot),
        description=comment_text(robot.description),
        markdown=re.sub(r"([\\`*_{}\[\]<>#|])", r"\\\1", comment_text(robot.description)),
        title=controller.makers_name,
        real=real.value,
        prefix=prefix(robot.name, real),
        dof=macro(robot.name, "DOF"),
        header=c_file(robot.name, "h", real),
        sources=(c_file(robot.name, "c", real), follow.source),
        objects=tuple(name.removesuffix(".c") + ".o" for name in (c_file(robot.name, "c", real), follow.source)),
        selftests=(selftest_file(robot.name, real), vectors_file(robot.name, real)),
        selftest=selftest_file(robot.name, real).removesuffix(".c"),
        follow=follow,
        joints=_joints(machine, real),
        joint_lines=joint_lines(robot),
        coordinates=machine.coordinates,
        words=tuple(map("XYZABC".index, machine.coordinates)),
        length=robot.units.length,
        xml=escape(comment_text(robot.description) or robot.name).replace("--", "- -"),
        millimetres=real.literal(Fraction(machine.millimetres)),
        metres=real.literal(Fraction(machine.millimetres) / 1000),
        tilt=(real.literal(Fraction(machine.tilt[0])), real.literal(Fraction(machine.tilt[1]))),
        reach=_short(machine.reach * machine.millimetres),
        home=tuple(map(_short, machine.home[:3])),
        step=_short(step),
        half_step=_short(step / 2),
        feed=_short(step * 40),
    )


def _joints(machine: Machine, real: Real) -> tuple[ControlledJoint, ...]:
    return tuple(
        ControlledJoint(
            index=joint.index,
            name=joint.name,
            turns=joint.turns,
            unit=joint.unit,
            scale=real.literal(Fraction(joint.scale)),
            kind="ANGULAR" if joint.turns else "LINEAR",
            low=_short(-_UNLIMITED if joint.low is None else joint.low),
            high=_short(_UNLIMITED if joint.high is None else joint.high),
            home=_short(joint.home),
            home_kernel=Real.DOUBLE.literal(Fraction(joint.home) * Fraction(joint.scale)),
            home_float=Real.FLOAT.literal(Fraction(joint.home) * Fraction(joint.scale)),
        )
        for joint in machine.joints
    )


def _short(number: float) -> str:
    """A number with six digits after the point, without zeros at its end."""
    text = f"{number:.6f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text
