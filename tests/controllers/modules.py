"""Modules for LinuxCNC, compiled with the headers that the contract gives, and called as motion calls them."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.controllers.controller import Controller
from kinegen.backends.controllers.kernel_calls import needed
from kinegen.backends.controllers.machine_tool import Mill, mill_for
from kinegen.backends.controllers.project import emit_controller
from kinegen.backends.files import emit_files
from kinegen.backends.scalar_types import ScalarType
from kinegen.derive.dispatch import derive
from kinegen.ir.lower import lower, runtime_defaults
from kinegen.model.robot import Robot
from kinegen.support.files.write import write_files
from kinegen.verify import reference
from kinegen.verify.vectors import compute_vectors
from tests.controllers.contract import headers
from tests.controllers.packages import FLAGS, need, run

Joints = Sequence[float] | NDArray[np.float64]
Numbers = NDArray[np.float64]
World = ctypes.Array[ctypes.c_double]


def write_linuxcnc(place: Path, robot: Robot, *, solved: bool) -> Path:
    """Write the package of a robot and return its folder.

    Args:
        place: The folder around it.
        robot: The robot.
        solved: Whether it has a closed-form inverse.
    """
    mill = mill_for(robot, solved=solved)
    quantities = needed(robot, Controller.LINUXCNC) if mill is None else mill.quantities
    programs = tuple(lower(derive(robot, quantity)) for quantity in quantities)
    kernels = RobotPrograms(robot, programs, runtime_defaults(robot))
    files = emit_files(kernels, (ScalarType.DOUBLE,), compute_vectors(kernels)).files
    write_files(place / robot.name, emit_controller(kernels, files, Controller.LINUXCNC))
    return place / robot.name


class _Pin(ctypes.Structure):
    _fields_ = (("name", ctypes.c_char * 48), ("number", ctypes.c_double), ("bit", ctypes.c_ubyte))


class Module:
    """A compiled module; joints and worlds in its units.

    Args:
        folder: The package.
        change: A text of the glue and what it is replaced by.
        flags: Further flags of the compiler.
    """

    def __init__(self, folder: Path, change: tuple[str, str] = ("", ""), flags: Sequence[str] = ()) -> None:
        need("gcc")
        name = folder.name
        glue, library = folder / f"{name}_glue.c", folder / "module.so"
        assert change[0] in glue.read_text()
        glue.write_text(glue.read_text().replace(*change) if change[0] else glue.read_text())
        write_files(folder / "standins", headers("linuxcnc"))
        sources = list(folder.glob("*.c"))
        options = [*FLAGS, "-Wmissing-prototypes", "-shared", "-fPIC", *flags]
        run(["gcc", *options, f"-I{folder / 'standins'}", f"-I{folder}", *sources, "-lm", "-o", library], folder)
        self.library = ctypes.CDLL(str(library))
        self.name = name
        self.started = self.library.rtapi_app_main()
        self._pins = (_Pin * 64).in_dll(self.library, "standin_pins")

    @property
    def pins(self) -> dict[str, _Pin]:
        """The pins by name."""
        count = ctypes.c_int.in_dll(self.library, "standin_count").value
        return {pin.name.decode(): pin for pin in self._pins[:count]}

    def set(self, pin: str, value: float) -> None:
        """Set a pin of the module."""
        self.pins[f"{self.name}_kins.{pin}"].number = value

    @property
    def message(self) -> str:
        """The last message to the operator, which is taken back."""
        buffer = (ctypes.c_char * 512).in_dll(self.library, "standin_message")
        text = buffer.value.decode()
        buffer.value = b""
        return text

    def world(self, joints: Joints, world: World | None = None) -> Numbers:
        """The world (9,) of joint values."""
        result, found = self.forward(joints, world)
        assert result == 0
        return np.array(found)

    def forward(self, joints: Joints, world: World | None = None) -> tuple[int, Numbers]:
        """The result of the forward kinematics, and the world."""
        world = (ctypes.c_double * 9)() if world is None else world
        result = self.library.kinematicsForward(_joints(joints), world, None, None)
        return result, np.array(world)

    def inverse(self, world: Joints | World, beside: Joints) -> tuple[int, Numbers]:
        """The result of the inverse kinematics for a world next to joints, and what they become."""
        place = world if isinstance(world, ctypes.Array) else (ctypes.c_double * 9)(*map(float, world))
        joints = _joints(beside)
        result = self.library.kinematicsInverse(place, joints, None, None)
        return result, np.array(joints[: len(beside)])

    def joints(self, world: Joints | World, beside: Joints) -> Numbers:
        """The joint values of a world, next to others."""
        result, joints = self.inverse(world, beside)
        assert result == 0, self.message
        return joints


def _joints(joints: Joints) -> ctypes.Array[ctypes.c_double]:
    return (ctypes.c_double * 16)(*map(float, joints))


def turn(axis: int, degrees: float) -> Numbers:
    """A rotation about x, y or z as a (4, 4) matrix."""
    sine, cosine = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
    made = np.eye(4)
    first, second = (axis + 1) % 3, (axis + 2) % 3
    made[first, first] = made[second, second] = cosine
    made[second, first], made[first, second] = sine, -sine
    return made


def shift(x: float, y: float, z: float) -> Numbers:
    """A translation as a (4, 4) matrix."""
    made = np.eye(4)
    made[:3, 3] = x, y, z
    return made


def machine_vector(mill: Mill, robot: Robot, joints: Joints) -> Numbers:
    """The joint vector of a machine tool in mm from LinuxCNC's joints."""
    q = np.zeros(robot.dof)
    for value, place in zip(joints, mill.order, strict=True):
        q[place] = math.radians(value) if mill.letters[place] in "ABC" else value
    return q


def zero_pose(robot: Robot) -> Numbers:
    """The pose (4, 4) of a chain with all joints at 0."""
    return np.asarray(reference.pose(robot, np.zeros((1, robot.dof)))[0, 0])
