"""The reference's chain product in exact sympy numbers: a second way to every transform, from the printed links."""

from __future__ import annotations

from functools import cache

import sympy as sp

from kinegen.model.expression_parser import Arithmetic
from kinegen.model.robot import BASE, Robot
from kinegen.verify.reference import chain
from kinegen.verify.reference.exact_numbers import Kind

_EXACT = Kind(
    arithmetic=Arithmetic(
        number=lambda value: sp.Rational(value.numerator, value.denominator), pi=sp.pi, functions={"sqrt": sp.sqrt}
    ),
    sin=sp.sin,
    cos=sp.cos,
    matrix=sp.Matrix,
    multiply=lambda left, right: left * right,
)


@cache
def links(robot: Robot) -> dict[str, sp.Matrix]:
    """The link matrix of every frame but the base, in symbols."""
    values = {parameter.name: sp.Symbol(parameter.name, real=True) for parameter in robot.parameters}
    values |= {variable.name: sp.Symbol(variable.name, real=True) for variable in robot.variables}
    return chain.links_of(robot, values, _EXACT)


@cache
def parents(robot: Robot) -> dict[str, str]:
    """The parent of every frame but the base."""
    return dict(chain.parents(robot))


def transform(robot: Robot, start: str | int, end: str | int) -> sp.Matrix:
    """The transform between two frames as the plain product of the links.

    Args:
        robot: The robot; all its parameters stay symbols.
        start: Frame of reference, by name or row number.
        end: Frame that is reached.
    """
    up, down = _path(robot, start), _path(robot, end)
    while up and down and up[0] == down[0]:
        up, down = up[1:], down[1:]
    return _inverse(_product(robot, up)) * _product(robot, down)


def _path(robot: Robot, frame: str | int) -> list[str]:
    name = frame if isinstance(frame, str) else robot.rows[frame - 1].name if frame else chain.ORIGIN
    path = []
    while name != BASE:
        path.append(name)
        name = parents(robot)[name]
    return path[::-1]


def _product(robot: Robot, names: list[str]) -> sp.Matrix:
    product = sp.eye(4)
    for name in names:
        product = product * links(robot)[name]
    return product


def _inverse(matrix: sp.Matrix) -> sp.Matrix:
    """The inverse of a rigid displacement."""
    turn = matrix[:3, :3].T
    return sp.Matrix(sp.BlockMatrix([[turn, -turn * matrix[:3, 3]], [sp.zeros(1, 3), sp.eye(1)]]))
