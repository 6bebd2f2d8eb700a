"""Determinants and minors of the Jacobian in closed form: right for every arm, and factored as books print them."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import sympy as sp
from hypothesis import HealthCheck, assume, given, settings
from numpy.typing import NDArray

import kinegen
from kinegen.derive.pose import transform
from kinegen.derive.singularities.loci import Loci, Minor, singular_loci
from kinegen.model.expression_parser import evaluate
from kinegen.model.expression_values import FLOAT64
from kinegen.model.robot import Robot as Model
from kinegen.ui.api.robot import Robot
from kinegen.verify.reference import Kinematics
from tests.chains import robots

ROWS = ("vx", "vy", "vz", "wx", "wy", "wz")

Rows = list[tuple[Any, Any, Any, Any]]
"""theta, d, a and alpha of each row, in degrees."""

STANDARD: dict[str, Rows] = {
    "ur5": [
        ("q", "d1", 0, 90),
        ("q", 0, "a2", 0),
        ("q", 0, "a3", 0),
        ("q", "d4", 0, 90),
        ("q", "d5", 0, -90),
        ("q", "d6", 0, 0),
    ],
    "irb": [
        ("q", "d1", "a1", -90),
        ("q - 90", 0, "a2", 0),
        ("q", 0, "a3", -90),
        ("q", "d4", 0, 90),
        ("q", 0, 0, -90),
        ("q", "d6", 0, 0),
    ],
    "stanford": [
        ("q", "d1", 0, -90),
        ("q", "d2", 0, 90),
        (0, "q", 0, 0),
        ("q", 0, 0, -90),
        ("q", 0, 0, 90),
        ("q", "d6", 0, 0),
    ],
    "scara": [("q", "d1", "a1", 0), ("q", 0, "a2", 180), (0, "q", 0, 0), ("q", "d4", 0, 0)],
    "planar_2r": [("q", 0, "a1", 0), ("q", 0, "a2", 0)],
    "planar_3r": [("q", 0, "a1", 0), ("q", 0, "a2", 0), ("q", 0, "a3", 0)],
    "planar_4r": [("q", 0, "a1", 0), ("q", 0, "a2", 0), ("q", 0, "a3", 0), ("q", 0, "a4", 0)],
    "iiwa": [
        ("q", "d1", 0, -90),
        ("q", 0, 0, 90),
        ("q", "d3", 0, 90),
        ("q", 0, 0, -90),
        ("q", "d5", 0, -90),
        ("q", 0, 0, 90),
        ("q", "d6", 0, 0),
    ],
    "scorbot": [("q", "d1", "a1", -90), ("q", 0, "a2", 0), ("q", 0, "a3", 0), ("q - 90", 0, 0, -90), ("q", "d5", 0, 0)],
    "anthropomorphic": [("q", "d1", 0, 90), ("q", 0, "a2", 0), ("q", 0, "a3", 0)],
    "cylindrical": [("q", "d1", 0, 0), (0, "q", 0, -90), (0, "q", 0, 0)],
    "spherical": [("q", "d1", 0, -90), ("q", "d2", 0, 90), (0, "q", 0, 0)],
    "wrist": [("q", 0, 0, -90), ("q", 0, 0, 90), ("q", "d6", 0, 0)],
    "skew": [("q", "d1", "a1", 60), ("q", "d2", "a2", 30), ("q", "d4", "a3", 45)],
}
MODIFIED: dict[str, Rows] = {
    "puma": [
        ("q", 0, 0, 0), ("q", 0, 0, -90), ("q", "d3", "a2", 0), ("q", "d4", "a3", -90),
        ("q", 0, 0, 90), ("q", 0, 0, -90),
    ],
    "panda": [
        ("q", "d1", 0, 0), ("q", 0, 0, -90), ("q", "d3", 0, 90), ("q", 0, "a4", 90),
        ("q", "d5", "-a4", -90), ("q", 0, 0, 90), ("q", 0, "a7", 90),
    ],
    "five": [
        ("q", "d1", "a1", -90), ("q", 0, "a2", 0), ("q", "d3", 0, -90), ("q", 0, 0, 90), ("q", "d5", 0, -90),
    ],
}  # fmt: skip
LENGTHS = {
    f"{letter}{number}": 0.1 + 0.07 * number + 0.05 * (letter == "d") for letter in "ad" for number in range(1, 8)
}


def arm(name: str) -> Robot:
    convention = "standard" if name in STANDARD else "modified"
    rows = (STANDARD | MODIFIED)[name]
    used = [length for length in LENGTHS if any(length in str(entry) for row in rows for entry in row)]
    joints = [
        dict(zip(("name", "theta", "d", "a", "alpha"), (f"j{index}", *row), strict=True))
        for index, row in enumerate(rows, start=1)
    ]
    return kinegen.load(
        {
            "kinegen": 1,
            "name": name,
            "convention": convention,
            "units": {"length": "m", "angle": "deg"},
            "parameters": {length: LENGTHS[length] for length in used},
            "joints": joints,
        }
    )


def numbers(robot: Model, q: NDArray[np.float64]) -> dict[sp.Symbol, float]:
    values = {sp.Symbol(each.name, real=True): evaluate(each.value, {}, FLOAT64) for each in robot.parameters}
    return values | {sp.Symbol(each.name, real=True): q[each.index] for each in robot.variables}


def value(minor: Minor, at: dict[sp.Symbol, float]) -> float:
    return float(minor.constant) * math.prod(float(f.expression.subs(at)) ** f.power for f in minor.factors)


def seen(robot: Model, loci: Loci, q: NDArray[np.float64]) -> NDArray[np.float64]:
    """The Jacobian of the reference, in the axes and for the point that the loci name."""
    kinematics = Kinematics(robot, q[None])
    jacobian = kinematics.jacobian(robot.tips[0])[0]
    tip = kinematics.pose(robot.tips[0])[0]
    base = np.array(transform(robot, robot.root, 0).subs(numbers(robot, q)), dtype=float)
    frames = {robot.root: np.eye(4), "0": base, "": tip}
    axes, place = (frames[name] if name in frames else kinematics.pose(name)[0] for name in (loci.axes, loci.point))
    turn, point = axes[:3, :3] if loci.axes else np.eye(3), place[:3, 3]
    linear = jacobian[:3] + np.cross(jacobian[3:], point - tip[:3, 3], axisa=0, axisc=0)
    return np.concatenate([turn.T @ linear, turn.T @ jacobian[3:]])


@pytest.mark.parametrize("name", [*STANDARD, *MODIFIED])
def test_every_minor_is_that_of_the_reference(name: str) -> None:
    robot = arm(name)
    loci = singular_loci(robot, robot.root, robot.tips[0])

    places = np.random.default_rng(3).uniform(-2, 2, (3, robot.dof))
    found = [require_minors(robot, loci, q) for q in places]
    assert any(found)


def require_minors(robot: Model, loci: Loci, q: NDArray[np.float64]) -> bool:
    """Compare all minors; say whether one of them is not zero."""
    assert loci.common is not None
    known = {(minor.rows, minor.joints): minor for minor in loci.minors or [loci.common]}
    names = [variable.name for variable in robot.variables]
    jacobian, at, some = seen(robot, loci, q), numbers(robot, q), False
    for rows, joints in itertools.product(
        itertools.combinations(loci.rows, loci.rank), itertools.combinations(loci.joints, loci.rank)
    ):
        columns = [names.index(joint) for joint in joints]
        expected = np.linalg.det(jacobian[np.ix_([ROWS.index(row) for row in rows], columns)])
        minor = known.get((rows, joints))
        found = 0.0 if minor is None else value(minor, at) * (value(loci.common, at) if loci.minors else 1)
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)
        some = some or abs(expected) > 1e-6
    return some


PRINTED = {
    "ur5": "a2*a3*sin(j3)*sin(j5)*(a2*cos(j2) + a3*cos(j2 + j3) + d5*sin(j2 + j3 + j4))",
    "puma": "a2*sin(j5)*(a3*sin(j3) + d4*cos(j3))*(a2*cos(j2) + a3*cos(j2 + j3) - d4*sin(j2 + j3))",
    "stanford": "j3**2*sin(j2)*sin(j5)",
    "scara": "a1*a2*sin(j2)",
    "planar_2r": "a1*a2*sin(j2)",
    "planar_3r": "a1*a2*sin(j2)",
    "anthropomorphic": "a2*a3*sin(j3)*(a2*cos(j2) + a3*cos(j2 + j3))",
    "cylindrical": "j3",
    "wrist": "sin(j2)",
    "iiwa": "d3*d5*sin(j4)",
    "scorbot": "a2*a3*sin(j3)",
}
"""What books print, or of several minors what they share; the sign depends on the table."""


@pytest.mark.parametrize("name", PRINTED)
def test_the_factors_are_those_of_books(name: str) -> None:
    robot = arm(name)
    common = singular_loci(robot, robot.root, robot.tips[0]).common
    assert common is not None
    expected = sp.Mul.make_args(sp.sympify(PRINTED[name], locals=symbols(robot)))

    assert sorted(str(f.expression**f.power) for f in common.factors) == sorted(map(str, expected))


def symbols(robot: Robot) -> dict[str, sp.Symbol]:
    return {name: sp.Symbol(name, real=True) for name in (*robot.joints, *(each.name for each in robot.parameters))}


def test_an_arm_with_seven_joints_is_singular_where_two_factors_vanish() -> None:
    robot = arm("iiwa")
    sets = singular_loci(robot, robot.root, robot.tips[0]).sets

    assert sets is not None
    assert {frozenset(map(str, each)) for each in sets} == {
        frozenset({"sin(j4)"}),
        frozenset({"sin(j2)", "cos(j3)"}),
        frozenset({"sin(j6)", "cos(j5)"}),
        frozenset({"sin(j2)", "sin(j6)"}),
    }


@pytest.mark.parametrize("name", ["ur5", "irb", "puma", "stanford", "scorbot", "iiwa", "planar_4r", "scara", "five"])
def test_the_jacobian_loses_rank_where_a_set_vanishes(name: str) -> None:
    robot = arm(name)
    loci = singular_loci(robot, robot.root, robot.tips[0])
    assert loci.sets
    for expressions in loci.sets:
        q = vanishing(robot, expressions)
        assert q is not None, expressions
        rank = np.linalg.matrix_rank(Kinematics(robot, q[None]).jacobian(robot.tips[0])[0], tol=1e-6)
        assert rank == loci.rank - 1, (expressions, q)


def vanishing(robot: Robot, expressions: tuple[sp.Expr, ...]) -> NDArray[np.float64] | None:
    """A joint vector at which expressions vanish, by Newton's method with differences."""
    joints = [sp.Symbol(name, real=True) for name in robot.joints]
    lengths = {key: value for key, value in numbers(robot, np.zeros(robot.dof)).items() if key not in joints}
    function = sp.lambdify([joints], [each.subs(lengths) for each in expressions])
    for start in np.random.default_rng(1).uniform(-2, 2, (30, robot.dof)):
        q = start
        for _ in range(50):
            here = np.array(function(q))
            slopes = np.array([(np.array(function(q + step)) - here) / 1e-6 for step in 1e-6 * np.eye(robot.dof)]).T
            q = q - np.linalg.pinv(slopes) @ here
        if np.abs(function(q)).max() < 1e-10:
            return np.asarray(q, dtype=np.float64)
    return None


