"""The closed forms of a table as CasADi has them, and what they cost there."""

from __future__ import annotations

import math
from collections.abc import Callable

import casadi as ca
import numpy as np

from kinegen.model.outputs import Kind
from tests.operations.optimiser import PAIR
from tests.operations.tables import Mount, Row, Table

MULTIPLICATIONS = (ca.OP_MUL, ca.OP_SQ)
ADDITIONS = (ca.OP_ADD, ca.OP_SUB, ca.OP_TWICE)
FREE = (ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST, ca.OP_NEG)

QUARTERS = {0: (1, 0), 90: (0, 1), 180: (-1, 0), 270: (0, -1)}


def _matrix(rows: list[list[object]]) -> ca.SX:
    return ca.vertcat(*(ca.horzcat(*map(ca.SX, row)) for row in rows))


def _cosine_sine(degrees: float, variable: ca.SX | None = None) -> tuple[object, object]:
    """Of a variable plus an angle; quarter turns are exact."""
    if degrees % 90:
        angle = math.radians(degrees) + (0 if variable is None else variable)
        return ca.cos(angle), ca.sin(angle)
    c, s = QUARTERS[degrees % 360]
    if variable is None:
        return c, s
    return c * ca.cos(variable) - s * ca.sin(variable), s * ca.cos(variable) + c * ca.sin(variable)


def _about_z(row: Row, q: ca.SX) -> ca.SX:
    c, s = _cosine_sine(float(row.theta), row.sign * q if row.is_turning else None)
    d = float(row.d) + (0 if row.is_turning else row.sign * q)
    return _matrix([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, d], [0, 0, 0, 1]])


def _about_x(row: Row) -> ca.SX:
    c, s = _cosine_sine(float(row.alpha))
    return _matrix([[1, 0, 0, float(row.a)], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]])


def _mount(row: Mount) -> ca.SX:
    found = np.eye(4)
    found[:3, 3] = [float(each) for each in row.xyz]
    for axis, angle in row.turns:
        turn = np.eye(4)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        c, s = QUARTERS.get(float(angle) % 360) or (
            math.cos(math.radians(float(angle))),
            math.sin(math.radians(float(angle))),
        )
        turn[i, i] = turn[j, j] = c
        turn[i, j], turn[j, i] = -s, s
        found = found @ turn
    found[abs(found) < 1e-15] = 0
    return ca.SX(found)


class Peer:
    """The closed forms of a table as CasADi has them.

    Args:
        table: The arm.
    """

    def __init__(self, table: Table) -> None:
        number = table.joints
        self.q, self.rates = ca.SX.sym("q", number), ca.SX.sym("qd", number)
        pose = ca.SX.eye(4)
        axes = []
        variables = iter(ca.vertsplit(self.q))
        for row in table.rows:
            if isinstance(row, Mount):
                pose = pose @ _mount(row)
                continue
            q = next(variables)
            if table.convention == "modified":
                pose = pose @ _about_x(row)
            axes.append(row.sign * pose[:3, 2] if row.is_turning else ca.SX(3, 1))
            pose = pose @ _about_z(row, q)
            if table.convention == "standard":
                pose = pose @ _about_x(row)
        self.position = pose[:3, :3] @ ca.vertcat(*map(float, table.tool)) + pose[:3, 3]
        self.pose = ca.horzcat(pose[:3, :3], self.position)
        self.axes = ca.horzcat(*axes)

    def jacobian(self) -> ca.SX:
        """The linear part by differentiation, and the axes."""
        return ca.vertcat(ca.jacobian(self.position, self.q), self.axes)

    def twists(self) -> list[ca.SX]:
        """The Jacobian times the rates, and the derivative of the position along them."""
        angular = self.axes @ self.rates
        product = ca.jacobian(self.position, self.q) @ self.rates
        return [ca.vertcat(linear, angular) for linear in (product, ca.jtimes(self.position, self.q, self.rates))]

    def values(self, form: ca.SX, joints: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """A form at some joint variables and rates."""
        return np.asarray(ca.Function("form", [self.q, self.rates], [form])(joints, rates))

    def operations(self, form: ca.SX) -> int:
        """Multiplications and additions with common subexpressions once, and each pair as so many."""
        function = ca.Function("form", [self.q, self.rates], [ca.cse(form)])
        found = functions = 0
        for place in range(function.n_instructions()):
            operation = function.instruction_id(place)
            if operation in MULTIPLICATIONS or operation in ADDITIONS:
                found += 1
            elif operation in (ca.OP_SIN, ca.OP_COS):
                functions += 1
            else:
                assert operation in FREE, operation
        return found + PAIR * ((functions + 1) // 2)


FORMS: dict[Kind, Callable[[Peer], list[ca.SX]]] = {
    Kind.POSE: lambda peer: [peer.pose],
    Kind.POSITION: lambda peer: [peer.position],
    Kind.JACOBIAN: lambda peer: [peer.jacobian()],
    Kind.TWIST: Peer.twists,
}


def least_operations(table: Table, kind: Kind) -> int:
    """What the shortest form of CasADi costs."""
    peer = Peer(table)
    return min(map(peer.operations, FORMS[kind](peer)))
