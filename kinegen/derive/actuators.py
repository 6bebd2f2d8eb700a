"""What is computed from and for actuators: joints, readings, the pose and its derivative by the readings."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import sympy as sp

from kinegen.derive.derivative import derivative
from kinegen.derive.drivetrain import Drivetrain, drivetrain, solve
from kinegen.derive.expressions import (
    Definition,
    Expressions,
    LetBindings,
    chains_of,
    frame_array,
    joint_array,
    joint_symbols,
    parameter_symbols,
    pose_array,
    signature,
)
from kinegen.derive.folding import dot, fold
from kinegen.derive.pose import cheapest_plan, evaluate, pose_entries
from kinegen.model.outputs import Array, Kind, Quantity
from kinegen.model.robot import Robot

JOINTS = "joints"
"""The joint vector beside the actuator vector."""


def derive_actuators(robot: Robot, quantity: Quantity) -> Expressions:
    """Derive what has to do with actuators.

    Returns:
        In readings and runtime parameters: the joint vector; twelve entries for each frame, the upper three rows of its
        pose; or a matrix of six rows for each frame, row by row, with a column for each reading, J dq/dA. In joint
        variables and runtime parameters: the readings.

    Raises:
        KinegenError: If the robot has no actuators, there is no such frame, or no closed form of the readings.
    """
    match quantity.kind:
        case Kind.ACTUATORS_TO_JOINTS:
            return _joints(robot, quantity)
        case Kind.JOINTS_TO_ACTUATORS:
            return _readings(robot, quantity)
        case Kind.FK_ACTUATORS:
            return _pose(robot, quantity)
        case _:
            return _jacobian(robot, quantity)


def actuator_array(robot: Robot) -> Array:
    """Return the actuator vector."""
    return Array("actuators", (len(robot.actuators.readings),))


def _joints(robot: Robot, quantity: Quantity) -> Expressions:
    train = drivetrain(robot)
    entries = [train.values[variable.name] for variable in robot.variables]
    return _expressions(train, quantity, joint_array(robot, JOINTS), entries)


def _readings(robot: Robot, quantity: Quantity) -> Expressions:
    solution = solve(robot)
    return Expressions(
        signature=signature(robot, quantity, (joint_array(robot, JOINTS),), actuator_array(robot)),
        variables=joint_symbols(robot, solution.values),
        parameters=parameter_symbols(robot, solution.values),
        ways=(solution.bindings.way(solution.solved[reading.name] for reading in robot.actuators.readings),),
    )


def _pose(robot: Robot, quantity: Quantity) -> Expressions:
    train = drivetrain(robot)
    bindings = LetBindings()
    entries: list[sp.Expr] = []
    for chain in chains_of(robot, quantity, train.values):
        folded = fold(chain)
        columns, position = evaluate(folded, cheapest_plan(folded), bindings)
        entries += pose_entries(columns, position, folded.attitude)
    return _expressions(train, quantity, pose_array(robot, quantity), _joined(train, bindings.definitions, entries))


def _jacobian(robot: Robot, quantity: Quantity) -> Expressions:
    """By the chain rule: the derivative by whatever the joints are sums of, times its derivative by the readings."""
    train = drivetrain(robot)
    moving = (*train.readings, *train.parts)
    chains = chains_of(robot, quantity, train.values)
    found = derivative(chains, moving, quantity.reference)
    entries = _joined(train, found.definitions, found.entries)
    rates = [[train.rate(symbol, reading) for symbol in moving] for reading in train.readings]
    rows = [entries[start : start + len(moving)] for start in range(0, len(entries), len(moving))]
    products = [dot(row, rate) for row in rows for rate in rates]
    result = frame_array(robot, quantity, "jacobian", (6, len(train.readings)))
    return _expressions(train, quantity, result, products)


def _expressions(train: Drivetrain, quantity: Quantity, result: Array, entries: Sequence[sp.Expr]) -> Expressions:
    robot = train.robot
    return Expressions(
        signature=signature(robot, quantity, (actuator_array(robot),), result),
        variables=train.readings,
        parameters=parameter_symbols(robot, train.values),
        ways=(train.bindings.way(entries),),
    )


def _joined(train: Drivetrain, definitions: Iterable[Definition], entries: Iterable[sp.Expr]) -> list[sp.Expr]:
    """Put what was derived into the bindings of the drivetrain, with sines and cosines of linkages in closed form.

    A linkage gives the sine and cosine of its angle at less cost than the angle itself, so that a pose takes neither
    `atan2` nor a sine of it: `cos(A1 + part)` becomes `cos(A1)*cosine - sin(A1)*sine`.
    """
    written = [*definitions]
    outputs = list(entries)
    angles = _angles([*(value for _, value in written), *outputs], train)
    known: dict[sp.Expr, sp.Expr] = {}
    for angle in angles:
        cosine, sine = _closed(angle, train)
        known |= {sp.cos(angle): cosine, sp.sin(angle): sine}
    train.bindings.definitions += [(symbol, value.xreplace(known)) for symbol, value in written]
    return [output.xreplace(known) for output in outputs]


def _angles(expressions: Iterable[sp.Expr], train: Drivetrain) -> list[sp.Expr]:
    """Return the angles with parts in them whose sine and cosine have a closed form, in order of appearance."""
    found: dict[sp.Expr, None] = {}
    moving = (*train.readings, *train.parts)
    for expression in expressions:
        angles = {atom.args[0] for atom in expression.atoms(sp.sin, sp.cos)}
        for angle in sorted(angles, key=lambda angle: [str(angle.coeff(symbol)) for symbol in moving]):
            inside = [(part, angle.coeff(symbol)) for symbol, part in train.parts.items() if angle.has(symbol)]
            if inside and all(abs(factor) == 1 and part.cosine is not None for part, factor in inside):
                found[angle] = None
    return list(found)


def _closed(angle: sp.Expr, train: Drivetrain) -> tuple[sp.Expr, sp.Expr]:
    name = train.bindings.name
    inside = [(part, angle.coeff(symbol)) for symbol, part in train.parts.items() if angle.has(symbol)]
    rest = angle - sum((factor * part.symbol for part, factor in inside), sp.S.Zero)
    cosine, sine = sp.cos(rest), sp.sin(rest)
    for part, factor in inside:
        c, s = part.cosine, factor * part.sine
        cosine, sine = name(cosine * c - sine * s), name(sine * c + cosine * s)
    return cosine, sine
