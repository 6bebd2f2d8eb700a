"""The proof of a build: every way to call what was emitted, against the reference."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from fractions import Fraction
from types import ModuleType

import mpmath
import numpy as np
from numpy.typing import NDArray

from kinegen import reference
from kinegen.errors import ProofError
from kinegen.outputs import Quantity
from kinegen.robot.expressions import Arithmetic, evaluate, number
from kinegen.robot.extent import reach
from kinegen.robot.model import Robot
from kinegen.verify.samples import proof_samples, vector_samples
from kinegen.verify.tolerances import accepted_error
from kinegen.verify.vectors import quantity_frames
from kinegen.verify.ways import DTYPES, Floats, ways_to_call

FloatArray = NDArray[np.float64]

MOVED_POSES = 1024
"""Joint vectors that are tried with other values of the runtime parameters."""

_FLOATS = Arithmetic(number=float, pi=math.pi, functions={"sqrt": math.sqrt})


@dataclass(frozen=True, slots=True)
class Comparison:
    """One kernel, called in one way, compared with the reference.

    Attributes:
        target: What was called, such as `C double, batch`.
        quantity: What it computes.
        poses: Number of joint vectors.
        position_error: Largest error of a coordinate, in the file's length unit.
        rotation_error: Largest error of an entry of a rotation (for small errors, radians).
        position_tolerance: What was accepted.
        rotation_tolerance: What was accepted.
        worst: Joint vector of the largest error, relative to its tolerance.
        frame: Frame of the largest error.
    """

    target: str
    quantity: Quantity
    poses: int
    position_error: float
    rotation_error: float
    position_tolerance: float
    rotation_tolerance: float
    worst: tuple[float, ...]
    frame: str

    @property
    def holds(self) -> bool:
        """Whether both errors are within their tolerances; a NaN is not."""
        return self.position_error <= self.position_tolerance and self.rotation_error <= self.rotation_tolerance


@dataclass(frozen=True, slots=True)
class Proof:
    """The result of all comparisons of a build.

    Attributes:
        reach: Reach of the robot, to which position tolerances are relative.
        comparisons: One for each kernel and way to call it.
    """

    reach: float
    comparisons: tuple[Comparison, ...]

    @property
    def holds(self) -> bool:
        """Whether every comparison holds."""
        return all(comparison.holds for comparison in self.comparisons)

    def require(self, robot: Robot) -> None:
        """Refuse a build whose proof does not hold.

        Raises:
            ProofError: Naming the worst kernel, its error and the joint vector.
        """
        for comparison in self.comparisons:
            if not comparison.holds:
                place = ", ".join(f"{entry:.6g}" for entry in comparison.worst)
                raise ProofError(
                    f"{robot.name}: {comparison.target} {comparison.quantity} differs from the reference at "
                    f"q = ({place}), frame {comparison.frame}: {comparison.position_error:.3g} {robot.units.length} "
                    f"(accepted {comparison.position_tolerance:.3g}), rotation {comparison.rotation_error:.3g} "
                    f"(accepted {comparison.rotation_tolerance:.3g}); nothing was written"
                )


def prove(robot: Robot, package: ModuleType, quantities: tuple[Quantity, ...], reals: tuple[str, ...]) -> Proof:
    """Compare a generated package with the reference in every way it can be called.

    Args:
        robot: The robot.
        package: Its generated package, imported.
        quantities: The quantities it was built for.
        reals: Its number types, `double` and `float`.

    Returns:
        The comparisons; see `Proof.require`.
    """
    samples = proof_samples(robot)
    comparisons = _compare_ways(robot, package, quantities, reals, samples)
    if robot.runtime_parameters:
        moved, values = move_parameters(robot)
        others = _compare_ways(moved, package, quantities, reals, samples[-MOVED_POSES:], values)
        comparisons += [replace(other, target=f"{other.target}, other parameters") for other in others]
    comparisons += [_exact(robot, package, quantity) for quantity in quantities if "double" in reals]
    return Proof(reach(robot), tuple(comparisons))


def move_parameters(robot: Robot) -> tuple[Robot, tuple[float, ...]]:
    """Give every runtime parameter another value, so that a kernel that ignores or mixes them up is seen.

    Args:
        robot: A robot with runtime parameters.

    Returns:
        The robot with its parameters moved, each in its own way, and their values, which floats hold exactly.
    """
    moved: dict[str, Fraction] = {}
    for place, parameter in enumerate(robot.runtime_parameters, start=1):
        value = float(evaluate(parameter.value, {}, _FLOATS))
        moved[parameter.name] = Fraction(float(np.float32(value * (1 + place / 16) + 1 / 32)))
    parameters = tuple(
        replace(parameter, value=number(moved[parameter.name])) if parameter.runtime else parameter
        for parameter in robot.parameters
    )
    return replace(robot, parameters=parameters), tuple(float(value) for value in moved.values())


def _compare_ways(
    robot: Robot,
    package: ModuleType,
    quantities: tuple[Quantity, ...],
    reals: tuple[str, ...],
    samples: FloatArray,
    parameters: tuple[float, ...] | None = None,
) -> list[Comparison]:
    comparisons = []
    for real in reals:
        points = samples.astype(DTYPES[real])
        known = reference.frames(robot, points.astype(np.float64))
        for quantity in quantities:
            expected = expected_results(robot, quantity, known)
            for way in ways_to_call(package, quantity, real, parameters):
                result = way.call(points)
                comparisons.append(_compare(robot, quantity, way.target, points, result, expected, real))
    return comparisons


def expected_results(robot: Robot, quantity: Quantity, known: dict[str, FloatArray]) -> FloatArray:
    """Reference results of one quantity, as matrices (N, frames, 4, 4)."""
    return np.stack([known[frame] for frame in quantity_frames(robot, quantity)], axis=1)


def _compare(
    robot: Robot,
    quantity: Quantity,
    target: str,
    points: Floats,
    result: Floats,
    expected: FloatArray,
    real: str,
) -> Comparison:
    extent = reach(robot, quantity_frames(robot, quantity))
    relative = accepted_error(robot, real)
    frames = quantity_frames(robot, quantity)
    if quantity.is_pose:
        found = result.reshape(expected.shape).astype(np.float64)
        rotation = np.abs(found[..., :3, :3] - expected[..., :3, :3]).max(axis=(2, 3))
        rotation = np.maximum(rotation, np.abs(found[..., 3, :] - (0.0, 0.0, 0.0, 1.0)).max(axis=2))
        position = np.abs(found[..., :3, 3] - expected[..., :3, 3]).max(axis=2)
    else:
        position = np.abs(result.reshape(len(points), len(frames), 3) - expected[..., :3, 3]).max(axis=2)
        rotation = np.zeros_like(position)
    severity = np.nan_to_num(np.maximum(position / extent, rotation), nan=np.inf)
    row, column = np.unravel_index(np.argmax(severity), severity.shape)
    return Comparison(
        target=target,
        quantity=quantity,
        poses=len(points),
        position_error=float(position.max()),
        rotation_error=float(rotation.max()),
        position_tolerance=relative * extent,
        rotation_tolerance=relative,
        worst=tuple(float(entry) for entry in points[row]),
        frame=frames[int(column)],
    )


def _exact(robot: Robot, package: ModuleType, quantity: Quantity) -> Comparison:
    """The double kernel against 50 digits, which shows its own error and not the reference's rounding."""
    extent = reach(robot, quantity_frames(robot, quantity))
    points = vector_samples(robot)
    kernel = getattr(package, quantity.function)
    frames = quantity_frames(robot, quantity)
    width = 4 if quantity.is_pose else 1
    position, rotation, worst = 0.0, 0.0, (0.0, 0, 0)
    for row, point in enumerate(points):
        known = reference.frames_mp(robot, point)
        result = kernel(point).reshape(len(frames), -1, width)
        for column, frame in enumerate(frames):
            errors = [
                [
                    abs(float(mpmath.mpf(float(result[column][i][j])) - known[frame][i, j if width == 4 else 3]))
                    for j in range(width)
                ]
                for i in range(3)
            ]
            here = max(line[-1] for line in errors)
            turned = max((error for line in errors for error in line[:-1]), default=0.0)
            position, rotation = max(position, here), max(rotation, turned)
            worst = max(worst, (max(here / extent, turned), row, column))
    language = "C double" if kernel.backend == "c" else "NumPy double"
    return Comparison(
        target=f"{language}, 50 digits",
        quantity=quantity,
        poses=len(points),
        position_error=position,
        rotation_error=rotation,
        position_tolerance=accepted_error(robot, "double") * extent,
        rotation_tolerance=accepted_error(robot, "double"),
        worst=tuple(float(entry) for entry in points[worst[1]]),
        frame=frames[worst[2]],
    )
