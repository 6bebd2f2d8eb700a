"""Robots at random, as texts of robot files: all conventions and features together, from a seed.

A robot is decided by its seed and number alone. One seed is the commit that is checked out, so every change is proven
with other robots than the last one; a failure names seed and number, with which `robot_text` makes the robot again.
"""

from __future__ import annotations

import random
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

CONVENTIONS = ("standard", "modified", "modified_prev_d", "hayati", "ets")
OUTPUTS = (
    *("pose", "frames", "position", "jacobian", "jacobian_local", "fk_jacobian_world", "twist", "hessian"),
    *("acceleration", "bias_acceleration_local", "quaternion_wxyz", "rpy_zyx", "rpy_xyz", "euler_zyz", "axis_angle"),
    *("rpy_zyx_jacobian", "inverse_pose", "adjoint", "transform_point"),
)
SHORT = ("frames", "position", "quaternion_wxyz", "rpy_zyx", "euler_zyz", "axis_angle", "inverse_pose", "adjoint")
"""What is built of robots with many rows, whose derivatives take minutes."""

MANY = 8
_LENGTHS = ("0", "0", "0.4318", "-0.02", "1/3", "0.25", "a", "-2*b", "a + b", "0.1503")
_TWISTS = ("0", "0", "90", "-90", "180", "270", "30", "-45", "89.9999", "pi/3", "17.25", "acos(1/3)", "2*atan(1/2)")
_TURNS = ("q", "q", "q", "-q", "q + 90", "180 - q", "q - 30", "2*q", "q/2 + 0.1")
_STROKES = ("q", "-q", "q + 0.1", "0.5*q + a")
_LIMITS = ("[-170, 170]", "[-90, 90]", "[0, 360]", "[-720, 10]", "[30, 60]")
_RIGHT = (0, 90, -90, 180, 30, 12.5)


def commit() -> str:
    """The commit that is checked out; `0` without git."""
    command = ("git", "-C", str(ROOT), "rev-parse", "HEAD")
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return "0"


