"""The Klipper helper and class against stand-ins of the interface: steppers along moves, refusals, installation."""

from __future__ import annotations

import ast
import configparser
import importlib.util
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType, ModuleType, SimpleNamespace
from typing import Any

import cffi
import numpy as np
import pytest

from kinegen.backends.controllers.controller import Controller
from kinegen.backends.controllers.machine import Machine
from kinegen.model.robot import Robot
from kinegen.verify import reference
from tests.controllers import contract
from tests.controllers.packages import FLAGS, joints_at, kernels, machine, need, run, write_package
from tests.controllers.paths import with_parameter

pytestmark = pytest.mark.controllers

ARMS = ("scara", "palletiser3", "anthropomorphic_arm", "coupled3")

DECLARED = """
    struct coord { double x, y, z; };
    struct move { double print_time, move_t, start_v, half_accel; struct coord start_pos, axes_r; };
    struct stepper_kinematics {
        double step_dist, commanded_pos; int active_flags;
        double (*calc_position_cb)(struct stepper_kinematics *, struct move *, double);
    };
    void free(void *);
"""


class RefusedError(Exception):
    """What a move raises that is refused."""


def prototypes(folder: Path) -> str:
    """What the script of a package adds to Klipper's declarations."""
    return (folder / "install.sh").read_text().split('"""')[1]


_HELPERS: dict[str, Path] = {}
"""The compiled helpers by robot."""


def compiled(place: Path, name: str, change: tuple[str, str] = ("", "")) -> tuple[cffi.FFI, Any, Path]:
    """The helper, made once, and opened as Klipper opens its helpers; with one alteration of its text where asked."""
    need("gcc")
    folder = write_package(place, name, Controller.KLIPPER)
    library = place / "helper.so"
    if change[0] or name not in _HELPERS:
        _make_helper(folder, library, change)
        if not change[0]:
            _HELPERS[name] = library
    else:
        shutil.copy(_HELPERS[name], library)  # another file has variables of its own
    ffi = cffi.FFI()
    ffi.cdef(DECLARED + prototypes(folder))
    return ffi, ffi.dlopen(str(library)), folder


def _make_helper(folder: Path, library: Path, change: tuple[str, str]) -> None:
    helper, headers = folder / "chelper" / f"kin_{folder.name}.c", folder.parent / "headers"
    assert change[0] in helper.read_text()
    helper.write_text(helper.read_text().replace(*change) if change[0] else helper.read_text())
    headers.mkdir()
    for path, text in contract.headers("klipper").items():
        (headers / path).write_text(text)
    sources = sorted((folder / "chelper").glob("*.c"))
    flags = [flag for flag in FLAGS if flag != "-std=c99"]
    run(["gcc", *flags, "-std=gnu11", "-shared", "-fPIC", f"-I{headers}", *sources, "-o", library], folder.parent)


class Stepper:
    """What the contract names of a stepper: it is where its kinematics put it."""

    def __init__(self, name: str, *, turns: bool) -> None:
        self.name, self.turns = name, turns
        self.ffi, self.lib = sys.modules["chelper"].get_ffi()

    def setup_itersolve(self, function: str, *arguments: int) -> None:
        """Make the stepper's kinematics."""
        self.sk = self.ffi.gc(getattr(self.lib, function)(*arguments), self.lib.free)

    def get_name(self, *, short: bool = False) -> str:
        """The section of the configuration."""
        return self.name[8:] if short else self.name

    def set_trapq(self, _trapq: object) -> None:
        """Nothing."""

    def set_position(self, position: Any) -> None:
        """Be where these coordinates are."""
        self.at = self.along(position[:3], [0.0] * 3, 0.0)

    def get_commanded_position(self) -> float:
        """Where it is."""
        return self.at

    def along(self, start: Any, speed: Any, time: float) -> float:
        """Where the stepper is on a move at constant speed."""
        fast = float(np.linalg.norm(speed))
        way = np.array(speed) / (fast or 1.0)
        move = self.ffi.new("struct move *", {"start_v": fast, "move_t": 1e9})
        (move.start_pos.x, move.start_pos.y, move.start_pos.z), at = map(float, start), move.axes_r
        at.x, at.y, at.z = map(float, way)
        return float(self.sk.calc_position_cb(self.sk, move, time))


