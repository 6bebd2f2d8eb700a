"""What LinuxCNC after 2.9 asks of a kinematics module in addition: the frames of tool and work, and the Jacobian.

The module is compiled against stand-ins of the headers, with and without the macros of the later ones.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from kinegen import reference
from kinegen.emit.controllers.controller import Controller
from kinegen.emit.controllers.home import samples
from tests.controllers.packages import FLAGS, HERE, kernels, machine, need, run, write_package

pytestmark = pytest.mark.controllers

STANDIN = HERE / "standins" / "linuxcnc"
FRAMES = ("-DSTANDIN_FRAMES",)
JACOBIAN = (*FRAMES, "-DSTANDIN_JACOBIAN")
ARMS = ("puma560", "ur5", "scara4", "scara", "palletiser3", "puma560_mm", "leaning6")
SINGULAR = {
    "puma560": [20.0, -50, 60, 30, 0, 10],
    "ur5": [20.0, -50, 60, 30, 0, 10],
    "scara4": [20.0, 0, 100, 30],
    "palletiser3": [20.0, 40, 0],
}
"""Joint values in degrees and mm at which the arm is stretched out, or two axes of its wrist are parallel."""

Joints = Sequence[float] | NDArray[np.float64]


class Module:
    """A compiled module; joints and worlds in its units."""

    def __init__(self, place: Path, name: str, later: Sequence[str], change: tuple[str, str] = ("", "")) -> None:
        need("gcc")
        folder = write_package(place, name, Controller.LINUXCNC)
        glue, library = folder / f"{name}_glue.c", folder / "module.so"
        assert change[0] in glue.read_text()
        glue.write_text(glue.read_text().replace(*change) if change[0] else glue.read_text())
        sources = [glue, folder / f"{name}.c", folder / f"{name}_follow.c"]
        flags = [*FLAGS, "-Wmissing-prototypes", "-shared", "-fPIC", *later]
        run(["gcc", *flags, f"-I{STANDIN}", f"-I{folder}", *sources, "-lm", "-o", library], folder)
        self.library = ctypes.CDLL(str(library))
        self.name, self.dof = name, kernels(name).robot.dof

    def world(self, joints: Joints, before: Joints = ()) -> NDArray[np.float64]:
        """The world (9,) of joint values, its angles next to those of the one before."""
        world = (ctypes.c_double * 9)(*map(float, before))
        assert self.library.kinematicsForward(self._joints(joints), world, None, None) == 0
        return np.array(world)

    def joints(self, world: Joints, beside: Joints) -> NDArray[np.float64]:
        """The joint values (J,) of a world, next to others."""
        joints = self._joints(beside)
        assert self.library.kinematicsInverse((ctypes.c_double * 9)(*map(float, world)), joints, None, None) == 0
        return np.array(joints[: self.dof])

    def frame(self, function: str, joints: Joints) -> tuple[int, NDArray[np.float64]]:
        """The result of `kinematicsToolFrame` or `kinematicsWorkFrame`, and its rotation (3, 3)."""
        columns = (ctypes.c_double * 9)()
        result = getattr(self.library, function)(self._joints(joints), columns, None)
        return result, np.array(columns).reshape(3, 3).T

    def jacobian(self, joints: Joints, world: Joints) -> tuple[int, NDArray[np.float64]]:
        """The result of `kinematicsJacobian`, and its rates (16, 9), which hold 7 where nothing is written."""
        rates = (ctypes.c_double * 144)(*[7.0] * 144)
        result = self.library.kinematicsJacobian(
            self._joints(joints), (ctypes.c_double * 9)(*map(float, world)), rates, None
        )
        return result, np.array(rates).reshape(16, 9)

    def _joints(self, joints: Joints) -> ctypes.Array[ctypes.c_double]:
        return (ctypes.c_double * 16)(*map(float, joints))


def vectors(name: str, count: int = 25) -> list[NDArray[np.float64]]:
    """Joint values (J,) in degrees and mm, away from round angles."""
    scales = np.array([joint.scale for joint in machine(name, Controller.LINUXCNC).joints])
    return [(np.asarray(q) + 0.013) / scales for q in samples(kernels(name).robot, count)]


def words(name: str) -> list[int]:
    """Columns of the words that the arm moves."""
    return ["XYZABC".index(letter) for letter in machine(name, Controller.LINUXCNC).coordinates]


def compare_rates(module: Module) -> None:
    """The Jacobian is the derivative of the inverse, by differences of the module's own inverse and forward."""
    moved, dof, step = words(module.name), module.dof, 1e-3
    compared = 0
    for joints in vectors(module.name):
        world = module.world(joints)
        result, rates = module.jacobian(joints, world)
        assert result == 0
        inner = np.ix_(range(dof), moved)
        outside = rates.copy()
        outside[inner] = 0.0
        assert not outside.any()
        ahead = np.array([module.world(joints + step * unit, world) for unit in np.eye(dof)])
        behind = np.array([module.world(joints - step * unit, world) for unit in np.eye(dof)])
        slopes = ((ahead - behind) / (2 * step)).T[moved]
        error = 1e-7 * (1 + np.abs(rates[inner]).max()) * (1 + np.abs(slopes).max())
        np.testing.assert_allclose(rates[inner] @ slopes, np.eye(dof), atol=error)
        if np.abs(rates[inner]).max() < 10:  # nearer to singularities differences of the inverse are coarse
            compared += 1
            np.testing.assert_allclose(rates[:dof, moved], differences(module, joints, world), atol=1e-7, rtol=1e-7)
    assert compared > 10


