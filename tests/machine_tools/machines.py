"""Five-axis machines of the standard types, and their transformations written out, one function for each.

The types are those of R.-S. Lee and C.-H. She, Developing a postprocessor for three types of five-axis machine tools,
Int. J. Adv. Manuf. Technol. 13 (1997) 658-665 (table, spindle, both), and those with an axis inclined by 45 degrees.
Each function is the product of the motions between workpiece and tool, multiplied out by hand into sines and cosines.
Angles of tables are those of the tool against the workpiece. L is the length of the tool.

`trunnion_by_manual` is printed: 5-Axis Kinematics in the LinuxCNC documentation (R. du Preez), section on the trunnion
with A and C, the forward transformation with an offset between the rotary axes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, sin, sqrt

import numpy as np

Vector = tuple[float, float, float]
Motion = Callable[..., tuple[Vector, Vector]]

L = 80.0
_HEAD = """\
kinegen: 1
name: {name}
convention: standard
units: {{length: mm, angle: rad}}
parameters:
  tool_length: {{value: 80, runtime: true}}
joints:
"""


@dataclass(frozen=True, slots=True)
class Machine:
    """One machine.

    Attributes:
        name: What it is called.
        rows: The joints of the robot file, then its frames.
        formula: Point of the tool and direction of its axis in the frame of the workpiece, of the joint vector.
    """

    name: str
    rows: str
    formula: Motion

    @property
    def text(self) -> str:
        """The robot file."""
        return _HEAD.format(name=self.name) + self.rows

    def motion(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points and directions of joint vectors (first rotary, second rotary, x, y, z), shape (N, 3) each."""
        rows = [self.formula(*map(float, row)) for row in q]
        return np.array([point for point, _ in rows]), np.array([axis for _, axis in rows])


SLIDES = """\
  - {{name: x, parent: {parent}, ets: [Tx(q)], limits: [-500, 500]}}
  - {{name: y, parent: x, ets: [Ty(q)], limits: [-500, 500]}}
  - {{name: z, parent: y, ets: [Tz(q)], limits: [-500, 500]}}
"""
FRAMES = """\
frames:
  workpiece: {{parent: {workpiece}, tip: true, xyz: [0, 0, 0]}}
  cutter: {{parent: {tool}, tip: true, ets: [Tz(-tool_length)]}}
"""


def table_ac(c: float, a: float, x: float, y: float, z: float) -> tuple[Vector, Vector]:
    """Trunnion with A under C: p = Rz(c) Rx(a) (x, y, z - L), and the axis is the third column of Rz(c) Rx(a)."""
    h = z - L
    return (
        (
            x * cos(c) - y * sin(c) * cos(a) + h * sin(c) * sin(a),
            x * sin(c) + y * cos(c) * cos(a) - h * cos(c) * sin(a),
            y * sin(a) + h * cos(a),
        ),
        (sin(c) * sin(a), -cos(c) * sin(a), cos(a)),
    )


def table_bc(c: float, b: float, x: float, y: float, z: float) -> tuple[Vector, Vector]:
    """Trunnion with B under C: p = Rz(c) Ry(b) (x, y, z - L)."""
    h = z - L
    return (
        (
            x * cos(c) * cos(b) - y * sin(c) + h * cos(c) * sin(b),
            x * sin(c) * cos(b) + y * cos(c) + h * sin(c) * sin(b),
            -x * sin(b) + h * cos(b),
        ),
        (cos(c) * sin(b), sin(c) * sin(b), cos(b)),
    )


def head_ca(c: float, a: float, x: float, y: float, z: float) -> tuple[Vector, Vector]:
    """Fork head with A on C: the tip is L behind the pivot along the axis Rz(c) Rx(a) z."""
    axis = (sin(c) * sin(a), -cos(c) * sin(a), cos(a))
    return (x - L * axis[0], y - L * axis[1], z - L * axis[2]), axis


def head_cb(c: float, b: float, x: float, y: float, z: float) -> tuple[Vector, Vector]:
    """Fork head with B on C: the axis is Rz(c) Ry(b) z."""
    axis = (cos(c) * sin(b), sin(c) * sin(b), cos(b))
    return (x - L * axis[0], y - L * axis[1], z - L * axis[2]), axis


def mixed_cb(c: float, b: float, x: float, y: float, z: float) -> tuple[Vector, Vector]:
    """Table with C, head with B: p = Rz(c) ((x, y, z) - L Ry(b) z)."""
    u, v, w = x - L * sin(b), y, z - L * cos(b)
    return (
        (u * cos(c) - v * sin(c), u * sin(c) + v * cos(c), w),
        (sin(b) * cos(c), sin(b) * sin(c), cos(b)),
    )