class Rail:
    """What the contract names of a rail with one stepper and a switch."""

    def __init__(self, section: Section, *, turns: bool) -> None:
        self.steppers, self.section = [Stepper(section.name, turns=turns)], section

    def get_steppers(self) -> list[Stepper]:
        """Its stepper."""
        return self.steppers

    def get_range(self) -> tuple[float, float]:
        """Where it may be."""
        return self.section.getfloat("position_min"), self.section.getfloat("position_max")

    def get_homing_info(self) -> SimpleNamespace:
        """Where its switch is."""
        return SimpleNamespace(position_endstop=self.section.getfloat("position_endstop"), positive_dir=False)


class Section:
    """A section of the emitted printer.cfg, with more of it if need be."""

    error = RefusedError

    def __init__(self, folder: Path, name: str, *, switches: bool = False) -> None:
        self.folder, self.name, self.switches = folder, name, switches
        text = (folder / "printer.cfg").read_text()
        parser = configparser.ConfigParser()
        parser.read_string(re.sub(r"^#(?=endstop|position|homing)", "", text, flags=re.MULTILINE) if switches else text)
        self.values = dict(parser[name])

    def get(self, option: str, default: Any = None) -> Any:
        """An option."""
        return self.values.get(option, default)

    def getfloat(self, option: str, default: float | None = None, above: float | None = None) -> float:
        """An option that is a number; it has to be there if there is no default."""
        value = float(self.values[option]) if default is None else float(self.values.get(option, default))
        assert above is None or value > above
        return value

    def get_printer(self) -> Toolhead:
        """The printer."""
        raise NotImplementedError

    def getsection(self, name: str) -> Section:
        """Another section."""
        return Section(self.folder, name, switches=self.switches)


class Words(dict[str, float]):
    """What the contract names of a command of G-code: its words, and how it is refused."""

    error = RefusedError

    def get_float(self, name: str, default: float) -> float:
        """A word that is a number."""
        return self.get(name, default)


class Toolhead:
    """What the contract names of the toolhead, of the printer and of the commands that are registered."""

    Coord = tuple

    def __init__(self) -> None:
        self.commands: dict[str, Callable[[Words], None]] = {}
        self.at: list[float] = [0.0] * 4
        self.kin: Any = None

    def lookup_object(self, name: str) -> Toolhead:
        """Where commands are registered."""
        assert name == "gcode"
        return self

    def register_command(self, name: str, function: Callable[[Words], None]) -> None:
        """A command of G-code."""
        self.commands[name] = function

    def get_trapq(self) -> None:
        """Nothing."""

    def flush_step_generation(self) -> None:
        """Nothing."""

    def get_position(self) -> list[float]:
        """Where it is."""
        return list(self.at)

    def set_position(self, position: Any, homing_axes: str = "") -> None:
        """Be there."""
        self.at[:3] = position[:3]
        self.kin.set_position(self.at, homing_axes)


class HomingState:
    """What the contract names of a homing cycle: each rail ends at its switch."""

    def __init__(self, toolhead: Toolhead) -> None:
        self.toolhead = toolhead
        self.searches: list[tuple[Any, Any]] = []

    def set_axes(self, axes: list[int]) -> None:
        """The axes that are homed."""
        self.axes = axes

    def set_homed_position(self, position: Any) -> None:
        """Be there."""
        self.toolhead.set_position(position)

    def home_rails(self, rails: list[Rail], begin: Any, end: Any) -> None:
        """Move from the begin to the end."""
        assert len(rails) == 1
        self.searches.append((begin, end))
        for places in (begin, end):
            filled = [here if place is None else place for place, here in zip(places, self.toolhead.at, strict=True)]
            self.toolhead.set_position(
                filled, "".join(axis for axis, place in zip("xyz", begin, strict=False) if place is not None)
            )


