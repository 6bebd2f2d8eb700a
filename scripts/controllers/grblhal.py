"""grblHAL itself, from checkouts of its core and its simulator, above an arm whose motors count their steps."""

from __future__ import annotations

import contextlib
import math
import re
import select
import socket
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from kinegen.backends.controllers.machine import Machine
from kinegen.model.robot import Robot
from kinegen.verify import reference
from tests.controllers.paths import Numbers, joints_of, other_tool, speed

HERE = Path(__file__).resolve().parent
SIMULATOR = "main simulator driver eeprom grbl_eeprom_extensions mcu serial grbl_interface platform_linux".split()
DEFINED = ("-DF_CPU=16000000", "-DKINEMATICS_API", "-DPLATFORM_LINUX")
STEPS = 1000
"""Steps per degree and per millimetre."""

PULL_OFF = 1.0
_SHUT_DOWN = b"\x06"
_ASK, _RESET, _CANCEL_JOG = b"?", b"\x18", b"\x85"

_PATIENCE = 180.0, 2.0
"""Seconds to wait for an answer, and for one to a byte that the simulator may have lost."""

_FLOAT = 1e-4
"""What floats of grblHAL and of the plug-in may put a motor off, in degrees and millimetres."""

_CHORDS = 20
"""Speeds are measured over so many of the recorded milliseconds."""


def compiled(core: Path, simulator: Path, package: Path, axes: int, place: Path) -> Path:
    """The simulator with a plug-in; nothing in the checkouts is changed."""
    (place / "grbl").symlink_to(core.resolve())
    information = "\n".join(f'#define SIM_{name} "-"' for name in ("BUILD_TYPE", "C_FLAGS", "COMPILER", "TARGET"))
    (place / "build_info.h").write_text(information + "\n")
    theirs = [simulator / "src" / f"{name}.c" for name in SIMULATOR]
    theirs += [path for path in (*core.glob("*.c"), *core.glob("kinematics/*.c")) if path.name != "my_plugin.c"]
    flags = ["-w", "-O2", "-fno-strict-aliasing", *DEFINED, f"-DN_AXIS={axes}"]
    folders = [f"-I{each}" for each in (place, simulator / "src", place / "grbl", package)]
    ours = [*package.glob("*.c"), *package.glob("example/*.c"), HERE / "grblhal.c"]
    libraries = ["-Wl,--wrap=driver_init,--wrap=plan_buffer_line", "-lm", "-lrt", "-lpthread"]
    subprocess.run(["gcc", *flags, *folders, *theirs, *ours, *libraries, "-o", place / "simulated"], check=True)
    return place / "simulated"


