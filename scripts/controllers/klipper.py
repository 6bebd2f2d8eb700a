"""Klipper's own host, from a checkout, above motors whose step commands are read back."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from kinegen.backends.controllers.machine import Machine
from kinegen.model.robot import Robot
from kinegen.verify import reference
from tests.controllers.paths import Numbers, joints_of, other_tool, speed

HERE = Path(__file__).resolve().parent
NEEDED = ("cffi", "greenlet", "jinja2", "serial")
CLOCK = 50_000_000
"""Ticks in a second, of the firmware for Linux."""

_CHORDS = 10
"""Speeds are measured over so many of the times that are looked at."""


def installed(checkout: Path, place: Path) -> Path:
    """A copy of the checkout with the messages of its firmware for Linux; nothing in the checkout is changed."""
    copy = place / "klipper"
    for folder in ("klippy", "src", "scripts", "lib/kconfiglib"):
        shutil.copytree(checkout / folder, copy / folder, ignore=shutil.ignore_patterns("*.so", "__pycache__"))
    shutil.copy(checkout / "Makefile", copy)
    (copy / ".config").write_text("CONFIG_MACH_LINUX=y\n")
    for goal in ("olddefconfig", "out/klipper.elf"):
        subprocess.run(["make", "-s", goal], cwd=copy, check=True, capture_output=True)
    shutil.copy(HERE / "klipper_judge.py", copy / "klippy" / "extras")
    return copy


class Host:
    """Klipper's host with a package.

    Args:
        copy: A copy of Klipper in which the package is installed.
        package: The package.
        place: An empty folder.
    """

    def __init__(self, copy: Path, package: Path, place: Path) -> None:
        self._copy, self._package, self._place = copy, package, place
        place.mkdir()
        self.notes: list[dict[str, Any]] = []

    def run(self, program: Sequence[str], change: Sequence[tuple[str, str]] = ()) -> None:
        """Run a program of G-code with the emitted printer.cfg, some of its lines replaced by patterns."""
        text = (self._package / "printer.cfg").read_text(encoding="utf-8")
        pins = sorted(set(re.findall(r"\bP[A-L]\d\b", text)))
        for pattern, new in change:
            text = re.sub(pattern, new, text, flags=re.MULTILINE)
        aliases = ", ".join(f"{pin}=gpiochip0/gpio{number}" for number, pin in enumerate(pins))
        notes = self._place / "notes"
        notes.unlink(missing_ok=True)
        text += f"\n[board_pins]\naliases: {aliases}\n[gcode_arcs]\nresolution: 0.5\n[klipper_judge]\npath: {notes}\n"
        (self._place / "printer.cfg").write_text(text)
        (self._place / "program").write_text("".join(f"{line}\n" for line in (*program, "FINISH")))
        dictionary, log = self._copy / "out" / "klipper.dict", self._place / "log"
        words: list[str | Path] = [
            sys.executable,
            self._copy / "klippy" / "klippy.py",
            self._place / "printer.cfg",
            "-l",
            log,
        ]
        words += ["-i", self._place / "program", "-o", self._place / "messages", "-d", dictionary]
        done = subprocess.run(words, check=False, capture_output=True, text=True)
        if done.returncode:
            raise SystemExit(f"Klipper ends with {done.returncode}: {done.stderr}{log.read_text()[-3000:]}")
        self.notes = [json.loads(line) for line in notes.read_text().splitlines()]

    def steps(self) -> list[Numbers]:
        """Times in seconds and counts of steps, (N, 2) for each motor, from the messages to the firmware."""
        script = self._copy / "klippy" / "parsedump.py"
        words: list[str | Path] = [
            sys.executable,
            script,
            self._copy / "out" / "klipper.dict",
            self._place / "messages",
        ]
        text = subprocess.run(words, check=True, capture_output=True, text=True).stdout
        motors: dict[int, _Motor] = {}
        for line in text.splitlines():
            name, *pairs = line.split()
            if name not in ("config_stepper", "reset_step_clock", "set_next_step_dir", "queue_step"):
                continue
            values = dict(pair.split("=", 1) for pair in pairs)
            motors.setdefault(int(values["oid"]), _Motor()).take(name, values)
        return [np.array(motor.rows, float).reshape(-1, 2) / [CLOCK, 1] for _, motor in sorted(motors.items())]


class _Motor:
    def __init__(self) -> None:
        self.rows: list[tuple[int, int]] = []
        self._clock = self._count = 0
        self._way = 1

    def take(self, name: str, values: dict[str, str]) -> None:
        if name == "reset_step_clock":
            # The message has the lower 32 bits of the clock, which never goes back.
            self._clock += (int(values["clock"]) - self._clock) % 2**32
        elif name == "set_next_step_dir":
            self._way = 1 if int(values["dir"]) else -1
        elif name == "queue_step":
            interval, add = int(values["interval"]), int(values["add"])
            for _ in range(int(values["count"])):
                self._clock += interval
                interval += add
                self._count += self._way
                self.rows.append((self._clock, self._count))


class Judge:
    """What an arm did, by an independent product of its table."""

    def __init__(self, robot: Robot, machine: Machine, host: Host) -> None:
        self._robot, self._machine, self._host = robot, machine, host
        self._units = np.array([np.pi / 180 if motor.turns else 1.0 for motor in machine.motors])
        self.home = np.array([motor.home for motor in machine.motors]) * self._units

    def tool(self, motors: Numbers) -> Numbers:
        """Positions of the tool in mm for motors (N, 3) in radians and mm."""
        q = joints_of(self._robot, self._machine, motors / self._units)
        return np.asarray(reference.pose(self._robot, q)[:, 0, :3, 3] * self._machine.millimetres)

    def along(self, index: int) -> tuple[Numbers, Numbers]:
        """Times, and motors in radians and mm, between two notes; a motor is between two steps where the time is."""
        begin, end = self._host.notes[index], self._host.notes[index + 1]
        times = np.linspace(begin["time"], end["time"], 1501)
        found = []
        steps = self._host.steps()
        if [int(rows[-1, 1]) if len(rows) else 0 for rows in steps] != self._host.notes[-1]["steps"]:
            raise SystemExit("the messages to the firmware are not those of all steps that Klipper counts")
        for rows, distance, home in zip(steps, end["distances"], self.home, strict=True):
            moved = np.interp(times, rows[:, 0], rows[:, 1] * distance) if len(rows) else np.zeros(len(times))
            found.append(moved + home)
        return times, np.array(found).T

    def off_places(self, index: int) -> tuple[float, float]:
        """How far in steps the motors are from the position at a note: as stated, and as counted beyond a step."""
        note = self._host.notes[index]
        stated, distances = np.array(note["motors"]), np.array(note["distances"])
        apart = self.tool(stated[None])[0] - np.array(note["position"])
        off = np.linalg.lstsq(self._derivative(stated), apart, rcond=None)[0] / distances
        counted = np.array(note["steps"]) - (stated - self.home) / distances
        return float(np.abs(off).max()), float(max(0.0, np.abs(counted).max() - 1.0))

    def _derivative(self, motors: Numbers) -> Numbers:
        ways = np.eye(3) * 1e-4
        return (self.tool(motors + ways) - self.tool(motors - ways)).T / 2e-4


def tried(robot: Robot, machine: Machine, copy: Path, package: Path, place: Path) -> Iterator[tuple[str, float, float]]:
    """Run the cases.

    Args:
        robot: The arm.
        machine: The arm as the package sees it.
        copy: A copy of Klipper in which the package is installed.
        package: The package.
        place: A folder that does not exist yet.

    Yields:
        What was measured, the measure, and how far it may be off what is asked: an error, in its unit.
    """
    host = Host(copy, package, place)
    judge = Judge(robot, machine, host)
    side = round(machine.reach * machine.millimetres / 10, 3)
    yield from _by_hand(host, judge, side)
    yield from _limited(host, judge, machine, side)
    if all(motor.low is not None for motor in machine.motors):
        yield from _switched(host, judge, machine)
    if robot.runtime_parameters:
        yield from _another_tool(host, robot, machine, side)


def _by_hand(host: Host, judge: Judge, side: float) -> Iterator[tuple[str, float, float]]:
    feeds = (300, 1500)
    x, y, z = judge.tool(judge.home[None])[0]
    program = ["G28", "JUDGE"]
    for feed in feeds:
        program += [f"G1 X{x + side:.6f} F{feed}", "JUDGE", f"G2 X{x:.6f} Y{y:.6f} I{-side / 2} J0 F{feed}", "JUDGE"]
    program += [f"REFUSED X={50 * side}", f"REFUSED X={side / 100}", f"G1 Y{y + 0.5:.6f}", "JUDGE"]
    host.run([*program, "SET_KINEMATIC_POSITION", f"G1 Z{z + side / 2:.6f}", "JUDGE"])
    notes = [note for note in host.notes if "time" in note]
    answers = [note["answer"] for note in host.notes if "answer" in note]
    host.notes = notes
    yield (
        "by hand: tool beside its home pose, mm",
        float(np.abs(judge.tool(judge.home[None])[0] - notes[0]["position"]).max()),
        1e-5,
    )
    for number, feed in enumerate(feeds):
        for kind, index in (("line", 2 * number), ("arc", 2 * number + 1)):
            times, motors = judge.along(index)
            found = speed(times, judge.tool(motors), _CHORDS)
            yield f"{kind} at F{feed}: speed, %", 100 * abs(found / feed - 1), 2
    offs = [judge.off_places(index) for index in range(len(notes))]
    yield "ends of blocks: motors as stated, steps", max(stated for stated, _ in offs), 1e-4
    yield "ends of blocks: motors as counted beyond a step", max(counted for _, counted in offs), 1e-2
    yield "answers that are wrong", float("out of reach" not in answers[0]) + float(answers[1] != "moves"), 0
    box = np.array(notes[0]["box"])
    inside = [bool((box[0] <= note["position"]).all() and (note["position"] <= box[1]).all()) for note in notes]
    yield "positions outside axis_minimum and axis_maximum", float(len(inside) - sum(inside)), 0


def _limited(host: Host, judge: Judge, machine: Machine, side: float) -> Iterator[tuple[str, float, float]]:
    limit = 2.0
    host.run(
        ["G28", "G91", "JUDGE", f"G1 X{side} F6000", "JUDGE"],
        [(r"^max_(joint|motor)_velocity: .*", rf"max_\1_velocity: {limit}")],
    )
    times, motors = judge.along(0)
    units = np.array([np.pi / 180 if motor.turns else 1.0 for motor in machine.motors])
    rates = np.abs(np.diff(motors[::25] / units, axis=0)) / np.diff(times[::25])[:, None]
    fastest = float(rates.max() / limit)
    yield "largest motor speed over its limit, %", 100 * (fastest - 1), 2
    yield "that below its limit, %", 100 * (1 - fastest), 5


def _switched(host: Host, judge: Judge, machine: Machine) -> Iterator[tuple[str, float, float]]:
    host.run(["G28", "JUDGE"], [(r"^#(?=endstop_pin|position_|homing_)", "")])
    note = host.notes[0]
    low = np.array([motor.low for motor in machine.motors if motor.low is not None])
    places = low * [np.pi / 180 if motor.turns else 1.0 for motor in machine.motors]
    yield "switches: motors beside them, units", float(np.abs(np.array(note["motors"]) - places).max()), 1e-6
    yield "switches: axes that are not homed", float(note["homed"] != "xyz"), 0
    tool = judge.tool(places[None])[0]
    yield "switches: tool beside its place, mm", float(np.abs(tool - note["position"]).max()), 1e-6


def _another_tool(host: Host, robot: Robot, machine: Machine, side: float) -> Iterator[tuple[str, float, float]]:
    """A runtime parameter is set, as for another tool: the motors stay, and lines are those of its tip."""
    longer, values = other_tool(robot, machine)
    words = [f"{each.name.upper()}={value}" for each, value in zip(robot.runtime_parameters, values, strict=True)]
    host.run(
        ["G28", "JUDGE", f"SET_KINEMATICS_PARAMETERS {' '.join(words)}", "JUDGE", "G91", f"G1 X{side} F900", "JUDGE"]
    )
    judge = Judge(longer, machine, host)
    before, after = (np.array(note["motors"]) for note in host.notes[:2])
    yield "another tool: motors that moved, units", float(np.abs(after - before).max()), 1e-12
    yield (
        "another tool: its place, mm",
        float(np.abs(judge.tool(after[None])[0] - host.notes[1]["position"]).max()),
        1e-9,
    )
    times, motors = judge.along(1)
    yield "another tool: speed, %", 100 * abs(speed(times, judge.tool(motors), _CHORDS) / 900 - 1), 2
    yield "another tool: end of the line, steps", judge.off_places(2)[0], 1e-4