def test_one_minor_is_a_determinant_and_names_its_rows_alone() -> None:
    """The row that it leaves out vanishes for the point in question, and the minor is the same for every other one."""
    robot = arm("five")
    loci = singular_loci(robot, robot.root, robot.tips[0])
    assert loci.minors == ()
    assert loci.rows == ("vx", "vy", "wx", "wy", "wz")

    at_the_tip = replace(loci, point="")
    assert require_minors(robot, at_the_tip, np.array([0.3, -0.7, 1.1, 0.4, -0.2]))


@pytest.mark.parametrize("name", ["ur5", "irb", "puma", "stanford", "scorbot", "iiwa", "planar_4r", "five"])
def test_no_other_place_is_singular(name: str) -> None:
    """Multiples of 45 degrees meet most of the sets, and much beside them."""
    robot = arm(name)
    loci = singular_loci(robot, robot.root, robot.tips[0])
    assert loci.sets
    joints = [sp.Symbol(joint, real=True) for joint in robot.joints]
    lengths = {key: value for key, value in numbers(robot, np.zeros(robot.dof)).items() if key not in joints}
    places = np.random.default_rng(2).integers(-4, 5, (400, robot.dof)) * np.pi / 4
    jacobians = Kinematics(robot, places).jacobian(robot.tips[0])
    functions = [sp.lambdify([joints], [each.subs(lengths) for each in some]) for some in loci.sets]
    singular = [any(np.abs(function(q)).max() < 1e-9 for function in functions) for q in places]

    assert 20 < sum(singular) < 400
    assert singular == [np.linalg.matrix_rank(jacobian, tol=1e-9) < loci.rank for jacobian in jacobians]


