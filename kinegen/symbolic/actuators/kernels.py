"""What is computed from and for actuators: joints, readings, and the pose and its derivative by the readings."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import sympy as sp

from kinegen.outputs import Array, Kind, Quantity
from kinegen.robot.model import Robot
from kinegen.symbolic.actuators.inverse import solve
from kinegen.symbolic.actuators.joints import Drivetrain, drivetrain
from kinegen.symbolic.chain import transforms_between
from kinegen.symbolic.derivative import derivative
from kinegen.symbolic.expressions import Definition, Expressions, Tape
from kinegen.symbolic.fold import fold
from kinegen.symbolic.pose import cheapest_plan, evaluate, pose_entries
from kinegen.symbolic.signatures import (
    frame_array,
    frames_of,
    joint_array,
    joint_symbols,
    parameter_symbols,
    pose_array,
    signature,
    start_of,
)

KINDS = (Kind.ACTUATORS_TO_JOINTS, Kind.JOINTS_TO_ACTUATORS, Kind.FK_ACTUATORS, Kind.JACOBIAN_ACTUATORS)

JOINTS = "joints"
"""The joint vector beside the actuator vector."""


def derive_actuators(robot: Robot, quantity: Quantity) -> Expressions:
    """Derive what has to do with actuators.

    Args:
        robot: The robot; parameters that are not runtime parameters become exact numbers.
        quantity: One of `KINDS`; the poses and Jacobians of the tips, or of one frame.

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
    """The actuator vector."""
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
        definitions=tuple(solution.tape.definitions),
        entries=tuple(solution.solved[reading.name] for reading in robot.actuators.readings),
    )


def _pose(robot: Robot, quantity: Quantity) -> Expressions:
    train = drivetrain(robot)
    tape = Tape()
    entries: list[sp.Expr] = []
    for frame in frames_of(robot, quantity):
        folded = fold(transforms_between(robot, start_of(robot, quantity), frame, train.values))
        columns, position = evaluate(folded, cheapest_plan(folded), tape)
        entries += pose_entries(columns, position, folded.attitude)
    return _expressions(train, quantity, pose_array(robot, quantity), _joined(train, tape.definitions, entries))


def _jacobian(robot: Robot, quantity: Quantity) -> Expressions:
    """By the chain rule: the derivative by whatever the joints are sums of, times its derivative by the readings."""
    train = drivetrain(robot)
    moving = (*train.readings, *train.parts)
    chains = [
        transforms_between(robot, start_of(robot, quantity), frame, train.values)
        for frame in frames_of(robot, quantity)
    ]
    found = derivative(chains, moving, quantity.reference)
    entries = _joined(train, found.definitions, found.entries)
    rates = [[train.rate(symbol, reading) for symbol in moving] for reading in train.readings]
    rows = [entries[start : start + len(moving)] for start in range(0, len(entries), len(moving))]
    products = [_dot(row, rate) for row in rows for rate in rates]
    result = frame_array(robot, quantity, "jacobian", (6, len(train.readings)))
    return _expressions(train, quantity, result, products)


def _dot(row: Sequence[sp.Expr], rates: Sequence[sp.Expr]) -> sp.Expr:
    return sum((entry * rate for entry, rate in zip(row, rates, strict=True)), sp.S.Zero)


def _expressions(train: Drivetrain, quantity: Quantity, result: Array, entries: Sequence[sp.Expr]) -> Expressions:
    robot = train.robot
    return Expressions(
        signature=signature(robot, quantity, (actuator_array(robot),), result),
        variables=train.readings,
        parameters=parameter_symbols(robot, train.values),
        definitions=tuple(train.tape.definitions),
        entries=tuple(entries),
    )


def _joined(train: Drivetrain, definitions: Iterable[Definition], entries: Iterable[sp.Expr]) -> list[sp.Expr]:
    """Put what was derived on the tape of the drivetrain, with sines and cosines of linkages in closed form.

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
    train.tape.definitions += [(symbol, value.xreplace(known)) for symbol, value in written]
    return [output.xreplace(known) for output in outputs]


def _angles(expressions: Iterable[sp.Expr], train: Drivetrain) -> list[sp.Expr]:
    """The angles with parts in them whose sine and cosine have a closed form, in order of appearance."""
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
    """Cosine and sine of a sum by the addition theorems."""
    name = train.tape.name
    inside = [(part, angle.coeff(symbol)) for symbol, part in train.parts.items() if angle.has(symbol)]
    rest = angle - sum((factor * part.symbol for part, factor in inside), sp.S.Zero)
    cosine, sine = sp.cos(rest), sp.sin(rest)
    for part, factor in inside:
        c, s = part.cosine, factor * part.sine
        cosine, sine = name(cosine * c - sine * s), name(sine * c + cosine * s)
    return cosine, sine