class Session:
    """A running simulator, and what it answers.

    Args:
        program: The compiled simulator.
        machine: The arm.
        start: Where its motors are when the power comes, in degrees and millimetres.
    """

    def __init__(self, program: Path, machine: Machine, start: Sequence[float]) -> None:
        self._folder = program.parent
        rows = [
            (begin, motor.low or 0.0, motor.high or 0.0) for begin, motor in zip(start, machine.motors, strict=True)
        ]
        text = "".join(" ".join(str(round(STEPS * number)) for number in row) + "\n" for row in rows)
        (self._folder / "arm").write_text(text + f"0 {-(10**9)} {10**9}\n" * 4)
        (self._folder / "EEPROM.DAT").unlink(missing_ok=True)
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        self._process = subprocess.Popen(
            [program, "-n", "-p", str(port)], cwd=self._folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        try:
            self._socket = self._connected(port)
        except BaseException:
            self._end()
            raise
        self._read = b""
        self.answers: list[str] = []
        self.offsets: Numbers | float = 0.0

    def _connected(self, port: int) -> socket.socket:
        for _ in range(100):
            with contextlib.suppress(OSError):
                return socket.create_connection(("127.0.0.1", port), timeout=180)
            time.sleep(0.05)
        raise SystemExit("the simulator does not start")

    def say(self, line: str) -> str:
        """Send a line, and return the last line of the answer: ok, an error or an alarm."""
        self._socket.sendall(line.encode() + b"\n")
        return self._until(("ok", "error", "ALARM"))

    def begin(self) -> None:
        """Read what is said when the power comes, such as that the memory of settings is empty."""
        self._socket.sendall(b"$I\n")
        self._until(("[VER",))
        self._until(("ok",))

    def _until(self, words: Sequence[str], again: bytes = b"") -> str:
        """The next line that begins with one of some words; bytes that may have been lost are sent again."""
        while True:
            while b"\n" not in self._read:
                if not select.select([self._socket], [], [], _PATIENCE[bool(again)])[0]:
                    if not again:
                        raise SystemExit(f"the simulator is silent, after {self.answers[-20:]}")
                    self._socket.sendall(again)
                elif received := self._socket.recv(4096):
                    self._read += received
                else:
                    raise SystemExit(f"the simulator has ended, after {self.answers[-20:]}")
            line, _, self._read = self._read.partition(b"\n")
            answer = line.decode(errors="replace").strip()
            self.answers.append(answer)
            if answer.startswith(tuple(words)):
                return answer

    def cancel_jog(self, line: str) -> None:
        """Send a jog that is longer than the planner's memory, and cancel it while it is being planned."""
        self._socket.sendall(line.encode() + b"\n")
        time.sleep(1)
        self._socket.sendall(_CANCEL_JOG)
        self._until(("ok", "error", "ALARM"))

    def reset(self) -> None:
        """Leave an alarm."""
        self._socket.sendall(_RESET)
        time.sleep(0.5)
        self.say("$X")

    def status(self) -> str:
        """The status report."""
        self._socket.sendall(_ASK)
        return self._until("<", _ASK)

    def wait(self) -> str:
        """Until nothing moves and nothing is planned, asked twice, or there is an alarm; the status then."""
        idle = 0
        while True:
            status = self.status()
            idle = idle + 1 if re.match(r"<Idle.*Bf:100,", status) else 0
            if idle == 2 or status.startswith("<Alarm"):
                return status
            time.sleep(0.05)

    def motors(self) -> Numbers:
        """Where the motors are, by their own count, in degrees and millimetres."""
        return self._numbers("MOTORS") / STEPS - self.offsets

    def planned(self) -> Numbers:
        """Motors at the end of the last block, as the planner was given them, in degrees and millimetres."""
        return self._numbers("PLANNED")

    def _numbers(self, command: str) -> Numbers:
        self.say(f"${command}")
        line = next(each for each in reversed(self.answers) if each.startswith(f"[{command}:"))
        return np.array(line[len(command) + 2 : -1].split(","), float)

    def recorded(self) -> Numbers:
        """Time in seconds, then the motors, in the order in which they moved."""
        axes = self.motors().size
        found = np.loadtxt(self._folder / "motors", ndmin=2) / ([1] + [STEPS] * axes)
        found[:, 1:] -= self.offsets
        return found

    def close(self) -> None:
        """End it."""
        with contextlib.suppress(OSError), self._socket:
            self._socket.sendall(_SHUT_DOWN)
        self._end()

    def _end(self) -> None:
        """End the process, which does not always heed SIGTERM."""
        self._process.kill()
        self._process.wait()


@contextlib.contextmanager
def session(program: Path, machine: Machine, start: Sequence[float]) -> Iterator[Session]:
    """A simulator with its settings, homed to the lower limits."""
    running = Session(program, machine, start)
    try:
        running.begin()
        for setting in settings(machine):
            running.say(setting)
        running.say("$H")
        yield running
    finally:
        running.close()


def settings(machine: Machine) -> list[str]:
    """The settings that a builder types: steps, rates, accelerations, travel, homing."""
    mask = (1 << machine.dof) - 1
    found = [f"$23={mask}", f"$27={PULL_OFF}", "$24=60", "$25=600", "$44=0", "$45=0", "$46=0"]
    for joint in machine.motors:
        low, high = joint.low, joint.high
        if low is None or high is None:
            raise SystemExit(f"{joint.name} has no limits, and is homed at one")
        rate, acceleration = (60000, 20000)
        found += [
            f"${100 + joint.index}={STEPS}",
            f"${110 + joint.index}={rate}",
            f"${120 + joint.index}={acceleration}",
            f"${130 + joint.index}={high - low}",
            f"${44 + joint.index}={1 << joint.index}",
        ]
    return [*found, "$22=1"]


class Judge:
    """What an arm in the simulator did, by an independent product of its table."""

    def __init__(self, robot: Robot, machine: Machine, running: Session) -> None:
        self._robot, self._machine, self._running = robot, machine, running

    def tool(self, motors: Numbers) -> Numbers:
        """Positions of the tool in mm for motors (N, axes)."""
        poses = reference.pose(self._robot, joints_of(self._robot, self._machine, motors))[:, 0]
        return np.asarray(poses[:, :3, 3] * self._machine.millimetres)

    def here(self) -> Numbers:
        """Where the tool is."""
        return np.asarray(self.tool(self._running.motors()[None])[0])

    def steps_off(self, place: Numbers) -> float:
        """How many steps the motors are from those that have the tool at a place; half a step is rounding."""
        return self._off(self._running.motors(), place) * STEPS

    def planned_off(self, place: Numbers) -> float:
        """The same before motors are rounded to steps, in degrees and millimetres."""
        return self._off(self._running.planned(), place)

    def _off(self, motors: Numbers, place: Numbers) -> float:
        at = motors[: self._machine.dof]
        ways = np.eye(len(at)) * 1e-3
        derivative = np.array([(self.tool((at + way)[None]) - self.tool((at - way)[None]))[0] / 2e-3 for way in ways]).T
        off = np.linalg.lstsq(derivative, self.tool(at[None])[0] - place, rcond=None)[0]
        return float(np.abs(off).max())

    def go(self, motors: Sequence[float] | Numbers) -> None:
        """Move until the motors are somewhere, in short lines along the way that they take."""
        begin = self._running.motors()[: self._machine.dof]
        for part in np.linspace(0, 1, 25)[1:]:
            target = begin + part * (np.array(motors) - begin)
            answer = self.line(self.tool(target[None])[0], "G1 F20000", self._turned(target))
            if answer != "ok":
                raise SystemExit(f"the way to the example's place is answered by {answer} at {target}")
        self._running.wait()

    def _turned(self, motors: Numbers) -> float | None:
        if not self._machine.turning:
            return None
        begin, *rates = self._machine.turning
        q = joints_of(self._robot, self._machine, motors[None])[0]
        return math.degrees(begin + float(np.dot(rates, q)))

    def line(self, to: Sequence[float] | Numbers, words: str, turned: float | None = None) -> str:
        """Send a move to a position of the tool."""
        a = "" if turned is None else f" A{turned:.4f}"
        return self._running.say(f"{words} X{to[0]:.4f} Y{to[1]:.4f} Z{to[2]:.4f}{a}")

    def timed(self, send: Callable[[], str]) -> tuple[Numbers, Numbers]:
        """Times and positions of the tool along a move, from the steps of the motors."""
        before = len(self._running.recorded())
        if (answer := send()) != "ok":
            raise SystemExit(f"the move is answered by {answer}, after {self._running.answers[-20:]}")
        self._running.wait()
        rows = self._running.recorded()[before:]
        if not len(rows):
            raise SystemExit(f"nothing moves, after {self._running.answers[-20:]}")
        return rows[:, 0], self.tool(rows[:, 1:])


def tried(robot: Robot, machine: Machine, program: Path) -> Iterator[tuple[str, float, float]]:
    """Run the cases.

    Args:
        robot: The arm.
        machine: The arm as the package sees it.
        program: The simulator with its plug-in.

    Yields:
        What was measured, the measure, and how far it may be off what is asked: an error, in its unit.
    """
    start = [(motor.low or 0) + 3 for motor in machine.motors]
    home = np.array([motor.home for motor in machine.motors])
    with session(program, machine, start) as running:
        judge = Judge(robot, machine, running)
        # A switch is seen some steps after it closes, which is no fault of the arm.
        running.offsets = running.motors()
        running.offsets[: machine.dof] -= np.array([motor.low for motor in machine.motors]) + PULL_OFF
        yield "homing: motors beside their places, units", float(np.abs(running.offsets).max()), 0.05
        judge.go(home)
        at, side = judge.here(), machine.reach * machine.millimetres / 8
        yield "position against the table, mm", _apart(running.status(), at), 0.01
        yield from _moves(running, judge, at, side)
        before = running.motors()
        beyond = judge.line(at + np.array([50 * side, 0, 0]), "G1 F600")
        moved = float(np.abs(running.motors() - before).max())
        yield "out of reach: motors that moved", moved + (beyond != "ALARM:2"), 0
        running.reset()
        judge.timed(lambda: judge.line(at, "G1 F6000"))
        running.cancel_jog(f"$J=G91 X{side:.4f} F300")
        status = running.wait()
        went = float(np.linalg.norm(judge.here() - at))
        yield "cancelled jog: part of its way", went / side, 0.25
        yield "cancelled jog: position against the table, mm", _apart(status, judge.here()), 0.01
        if robot.runtime_parameters:
            yield from _another_tool(running, robot, machine)


def _another_tool(running: Session, robot: Robot, machine: Machine) -> Iterator[tuple[str, float, float]]:
    """A runtime parameter is set, as for another tool: the motors stay, and lines are those of its tip."""
    before, (longer, values) = running.motors(), other_tool(robot, machine)
    for index, value in enumerate(values):
        if (answer := running.say(f"${640 + index}={value:.3f}")) != "ok":
            raise SystemExit(f"the parameter is answered by {answer}")
    judge = Judge(longer, machine, running)
    at, side = judge.here(), machine.reach * machine.millimetres / 20
    yield "another tool: motors that moved", float(np.abs(running.motors() - before).max()), 0
    yield "another tool: position against the table, mm", _apart(running.status(), at), 0.01
    end = at + np.array([-side, side, 0])
    times, places = judge.timed(lambda: judge.line(end, "G1 F1200"))
    yield "another tool: speed, %", 100 * abs(speed(times, places, _CHORDS) / 1200 - 1), 2
    yield "another tool: end of the line, steps", judge.steps_off(end), 0.55


def _moves(running: Session, judge: Judge, at: Numbers, side: float) -> Iterator[tuple[str, float, float]]:
    """Lines and arcs at two feeds, and a line that has to take its time."""

    def off(send: Callable[[], str], feed: float) -> float:
        return 100 * abs(speed(*judge.timed(send), _CHORDS) / feed - 1)

    beside, arc = at + np.array([side, 0, 0]), f"G3 X{at[0]:.4f} Y{at[1]:.4f} R{side:.4f}"
    for feed in (600, 3000):
        yield f"line at F{feed}: speed, %", off(partial(judge.line, beside, f"G1 F{feed}"), feed), 2
        yield f"line at F{feed}: its end, steps", judge.steps_off(beside), 0.55
        yield f"line at F{feed}: its end before rounding, units", judge.planned_off(np.round(beside, 4)), _FLOAT
        yield f"arc at F{feed}: speed, %", off(partial(running.say, f"{arc} F{feed}"), feed), 2
    yield "G93, 6 s: mean speed, %", off(partial(judge.line, at + np.array([0, side, 0]), "G93 G1 F10"), 10 * side), 2
    running.say("G94")


def _apart(status: str, tool: Numbers) -> float:
    found = np.array(re.findall(r"MPos:([^|]*)", status)[0].split(",")[:3], float)
    return float(np.abs(found - tool).max())