def _inclined(b: float) -> Vector:
    """The z axis turned by b about (0, 1, 1) / sqrt(2)."""
    return (sin(b) / sqrt(2), (1 - cos(b)) / 2, (1 + cos(b)) / 2)


def nutating_head(c: float, b: float, x: float, y: float, z: float) -> tuple[Vector, Vector]:
    """Head with B at 45 degrees on C."""
    u, v, w = _inclined(b)
    axis = (u * cos(c) - v * sin(c), u * sin(c) + v * cos(c), w)
    return (x - L * axis[0], y - L * axis[1], z - L * axis[2]), axis


def nutating_table(c: float, b: float, x: float, y: float, z: float) -> tuple[Vector, Vector]:
    """Table with C on B at 45 degrees: p = Rz(c) R(b) (x, y, z - L)."""
    h, s = z - L, sin(b) / sqrt(2)
    k, m = (1 + cos(b)) / 2, (1 - cos(b)) / 2
    u, v, w = x * cos(b) - y * s + h * s, x * s + y * k + h * m, -x * s + y * m + h * k
    p, q, r = _inclined(b)
    return (
        (u * cos(c) - v * sin(c), u * sin(c) + v * cos(c), w),
        (p * cos(c) - q * sin(c), p * sin(c) + q * cos(c), r),
    )


def nutating_mixed(c: float, b: float, x: float, y: float, z: float) -> tuple[Vector, Vector]:
    """Table with C, head with B at 45 degrees."""
    p, q, r = _inclined(b)
    u, v, w = x - L * p, y - L * q, z - L * r
    return (
        (u * cos(c) - v * sin(c), u * sin(c) + v * cos(c), w),
        (p * cos(c) - q * sin(c), p * sin(c) + q * cos(c), r),
    )


def trunnion_by_manual(a: float, c: float, place: Vector, dy: float, dz: float) -> Vector:
    """The point of a tool in the frame of the workpiece, which turns with the table.

    Args:
        a: Tilt of the table.
        c: Turn of the table.
        place: Of the tool, in the axes of the machine from the zero of the workpiece.
        dy: How far the axis of A is from that of C, along y.
        dz: How far the axis of A is above the zero of the workpiece.
    """
    x, y, z = place
    return (
        x * cos(c) + (y - dy) * sin(c) * cos(a) + (z - dz) * sin(c) * sin(a) + dy * sin(c),
        -x * sin(c) + (y - dy) * cos(c) * cos(a) + (z - dz) * cos(c) * sin(a) + dy * cos(c),
        -(y - dy) * sin(a) + (z - dz) * cos(a) + dz,
    )


_TABLE = """\
  - {{name: second, parent: base, ets: [{second}], limits: [-2.5, 2.5]}}
  - {{name: first, parent: second, ets: [Rz(-q)], limits: [-7, 7]}}
"""
_TURNED = "  - {name: first, parent: base, ets: [Rz(-q)], limits: [-7, 7]}\n"
_INCLINED = "Rx(-pi/4), Rz({0}q), Rx(pi/4)"


def _head(second: str) -> str:
    return (
        SLIDES.format(parent="base")
        + "  - {name: first, parent: z, ets: [Rz(q)], limits: [-7, 7]}\n"
        + f"  - {{name: second, parent: first, ets: [{second}], limits: [-2.5, 2.5]}}\n"
    )


def _on_table(second: str) -> str:
    return _TABLE.format(second=second) + SLIDES.format(parent="base") + FRAMES.format(workpiece="first", tool="z")


def _in_head(second: str) -> str:
    return _head(second) + FRAMES.format(workpiece="plate", tool="second").replace("{{", "{")


def _mixed(second: str) -> str:
    rows = _TURNED + SLIDES.format(parent="base")
    rows += f"  - {{name: second, parent: z, ets: [{second}], limits: [-2.5, 2.5]}}\n"
    return rows + FRAMES.format(workpiece="first", tool="second")


_PLATE = "  - {name: plate, parent: base, ets: [Tz(0)]}\n"

MACHINES = (
    Machine("table_ac", _on_table("Rx(-q)"), table_ac),
    Machine("table_bc", _on_table("Ry(-q)"), table_bc),
    Machine("head_ca", _PLATE + _in_head("Rx(q)"), head_ca),
    Machine("head_cb", _PLATE + _in_head("Ry(q)"), head_cb),
    Machine("mixed_cb", _mixed("Ry(q)"), mixed_cb),
    Machine("nutating_head", _PLATE + _in_head(_INCLINED.format("")), nutating_head),
    Machine("nutating_table", _on_table(_INCLINED.format("-")), nutating_table),
    Machine("nutating_mixed", _mixed(_INCLINED.format("")), nutating_mixed),
)
