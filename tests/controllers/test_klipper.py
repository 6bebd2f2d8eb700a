"""The Klipper helper and class against stand-ins of the interface: steppers along moves, refusals, installation."""

from __future__ import annotations

import ast
import importlib.util
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import cffi
import numpy as np
import pytest

from kinegen import reference
from kinegen.emit.controllers.controller import Controller
from tests.controllers.packages import FLAGS, HERE, kernels, machine, need, run, write_package

pytestmark = pytest.mark.controllers

STANDIN = HERE / "standins" / "klipper"
ARMS = ("scara", "palletiser3", "anthropomorphic_arm")

DECLARED = """
    struct coord { double x, y, z; };
    struct move { struct coord start, speed; };
    struct stepper_kinematics {
        double commanded_pos; int active_flags;
        double (*calc_position_cb)(struct stepper_kinematics *, struct move *, double);
    };
    void free(void *);
"""


class RefusedError(Exception):
    """What a move raises that is refused."""


def prototypes(folder: Path) -> str:
    """What the script of a package adds to Klipper's declarations."""
    return (folder / "install.sh").read_text().split('"""')[1]


def compiled(place: Path, name: str, change: tuple[str, str] = ("", "")) -> tuple[cffi.FFI, Any, Path]:
    """The helper, compiled with the stand-in and opened as Klipper opens its helpers."""
    need("gcc")
    folder = write_package(place, name, Controller.KLIPPER)
    helper = folder / "chelper" / f"kin_{name}.c"
    assert change[0] in helper.read_text()
    helper.write_text(helper.read_text().replace(*change) if change[0] else helper.read_text())
    library = place / "helper.so"
    sources = sorted((folder / "chelper").glob("*.c"))
    flags = [flag for flag in FLAGS if flag != "-std=c99"]
    run(["gcc", *flags, "-std=gnu11", "-shared", "-fPIC", f"-I{STANDIN}", *sources, "-o", library], place)
    ffi = cffi.FFI()
    ffi.cdef(DECLARED + prototypes(folder))
    return ffi, ffi.dlopen(str(library)), folder


class Rail:
    """A stand-in for a rail with one stepper."""

    def __init__(self, section: str, *, units_in_radians: bool, **_: object) -> None:
        self.name, self.turns = section, units_in_radians
        self.ffi: Any = None
        self.lib: Any = None

    def setup_itersolve(self, function: str, *arguments: int) -> None:
        """Make the stepper's kinematics, as Klipper does."""
        self.ffi, self.lib = sys.modules["chelper"].get_ffi()
        self.sk = self.ffi.gc(getattr(self.lib, function)(*arguments), self.lib.free)

    def get_steppers(self) -> list[Rail]:
        """Itself."""
        return [self]

    def get_name(self) -> str:
        """The section of the configuration."""
        return self.name

    def set_trapq(self, _trapq: object) -> None:
        """Nothing."""

    def generate_steps(self, _time: float) -> None:
        """Nothing."""

    def set_position(self, position: Any) -> None:
        """Ask where the stepper is."""
        self.at = self.along(position[:3], [0.0] * 3, 0.0)

    def along(self, start: Any, speed: Any, time: float) -> float:
        """Where the stepper is on a move."""
        move = self.ffi.new("struct move *", [tuple(start), tuple(speed)])
        return float(self.sk.calc_position_cb(self.sk, move, time))


@pytest.fixture
def klipper(monkeypatch: pytest.MonkeyPatch) -> Callable[[Path, str], Any]:
    """Makes the class of a package among stand-ins of Klipper's modules."""

    def make(place: Path, name: str, change: tuple[str, str] = ("", "")) -> Any:
        ffi, lib, folder = compiled(place, name, change)
        helper, stepper = ModuleType("chelper"), ModuleType("stepper")
        helper.get_ffi = lambda: (ffi, lib)  # type: ignore[attr-defined]
        stepper.PrinterRail = Rail  # type: ignore[attr-defined]
        monkeypatch.setitem(sys.modules, "chelper", helper)
        monkeypatch.setitem(sys.modules, "stepper", stepper)
        spec = importlib.util.spec_from_file_location(f"klippy_{name}", folder / f"{name}.py")
        assert spec
        assert spec.loader
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        toolhead = SimpleNamespace(get_trapq=lambda: None)
        printer = SimpleNamespace(register_event_handler=lambda *_: None)
        config = SimpleNamespace(getsection=lambda section: section, get_printer=lambda: printer)
        return module.load_kinematics(toolhead, config)

    return make


def move(start: Any, end: Any) -> SimpleNamespace:
    """A move as the toolhead hands it out for a check."""
    axes = [b - a for a, b in zip(start, end, strict=True)]
    return SimpleNamespace(
        start_pos=[*start, 0.0],
        end_pos=[*end, 0.0],
        axes_d=[*axes, 0.0],
        move_d=float(np.linalg.norm(axes)),
        move_error=RefusedError,
    )