@pytest.fixture
def klipper(monkeypatch: pytest.MonkeyPatch) -> Callable[[Path, str], Any]:
    """Makes the class of a package among stand-ins of Klipper's modules."""

    def make(
        place: Path,
        name: str,
        change: tuple[str, str] = ("", ""),
        *,
        switches: bool = False,
        options: Mapping[str, str] = MappingProxyType({}),
    ) -> Any:
        ffi, lib, folder = compiled(place, name, change)
        helper, stepper = ModuleType("chelper"), ModuleType("stepper")
        helper.get_ffi = lambda: (ffi, lib)  # type: ignore[attr-defined]
        stepper.PrinterStepper = lambda section, units_in_radians=False: Stepper(section.name, turns=units_in_radians)  # type: ignore[attr-defined]
        stepper.LookupMultiRail = lambda section, units_in_radians=False: Rail(section, turns=units_in_radians)  # type: ignore[attr-defined]
        monkeypatch.setitem(sys.modules, "chelper", helper)
        monkeypatch.setitem(sys.modules, "stepper", stepper)
        spec = importlib.util.spec_from_file_location(f"klippy_{name}", folder / f"{name}.py")
        assert spec
        assert spec.loader
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        toolhead = Toolhead()
        section = Section(folder, "printer", switches=switches)
        section.get_printer = lambda: toolhead  # type: ignore[method-assign]
        section.values |= options
        toolhead.kin = module.load_kinematics(toolhead, section)
        return toolhead.kin

    return make


class Move(SimpleNamespace):
    """A move as the toolhead hands it out for a check."""

    speed: float
    accel: float

    def __init__(self, start: Any, end: Any) -> None:
        axes = [float(b - a) for a, b in zip(start, end, strict=True)]
        super().__init__(
            start_pos=(*map(float, start), 0.0),
            end_pos=(*map(float, end), 0.0),
            axes_d=[*axes, 0.0],
            move_d=float(np.linalg.norm(axes)),
            move_error=RefusedError,
            speed=np.inf,
            accel=np.inf,
        )

    def limit_speed(self, speed: float, accel: float) -> None:
        """Bound the cruising speed and the acceleration."""
        self.speed, self.accel = min(self.speed, speed), min(self.accel, accel)


def steppers(arm: Any) -> list[Stepper]:
    """The steppers of an arm."""
    return list(arm.get_steppers())


def home(arm: Any, name: str) -> np.ndarray[Any, Any]:
    """Home the arm as G28 does, and return the position."""
    arm.home(HomingState(arm.toolhead))
    assert arm.get_status(0.0)["homed_axes"] == "xyz"
    found = np.array(arm.toolhead.get_position()[:3])
    np.testing.assert_allclose(found, machine(name, Controller.KLIPPER).home[:3], atol=1e-5)
    return found


def in_degrees(made: Machine, motors: Any) -> list[float]:
    """Motors in degrees and mm, from radians and mm."""
    return [np.degrees(place) if motor.turns else place for place, motor in zip(motors, made.motors, strict=True)]


def tool(name: str, motors: Any, robot: Robot | None = None) -> np.ndarray[Any, Any]:
    """The position of the tool in mm, by the product of the table; of the same arm with other parameters if need be."""
    made = machine(name, Controller.KLIPPER)
    q = joints_at(name, Controller.KLIPPER, in_degrees(made, motors))
    return np.asarray(reference.pose(robot or kernels(name).robot, [q])[0, 0, :3, 3] * made.millimetres)


