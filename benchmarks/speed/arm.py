"""A robot as the benchmarks need it: its program, its table as numbers, its package, random configurations."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from kinegen.backends.bundle import RobotPrograms
from kinegen.derive.transforms import SYMPY
from kinegen.driver.pipeline import build
from kinegen.driver.results import BuildOptions
from kinegen.io.load import load
from kinegen.ir.lower import program_of
from kinegen.ir.program import Program
from kinegen.model.expression_parser import ZERO, evaluate, linear
from kinegen.model.outputs import Quantity
from kinegen.model.robot import Convention, Robot, Row
from kinegen.runtime.extension import load_package
from kinegen.verify import reference

ROBOTS = Path(__file__).resolve().parents[2] / "robots"

SEED = 560

Array = NDArray[Any]


@dataclass(frozen=True, slots=True)
class Link:
    """One row of a Denavit-Hartenberg table, exact.

    Attributes:
        standard: Whether the row is `Rz Tz Tx Rx`; otherwise it is Craig's `Rx Tx Rz Tz`.
        alpha: Twist.
        a: Length.
        d: Offset.
        theta: The constant part of the angle.
        joint: Index of the joint variable that is added to it, or None.
    """

    standard: bool
    alpha: sp.Expr
    a: sp.Expr
    d: sp.Expr
    theta: sp.Expr
    joint: int | None

    def matrix(self, c: Any, s: Any, number: Any = float) -> list[list[Any]]:
        """The link matrix as its book prints it.

        Args:
            c: Cosine of the whole angle, in any kind of numbers.
            s: Its sine.
            number: Makes such a number of an exact one.

        Returns:
            Four rows.
        """
        ca, sa, a, d = (number(value) for value in (sp.cos(self.alpha), sp.sin(self.alpha), self.a, self.d))
        last = [number(0), number(0), number(0), number(1)]
        if self.standard:
            return [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [number(0), sa, ca, d], last]
        return [[c, -s, number(0), a], [s * ca, c * ca, -sa, -sa * d], [s * sa, c * sa, ca, ca * d], last]


@dataclass(frozen=True, slots=True)
class Arm:
    """A chain of revolute joints.

    Attributes:
        robot: The robot.
        links: Its table.
        program: The pose kernel.
        kernels: The same, as the emitters take it.
        package: The compiled package.
    """

    robot: Robot
    links: tuple[Link, ...]
    program: Program
    kernels: RobotPrograms
    package: ModuleType

    @property
    def name(self) -> str:
        """Name of the robot."""
        return self.robot.name

    @property
    def dof(self) -> int:
        """Number of joints."""
        return self.robot.dof

    def configurations(self, count: int, real: str) -> Array:
        """Random joint vectors, all different, shape (count, dof)."""
        q = np.random.default_rng(SEED).uniform(-np.pi, np.pi, (count, self.dof))
        return q.astype(dtype(real))

    def poses(self, q: Array) -> Array:
        """The poses of the reference, shape (N, 4, 4)."""
        return reference.pose(self.robot, q)[:, 0]


def dtype(real: str) -> type[np.floating[Any]]:
    """The NumPy type of `double` and `float`."""
    return np.float64 if real == "double" else np.float32


def load_arm(name: str, folder: Path) -> Arm:
    """Load a robot file and build its package.

    Args:
        name: Name of a file in robots/, without its ending.
        folder: Where the package goes.

    Returns:
        The arm.
    """
    robot = load(ROBOTS / f"{name}.yaml")
    program = program_of(robot, Quantity.POSE)
    options = BuildOptions(output=folder, quantities=(Quantity.POSE,))
    result = build(ROBOTS / f"{name}.yaml", options, lambda _: None)
    return Arm(robot, links(robot), program, RobotPrograms(robot, (program,), ()), load_package(result.folder))


def links(robot: Robot) -> tuple[Link, ...]:
    """The table of a robot as numbers.

    Args:
        robot: A chain in one of the two usual conventions, with plain revolute joints and nothing at its ends.

    Raises:
        ValueError: If it is another kind of robot; the peers are set up for these alone.
    """
    if robot.is_tree or robot.base or robot.tool or robot.runtime_parameters:
        raise ValueError(f"{robot.name} is not a plain chain")
    values = {entry.name: evaluate(entry.value, {}, SYMPY) for entry in robot.parameters}
    indices = {variable.name: variable.index for variable in robot.variables}
    return tuple(_link(row, values, indices) for row in robot.rows)


def _link(row: Row, values: dict[str, Any], indices: dict[str, int]) -> Link:
    if row.convention not in (Convention.STANDARD, Convention.MODIFIED):
        raise ValueError(f"{row.name} is neither a standard nor a modified row")
    factors, constant = linear(row.theta or ZERO, frozenset(indices))
    if any(evaluate(factor, {}, SYMPY) != 1 for factor in factors.values()) or len(factors) > 1:
        raise ValueError(f"{row.name} is not a plain revolute joint")
    alpha, a, d, theta = (evaluate(entry or ZERO, values, SYMPY) for entry in (row.alpha, row.a, row.d, constant))
    joint = next((indices[name] for name in factors), None)
    return Link(row.convention is Convention.STANDARD, alpha, a, d, theta, joint)
