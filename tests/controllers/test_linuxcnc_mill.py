"""Machine tools in LinuxCNC: tool centre point, identity, tools; with headers that are printed from the contract."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from kinegen.backends.controllers.machine_tool import Mill, mill_for
from kinegen.errors import KinegenError
from kinegen.io.load import load, loads
from kinegen.model.robot import Robot
from tests.controllers.cone import trunnion
from tests.controllers.modules import Module, Numbers, machine_vector, shift, turn, write_linuxcnc
from tests.emit.emitted import ROOT
from tests.machine_tools.machines import MACHINES, L

pytestmark = pytest.mark.controllers

Motion = Callable[[Numbers], Numbers]
"""The pose (4, 4) of the tool in the frame of the workpiece, by LinuxCNC's joints, as a product of turns and shifts."""

HEAD = """\
kinegen: 1
name: fork_head
convention: standard
units: {{length: in, angle: deg}}
parameters:
  gauge: {{value: 4, runtime: true}}
  pivot: {{value: 6, runtime: true}}
joints:
  - {{name: x_axis, ets: [Tx(q)], limits: [-20, 20]}}
  - {{name: y_axis, ets: [Ty(q)], limits: [-10, 10]}}
  - {{name: z_axis, ets: [Tz(q)], limits: [-12, 12]}}
  - {{name: c_axis, ets: [Rz(q)], limits: [-360, 360]}}
  - {{name: b_axis, ets: [{joint}], limits: [-100, 100]}}
tool: {{ets: [{tool}]}}
"""

QUILL = """\
kinegen: 1
name: quill_mill
convention: standard
units: {length: mm, angle: deg}
joints:
  - {name: b_axis, parent: base, ets: [Ry(-q)], limits: [-100, 100]}
  - {name: x_axis, parent: base, ets: [Tx(q)], limits: [-400, 400]}
  - {name: y_axis, parent: x_axis, ets: [Ty(q)], limits: [-300, 300]}
  - {name: z_axis, parent: y_axis, ets: [Tz(q)], limits: [0, 500]}
  - {name: w_quill, parent: z_axis, ets: [Tz(-q)], limits: [0, 120]}
frames:
  table: {parent: b_axis, tip: true, ets: [Tz(40)]}
  spindle: {parent: w_quill, tip: true, ets: [Tz(-70)]}
"""
"""Four axes and a quill."""

TILTED = """\
kinegen: 1
name: tilted_quill
convention: standard
units: {length: m, angle: deg}
joints:
  - {name: slide_1, ets: [Ty(q)], limits: [-1, 1]}
  - {name: slide_2, ets: [Tx(q)], limits: [-1, 1]}
  - {name: slide_3, ets: [Tz(q)], limits: [0, 1.5]}
  - {name: swing, ets: [Rx(q)], limits: [-95, 95]}
  - {name: quill, ets: [Tz(-q)], limits: [0, 0.2]}
tool: {ets: [Tz(-0.1)]}
frames:
  workpiece: {parent: base, xyz: [0.3, 0.2, 0.05]}
"""
"""A chain in metres, whose quill is behind the joint that tilts; its joints are named by no letter."""


def quill_mill(j: Numbers) -> Numbers:
    table = turn(1, -j[3]) @ shift(0, 0, 40)
    return np.asarray(np.linalg.inv(table) @ shift(j[0], j[1], j[2]) @ shift(0, 0, -j[4] - 70))


def tilted_quill(j: Numbers) -> Numbers:
    head = shift(j[0], j[1], j[2]) @ turn(0, j[3]) @ shift(0, 0, -j[4] - 100)
    return np.asarray(np.linalg.inv(shift(300, 200, 50)) @ head)


@dataclass(frozen=True)
class Case:
    """A machine, its motion, and the range of each of LinuxCNC's joints."""

    robot: Robot
    motion: Motion
    words: str
    box: tuple[tuple[float, float], ...]

    @property
    def mill(self) -> Mill:
        """What it is."""
        found = mill_for(self.robot, solved=False)
        assert found is not None
        return found

    def samples(self, count: int = 40) -> Numbers:
        """Joints within their ranges."""
        low, high = np.array(self.box).T
        return np.asarray(low + (high - low) * np.random.default_rng(5).random((count, len(self.box))))