@pytest.mark.parametrize("name", ARMS)
def test_steppers_follow_a_straight_move(name: str, klipper: Callable[..., Any], tmp_path: Path) -> None:
    arm, made = klipper(tmp_path, name), machine(name, Controller.KLIPPER)
    at = home(arm, name)
    speed = np.array([1.0, -0.6, 0.4]) * made.reach * made.millimetres / 40
    arm.check_move(Move(at, at + speed))
    assert [stepper.turns for stepper in steppers(arm)] == [motor.turns for motor in made.motors]

    for time in [*np.linspace(0, 1, 101), *np.linspace(1, 0, 101)]:
        motors = [stepper.along(at, speed, float(time)) for stepper in steppers(arm)]
        np.testing.assert_allclose(tool(name, motors), at + time * speed, atol=1e-9)
        found = arm.calc_position({each.get_name(): s for each, s in zip(steppers(arm), motors, strict=True)})
        np.testing.assert_allclose(found, at + time * speed, atol=1e-9)
    np.testing.assert_allclose(in_degrees(made, motors), [motor.home for motor in made.motors], atol=1e-7)


@pytest.mark.parametrize("name", ["palletiser3", "scara"])
def test_moves_before_homing_and_out_of_reach_are_refused(
    name: str, klipper: Callable[..., Any], tmp_path: Path
) -> None:
    arm = klipper(tmp_path, name)
    at = np.array(machine(name, Controller.KLIPPER).home[:3])
    with pytest.raises(RefusedError, match="Must home axis first"):
        arm.check_move(Move(at, at + 1))
    at = home(arm, name)
    with pytest.raises(RefusedError, match=f"{name}: out of reach, or outside joint limits"):
        arm.check_move(Move(at, at + np.array([1e5, 0, 0])))
    arm.check_move(Move(at, at + 1))
    arm.check_move(Move(at, at - 1))  # as if another part of Klipper had refused the move before
    status = arm.get_status(0.0)
    assert all(
        low < place < high for low, place, high in zip(status["axis_minimum"], at, status["axis_maximum"], strict=True)
    )
    arm.clear_homing_state("")  # what SET_KINEMATIC_POSITION does
    assert arm.get_status(0.0)["homed_axes"] == "xyz"
    arm.clear_homing_state("xyz")
    assert arm.get_status(0.0)["homed_axes"] == ""


@pytest.mark.parametrize("name", ["palletiser3", "scara", "coupled3"])
def test_moves_are_slowed_until_no_motor_is_too_fast(name: str, klipper: Callable[..., Any], tmp_path: Path) -> None:
    arm, made = klipper(tmp_path, name), machine(name, Controller.KLIPPER)
    at = home(arm, name)
    way = np.array([0.3, -0.2, 0.1]) * made.reach * made.millimetres / 4
    move = Move(at, at + way)
    arm.check_move(move)

    times = np.linspace(0, move.move_d / move.speed, 4001)
    speed = way / move.move_d * move.speed
    motors = np.array([[each.along(at, speed, float(time)) for each in steppers(arm)] for time in times])
    units = [np.pi / 180 if motor.turns else 1.0 for motor in made.motors]
    rates = np.diff(motors / units, axis=0) / (times[1] - times[0])
    accels = np.diff(rates, axis=0) / (times[1] - times[0])
    share = max(np.abs(rates).max() / 90, np.sqrt(np.abs(accels).max() / 180))
    assert 0.97 < share < 1.001


@pytest.mark.parametrize("aside", [0.03, 1.0])
def test_steppers_that_are_asked_seldom_follow_a_joint_that_turns_far(
    aside: float, klipper: Callable[..., Any], tmp_path: Path
) -> None:
    """The waist turns half a turn beside its axis, and Klipper asks a stepper that hardly moves once in a while."""
    arm, name = klipper(tmp_path, "palletiser_straight"), "palletiser_straight"
    home(arm, name)
    begin, way = np.array([-400.0, aside, 700.0]), np.array([800.0, 0.0, 0.0])
    arm.toolhead.set_position([*begin, 0.0], "xyz")
    move = Move(begin, begin + way)
    arm.check_move(move)

    assert 0.999 < np.radians(90) * aside / move.speed < 1.01
    for part in [*np.linspace(0, 1, 1001), *np.linspace(1, 0, 778)]:
        motors = [each.along(begin, way, float(part)) for each in steppers(arm)]
        np.testing.assert_allclose(tool(name, motors), begin + part * way, atol=1e-7)