def differences(module: Module, joints: Joints, world: NDArray[np.float64], step: float = 2e-3) -> NDArray[np.float64]:
    """Rates (J, words) of the joints from five-point differences of the inverse."""
    columns = []
    for column in words(module.name):
        unit = step * np.eye(9)[column]
        there, back, twice, behind = (module.joints(world + k * unit, joints) for k in (1, -1, 2, -2))
        columns.append((8 * (there - back) - (twice - behind)) / (12 * step))
    return np.array(columns).T


@pytest.mark.parametrize("name", ARMS)
def test_the_jacobian_is_the_derivative_of_the_inverse(name: str, tmp_path: Path) -> None:
    compare_rates(Module(tmp_path, name, JACOBIAN))


@pytest.mark.parametrize("name", ARMS)
def test_the_frame_of_the_tool_is_the_pose_turned_over(name: str, tmp_path: Path) -> None:
    compare_frames(Module(tmp_path, name, FRAMES))


def compare_frames(module: Module) -> None:
    """The axis of the tool leads from its tip to the holder, against z of the flange; the work does not turn."""
    scales = np.array([joint.scale for joint in machine(module.name, Controller.LINUXCNC).joints])
    for joints in vectors(module.name):
        result, frame = module.frame("kinematicsToolFrame", joints)
        pose = reference.pose(kernels(module.name).robot, [joints * scales])[0, 0]
        assert result == 0
        np.testing.assert_allclose(frame, pose[:3, :3] @ np.diag([1, -1, -1]), atol=1e-14)
        assert np.linalg.det(frame) > 0
        level, work = module.frame("kinematicsWorkFrame", joints)
        assert level == 0
        np.testing.assert_array_equal(work, np.eye(3))


@pytest.mark.parametrize("name", ["puma560", "scara4"])
def test_where_the_world_has_lost_an_angle_the_jacobian_has_an_answer(name: str, tmp_path: Path) -> None:
    """With b at a quarter turn, or the tool of a SCARA straight down, nothing is wrong with the arm."""
    module = Module(tmp_path, name, JACOBIAN)
    world = module.world(vectors(name)[3])
    if name == "puma560":
        world[4] = 90.0
    joints = module.joints(world, vectors(name)[3])

    result, rates = module.jacobian(joints, world)

    assert result == 0
    expected = differences(module, joints, world)
    np.testing.assert_allclose(rates[: module.dof, words(name)], expected, atol=1e-7, rtol=1e-7)