@dataclass
class RandomRobot:
    """One robot in the making.

    Attributes:
        draw: The source of chance.
        movers: Names of its joint variables so far, and whether each is an angle.
        lines: Its rows.
    """

    draw: random.Random
    movers: dict[str, bool] = field(default_factory=dict)
    lines: list[str] = field(default_factory=list)

    def text(self) -> str:
        """The robot file."""
        draw = self.draw
        count = draw.choice((1, 2, 2, 3, 3, 4, 5, 6, 6, 7, 9, 12, 20))
        is_tree = count > 3 and draw.random() < 0.3
        for index in range(count):
            self._add_row(index, is_tree=is_tree)
        flag = draw.choice(("true", "false"))
        head = [
            "kinegen: 1",
            "name: chance",
            f"convention: {draw.choice(CONVENTIONS[:3])}",
            f"units: {{length: {draw.choice(('m', 'mm'))}, angle: deg}}",
            "parameters:",
            f"  a: {{value: 0.31, runtime: {flag}}}",
            "  b: 0.17",
        ]
        # Both parameters are used, or the file is refused.
        frames = ["frames:", f"  station: {{parent: base, xyz: [a, 0, -b], rpy: {self._angles()}}}"]
        frames += [f"  camera: {{parent: j{draw.randrange(count)}, xyz: {self._place()}, rpy: {self._angles()}}}"]
        sides = [f"base: {{xyz: {self._place()}, rpy: {self._angles()}}}"] * (draw.random() < 0.6)
        sides += [f"tool: {{xyz: {self._place()}, rpy: {self._angles()}}}"] * (not is_tree and draw.random() < 0.6)
        return "\n".join([*head, "joints:", *self.lines, *sides, *frames, *self._actuators(), ""])

    def _add_row(self, index: int, *, is_tree: bool) -> None:
        draw, name = self.draw, f"j{index}"
        kinds = ["revolute"] * 6 + ["prismatic", "screw", "fixed"] + ["follower", "slider"] * bool(self.movers)
        kind, convention = draw.choice(kinds), draw.choice((*CONVENTIONS, "", ""))
        theta, d, more = draw.choice(_TWISTS), draw.choice(_LENGTHS), ""
        if kind == "revolute" or (kind in ("prismatic", "screw", "slider") and convention == "hayati"):
            kind, theta = "revolute", draw.choice(_TURNS)
            more = f", limits: {draw.choice(_LIMITS)}" * (draw.random() < 0.6)
        elif kind == "prismatic":
            d, more = draw.choice(_STROKES), ", limits: [-0.2, 0.7]" * (draw.random() < 0.8)
        elif kind == "screw":
            theta, d = "q", draw.choice(("0.01*q/(2*pi)", "-0.003*q/pi"))
        elif kind == "follower":
            theta = f"{draw.choice(('0.5', '-1', '2'))}*{draw.choice(list(self.movers))} + 10"
        elif kind == "slider":
            d = f"{draw.choice(('0.01', '-0.01', '2'))}*{draw.choice(list(self.movers))}"
        if kind in ("revolute", "prismatic", "screw"):
            self.movers[name] = kind != "prismatic"
        if is_tree and index > 1 and draw.random() < 0.3:
            more += f", parent: {draw.choice(('base', *(f'j{each}' for each in range(index))))}"
        self.lines.append(f"  - {{name: {name}, {self._entries(convention, theta, d)}{more}}}")

    def _entries(self, convention: str, theta: str, d: str) -> str:
        """The entries of a row in a convention; that of the file where it is not named."""
        a, alpha = self.draw.choice(_LENGTHS), self.draw.choice(_TWISTS)
        if convention == "ets":
            axis = self.draw.choice("xyz")
            return f"ets: [T{axis}({d}), R{axis}({theta}), Tx({a}), Ry({alpha})]"
        if convention == "hayati":
            beta = self.draw.choice(_TWISTS)
            return f"convention: hayati, theta: {theta}, a: {a}, alpha: {alpha}, beta: {beta}"
        named = f"convention: {convention}, " if convention else ""
        return f"{named}theta: {theta}, d: {d}, a: {a}, alpha: {alpha}"

    def _place(self) -> str:
        return f"[{', '.join(self.draw.choice(('0', '0.1', '-0.25', 'b')) for _ in range(3))}]"

    def _angles(self) -> str:
        return str([self.draw.choice(_RIGHT) for _ in range(3)])

    def _actuators(self) -> list[str]:
        """Gears on all joints, the last two of three or more coupled; none on most robots."""
        angles = [name for name, is_angle in self.movers.items() if is_angle]
        if not angles or len(angles) < len(self.movers) or self.draw.random() < 0.6:
            return []
        readings = ", ".join(f"m{name}: angle" for name in angles)
        pair = angles[-2:] if len(angles) > 2 and self.draw.random() < 0.5 else []
        lines = ["actuators:", f"  readings: {{{readings}}}", "  joints:"]
        for name in angles:
            if name not in pair:
                ratio = self.draw.choice(("100", "50", "3/2"))
                lines.append(f"    - {{joint: {name}, form: gear, actuator: m{name}, ratio: {ratio}}}")
        if pair:
            joints, actuators = ", ".join(pair), ", ".join(f"m{name}" for name in pair)
            lines += [f"    - joints: [{joints}]", "      form: coupling", f"      actuators: [{actuators}]"]
            lines += ["      matrix:", "        - [1/6, 1/6]", "        - [1/6, -1/6]"]
        return lines


def robot_text(seed: str, number: int) -> str:
    """A robot file.

    Args:
        seed: What decides all robots, such as a commit.
        number: Which of them.
    """
    return RandomRobot(random.Random(f"{seed} {number}")).text()


def outputs_of(seed: str, number: int) -> tuple[str, ...]:
    """What is built of a robot: poses, some other outputs, and those of actuators where there are any."""
    draw = random.Random(f"outputs {seed} {number}")
    driven = ("fk_actuators", "actuators_to_joints", "joints_to_actuators", "jacobian_actuators")
    text = robot_text(seed, number)
    some = draw.sample(SHORT if rows_of(text) > MANY else OUTPUTS[1:], 4)
    return ("pose", *some, *driven * ("\nactuators:\n" in text))


def wrt_of(seed: str, number: int) -> tuple[str, ...]:
    """What stays an argument of the kernels beside the runtime parameters: all of the table for every sixth robot.

    A table of elementary sequences alone has no entries that could stay one.
    """
    text = robot_text(seed, number)
    is_short = rows_of(text) <= MANY
    has_entries = rows_of(text) > text.count("ets: [")
    return ("dh",) if is_short and has_entries and random.Random(f"wrt {seed} {number}").random() < 1 / 6 else ()


def rows_of(text: str) -> int:
    """The number of rows of a robot file."""
    return text.count("  - {name: j")
