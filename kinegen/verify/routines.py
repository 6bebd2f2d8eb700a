"""Sine and cosine, root and arc tangent on their own, against what the headers promise of them.

In: a library of the emitted functions. Out: nothing, or the first argument at which one is off by more. Poses say
little of them: a sine that is fifty times worse than promised moves a tip by less than is accepted of a whole arm.
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from functools import cache
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from kinegen.errors import ProofError
from kinegen.robot.model import Robot
from kinegen.verify.beyond import LARGEST_ANGLE
from kinegen.verify.probe import TYPES, Probe
from kinegen.verify.samples import SEED

Numbers = NDArray[Any]

SINE_ULPS = 0.85
"""What is promised of double sines and cosines, in units in the last place."""

SINE_ERROR = 5.4e-8
"""What is promised of those of floats."""

ANGLE_ULPS = 1.6
"""What is promised of double arc tangents, in units in the last place."""

ANGLE_ERROR = 1.7e-7
"""What is promised of those of floats, in radians."""

SAMPLES = 600
BITS = 90
_TYPES: Mapping[str, Any] = {"double": np.float64, "float": np.float32}


def require_routines(robot: Robot, probe: Probe) -> None:
    """Compare the functions of a number type with what is promised.

    Args:
        robot: The robot, for the message.
        probe: Its compiled files.

    Raises:
        ProofError: Naming the function and the argument.
    """
    for name in probe.routines:
        form, routine = name.removeprefix("kinegen_").split("_")
        check = {"sincos": _sincos, "sqrt": _sqrt, "atan2": _atan2}[routine]
        wrong = check(probe, name)
        if wrong is not None:
            raise ProofError(
                f"{robot.name}: {routine} of the {probe.real} {form} kernels is off by more than the header states at "
                f"{', '.join(f'{float(number):.9g}' for number in wrong)}; nothing was written"
            )


def _call(probe: Probe, name: str, arguments: tuple[Numbers, ...], results: int) -> list[Numbers]:
    found = [np.empty_like(arguments[0]) for _ in range(results)]
    pointer = ctypes.POINTER(TYPES[probe.real])
    arrays = [array.ctypes.data_as(pointer) for array in (*arguments, *found)]
    probe.library[name](ctypes.c_long(len(arguments[0])), *arrays)
    return found


def _first(wrong: Numbers, *arguments: Numbers) -> tuple[Any, ...] | None:
    return tuple(array[np.argmax(wrong)] for array in arguments) if wrong.any() else None


def _sincos(probe: Probe, name: str) -> tuple[Any, ...] | None:
    real = _TYPES[probe.real]
    x, limit = _angles(probe.real), real(LARGEST_ANGLE[probe.real])
    sine, cosine = _call(probe, name, (x,), 2)
    wrong = np.zeros(len(x), bool)
    for found, (high, low) in zip((sine, cosine), _exact_pair(probe.real), strict=True):
        error = np.abs((found.astype(np.float64) - high) - low)
        wrong |= ~(error <= (SINE_ULPS * np.spacing(np.abs(high)) if probe.real == "double" else SINE_ERROR))
    far = np.array([np.nextafter(limit, real(np.inf)), limit * 2, 1e30, np.inf, np.nan], real)
    far = np.concatenate([far, -far])
    spoilt = _call(probe, name, (far,), 2)
    return _first(wrong, x) or _first(~(np.isnan(spoilt[0]) & np.isnan(spoilt[1])), far)


@cache
def _angles(real: str) -> Numbers:
    """Angles of every size, some of them beside multiples of a quarter turn, and both ends."""
    generator, kind, limit = np.random.default_rng(SEED), _TYPES[real], LARGEST_ANGLE[real]
    quarters = generator.integers(-int(limit / (np.pi / 4)), int(limit / (np.pi / 4)), SAMPLES // 4) * (np.pi / 4)
    parts = (
        generator.uniform(-np.pi / 4, np.pi / 4, SAMPLES),
        generator.uniform(-8, 8, SAMPLES),
        generator.choice([-1, 1], SAMPLES // 2) * np.exp(generator.uniform(-30, np.log(limit), SAMPLES // 2)),
        quarters,
        np.nextafter(quarters.astype(kind), kind(0)),
        np.arange(-16, 17) * (np.pi / 4),
        np.array([0, limit, -limit]),
    )
    return np.concatenate(parts).astype(kind)


@cache
def _exact_pair(real: str) -> tuple[tuple[Numbers, Numbers], ...]:
    """Sines and cosines of `_angles`, each as a double and what is left of it, which is nothing beside a float."""
    if real == "float":
        angles = _angles(real).astype(np.float64)
        return (np.sin(angles), np.zeros(len(angles))), (np.cos(angles), np.zeros(len(angles)))
    with mpmath.workprec(BITS):
        pairs = [mpmath.cos_sin(mpmath.mpf(float(angle))) for angle in _angles(real)]
        return tuple(_split([pair[place] for pair in pairs]) for place in (1, 0))


def _split(numbers: list[Any]) -> tuple[Numbers, Numbers]:
    high = np.array([float(number) for number in numbers])
    return high, np.array([float(number - float(number)) for number in numbers])


def _sqrt(probe: Probe, name: str) -> tuple[Any, ...] | None:
    generator, kind = np.random.default_rng(SEED), _TYPES[probe.real]
    size = 300 if probe.real == "double" else 36
    x = np.concatenate(
        [
            10.0 ** generator.uniform(-size, size, SAMPLES),
            generator.uniform(0, 4, SAMPLES),
            np.arange(64.0) ** 2,
            np.array([0.0, 1.0, 2.0, -1.0, -1e-30, np.nan, -np.inf]),
        ]
    ).astype(kind)
    with np.errstate(invalid="ignore"):
        wanted = np.sqrt(x)  # correctly rounded by IEEE 754
    (found,) = _call(probe, name, (x,), 1)
    return _first(~((found == wanted) | (np.isnan(found) & np.isnan(wanted))), x)


def _atan2(probe: Probe, name: str) -> tuple[Any, ...] | None:
    y, x = _points(probe.real)
    (found,) = _call(probe, name, (y, x), 1)
    high, low = _exact_angle(probe.real)
    error = np.abs((found.astype(np.float64) - high) - low)
    wrong = ~(error <= (ANGLE_ULPS * np.spacing(np.abs(high)) if probe.real == "double" else ANGLE_ERROR))
    kind = _TYPES[probe.real]
    bad = np.array([np.nan, np.inf, -np.inf, 1.0, 1.0, 1.0], kind)
    (spoilt,) = _call(probe, name, (bad, np.roll(bad, 3)), 1)
    return _first(wrong, y, x) or _first(~np.isnan(spoilt), bad, np.roll(bad, 3))


@cache
def _points(real: str) -> tuple[Numbers, Numbers]:
    """Points in every direction and at many distances, and on both axes."""
    generator, kind = np.random.default_rng(SEED), _TYPES[real]
    angle, size = generator.uniform(-np.pi, np.pi, SAMPLES), np.exp(generator.uniform(-20, 20, SAMPLES))
    ends = np.array([(0, 0), (0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, 1), (1, -1), (-1, -1)], float)
    return (
        np.concatenate([size * np.sin(angle), ends[:, 0]]).astype(kind),
        np.concatenate([size * np.cos(angle), ends[:, 1]]).astype(kind),
    )


@cache
def _exact_angle(real: str) -> tuple[Numbers, Numbers]:
    if real == "float":
        y, x = (numbers.astype(np.float64) for numbers in _points(real))
        return np.arctan2(y, x), np.zeros(len(x))
    with mpmath.workprec(BITS):
        points = zip(*_points(real), strict=True)
        return _split([mpmath.atan2(float(y), float(x)) if x or y else mpmath.mpf(0) for y, x in points])