SLIDES = ((-300.0, 300.0), (-200.0, 200.0), (50.0, 400.0))


@cache
def case(name: str) -> Case:
    if name == "trunnion_mill":
        return Case(load(ROOT / "robots" / f"{name}.yaml"), trunnion, "XYZAC", (*SLIDES, (-30, 120), (-360, 360)))
    if name == "quill_mill":
        return Case(loads(QUILL, name), quill_mill, "XYZBW", (*SLIDES, (-100, 100), (0, 120)))
    if name == "tilted_quill":
        return Case(loads(TILTED, name), tilted_quill, "XYZAW", (*SLIDES, (-95, 95), (0, 200)))
    (machine,) = (each for each in MACHINES if each.name == name)
    robot = loads(machine.text, name)
    mill = mill_for(robot, solved=False)
    assert mill is not None
    order = [[variable.name for variable in robot.variables].index(each) for each in ("first", "second", "x", "y", "z")]

    def motion(j: Numbers) -> Numbers:
        point, axis = machine.motion(machine_vector(mill, robot, j)[order][None])
        pose = np.eye(4)
        pose[:3, 3], pose[:3, 2] = point[0], axis[0]
        return pose

    words = "".join(sorted(mill.letters, key="XYZABC".index))
    turns = {"first": (-180.0, 180.0), "second": (-100.0, 100.0)}
    names = [robot.variables[place].name for place in mill.order]
    return Case(robot, motion, words, (*SLIDES, *(turns[each] for each in names[3:])))


NAMES = (*(machine.name for machine in MACHINES), "trunnion_mill", "quill_mill", "tilted_quill")


def compared(name: str, module: Module, tool: float = 0.0) -> None:
    """The world is the tip by the motion that was written out, and its joints lead back; identity is the joints."""
    it = case(name)
    places = ["XYZABCUVW".index(word) for word in it.words]
    begin = it.motion(np.zeros(len(it.box)))[:3, 3]
    module.set("tool-offset.z", tool)
    for joints in it.samples():
        pose = it.motion(joints)
        world = module.world(joints)
        tip = pose[:3, 3] - tool * pose[:3, 2]
        np.testing.assert_allclose(world[:3], tip - begin + np.array([0, 0, tool]), atol=1e-9)
        np.testing.assert_array_equal(world[places[3:]], joints[3:])
        np.testing.assert_allclose(module.joints(world, joints + 1.0), joints, atol=1e-9)
    assert module.library.kinematicsSwitch(1) == 0
    joints = it.samples(1)[0]
    world = module.world(joints)
    np.testing.assert_array_equal(world[places], joints)
    np.testing.assert_array_equal(module.joints(world, joints * 0), joints)
    assert module.library.kinematicsSwitch(0) == 0


@pytest.mark.parametrize("name", NAMES)
def test_the_world_is_the_tip_of_the_tool_on_the_workpiece(name: str, tmp_path: Path) -> None:
    it = case(name)
    assert "".join(sorted(it.mill.letters, key="XYZABCUVW".index)) == it.words
    module = Module(write_linuxcnc(tmp_path, it.robot, solved=False))
    compared(name, module)
    compared(name, module, tool=37.5)


def test_a_runtime_parameter_and_the_tool_table_may_share_the_length_of_the_tool(tmp_path: Path) -> None:
    module = Module(write_linuxcnc(tmp_path, case("trunnion_mill").robot, solved=False))
    joints = [10.0, 20.0, 300.0, 35.0, 50.0]
    assert module.pins["trunnion_mill_kins.param.tool-length"].number == 120.0
    expected = trunnion(np.array(joints), 90.0)[:3, 3] - trunnion(np.zeros(5), 0.0)[:3, 3] + np.array([0, 0, 90.0])

    for parameter, offset in ((0.0, 90.0), (90.0, 0.0), (50.0, 40.0)):
        module.set("param.tool-length", parameter)
        module.set("tool-offset.z", offset)
        np.testing.assert_allclose(module.world(joints)[:3], expected, atol=1e-9)


