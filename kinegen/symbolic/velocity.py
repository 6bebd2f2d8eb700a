"""Twist and acceleration of frames at given joint rates, without a Jacobian.

The chain is walked from its end to its start. All that is known at a point is how the end moves as seen from there:
each transform that changes adds its own motion, each constant one only turns the axes or moves the point. So every
joint costs a few operations, however many others there are.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

import sympy as sp

from kinegen.outputs import Kind, Quantity, Reference
from kinegen.robot.model import Robot
from kinegen.symbolic.chain import transforms_between
from kinegen.symbolic.expressions import Expressions, Tape
from kinegen.symbolic.fold import NULL, Vector, rotate, total
from kinegen.symbolic.marks import Mark, Marked, mark, rates_by, reverse
from kinegen.symbolic.route import cross, scaled
from kinegen.symbolic.signatures import (
    frame_array,
    frames_of,
    joint_array,
    joint_symbols,
    parameter_symbols,
    signature,
    start_of,
)
from kinegen.symbolic.transforms import Turn, symbols


def derive_velocity(robot: Robot, quantity: Quantity) -> Expressions:
    """The twist of every tip, or of one frame, or its derivative by time; linear, then angular.

    With J the Jacobian in the same reference, `twist` is J qd, `bias_acceleration` is Jdot qd and `acceleration` is
    J qdd + Jdot qd, the derivative by time of the six numbers of the twist. That is

    - in `local_world_aligned`: the acceleration of the frame's origin as a point (called classical), and the angular
      acceleration, in the axes of the base;
    - in `local` and `world`: the spatial acceleration (Featherstone, Rigid Body Dynamics Algorithms, 2008, section
      2.10) of the frame's body, in the axes and at the origin of the frame or of the base.

    Args:
        robot: The robot; parameters that are not runtime parameters become exact numbers.
        quantity: A twist or an acceleration, in which reference and of which frame.

    Returns:
        Six entries for each frame, in terms of q, qd and, for `acceleration`, qdd.

    Raises:
        KinegenError: If there is no such frame.
    """
    values = symbols(robot, keep_parameters=False)
    joints = joint_symbols(robot, values)
    rates, accelerations = (_derivatives(joints, dots) for dots in ("d", "dd"))
    inputs, variables = [joint_array(robot), joint_array(robot, "qd")], [*joints, *rates]
    if quantity.kind is Kind.ACCELERATION:
        inputs.append(joint_array(robot, "qdd"))
        variables += accelerations
    else:
        accelerations = (sp.S.Zero,) * len(joints)
    tape = Tape()
    entries: list[sp.Expr] = []
    for frame in frames_of(robot, quantity):
        steps = transforms_between(robot, start_of(robot, quantity), frame, values)
        walk = _Walk(tape, rates, accelerations, quantity.reference)
        turns = rates_by(steps, joints)
        walk.inwards(reverse(steps, turns) if quantity.reference is Reference.LOCAL else mark(steps, turns))
        entries += walk.twist if quantity.kind is Kind.TWIST else walk.change
    result = frame_array(robot, quantity, quantity.kind.value, (6,))
    return Expressions(
        signature=signature(robot, quantity, tuple(inputs), result),
        variables=tuple(variables),
        parameters=parameter_symbols(robot, values),
        definitions=tuple(tape.definitions),
        entries=tuple(entries),
    )


def _derivatives(joints: tuple[sp.Symbol, ...], dots: str) -> tuple[sp.Symbol, ...]:
    return tuple(sp.Dummy(f"{joint.name}_{dots}", real=True) for joint in joints)


@dataclass(slots=True)
class _Walk:
    """How the end of a chain moves as seen from the point that has been reached, in the axes there.

    Angles and lengths are linear in the joint variables, so their second derivatives are those of the joints, combined.

    Attributes:
        tape: Receives the intermediate values.
        rates: First derivatives of the joints by time.
        accelerations: Second derivatives.
        reference: Decides of which point the velocity is: of the end of the chain (`local_world_aligned`), or of the
            point of its body that passes where the walk stands.
        lever: From the point reached to the end.
        velocity: Linear velocity.
        turning: Angular velocity.
        acceleration: Derivative of `velocity`.
        swelling: Derivative of `turning`.
    """

    tape: Tape
    rates: tuple[sp.Symbol, ...]
    accelerations: tuple[sp.Expr, ...]
    reference: Reference
    lever: Vector = NULL
    velocity: Vector = NULL
    turning: Vector = NULL
    acceleration: Vector = NULL
    swelling: Vector = NULL

    @property
    def twist(self) -> tuple[sp.Expr, ...]:
        """Linear and angular velocity; a chain walked from its end moves the other way."""
        sign = -1 if self.reference is Reference.LOCAL else 1
        return tuple(sign * entry for entry in (*self.velocity, *self.turning))

    @property
    def change(self) -> tuple[sp.Expr, ...]:
        """The derivative of the twist."""
        sign = -1 if self.reference is Reference.LOCAL else 1
        return tuple(sign * entry for entry in (*self.acceleration, *self.swelling))

    def inwards(self, marked: Marked) -> None:
        """Walk the whole chain."""
        for level in range(len(marked.turns), -1, -1):
            for item in reversed(marked.levels[level]):
                if not isinstance(item, Mark):
                    self._move(item)
                elif item.is_turn:
                    self._turn(item)
                else:
                    self._shift(item)
            if level:
                self._rotate(marked.turns[level - 1])

    def _rotate(self, turn: Turn) -> None:
        """Over to the axes before a turn."""

        def back(vector: Vector) -> Vector:
            return self.tape.vector(rotate(turn.axis, turn.angle, vector))

        self.lever = back(self.lever)
        self.velocity, self.turning = back(self.velocity), back(self.turning)
        self.acceleration, self.swelling = back(self.acceleration), back(self.swelling)

    def _move(self, piece: Vector) -> None:
        """Over to the start of a translation."""
        if self._of_end:
            self.lever = self._sum(self.lever, piece)
        else:
            self.velocity = self._sum(self.velocity, cross(piece, self.turning))
            self.acceleration = self._sum(self.acceleration, cross(piece, self.swelling))

    def _turn(self, item: Mark) -> None:
        """A turn here turns all that is known, and adds to it."""
        rate, acceleration = self._growth(item)
        before = self.velocity
        if self._of_end:
            swing = self.tape.vector(cross(item.axis, self.lever))
            self.velocity = self._sum(before, scaled(rate, swing))
            # The swing grows with the velocity before and with its own: rate * axis x (before + rate * swing).
            both = scaled(rate, self._sum(before, self.velocity))
            self.acceleration = self._sum(self.acceleration, cross(item.axis, both), scaled(acceleration, swing))
        else:
            self.acceleration = self._sum(self.acceleration, scaled(rate, cross(item.axis, before)))
        turned = scaled(rate, cross(item.axis, self.turning))
        self.swelling = self._sum(self.swelling, turned, scaled(acceleration, item.axis))
        self.turning = self._sum(self.turning, scaled(rate, item.axis))

    def _shift(self, item: Mark) -> None:
        """A shift here moves all that is known."""
        rate, acceleration = self._growth(item)
        along = scaled(rate, item.axis)
        self.velocity = self._sum(self.velocity, along)
        self.acceleration = self._sum(self.acceleration, scaled(acceleration, item.axis))
        if not self._of_end:
            self.acceleration = self._sum(self.acceleration, cross(along, self.turning))

    @property
    def _of_end(self) -> bool:
        return self.reference is Reference.LOCAL_WORLD_ALIGNED

    def _growth(self, item: Mark) -> tuple[sp.Expr, sp.Expr]:
        """First and second derivative by time of the angle or length."""
        first, second = (
            sum((rate * joint for rate, joint in zip(item.rates, by, strict=True)), sp.S.Zero)
            for by in (self.rates, self.accelerations)
        )
        return self.tape.name(first), self.tape.name(second)

    def _sum(self, *vectors: Vector) -> Vector:
        return self.tape.vector(reduce(total, vectors))