@given(robot=robots())
@settings(max_examples=25, suppress_health_check=list(HealthCheck))
def test_minors_of_random_chains_are_those_of_the_reference(robot: Model) -> None:
    """Of every convention, with joints that slide, screw and follow others, and any twists."""
    assume(0 < robot.dof <= 4 and not robot.is_tree)
    try:
        loci = singular_loci(robot, robot.root, robot.tips[0])
    except kinegen.KinegenError:
        return
    assume(loci.common is not None and (loci.axes or loci.rank == 6))
    require_minors(robot, loci, np.random.default_rng(3).uniform(-2, 2, robot.dof))


def test_what_is_too_long_is_not_known_instead_of_wrong() -> None:
    robot = kinegen.load(
        {
            "kinegen": 1,
            "name": "general",
            "convention": "standard",
            "units": {"length": "m", "angle": "deg"},
            "joints": [
                {"name": f"j{n}", "theta": "q", "d": 0.1 * n, "a": 0.2 + 0.01 * n, "alpha": 20 + 7 * n}
                for n in range(1, 7)
            ],
        }
    )
    loci = singular_loci(robot, robot.root, robot.tips[0])

    assert (loci.common, loci.minors, loci.missing, loci.sets) == (None, (), 1, None)


def test_a_frame_that_no_joint_moves_has_no_jacobian() -> None:
    robot = arm("scara")
    with pytest.raises(kinegen.KinegenError, match="no joint of scara moves 0"):
        singular_loci(robot, robot.root, "0")