@pytest.mark.parametrize(
    ("joint", "tool", "zero", "kept"),
    [
        ("Ry(q)", "Tz(-pivot), Tz(-gauge), Rz(30)", [], ["pivot", "gauge"]),  # which is the tool's own cannot be told
        ("Ry(q), Tz(-pivot)", "Tz(-gauge)", ["gauge"], ["pivot"]),
        ("Ty(pivot), Ry(q)", "Tz(-gauge)", ["gauge"], []),
    ],
)
def test_the_pivot_length_of_a_head_is_not_set_to_zero_for_the_tool_table(
    joint: str, tool: str, zero: list[str], kept: list[str], tmp_path: Path
) -> None:
    robot = loads(HEAD.format(joint=joint, tool=tool), "fork_head")
    folder = write_linuxcnc(tmp_path, robot, solved=False)
    hal, readme = ((folder / name).read_text() for name in ("sim/fork_head.hal", "README.md"))
    table = (folder / "sim" / "fork_head.tbl").read_text()
    assert [name for name in ("pivot", "gauge") if f"setp fork_head_kins.param.{name} 0\n" in hal] == zero
    for name in zero:
        assert f"where the tip is with `{name}` at 0" in readme
        assert f";from where the tip is with {name} at 0, to the tip\n" in table
    for name in kept:
        assert f"`{name}` is a length in the same direction: its pin keeps the value" in readme
    if not zero:
        assert ";from the frame tool of the robot file to the tip\n" in table


def test_with_the_table_level_both_kinematics_and_every_tool_have_the_same_world(tmp_path: Path) -> None:
    """So neither a switch nor G43 moves the machine there."""
    module = Module(write_linuxcnc(tmp_path, case("trunnion_mill").robot, solved=False))
    joints = np.array([10.0, 20.0, 300.0, 0.0, 0.0])
    for x, y, z in ((0, 0, 0), (1.0, -2.0, 80.0)):
        for axis, offset in zip("xyz", (x, y, z), strict=True):
            module.set(f"tool-offset.{axis}", offset)
        np.testing.assert_allclose(module.world(joints)[:6], [10, 20, 300, 0, 0, 0], atol=1e-12)


def test_a_tool_frame_that_is_turned_keeps_the_world_for_lengths_but_not_for_offsets_in_x(tmp_path: Path) -> None:
    """As the README says; by Rz(30) an offset of 10 mm in X is one of (8.66, 5, 0) on the workpiece."""
    robot = loads(HEAD.format(joint="Ry(q)", tool="Tz(-pivot), Tz(-gauge), Rz(30)"), "fork_head")
    folder = write_linuxcnc(tmp_path, robot, solved=False)
    readme = " ".join((folder / "README.md").read_text().split())
    module = Module(folder)
    joints = np.array([10.0, 20.0, 30.0, 0.0, 0.0])
    module.set("tool-offset.z", 80.0)
    np.testing.assert_allclose(module.world(joints)[:3], [10, 20, 30], atol=1e-9)
    module.set("tool-offset.x", 10.0)
    moved = np.array([10 - 10 * math.cos(math.pi / 6), -5.0, 0.0])
    np.testing.assert_allclose(module.world(joints)[:3], np.array([10, 20, 30]) + moved, atol=1e-9)
    assert "Change offsets in X and Y in kinematics 1 alone, unless" in readme


def test_motion_is_told_which_kinematics_there_are(tmp_path: Path) -> None:
    module = Module(write_linuxcnc(tmp_path, case("quill_mill").robot, solved=False))
    pins = module.pins

    assert module.library.kinematicsSwitchable() == 1
    assert [pins[f"kinstype.is-{kind}"].bit for kind in (0, 1)] == [1, 0]
    assert module.library.kinematicsSwitch(1) == 0
    assert [pins[f"kinstype.is-{kind}"].bit for kind in (0, 1)] == [0, 1]
    assert module.library.kinematicsSwitch(2) == -1
    assert module.message == "quill_mill: kinematics 2 do not exist: 0 tool centre point, 1 identity\n"
    assert [pins[f"kinstype.is-{kind}"].bit for kind in (0, 1)] == [0, 1]


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf, 1e308])
def test_what_is_not_a_number_is_refused_and_moves_nothing(wrong: float, tmp_path: Path) -> None:
    module = Module(write_linuxcnc(tmp_path, case("trunnion_mill").robot, solved=False))
    joints = np.array([10.0, 20.0, 300.0, 5.0, 7.0])
    world = module.world(joints)
    words = "trunnion_mill: a word, a joint or a pin of trunnion_mill_kins is not a finite number"
    for kind in (0, 1):
        module.library.kinematicsSwitch(kind)
        for place in (0, 1, 2, 3, 5):
            bad = world.copy()
            bad[place] = wrong
            result, found = module.inverse(bad, joints)
            assert result == -1
            assert module.message.startswith(words)
            np.testing.assert_array_equal(found, joints)
            assert module.inverse(module.world(joints), joints)[0] == 0
        for place in range(5):
            moved = joints.copy()
            moved[place] = wrong
            assert module.forward(moved)[0] == -1
    module.library.kinematicsSwitch(0)
    for pin in ("tool-offset.x", "param.tool-length"):
        module.set(pin, wrong)
        assert module.forward(joints)[0] == module.inverse(world, joints)[0] == -1
        module.set(pin, 0.0)


