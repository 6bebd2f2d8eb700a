"""The grblHAL plug-in against a stand-in of the interface: places, feeds, homing, jogs, refusals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from kinegen.backends.controllers.controller import Controller
from kinegen.support.files.write import write_files
from kinegen.verify import reference
from tests.controllers.contract import headers
from tests.controllers.packages import FLAGS, HERE, joints_at, kernels, machine, need, run, run_with, write_package
from tests.controllers.paths import with_parameter

pytestmark = pytest.mark.controllers

MACHINE = HERE / "standins" / "grblhal" / "machine.c"
STEPS = 1000.0
ARMS = ["scara4", "scara", "palletiser3", "anthropomorphic_arm", "coupled3", "splined4"]

Numbers = NDArray[np.float64]

_PROGRAMS: dict[tuple[str, int], Path] = {}
"""The compiled plug-ins by robot and number of axes; they keep nothing between two runs."""


@dataclass
class Answer:
    """What one command made: its blocks, lines that are no blocks, the alarm."""

    places: list[list[float]] = field(default_factory=list)
    lines: dict[str, Numbers] = field(default_factory=dict)
    alarm: int = 0

    def motors(self, axes: int = 4) -> Numbers:
        """Motors of each block."""
        return np.array(self.places)[:, :axes]

    def positions(self, axes: int = 4) -> Numbers:
        """Positions that their steps stand for."""
        return np.array(self.places)[:, axes : 2 * axes]

    @property
    def minutes(self) -> Numbers:
        """What each block takes."""
        return np.array(self.places)[:, -2]

    @property
    def speeds(self) -> Numbers:
        """What is reported for each."""
        return np.array(self.places)[:, -1]


def compiled(place: Path, name: str, change: tuple[str, str] | None = None, axes: int = 4) -> Path:
    """The plug-in in the machine of these tests, made once; with one alteration of its text where asked."""
    if change is not None:
        return _made(place, name, change, axes)
    if (name, axes) not in _PROGRAMS:
        _PROGRAMS[name, axes] = _made(place, name, ("", ""), axes)
    return _PROGRAMS[name, axes]


def _made(place: Path, name: str, change: tuple[str, str], axes: int) -> Path:
    need("gcc")
    folder = write_package(place, name, Controller.GRBLHAL)
    write_files(place / "standins", headers("grblhal"))
    plugin = folder / f"{name}_plugin.c"
    assert change[0] in plugin.read_text()
    plugin.write_text(plugin.read_text().replace(*change) if change[0] else plugin.read_text())
    sources = [plugin, folder / f"{name}_f32.c", folder / f"{name}_f32_follow.c", folder / "example" / "my_plugin.c"]
    includes = [f"-I{place / 'standins'}", f"-I{folder}", "-DKINEMATICS_API", f"-DN_AXIS={axes}"]
    run(["gcc", *FLAGS, *includes, *sources, MACHINE, "-lm", "-o", place / "machine"], place)
    return place / "machine"


def padded(numbers: Sequence[float], axes: int) -> list[float]:
    return [*map(float, numbers), *[0.0] * (axes - len(numbers))][:axes]


def answers(
    program: Path, name: str, commands: Sequence[Sequence[object]], axes: int = 4, start: Sequence[float] | None = None
) -> list[Answer]:
    """What the machine makes of commands: a word, then its numbers; the arm begins at home or at `start`."""
    begin = [motor.home for motor in machine(name, Controller.GRBLHAL).motors] if start is None else list(start)
    rows = [[STEPS] * axes, padded(begin, axes), [0b0101], [2.0], *commands]
    found, answer = [], Answer()
    for line in run_with(program, "\n".join(" ".join(map(str, row)) for row in rows)).splitlines():
        word, *numbers = line.split()
        if word == "end":
            answer.alarm = int(numbers[0])
            found.append(answer)
            answer = Answer()
        elif word == "place":
            answer.places.append([float(number) for number in numbers])
        elif word != "said":
            answer.lines[word] = np.array(numbers, float)
    return found


def home_of(name: str) -> Numbers:
    """Position of the tool at home in mm, and its angle c in degrees, as joints add up, for arms that turn it."""
    made = machine(name, Controller.GRBLHAL)
    begin, *rates = made.turning or (0.0,)
    q = joints_at(name, Controller.GRBLHAL, [motor.home for motor in made.motors])
    return np.array([*made.home[:3], np.degrees(begin + sum(rate * value for rate, value in zip(rates, q)))])


def side_of(name: str) -> float:
    made = machine(name, Controller.GRBLHAL)
    return made.reach * made.millimetres / 40


def beside(at: Numbers, *steps: float) -> list[float]:
    return [float(number) for number in at + np.array(steps)]


def exact(name: str, motors: Numbers) -> Numbers:
    """The position of the tool for motors, from the reference, in mm."""
    made = machine(name, Controller.GRBLHAL)
    q = joints_at(name, Controller.GRBLHAL, motors[: made.dof])
    return np.asarray(reference.pose(kernels(name).robot, [q])[0, 0, :3, 3]) * made.millimetres


def tool_at(name: str, motors: Numbers) -> Numbers:
    """Position of the tool in mm, and its angle c in degrees for arms that turn it, from the reference."""
    begin, *rates = machine(name, Controller.GRBLHAL).turning or (0.0,)
    turned = begin + np.dot(rates, joints_at(name, Controller.GRBLHAL, motors)) if rates else 0.0
    return np.array([*exact(name, motors), np.degrees(turned)])[: len(motors)]


def off(name: str, motors: Numbers, goal: Numbers) -> Numbers:
    """How far motors are from those that have the tool at a goal, in their units."""
    size = len(motors)
    steps = np.eye(size) * 1e-3
    columns = [(tool_at(name, motors + step) - tool_at(name, motors - step)) / 2e-3 for step in steps]
    return np.asarray(np.linalg.solve(np.array(columns).T, tool_at(name, motors) - goal[:size]))


@pytest.mark.parametrize("name", ARMS)
def test_straight_moves_are_straight(name: str, tmp_path: Path) -> None:
    at, dof = home_of(name), kernels(name).robot.dof
    corners = [at + side_of(name) * np.array(s) for s in ([1, 0, 0, 0], [1, 1, 0, 0], [0, 0, 0.5, 0], [0, 0, 0, 0])]
    ends = [corner + np.array([0, 0, 0, 5.0 * k if dof == 4 else 0]) for k, corner in enumerate(corners)]

    moves = answers(compiled(tmp_path, name), name, [("feed", 100, *end) for end in ends])

    begin = at
    for end, move in zip(ends, moves, strict=True):
        assert move.alarm == 0
        assert len(move.places) >= np.linalg.norm((end - begin)[:3]) - 1e-3
        parts = np.arange(1, len(move.places) + 1)[:, None] / len(move.places)
        expected = begin + parts * (end - begin)
        np.testing.assert_allclose(move.positions()[:, : max(3, dof)], expected[:, : max(3, dof)], atol=0.03)
        for motors, position in list(zip(move.motors(), move.positions(), strict=True))[:: max(1, len(parts) // 7)]:
            np.testing.assert_allclose(position[:3], exact(name, motors), atol=0.03)
        # Before they are rounded to steps, motors have the accuracy of floats: here of those next to 128.
        motors = move.motors(dof)[-1]
        last_place = np.spacing(np.maximum(np.abs(motors), 128).astype(np.float32))
        assert (np.abs(off(name, motors, end.astype(np.float32))) <= 10 * last_place).all()
        begin = end


@pytest.mark.parametrize("name", ARMS)
def test_the_tool_moves_at_the_programmed_feed(name: str, tmp_path: Path) -> None:
    """The planner measures blocks in degrees and millimetres of motors, and is told the feed that belongs to these."""
    side = side_of(name)
    ends = [home_of(name) + side * np.array(step) for step in ([1, 0, 0, 0], [1, 1, 0, 0], [0, 0, 0.5, 0])]
    moves = answers(compiled(tmp_path, name), name, [("feed", 1500, *end) for end in ends])

    for begin, end, move in zip([home_of(name), *ends], ends, moves, strict=False):
        length = np.linalg.norm(end - begin)
        assert move.minutes.sum() == pytest.approx(length / 1500, rel=1e-3)
        assert move.minutes == pytest.approx(move.minutes.mean(), rel=1e-3)
        assert move.speeds == pytest.approx(1500, rel=1e-3)


def test_steps_that_are_too_short_for_a_piece_take_no_time_away(tmp_path: Path) -> None:
    """Pieces that move no motor by a step are left out, and the next one takes their time."""
    name, at = "scara", home_of("scara")
    program = compiled(tmp_path, name, ("_SEGMENT 1.0F", "_SEGMENT 0.0004F"))
    (move,) = answers(program, name, [("feed", 600, *beside(at, 0, 0, 0.5, 0))])

    assert sum(minutes == 0 for minutes in move.minutes) > 50
    assert move.minutes.sum() == pytest.approx(0.5 / 600, rel=5e-3)


def test_an_inverse_time_move_takes_its_time(tmp_path: Path) -> None:
    at = home_of("scara4")
    program = compiled(tmp_path, "scara4")
    (move,) = answers(program, "scara4", [("inverse", 20, *beside(at, 15, 10, 5, 30))])

    assert move.minutes.sum() == pytest.approx(1 / 20, rel=1e-3)


def test_a_rapid_move_keeps_its_rate_and_reports_the_speed_of_the_tool(tmp_path: Path) -> None:
    at = home_of("scara4")
    (move,) = answers(compiled(tmp_path, "scara4"), "scara4", [("rapid", *beside(at, 20, 0, 0, 0))])
    lengths = np.linalg.norm(np.diff([at[:3], *move.positions()[:, :3]], axis=0), axis=1)

    # The stand-in takes 1 for the rate of a rapid block: minutes are the motors' way, and the speed is by their ratio.
    assert move.speeds == pytest.approx(lengths / move.minutes, rel=0.02)


def test_a_tool_that_turns_several_times_keeps_its_count(tmp_path: Path) -> None:
    at = home_of("scara4")
    program = compiled(tmp_path, "scara4")
    turns = [("feed", 1000, *beside(at, 0, 0, 0, turn)) for turn in (150, 300, -190, 0)]
    moves = answers(program, "scara4", turns)

    for turn, move in zip((150, 300, -190, 0), moves, strict=True):
        assert move.alarm == 0
        assert move.positions()[-1, 3] == pytest.approx(at[3] + turn, abs=0.01)
    assert np.abs(np.diff(np.concatenate([move.motors()[:, 3] for move in moves]))).max() < 2


@pytest.mark.parametrize("name", ["scara4", "palletiser3"])
def test_a_move_out_of_reach_is_refused_before_it_begins(name: str, tmp_path: Path) -> None:
    at, side = home_of(name), side_of(name)
    program = compiled(tmp_path, name)
    beyond, back = answers(
        program, name, [("feed", 100, *beside(at, 9000, 0, 0, 0)), ("feed", 100, *beside(at, side, 0, 0, 0))]
    )

    assert beyond.alarm == 2
    assert not beyond.places
    assert back.alarm == 0
    np.testing.assert_allclose(back.positions()[-1, :3], beside(at[:3], side, 0, 0), atol=0.03)


def test_a_move_with_an_end_within_reach_is_refused_if_it_leaves_the_reach(tmp_path: Path) -> None:
    """The straight way from one side of the waist to the other leads through the arm itself."""
    at = home_of("scara4")
    (move,) = answers(compiled(tmp_path, "scara4"), "scara4", [("feed", 100, -at[0], -at[1], *at[2:])])

    assert move.alarm == 2
    assert not move.places


def test_a_jog_ends_where_the_arm_cannot_follow(tmp_path: Path) -> None:
    at = home_of("scara4")
    beyond, back = answers(
        compiled(tmp_path, "scara4"),
        "scara4",
        [("jog", 900, *beside(at, 9000, 0, 0, 0)), ("jog", 900, *beside(at, 1, 0, 0, 0))],
    )

    assert beyond.alarm == back.alarm == 0
    assert len(beyond.places) > 20
    assert np.linalg.norm(exact("scara4", beyond.motors()[-1])[:2]) > np.linalg.norm(at[:2]) + 20
    assert np.abs(np.diff(beyond.motors(), axis=0)).max() < 5
    np.testing.assert_allclose(back.positions()[-1, :3], beside(at[:3], 1, 0, 0), atol=0.03)


def test_a_jog_that_is_cancelled_ends_at_once(tmp_path: Path) -> None:
    at = home_of("scara4")
    jog, after = answers(
        compiled(tmp_path, "scara4"),
        "scara4",
        [("cancelled", 7, 900, *beside(at, 30, 0, 0, 0)), ("jog", 900, *beside(at, 9, 0, 0, 0))],
    )

    assert len(jog.places) == 7
    np.testing.assert_allclose(after.positions()[-1, :3], beside(at[:3], 9, 0, 0), atol=0.03)


def test_a_probing_move_or_a_jog_is_shortened_to_what_is_within_reach(tmp_path: Path) -> None:
    at = home_of("scara4")
    far, near = answers(
        compiled(tmp_path, "scara4"),
        "scara4",
        [("clip", *beside(at, 9000, 0, 0, 0)), ("clip", *beside(at, 5, 0, 0, 0))],
    )

    assert at[0] + 20 < far.lines["beyond"][0] < machine("scara4", Controller.GRBLHAL).reach
    np.testing.assert_allclose(near.lines["within"], beside(at, 5, 0, 0, 0), atol=1e-3)


@pytest.mark.parametrize("name", ARMS)
def test_each_motor_is_homed_by_its_own_switch(name: str, tmp_path: Path) -> None:
    """The move and the pull-off turn one motor alone, which is then at its limit, less the pull-off; joints follow."""
    made = machine(name, Controller.GRBLHAL)
    program = compiled(tmp_path, name)
    found = answers(program, name, [("home", motor.index) for motor in made.motors])

    before = np.array(padded([motor.home for motor in made.motors], 4))
    for motor, answer in zip(made.motors, found, strict=True):
        is_low = motor.index in (0, 2)
        others = [axis for axis in range(4) if axis != motor.index]
        assert answer.alarm == 0
        assert answer.motors()[:, motor.index] == pytest.approx([-40, 2] if is_low else [40, -2])
        np.testing.assert_allclose(answer.motors()[:, others], [before[others]] * 2, atol=1e-3)
        place = (motor.low or 0) + 2 if is_low else (motor.high or 0) - 2
        assert answer.lines["home"][motor.index] == pytest.approx(place, abs=1e-3)
        np.testing.assert_allclose(answer.lines["home"][4:7], exact(name, answer.lines["home"][:4]), atol=0.03)
        before[motor.index] = place


def test_the_places_of_the_switches_can_be_stated(tmp_path: Path) -> None:
    change = ("#ifndef SCARA4_SWITCHES_2", "#define SCARA4_SWITCHES_2 {-11.5F, 22.25F}\n#ifndef SCARA4_SWITCHES_2")
    (answer,) = answers(compiled(tmp_path, "scara4", change), "scara4", [("home", 1)])

    assert answer.lines["home"][1] == pytest.approx(22.25 - 2)


def test_axes_that_are_no_joints_are_passed_through(tmp_path: Path) -> None:
    at = home_of("scara")
    start = [*(joint.home for joint in machine("scara", Controller.GRBLHAL).joints), 11.0, 12.0]
    move, single = answers(
        compiled(tmp_path, "scara", axes=5),
        "scara",
        [("feed", 100, *beside(at[:3], 10, 0, 0), 21.0, 22.0), ("single", *at[:3], 31.0, 32.0)],
        axes=5,
        start=start,
    )

    assert move.motors(5)[-1, 3:] == pytest.approx([21, 22])
    np.testing.assert_allclose(move.positions(5)[:, 3], np.linspace(11, 21, len(move.places) + 1)[1:], atol=1e-3)
    np.testing.assert_allclose(move.positions(5)[:, 4], np.linspace(12, 22, len(move.places) + 1)[1:], atol=1e-3)
    assert single.lines["single"][3:] == pytest.approx([31, 32])
    np.testing.assert_allclose(single.lines["single"][:3], start[:3], atol=1e-2)


@pytest.mark.parametrize("name", ["coupled3", "splined4"])
def test_runtime_parameters_are_settings_that_move_the_tool_and_no_motor(name: str, tmp_path: Path) -> None:
    """Another tool: the position is that of its tip, a line too, and the settings outlast the power."""
    made, arm = machine(name, Controller.GRBLHAL), kernels(name).robot
    begin = [motor.home for motor in made.motors]
    other = with_parameter(with_parameter(arm, 0, 151.5 / made.millimetres), 1, -62.0 / made.millimetres)
    pose = reference.pose(other, [joints_at(name, Controller.GRBLHAL, begin)])[0, 0]
    tip, way = pose[:3, 3] * made.millimetres, np.array([9.0, -8.0, 7.0])
    turned = [home_of(name)[3]] if made.coordinates == "XYZC" else [0.0]
    first, second, kept, move, usual = answers(
        compiled(tmp_path, name),
        name,
        [
            ("set", 640, 151.5),
            ("set", 641, -62.0),
            ("restart",),
            ("feed", 900, *(tip + way), *turned),
            ("set", 640, 100.0),
        ],
    )

    assert np.linalg.norm(first.lines["here"][:3] - home_of(name)[:3]) > 5
    np.testing.assert_allclose(second.lines["here"][:3], tip, atol=0.03)
    np.testing.assert_allclose(kept.lines["here"], second.lines["here"], atol=1e-6)
    assert move.minutes.sum() == pytest.approx(np.linalg.norm(way) / 900, rel=2e-3)
    reached = reference.pose(other, [joints_at(name, Controller.GRBLHAL, move.motors()[-1, : made.dof])])[0, 0, :3, 3]
    np.testing.assert_allclose(reached * made.millimetres, tip + way, atol=0.03)
    assert np.linalg.norm(usual.lines["here"][:3] - move.positions()[-1, :3]) > 5


def test_settings_that_leave_the_tool_no_position_are_put_back(tmp_path: Path) -> None:
    """A gear ratio of zero, or a joint that no motor moves; linkages have no position before they are homed."""
    program, name, at = compiled(tmp_path, "geared3"), "geared3", home_of("geared3")
    commands = [("set", 641, 0), ("set", 642, 0), ("set", 640, float("nan")), ("restart",), ("set", 641, 2.5)]
    *kept, other = answers(program, name, commands)

    for answer in kept:
        np.testing.assert_allclose(answer.lines["here"][:3], at[:3], atol=0.03)
    assert np.linalg.norm(other.lines["here"][:3] - at[:3]) > 5
    unhomed = answers(program, name, [("set", 641, 0), ("set", 640, 101.0), ("restart",)], start=[0.0] * 4)
    assert not np.isfinite(np.concatenate([answer.lines["here"][:3] for answer in unhomed])).any()
    begin = padded([motor.home for motor in machine(name, Controller.GRBLHAL).motors], 4)
    said = run_with(program, " ".join(map(str, [*[STEPS] * 4, *begin, 0, 0, "set", 641, 0])))
    assert "[MSG:Warning: geared3: the tool has no position with this setting; it is put back]" in said


def test_runtime_parameters_may_be_words_in_capitals(tmp_path: Path) -> None:
    """A macro of the plug-in with the name of a parameter would be put in its place."""
    compiled(tmp_path, "capitals3")


ALTERATIONS = {
    "degrees": ("#define SCARA4_DEGREES 57.2957795F", "#define SCARA4_DEGREES 57.5F"),
    "another buffer": (
        "    scale_feed(pl_data);\n    return &line.motors;",
        "    scale_feed(pl_data);\n    return NULL;",
    ),
    "end": ("(piece == pieces) ? to[i]", "(piece == pieces) ? from[i]"),
    "row": ("position[1] = pose[7]", "position[1] = pose[11]"),
    "feed": ("feed_rate *= moved / piece", "feed_rate *= piece / moved"),
    "no feed": ("plan->feed_rate *= moved / piece;", ""),
}


@pytest.mark.parametrize("case", ALTERATIONS)
def test_an_altered_plug_in_is_noticed(case: str, tmp_path: Path) -> None:
    goal = home_of("scara4") + np.array([20, 0, 0, 0])
    with pytest.raises((AssertionError, IndexError)):  # noqa: PT012 - the compiler may notice it too
        (move,) = answers(compiled(tmp_path, "scara4", ALTERATIONS[case]), "scara4", [("feed", 100, *goal)])
        np.testing.assert_allclose(move.positions()[-1, :3], goal[:3], atol=0.03)
        np.testing.assert_allclose(exact("scara4", move.motors()[-1]), move.positions()[-1, :3], atol=0.03)
        assert move.minutes.sum() == pytest.approx(20 / 100, rel=1e-2)
