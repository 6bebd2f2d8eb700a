"""What each kind of result must be, and what of it is a length: the one place that a new quantity adds to.

A subject says what the reference expects of a result, and how the numbers of a kernel are made comparable with that.
Orientations are compared as rotations, since angles beside a singularity may be any that give the rotation; derivatives
of angles grow there, and are compared times the square of the distance from it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from kinegen.model.outputs import Kind, Quantity
from kinegen.support.dataclass import dataclass
from kinegen.verify.reference import WIDE, Actuation, Orientation, readings, rotations
from kinegen.verify.reference_cache import (
    Numbers,
    ReferenceResults,
    Split,
    adjoint,
    split_adjoint,
    split_matrix,
    split_numbers,
    split_point,
    split_rows,
)

FORMS = (
    Kind.QUATERNION_WXYZ,
    Kind.QUATERNION_XYZW,
    Kind.RPY_ZYX,
    Kind.RPY_XYZ,
    Kind.EULER_ZYZ,
    Kind.AXIS_ANGLE,
)
"""The forms of orientations."""

ANGLES = (Kind.RPY_ZYX, Kind.RPY_XYZ, Kind.EULER_ZYZ)
"""Those that are three angles."""

RATES = MappingProxyType({Kind(f"{form}_jacobian"): form for form in FORMS})
"""The forms by the kinds of their derivatives."""

CLOSEST = 64
"""Derivatives are compared up to so many units of rounding for each row from a singularity or a change of sign. Nearer,
rounding of the rotation decides the last angle, or the sign."""

_ROUNDED = 1 + 1e-6
"""Half a turn in floats is a little more than half a turn."""


@dataclass(frozen=True, slots=True)
class ResultSpec:
    """One result of a kernel, for one frame."""

    rank: int  # Number of its axes for one configuration
    expected: Callable[[ReferenceResults, str], Numbers]  # What the reference says, shape (N, ...)
    split: Callable[[Numbers], Split]  # The entries that are lengths, and all others, shape (N, entries) each
    # Makes what a kernel gave comparable; numbers that break a promise become NaN
    read: Callable[[ReferenceResults, str, Numbers], Numbers] = lambda _known, _frame, found: found
    # What the kernel must return, where that is not `expected` itself
    numbers: Callable[[ReferenceResults, str], Numbers] | None = None
    # How far these numbers are from where they jump, shape (N,); None where they nowhere do
    margin: Callable[[ReferenceResults, str], Numbers] | None = None
    turns: bool = False  # Whether they are angles, of which whole turns do not matter

    def returned(self, known: ReferenceResults, frame: str) -> Numbers:
        """Returns what the kernel must return, shape (N, ...)."""
        return (self.numbers or self.expected)(known, frame)


def subjects(quantity: Quantity) -> tuple[ResultSpec, ...]:
    """Returns the results of a quantity, in order."""
    return _SUBJECTS[quantity.kind](quantity)


# What is compared -----------------------------------------------------------------------------------------------------


def _pose(_: Quantity) -> tuple[ResultSpec, ...]:
    return (ResultSpec(2, lambda known, frame: known.motion.pose(frame), split_matrix),)


def _position(_: Quantity) -> tuple[ResultSpec, ...]:
    return (ResultSpec(1, lambda known, frame: known.motion.pose(frame)[:, :3, 3], split_point),)


def _jacobian(quantity: Quantity) -> tuple[ResultSpec, ...]:
    return (ResultSpec(2, lambda known, frame: known.motion.jacobian(frame, quantity.reference), split_rows),)


def _pose_and_jacobian(quantity: Quantity) -> tuple[ResultSpec, ...]:
    return (*_pose(quantity), *_jacobian(quantity))


def _hessian(quantity: Quantity) -> tuple[ResultSpec, ...]:
    return (ResultSpec(3, lambda known, frame: known.motion.hessian(frame, quantity.reference), split_rows),)


def _twist(quantity: Quantity) -> tuple[ResultSpec, ...]:
    def expected(known: ReferenceResults, frame: str) -> Numbers:
        return known.motion.twist(frame, known.inputs["qd"], quantity.reference)[..., None]

    return (ResultSpec(1, expected, split_rows, _as_column),)


def _bias_acceleration(quantity: Quantity) -> tuple[ResultSpec, ...]:
    def expected(known: ReferenceResults, frame: str) -> Numbers:
        return known.motion.bias_acceleration(frame, known.inputs["qd"], quantity.reference)[..., None]

    return (ResultSpec(1, expected, split_rows, _as_column),)


def _acceleration(quantity: Quantity) -> tuple[ResultSpec, ...]:
    def expected(known: ReferenceResults, frame: str) -> Numbers:
        rates = known.inputs["qd"], known.inputs["qdd"]
        return known.motion.acceleration(frame, *rates, quantity.reference)[..., None]

    return (ResultSpec(1, expected, split_rows, _as_column),)


def _parameter_jacobian(quantity: Quantity) -> tuple[ResultSpec, ...]:
    def expected(known: ReferenceResults, frame: str) -> Numbers:
        names = [parameter.name for parameter in known.robot.varied_parameters]
        return known.motion.parameter_jacobian(frame, names, quantity.reference)

    return (ResultSpec(2, expected, split_rows),)


def _orientation(quantity: Quantity) -> tuple[ResultSpec, ...]:
    form = quantity.kind

    def read(known: ReferenceResults, _frame: str, found: Numbers) -> Numbers:
        numbers = found.astype(np.float64 if known.exact else WIDE)
        return np.where(_is_in_range(form, numbers)[:, None, None], rotations(form, numbers), np.nan)

    return (
        ResultSpec(
            1,
            lambda known, frame: known.motion.pose(frame)[:, :3, :3],
            split_numbers,
            read,
            numbers=lambda known, frame: _turned(known, frame).numbers(form),
            margin=lambda known, frame: _turned(known, frame).margin(form),
            turns=form in ANGLES,
        ),
    )


def _orientation_rates(quantity: Quantity) -> tuple[ResultSpec, ...]:
    form = RATES[quantity.kind]

    def margin(known: ReferenceResults, frame: str) -> Numbers:
        return _turned(known, frame).margin(form)

    def rates(known: ReferenceResults, frame: str) -> Numbers:
        return _turned(known, frame).jacobian(form, known.motion.jacobian(frame)[:, 3:])

    def weighted(known: ReferenceResults, frame: str, found: Numbers) -> Numbers:
        distance = margin(known, frame)
        is_close = distance < CLOSEST * known.unit * (1 + len(known.robot.rows))
        if form in ANGLES or form is Kind.AXIS_ANGLE:
            weight = distance**2 if form in ANGLES else 1 + 0 * distance
            return found * np.where(is_close, 0 * distance, weight)[:, None, None]
        # A quaternion changes its sign where w is zero, and rounding decides on which side of it a rotation is.
        right = rates(known, frame)
        turned = np.where(is_close & (_squared(found + right) < _squared(found - right)), -1, 1)
        return found * turned[:, None, None]

    def expected(known: ReferenceResults, frame: str) -> Numbers:
        return weighted(known, frame, rates(known, frame))

    return (ResultSpec(2, expected, split_numbers, weighted, rates, margin),)


def _squared(rates: Numbers) -> Numbers:
    """Returns the sum of the squares of each matrix, shape (N,)."""
    total: Numbers = (rates**2).sum(axis=(1, 2))
    return total


def _turned(known: ReferenceResults, frame: str) -> Orientation:
    return Orientation(known.motion.pose(frame)[:, :3, :3])


def _inverse_pose(_: Quantity) -> tuple[ResultSpec, ...]:
    def expected(known: ReferenceResults, _frame: str) -> Numbers:
        a_T_b = known.inputs["a_T_b"]
        b_T_a = np.zeros_like(a_T_b)
        b_T_a[:, :3, :3] = a_T_b[:, :3, :3].swapaxes(1, 2)
        b_T_a[:, :3, 3:] = -b_T_a[:, :3, :3] @ a_T_b[:, :3, 3:]
        b_T_a[:, 3, 3] = 1
        return b_T_a

    return (ResultSpec(2, expected, split_matrix),)


def _transform_point(_: Quantity) -> tuple[ResultSpec, ...]:
    def expected(known: ReferenceResults, _frame: str) -> Numbers:
        a_T_b, b_p = known.inputs["a_T_b"], known.inputs["b_p"]
        moved: Numbers = (a_T_b[:, :3, :3] @ b_p[..., None])[..., 0] + a_T_b[:, :3, 3]
        return moved

    return (ResultSpec(1, expected, split_point),)


def _adjoint(_: Quantity) -> tuple[ResultSpec, ...]:
    return (ResultSpec(2, lambda known, _: adjoint(known.inputs["a_T_b"]), split_adjoint),)


def _joints_of_actuators(_: Quantity) -> tuple[ResultSpec, ...]:
    def read(known: ReferenceResults, _frame: str, found: Numbers) -> Numbers:
        wanted = known.driven.joints
        impossible = np.where(_is_nan(found), 0, math.inf)
        return np.where(_is_nan(wanted), impossible, found)

    return (ResultSpec(1, lambda known, _: _defined(known.driven.joints), split_numbers, read),)


def _actuators_of_joints(_: Quantity) -> tuple[ResultSpec, ...]:
    """Right are the readings that give the joints back."""

    def read(known: ReferenceResults, _frame: str, found: Numbers) -> Numbers:
        return Actuation(known.robot, found, exact=known.exact, wide=True).joints

    def wanted(known: ReferenceResults, _frame: str) -> Numbers:
        return known.inputs["joints"]

    return (
        ResultSpec(1, wanted, split_numbers, read, numbers=lambda known, _: readings(known.robot, wanted(known, ""))),
    )


def _pose_of_actuators(_: Quantity) -> tuple[ResultSpec, ...]:
    def wanted(known: ReferenceResults, frame: str) -> Numbers:
        return known.driven.motion.pose(frame)

    return (ResultSpec(2, lambda known, frame: _defined(wanted(known, frame)), split_matrix, _where_defined(wanted)),)


def _jacobian_of_actuators(quantity: Quantity) -> tuple[ResultSpec, ...]:
    def wanted(known: ReferenceResults, frame: str) -> Numbers:
        return known.driven.jacobian(frame, quantity.reference)

    return (ResultSpec(2, lambda known, frame: _defined(wanted(known, frame)), split_rows, _where_defined(wanted)),)


_SUBJECTS: Mapping[Kind, Callable[[Quantity], tuple[ResultSpec, ...]]] = MappingProxyType(
    {
        Kind.POSE: _pose,
        Kind.FRAMES: _pose,
        Kind.POSITION: _position,
        Kind.JACOBIAN: _jacobian,
        Kind.FK_JACOBIAN: _pose_and_jacobian,
        Kind.TWIST: _twist,
        Kind.BIAS_ACCELERATION: _bias_acceleration,
        Kind.ACCELERATION: _acceleration,
        Kind.HESSIAN: _hessian,
        Kind.PARAMETER_JACOBIAN: _parameter_jacobian,
        Kind.INVERSE_POSE: _inverse_pose,
        Kind.TRANSFORM_POINT: _transform_point,
        Kind.ADJOINT: _adjoint,
        Kind.ACTUATORS_TO_JOINTS: _joints_of_actuators,
        Kind.JOINTS_TO_ACTUATORS: _actuators_of_joints,
        Kind.FK_ACTUATORS: _pose_of_actuators,
        Kind.JACOBIAN_ACTUATORS: _jacobian_of_actuators,
        **dict.fromkeys(FORMS, _orientation),
        **dict.fromkeys(RATES, _orientation_rates),
    }
)


# How it is compared ---------------------------------------------------------------------------------------------------


def _as_column(_known: ReferenceResults, _frame: str, found: Numbers) -> Numbers:
    return found[..., None]


def _is_in_range(form: Kind, numbers: Numbers) -> Numbers:
    """Returns whether numbers are those that are promised, out of all that describe a rotation."""
    half = math.pi * _ROUNDED
    inside: Numbers
    if form in (Kind.QUATERNION_WXYZ, Kind.QUATERNION_XYZW):
        inside = numbers[:, 0 if form is Kind.QUATERNION_WXYZ else 3] >= 0
    elif form is Kind.AXIS_ANGLE:
        inside = (numbers**2).sum(axis=1) <= half**2
    else:
        low, high = (0.0, half) if form is Kind.EULER_ZYZ else (-half / 2, half / 2)
        inside = (np.abs(numbers) <= half).all(axis=1) & (numbers[:, 1] >= low) & (numbers[:, 1] <= high)
    return inside


def _is_nan(numbers: Numbers) -> Numbers:
    return np.isnan(numbers.astype(np.float64))


def _defined(numbers: Numbers) -> Numbers:
    """Zero where readings of actuators are impossible."""
    return np.where(_is_nan(numbers), 0, numbers)


def _where_defined(
    wanted: Callable[[ReferenceResults, str], Numbers],
) -> Callable[[ReferenceResults, str, Numbers], Numbers]:
    """Zero for whatever a kernel gives there; what does not depend on such a reading may have a value."""
    return lambda known, frame, found: np.where(_is_nan(wanted(known, frame)), 0, found)