@pytest.mark.parametrize("name", ["arm3", "coupled3"])
def test_a_motor_with_a_switch_is_homed_alone_and_the_tool_is_where_the_joints_are(
    name: str, klipper: Callable[..., Any], tmp_path: Path
) -> None:
    """A joint follows its motors: one whose reading counts the joint before it stays where it is to the ground."""
    arm, made = klipper(tmp_path, name, switches=True), machine(name, Controller.KLIPPER)
    state = HomingState(arm.toolhead)
    arm.home(state)

    low = [round(motor.low or 0.0, 9) for motor in made.motors]
    assert [[place for place in end if place is not None] for _, end in state.searches] == [[each] for each in low]
    assert [
        begin[i] > motor.high for i, ((begin, _), motor) in enumerate(zip(state.searches, made.motors, strict=True))
    ] == [True] * 3
    np.testing.assert_allclose([each.at for each in steppers(arm)], np.radians(low), atol=1e-9)
    np.testing.assert_allclose(arm.toolhead.get_position()[:3], tool(name, np.radians(low)), atol=1e-9)
    assert arm.get_status(0.0)["homed_axes"] == "xyz"


def test_an_arm_is_not_homed_at_a_position_that_it_cannot_have(klipper: Callable[..., Any], tmp_path: Path) -> None:
    arm = klipper(tmp_path, "palletiser3")
    at = home(arm, "palletiser3")
    for wrong in ([1e5, 0.0, 0.0], [float("nan"), 0.0, 0.0]):
        arm.toolhead.set_position(wrong, "xyz")
        assert arm.get_status(0.0)["homed_axes"] == ""
    home(arm, "palletiser3")
    with pytest.raises(RefusedError, match="out of reach"):
        arm.check_move(Move(at, [float("nan"), 0.0, 0.0]))
    arm.toolhead.set_position(at + 1, "z")
    assert arm.get_status(0.0)["homed_axes"] == "xyz"
    motors = [each.get_commanded_position() for each in steppers(arm)]
    np.testing.assert_allclose(tool("palletiser3", motors), at + 1, atol=1e-9)


def test_homing_takes_the_arm_to_be_at_its_home_pose_whatever_it_was_before(
    klipper: Callable[..., Any], tmp_path: Path
) -> None:
    """The other branch would be nearer to the last joint values."""
    arm, made = klipper(tmp_path, "scara"), machine("scara", Controller.KLIPPER)
    home(arm, "scara")
    for stepper in steppers(arm):
        stepper.at = -stepper.at
    home(arm, "scara")
    motors = [each.at for each in steppers(arm)]
    np.testing.assert_allclose(in_degrees(made, motors), [motor.home for motor in made.motors], atol=1e-7)


def test_runtime_parameters_move_the_tool_and_no_motor(klipper: Callable[..., Any], tmp_path: Path) -> None:
    """SET_KINEMATICS_PARAMETERS is another tool: the position is that of its tip, and lines too."""
    name = "coupled3"
    arm, robot = klipper(tmp_path, name), kernels("coupled3").robot
    at = home(arm, name)
    before = [each.get_commanded_position() for each in steppers(arm)]
    command = arm.toolhead.commands["SET_KINEMATICS_PARAMETERS"]
    command(Words({"TOOL_Z": -62.5, "TOOL_X": 151.5}))

    longer = with_parameter(with_parameter(robot, 0, 151.5), 1, -62.5)
    tip = np.array(arm.toolhead.get_position()[:3])
    assert np.linalg.norm(tip - at) == pytest.approx(np.hypot(51.5, 12.5))
    np.testing.assert_allclose([each.get_commanded_position() for each in steppers(arm)], before, atol=1e-12)
    np.testing.assert_allclose(tip, tool(name, before, longer), atol=1e-9)
    way = np.array([20.0, -30.0, 15.0])
    arm.check_move(Move(tip, tip + way))
    motors = [each.along(tip, way, 1.0) for each in steppers(arm)]
    np.testing.assert_allclose(tool(name, motors, longer), tip + way, atol=1e-9)
    with pytest.raises(RefusedError, match="not a number"):
        command(Words({"TOOL_X": float("nan")}))
    command(Words({"TOOL_X": 100.0}))
    assert arm.parameters == {"tool_x": 100.0, "tool_z": -62.5}
    arm.clear_homing_state("xyz")
    command(Words({"TOOL_X": 90.0}))
    assert arm.get_status(0.0)["homed_axes"] == ""


