"""Rotations to try, written out by hand, and a way to evaluate coordinates of them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import sympy as sp
from hypothesis import strategies as st
from numpy.typing import NDArray

from kinegen.derive.expressions import LetBindings
from kinegen.derive.orientation import FORMS
from kinegen.model.outputs import Kind

Floats = NDArray[np.float64]

ANGLES = {
    Kind.RPY_ZYX: lambda a: rz(a[2]) @ ry(a[1]) @ rx(a[0]),
    Kind.RPY_XYZ: lambda a: rx(a[0]) @ ry(a[1]) @ rz(a[2]),
    Kind.EULER_ZYZ: lambda a: rz(a[0]) @ ry(a[1]) @ rz(a[2]),
}
"""The product that the name of each three-angle form states."""


def rx(angle: float) -> Floats:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def ry(angle: float) -> Floats:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def rz(angle: float) -> Floats:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def skew(v: Floats) -> Floats:
    """The matrix that multiplies by `v x`."""
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def about(axis: Floats, angle: float) -> Floats:
    """Rodrigues' formula."""
    unit = np.asarray(axis, float) / np.linalg.norm(axis)
    cosine = np.cos(angle)
    return cosine * np.eye(3) + np.sin(angle) * skew(unit) + (1 - cosine) * np.outer(unit, unit)


def of_quaternion(q: Floats) -> Floats:
    """The rotation of a unit quaternion w, x, y, z."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


_quarter = st.sampled_from([rx, ry, rz])
_near = st.sampled_from([0.0, np.pi / 2, -np.pi / 2, np.pi])
_off = st.sampled_from([0.0, 1e-16, -1e-12, 1e-8, -1e-4])
_any = st.floats(-3.2, 3.2)
_axis = st.tuples(*[st.sampled_from([-1.0, -1e-9, 0.0, 1e-5, 0.3, 1.0])] * 3).filter(lambda v: max(map(abs, v)) > 0.2)


@st.composite
def quarter_turns(draw: st.DrawFn) -> Floats:
    """A product of quarter turns without rounding: every singularity is among them."""
    product = np.eye(3)
    for turn in draw(st.lists(_quarter, max_size=5)):
        product = product @ np.round(turn(np.pi / 2))
    return product + 0.0


@st.composite
def half_turns(draw: st.DrawFn) -> Floats:
    """Half a turn, or nearly, about an axis that may lie in or beside a plane."""
    return about(np.array(draw(_axis)), np.pi + draw(_off))


@st.composite
def turned(draw: st.DrawFn) -> Floats:
    """Three turns, many of them on or beside singularities."""
    one_angle = st.one_of(_any, st.builds(lambda near, off: near + off, _near, _off))
    return rx(draw(one_angle)) @ ry(draw(one_angle)) @ rz(draw(one_angle))


@st.composite
def small(draw: st.DrawFn) -> Floats:
    """Nearly no turn at all."""
    return about(np.array(draw(_axis)), draw(st.sampled_from([0.0, 1e-200, 1e-160, 1e-17, 1e-9, 1e-4])))


rotations = st.one_of(quarter_turns(), half_turns(), turned(), small())
velocities = st.tuples(*[st.floats(-2, 2)] * 3).map(np.array)


def coordinates(kind: Kind, R: Floats) -> Floats:
    """The coordinates of a rotation, as the symbolic stage writes them."""
    return np.array(_function(kind)(*R.ravel(), 0, 0, 0)[0], float)


def rates(kind: Kind, R: Floats, omega: Floats) -> Floats:
    """The rates of the coordinates at an angular velocity."""
    return np.array(_function(kind)(*R.ravel(), *omega)[1], float)


@cache
def _function(kind: Kind) -> Callable[..., tuple[list[Floats], list[Floats]]]:
    names = [[sp.Symbol(f"r{row}{column}", real=True) for column in range(3)] for row in range(3)]
    omega = tuple(sp.Symbol(f"w{axis}", real=True) for axis in range(3))
    bindings = LetBindings()
    found = FORMS[kind](tuple(tuple(row) for row in names), bindings)
    results = [list(found.values), list(found.rates(omega))]
    given = [*names[0], *names[1], *names[2], *omega]
    return sp.lambdify(given, results, "math", cse=lambda each: (bindings.definitions, list(each)))