def home(arm: Any, name: str) -> np.ndarray[Any, Any]:
    """Home the arm as Klipper's G28 does, and return the position."""
    taken: list[Any] = []
    state = SimpleNamespace(set_axes=lambda _: None, set_homed_position=taken.append)
    arm.home(state)
    arm.set_position(taken[0], "xyz")
    np.testing.assert_allclose(taken[0], machine(name, Controller.KLIPPER).home[:3], atol=1e-5)
    return np.array(taken[0])


@pytest.mark.parametrize("name", ARMS)
def test_steppers_follow_a_straight_move(name: str, klipper: Callable[..., Any], tmp_path: Path) -> None:
    arm, made = klipper(tmp_path, name), machine(name, Controller.KLIPPER)
    at = home(arm, name)
    speed = np.array([1.0, -0.6, 0.4]) * made.reach * made.millimetres / 40
    arm.check_move(move(at, at + speed))
    assert [rail.turns for rail in arm.rails] == [joint.turns for joint in made.joints]

    for time in [*np.linspace(0, 1, 101), *np.linspace(1, 0, 101)]:
        steppers = [rail.along(at, speed, float(time)) for rail in arm.rails]
        q = [s if joint.turns else s / made.millimetres for s, joint in zip(steppers, made.joints)]
        pose = reference.pose(kernels(name).robot, [q])[0, 0]
        np.testing.assert_allclose(pose[:3, 3] * made.millimetres, at + time * speed, atol=1e-6)
        found = arm.calc_position({rail.get_name(): s for rail, s in zip(arm.rails, steppers, strict=True)})
        np.testing.assert_allclose(found, at + time * speed, atol=1e-6)
    joints = [joint.home * joint.scale for joint in made.joints]
    back = [s if joint.turns else s / made.millimetres for s, joint in zip(steppers, made.joints)]
    np.testing.assert_allclose(back, joints, atol=1e-6)


@pytest.mark.parametrize("name", ["palletiser3", "scara"])
def test_moves_before_homing_and_out_of_reach_are_refused(
    name: str, klipper: Callable[..., Any], tmp_path: Path
) -> None:
    arm = klipper(tmp_path, name)
    at = np.array(machine(name, Controller.KLIPPER).home[:3])
    with pytest.raises(RefusedError, match="Must home axis first"):
        arm.check_move(move(at, at + 1))
    at = home(arm, name)
    with pytest.raises(RefusedError, match=f"{name}: out of reach, or beyond the limits of the joints"):
        arm.check_move(move(at, at + np.array([1e5, 0, 0])))
    arm.check_move(move(at, at + 1))
    assert arm.get_status(0.0) == {"homed_axes": "xyz"}
    arm.clear_homing_state("xyz")
    assert arm.get_status(0.0) == {"homed_axes": ""}


@pytest.mark.parametrize(
    "change",
    [("at.x, at.y, at.z, stepper", "at.y, at.x, at.z, stepper"), ("#define MILLIMETRES 1", "#define MILLIMETRES 2")],
)
def test_an_altered_helper_is_noticed(change: tuple[str, str], klipper: Callable[..., Any], tmp_path: Path) -> None:
    with pytest.raises((AssertionError, RefusedError)):
        test_steppers_follow_a_straight_move("palletiser3", lambda place, name: klipper(place, name, change), tmp_path)


def test_the_script_installs_into_a_checkout_once(tmp_path: Path) -> None:
    """A checkout of the same form: a list of sources and a list of declarations."""
    folder = write_package(tmp_path, "scara", Controller.KLIPPER)
    helper = tmp_path / "klipper" / "klippy" / "chelper"
    helper.mkdir(parents=True)
    (helper.parent / "kinematics").mkdir()
    (helper / "__init__.py").write_text(
        "SOURCE_FILES = ['trapq.c']\nHC_SOURCE_FILES = ['hub.c']\ndefs_one = 'a'\ndefs_all = [defs_one]\n"
    )

    for _ in range(2):
        run(["sh", folder / "install.sh", tmp_path / "klipper"], tmp_path)

    scope: dict[str, Any] = {}
    exec(compile(ast.parse((helper / "__init__.py").read_text()), "chelper", "exec"), scope)  # noqa: S102 - our own text
    assert scope["SOURCE_FILES"] == ["scara.c", "scara_follow.c", "kin_scara.c", "trapq.c"]
    assert len(scope["defs_all"]) == 2
    assert all((helper / name).exists() for name in scope["SOURCE_FILES"][:3])
    assert (helper.parent / "kinematics" / "scara.py").exists()