def test_a_joint_that_would_be_faster_than_its_pin_says_stops_the_move_but_not_a_look_at_its_end(
    tmp_path: Path,
) -> None:
    module = Module(write_linuxcnc(tmp_path, case("trunnion_mill").robot, solved=False))
    place = (ctypes.c_double * 9)()
    joints = np.array([100.0, 0.0, 300.0, 0.0, 0.0])
    world = module.world(joints, place)
    ahead = world.copy()
    ahead[5] += 0.05  # of the table; the tip is 100 mm beside its axis
    module.set("servo-period", 1e6)
    module.set("max-speed.1", 80.0)

    assert module.inverse(ahead, joints)[0] == 0  # another place: the end of a move
    place[5] = ahead[5]
    result, found = module.inverse(place, joints)
    assert result == -1
    assert module.message == "trunnion_mill: joint 1 would be faster than trunnion_mill_kins.max-speed.1\n"
    np.testing.assert_array_equal(found, joints)
    for limit in (0.0, 95.0):
        module.set("max-speed.1", limit)
        assert module.inverse(place, joints)[0] == 0
    module.set("max-speed.4", 49.0)
    assert module.inverse(place, joints)[0] == -1


@pytest.mark.parametrize(
    "change",
    [
        ("right[i] = (((words[i] - tool[i])", "right[i] = (((words[i] + tool[i])"),
        ("- ((row[0] * x)", "+ ((row[0] * x)"),
        ("slides[3] = {2, 3, 4}", "slides[3] = {3, 2, 4}"),
        ("tip[2] - zero[2]", "tip[2]"),
        ("joint[4] = world->c", "joint[4] = world->a"),
        ("found[0] = world->tran.x", "found[0] = world->tran.y"),
    ],
    ids=["offset", "tool", "slides", "zero", "word", "identity"],
)
def test_an_altered_module_is_noticed(change: tuple[str, str], tmp_path: Path) -> None:
    module = Module(write_linuxcnc(tmp_path, case("trunnion_mill").robot, solved=False), change)
    with pytest.raises(AssertionError):
        compared("trunnion_mill", module, tool=37.5)
    assert L == 80.0


def test_a_tool_that_points_out_of_its_holder_is_turned_over() -> None:
    text = QUILL.replace("ets: [Tz(-70)]", "ets: [Tz(-70), Rx(180)]")
    found = mill_for(loads(text, "quill"), solved=False)
    assert found is not None
    assert not found.towards_holder


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("z_axis, ets: [Tz(-q)]", "z_axis, ets: [Rz(-q)]"), ""),
        (
            ("limits: [0, 120]}", "limits: [0, 120]}\n  - {name: rest, parent: base, ets: [Tz(q)]}"),
            "a machine tool has two",
        ),
        (("table: {parent: b_axis", "one: {parent: b_axis"), ""),
        (("y_axis, parent: x_axis, ets: [Ty(q)]", "y_axis, parent: x_axis, ets: [Rx(q)]"), "independent wherever"),
    ],
)
def test_what_is_no_machine_tool_is_refused_with_the_reason(change: tuple[str, str], words: str) -> None:
    robot = loads(QUILL.replace(*change), "quill")
    if words:
        with pytest.raises(KinegenError, match=words):
            mill_for(robot, solved=False)
    else:
        assert mill_for(robot, solved=False) is not None
