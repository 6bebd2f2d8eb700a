"""The proof of a build: every way to call what was emitted, against the reference."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from types import ModuleType
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from kinegen import reference
from kinegen.errors import ProofError
from kinegen.native.package import runnable_variants, select_variant
from kinegen.outputs import Quantity
from kinegen.robot.extent import reach
from kinegen.robot.model import Robot
from kinegen.verify.samples import proof_samples, vector_samples
from kinegen.verify.tolerances import TOLERANCES
from kinegen.verify.vectors import quantity_frames

Floats = NDArray[np.floating[Any]]
FloatArray = NDArray[np.float64]

DTYPES: dict[str, np.dtype[Any]] = {"double": np.dtype(np.float64), "float": np.dtype(np.float32)}
"""NumPy's names of the number types."""


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
    extent = reach(robot)
    comparisons: list[Comparison] = []
    for real in reals:
        points = samples.astype(DTYPES[real])
        known = reference.frames(robot, points.astype(np.float64))
        for quantity in quantities:
            kernel = getattr(package, quantity.function)
            expected = expected_results(robot, quantity, known)
            for target, call in _ways(package, kernel, quantity, real):
                comparisons.append(_compare(robot, quantity, target, points, call(points), expected, extent, real))
    comparisons += [_exact(robot, package, quantity, extent) for quantity in quantities if "double" in reals]
    return Proof(extent, tuple(comparisons))


def _ways(
    package: ModuleType, kernel: Any, quantity: Quantity, real: str
) -> list[tuple[str, Callable[[Floats], Floats]]]:
    """The ways to evaluate a kernel: compiled one by one, compiled as a batch (in each variant), and in NumPy."""
    ways: list[tuple[str, Callable[[Floats], Floats]]] = [(f"NumPy {real}", _numpy_form(package, kernel, quantity))]
    if kernel.backend == "c":
        variants = runnable_variants(package)
        batches = [(f"C {real}, batch {name}", partial(_in_variant, package, kernel, name)) for name in variants]
        ways = [
            (f"C {real}", lambda points: np.stack([kernel(point) for point in points])),
            *(batches or [(f"C {real}, batch", kernel)]),
            *ways,
        ]
    return ways


def _in_variant(package: ModuleType, kernel: Any, name: str, points: Floats) -> Floats:
    select_variant(package, name)
    result: Floats = kernel(points)
    return result


def _numpy_form(package: ModuleType, kernel: Any, quantity: Quantity) -> Callable[[Floats], Floats]:
    """The same kernel as it would be without the compiled extension."""
    params = getattr(package, "Params", None)
    numpy_form: Callable[[Floats], Floats] = type(kernel)(
        quantity.function,
        module=package.__name__,
        symbol="",
        dof=kernel.dof,
        shape=kernel.shape,
        reals=tuple(str(dtype) for dtype in DTYPES.values()),
        formula=getattr(sys.modules[f"{package.__name__}._numpy"], quantity.function),
        params=params() if params else None,
    )
    return numpy_form


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
    extent: float,
    real: str,
) -> Comparison:
    relative = TOLERANCES.double if real == "double" else TOLERANCES.float
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


def _exact(robot: Robot, package: ModuleType, quantity: Quantity, extent: float) -> Comparison:
    """The double kernel against 50 digits, which shows its own error and not the reference's rounding."""
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
        position_tolerance=TOLERANCES.double * extent,
        rotation_tolerance=TOLERANCES.double,
        worst=tuple(float(entry) for entry in points[worst[1]]),
        frame=frames[worst[2]],
    )