@pytest.mark.parametrize("name", SINGULAR)
def test_a_singular_arm_has_no_jacobian(name: str, tmp_path: Path) -> None:
    module = Module(tmp_path, name, JACOBIAN)
    joints = np.array(SINGULAR[name])

    result, rates = module.jacobian(joints, module.world(joints))

    assert result == -1
    assert (rates == 7.0).all()
    assert module.frame("kinematicsToolFrame", joints)[0] == 0


@pytest.mark.parametrize("name", ["puma560", "ur5", "scara4", "palletiser3"])
@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
def test_a_joint_that_is_not_a_number_is_an_error(name: str, wrong: float, tmp_path: Path) -> None:
    module = Module(tmp_path, name, JACOBIAN)
    for k in range(module.dof):
        joints = vectors(name)[1].copy()
        world = module.world(joints)
        joints[k] = wrong

        result, rates = module.jacobian(joints, world)

        assert result == -1
        assert (rates == 7.0).all()
        result, frame = module.frame("kinematicsToolFrame", joints)
        assert result == -1
        assert not frame.any()


@pytest.mark.parametrize("wrong", [math.nan, math.inf])
@pytest.mark.parametrize("place", [3, 4, 5])
def test_a_world_that_is_not_a_number_has_no_jacobian(place: int, wrong: float, tmp_path: Path) -> None:
    module = Module(tmp_path, "puma560", JACOBIAN)
    joints = vectors("puma560")[1]
    world = module.world(joints)
    world[place] = wrong

    assert module.jacobian(joints, world)[0] == -1


@pytest.mark.parametrize("later", [(), FRAMES, JACOBIAN], ids=["2.9", "frames", "jacobian"])
@pytest.mark.parametrize("name", ["puma560", "scara4", "scara"])
def test_a_module_has_what_its_headers_ask_for(name: str, later: tuple[str, ...], tmp_path: Path) -> None:
    library = Module(tmp_path, name, later).library

    assert hasattr(library, "kinematicsInverse")
    assert (
        hasattr(library, "kinematicsToolFrame") == hasattr(library, "kinematicsWorkFrame") == ("FRAMES" in str(later))
    )
    assert hasattr(library, "kinematicsJacobian") == ("JACOBIAN" in str(later))


@pytest.mark.parametrize(
    "change",
    [
        ("twists[5][3] = -sin(b)", "twists[5][3] = sin(b)"),
        ("twists[3][4] = -sin(c)", "twists[3][4] = -sin(b)"),
        ("twists[i][i] = 1.0 /", "twists[i][i] = 1.1 /"),
        ("rates[i][k] * scales[i] * machine[i]", "rates[i][k] * scales[i]"),
        ("rates[row][column] -= part", "rates[row][column] += part"),
        ("* rows[row]) + k]", "* row) + (5 - k)]"),
        ("rot->y.x = -pose[1]", "rot->y.x = pose[1]"),
        ("rot->x.y = pose[4]", "rot->x.y = pose[1]"),
        ("{ 0.0, 1.0, 0.0 }, { 0.0, 0.0, 1.0 }", "{ 0.0, -1.0, 0.0 }, { 0.0, 0.0, -1.0 }"),
    ],
    ids=["sign", "angle", "length", "unit", "elimination", "column", "reflection", "transposed", "work"],
)
def test_an_altered_module_is_noticed(change: tuple[str, str], tmp_path: Path) -> None:
    module = Module(tmp_path, "puma560", JACOBIAN, change)
    with pytest.raises(AssertionError):  # noqa: PT012 - one of the two
        compare_rates(module)
        compare_frames(module)