def test_parameters_that_leave_the_tool_no_position_are_refused(klipper: Callable[..., Any], tmp_path: Path) -> None:
    """A gear ratio of zero is finite, and what is divided by it is not."""
    arm, name = klipper(tmp_path, "geared3"), "geared3"
    at = home(arm, name)
    command = arm.toolhead.commands["SET_KINEMATICS_PARAMETERS"]
    for word in ("RATIO_OF", "PART_OF"):
        with pytest.raises(RefusedError, match="with these parameters the tool has no position"):
            command(Words({word: 0.0}))
        np.testing.assert_array_equal(arm.toolhead.get_position()[:3], at)
        assert arm.parameters == {"tool_x": 100.0, "ratio_of": 2.0, "part_of": 1.0}
    arm.check_move(Move(at, at + 1))
    motors = [each.along(at, np.ones(3), 1.0) for each in steppers(arm)]
    np.testing.assert_allclose(tool(name, motors), at + 1, atol=1e-9)


@pytest.mark.parametrize(("option", "message"), [("tool_x", "is not a number"), ("ratio_of", "has no position")])
def test_options_that_leave_the_tool_no_position_are_refused(
    option: str, message: str, klipper: Callable[..., Any], tmp_path: Path
) -> None:
    options = {f"parameter_{option}": "nan" if option == "tool_x" else "0"}
    with pytest.raises(RefusedError, match=message):
        klipper(tmp_path, "geared3", options=options)


def test_runtime_parameters_may_be_words_in_capitals(tmp_path: Path) -> None:
    """A macro of the helper with the name of a parameter would be put in its place."""
    compiled(tmp_path, "capitals3")


@pytest.mark.parametrize(
    "change",
    [("_solve(b.x, b.y, b.z, q)", "_solve(b.y, b.x, b.z, q)"), ("_MILLIMETRES 1", "_MILLIMETRES 2")],
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
        # What an earlier package declared is replaced.
        text = (helper / "__init__.py").read_text()
        (helper / "__init__.py").write_text(text.replace("    int scara_along(", "    int scara_old("))
    run(["sh", folder / "install.sh", tmp_path / "klipper"], tmp_path)

    scope: dict[str, Any] = {}
    exec(compile(ast.parse((helper / "__init__.py").read_text()), "chelper", "exec"), scope)  # noqa: S102 - our own text
    assert scope["SOURCE_FILES"] == ["scara.c", "scara_follow.c", "kin_scara.c", "trapq.c"]
    assert len(scope["defs_all"]) == 2
    assert scope["defs_all"][0] == prototypes(folder)
    assert all((helper / name).exists() for name in scope["SOURCE_FILES"][:3])
    assert (helper.parent / "kinematics" / "scara.py").exists()


def test_the_script_keeps_the_files_of_klipper(tmp_path: Path) -> None:
    folder = write_package(tmp_path, "scara", Controller.KLIPPER)
    klippy = tmp_path / "klipper" / "klippy"
    for each in ("chelper", "kinematics"):
        (klippy / each).mkdir(parents=True)
    (klippy / "chelper" / "__init__.py").write_text("")
    (klippy / "kinematics" / "scara.py").write_text("# of Klipper\n")

    done = subprocess.run(
        ["sh", folder / "install.sh", tmp_path / "klipper"], capture_output=True, text=True, check=False
    )

    assert done.returncode == 1
    assert done.stderr == "Klipper has its own klippy/kinematics/scara.py: give the robot another name\n"
    assert (klippy / "kinematics" / "scara.py").read_text() == "# of Klipper\n"
    assert sorted(path.name for path in (klippy / "chelper").iterdir()) == ["__init__.py"]
