"""Calibrates a UR5: 24 numbers of its table are found again from 50 noisy poses, with generated kernels.

    python examples/calibration_ur5.py              builds the kernels, measures, calibrates and prints
    python examples/calibration_ur5.py --no-compile does without a C compiler

The measurement is simulated, so that what is found can be held against the truth. docs/calibration.md explains each
step. SciPy is optional: where it is installed, its `least_squares` does the same once more.
"""

from __future__ import annotations

import importlib
import sys
import tempfile
import textwrap
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import build
from kinegen.driver.results import BuildOptions
from kinegen.model.outputs import Kind, Quantity

try:
    from scipy.optimize import least_squares
except ImportError:
    least_squares = None

Floats = NDArray[np.float64]

ROOT = Path(__file__).resolve().parent.parent
HAYATI = ROOT / "examples" / "ur5_calibration.yaml"
STANDARD = ROOT / "robots" / "ur5.yaml"

MOUNTING = tuple(f"{end}_{number}" for end in ("base", "tool") for number in ("x", "y", "z", "roll", "pitch", "yaw"))
"""Base and tool; known here, and varied only for the table of identifiable parameters."""

FIXED = ("base_z", "base_yaw", "tool_x", "tool_z", "tool_roll", "tool_yaw")
"""What the table says already where base and tool are varied too: d and theta of the first row, all of the last."""

POSES = 50
NOISE = np.array([0.05e-3] * 3 + [0.1e-3] * 3)
"""Standard deviation of what is measured: 0.05 mm along and 0.1 mrad about each axis."""

LENGTH_ERROR, ANGLE_ERROR = 1e-3, 3e-3
"""Size of what is wrong with the arm: 1 mm and 3 mrad."""


# Kernels --------------------------------------------------------------------------------------------------------------


def kernels(file: Path, wrt: tuple[str, ...], folder: Path, *, compiled: bool) -> ModuleType:
    """Build and import the module of one robot; as `kinegen build FILE --wrt ...`, but from Python."""
    quantities = (Quantity.POSE, Quantity(Kind.PARAMETER_JACOBIAN))
    options = BuildOptions(folder, (ScalarType.DOUBLE,), quantities, wrt, compile=compiled)
    result = build(file, options, lambda _: None)
    sys.path.insert(0, str(folder))
    try:
        return importlib.import_module(result.robot.name)
    finally:
        sys.path.remove(str(folder))


# The model ------------------------------------------------------------------------------------------------------------


def rotation(vectors: Floats) -> Floats:
    """Rotations (N, 3, 3) by rotation vectors (N, 3)."""
    angle = np.linalg.norm(vectors, axis=1)[:, None, None]
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    cross: Floats = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
    turned: Floats = np.eye(3) + np.sinc(angle / np.pi) * cross + np.sinc(angle / 2 / np.pi) ** 2 / 2 * cross @ cross
    return turned


def difference(measured: Floats, modelled: Floats) -> Floats:
    """What leads from modelled to measured poses, (N, 6): a shift, and a rotation vector for small angles."""
    turn = measured[:, :3, :3] @ modelled[:, :3, :3].swapaxes(1, 2)
    vector = np.stack([turn[:, i, j] - turn[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))], axis=1) / 2
    return np.hstack([measured[:, :3, 3] - modelled[:, :3, 3], vector])


@dataclass(frozen=True)
class Model:
    """An arm, and which of its parameters are to be found.

    Attributes:
        arm: Its generated module.
        free: Columns of `parameter_jacobian` of the parameters that are varied.
    """

    arm: ModuleType
    free: list[int]

    def params(self, values: Floats) -> Any:
        """All parameters, with values for the free ones."""
        found = np.array(self.arm.Params())
        found[self.free] = values
        return self.arm.Params(*found)

    def residuals(self, values: Floats, q: Floats, measured: Floats) -> Floats:
        """Differences over their standard deviations, (6 N,)."""
        modelled = self.arm.fk(q, params=self.params(values))
        found: Floats = difference(measured, modelled) / NOISE
        return found.ravel()

    def jacobian(self, values: Floats, q: Floats) -> Floats:
        """Derivative of the residuals by the free parameters, (6 N, p): the modelled pose has the other sign."""
        columns: Floats = self.arm.parameter_jacobian(q, params=self.params(values))[..., self.free]
        return np.reshape(-columns / NOISE[:, None], (-1, len(self.free)))


def model(arm: ModuleType, leave_out: Iterable[str] = ()) -> Model:
    """A model in which all parameters but some are free."""
    return Model(arm, [column for column, name in enumerate(arm.PARAMETERS) if name not in set(leave_out)])


@dataclass(frozen=True)
class Measurement:
    """What a simulated arm did.

    Attributes:
        truth: Its parameters, all that are free.
        q: Joint vectors (N, 6).
        poses: Measured poses (N, 4, 4).
    """

    truth: Floats
    q: Floats
    poses: Floats


# Calibration ----------------------------------------------------------------------------------------------------------


def gauss_newton(fit: Model, start: Floats, q: Floats, measured: Floats) -> tuple[Floats, list[float]]:
    """Minimise the sum of squared residuals.

    Returns:
        The values, and the root mean square of the residuals before each step and at the end.
    """
    values, sizes = start, []
    for _ in range(10):
        residuals = fit.residuals(values, q, measured)
        sizes.append(float(np.sqrt(np.mean(residuals**2))))
        step = np.linalg.lstsq(fit.jacobian(values, q), -residuals, rcond=None)[0]
        values = values + step
        if np.max(np.abs(step)) < 1e-9:
            break
    return values, sizes


def with_scipy(fit: Model, measured: Measurement, found: Floats, sigma: Floats) -> str:
    """What SciPy says to the same residuals and derivatives."""
    start = np.array(fit.arm.Params())[fit.free]
    given = (measured.q, measured.poses)
    other = least_squares(fit.residuals, start, lambda values, q, _: fit.jacobian(values, q), args=given)
    same = np.max(np.abs(other.x - found) / sigma) < 0.01
    return f"scipy.optimize.least_squares, the same to 0.01 sigma: {'yes' if same else 'no'}"


def told_apart(fit: Model, q: Floats) -> tuple[int, list[str]]:
    """What poses say about the free parameters, from the singular values of the derivative with unit columns.

    Returns:
        The rank, and the parameters that are not identifiable separately: those in the null space.
    """
    columns = fit.jacobian(np.array(fit.arm.Params())[fit.free], q)
    _, sizes, directions = np.linalg.svd(columns / np.linalg.norm(columns, axis=0))
    rank = int(np.sum(sizes > 1e-9 * sizes[0]))
    lost = np.linalg.norm(directions[rank:], axis=0) > 1e-6
    return rank, [fit.arm.PARAMETERS[column] for column, is_lost in zip(fit.free, lost, strict=True) if is_lost]


def measure(fit: Model, random: np.random.Generator) -> Measurement:
    """Make an arm whose table is wrong, and measure its poses with noise."""
    names = [fit.arm.PARAMETERS[column] for column in fit.free]
    scale = [LENGTH_ERROR if name.startswith(("a_", "d_")) else ANGLE_ERROR for name in names]
    truth = np.array(fit.arm.Params())[fit.free] + scale * random.normal(size=len(names))
    q = random.uniform(-np.pi, np.pi, (POSES, fit.arm.DOF))
    noise = NOISE * random.normal(size=(POSES, 6))
    poses = fit.arm.fk(q, params=fit.params(truth))
    poses[:, :3, 3] += noise[:, :3]
    poses[:, :3, :3] = rotation(noise[:, 3:]) @ poses[:, :3, :3]
    return Measurement(truth, q, poses)


# Output ---------------------------------------------------------------------------------------------------------------


def print_ranks(hayati: ModuleType, standard: ModuleType, q: Floats) -> None:
    """What can be found at all."""
    cases = (
        ("standard table", model(standard)),
        ("Hayati rows", model(hayati, MOUNTING)),
        ("Hayati rows, base and tool", model(hayati)),
        ("the same without six", model(hayati, FIXED)),
    )
    print("varied                       parameters        rank")
    for name, fit in cases:
        rank, lost = told_apart(fit, q)
        print(f"{name:28} {len(fit.free):10}  {rank:10}")
        if lost:
            text = f"not identifiable separately: {', '.join(lost)}"
            print(textwrap.fill(text, 100, initial_indent="  ", subsequent_indent="    "))


def print_parameters(fit: Model, measured: Measurement, found: Floats, sigma: Floats) -> None:
    """Each parameter: what was wrong, what was found, how sure that is."""
    nominal = np.array(fit.arm.Params())[fit.free]
    print("parameter            wrong by      found      sigma  unit  off by")
    for column, true, value, start, spread in zip(fit.free, measured.truth, found, nominal, sigma, strict=True):
        name = fit.arm.PARAMETERS[column]
        unit = "mm  " if name.startswith(("a_", "d_")) else "mrad"
        wrong, got, width = 1e3 * (true - start), 1e3 * (value - start), 1e3 * spread
        print(f"{name:18} {wrong:10.4f} {got:10.4f} {width:10.4f}  {unit}  {(value - true) / spread:+.2f} sigma")


def print_accuracy(fit: Model, truth: Floats, values: Floats, random: np.random.Generator) -> None:
    """What it is good for: the error of poses that were not measured."""
    q = random.uniform(-np.pi, np.pi, (1000, fit.arm.DOF))
    true = fit.arm.fk(q, params=fit.params(truth))
    for name, guess in (("before", np.array(fit.arm.Params())[fit.free]), ("after", values)):
        errors = difference(true, fit.arm.fk(q, params=fit.params(guess)))
        position, angle = (1e3 * np.linalg.norm(part, axis=1).mean() for part in (errors[:, :3], errors[:, 3:]))
        print(f"mean error of 1000 other poses {name:6}: {position:.4f} mm, {angle:.4f} mrad")


def main(arguments: list[str]) -> int:
    """Run the example; the exit status is 0 if every parameter is found to within three standard deviations."""
    compiled = "--no-compile" not in arguments
    random = np.random.default_rng(0)
    with tempfile.TemporaryDirectory() as folder:
        hayati = kernels(HAYATI, ("dh", *MOUNTING), Path(folder), compiled=compiled)
        standard = kernels(STANDARD, ("dh",), Path(folder), compiled=compiled)
    fit = model(hayati, MOUNTING)
    measured = measure(fit, random)
    print_ranks(hayati, standard, measured.q)

    start = np.array(hayati.Params())[fit.free]
    found, sizes = gauss_newton(fit, start, measured.q, measured.poses)
    print(f"\nGauss-Newton, residuals in sigma: {', '.join(f'{size:.4f}' for size in sizes)}")
    columns = fit.jacobian(found, measured.q)
    sigma = np.sqrt(np.diag(np.linalg.inv(columns.T @ columns)))
    if least_squares is not None:
        print(with_scipy(fit, measured, found, sigma))
    print()
    print_parameters(fit, measured, found, sigma)
    print()
    print_accuracy(fit, measured.truth, found, random)
    worst = np.max(np.abs(found - measured.truth) / sigma)
    print(f"worst parameter: {worst:.2f} sigma")
    return int(worst > 3)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
