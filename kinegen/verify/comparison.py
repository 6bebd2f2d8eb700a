"""What a proof found: records alone, which reports read without all that proving takes."""

from __future__ import annotations

import math
from dataclasses import dataclass

from kinegen.errors import ProofError
from kinegen.outputs import Quantity
from kinegen.robot.model import Robot


@dataclass(frozen=True, slots=True)
class Comparison:
    """One kernel, called in one way, compared with the reference.

    Attributes:
        target: What was called, such as `C double, batch`.
        quantity: What it computes.
        poses: Number of joint vectors.
        position_error: Largest error of a coordinate, or of any other entry that is a length for each unit of what is
            differentiated by; in the file's length unit.
        rotation_error: Largest error of an entry of a rotation (for small errors, radians), or of any other entry.
        position_tolerance: What was accepted.
        rotation_tolerance: What was accepted.
        worst: Joint vector of the largest error, relative to its tolerance.
        frame: Frame of the largest error.
        real: Number type, `double`, `float` or `q30`; empty if it is not known.
        row: What it counts as in a report, such as `C double, batch` for every layout; the target if empty.
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
    real: str = ""
    row: str = ""

    @property
    def share(self) -> float:
        """The larger of both errors, as a share of its tolerance; infinite for a NaN."""
        shares = (
            self.position_error / self.position_tolerance if self.position_error else 0.0,
            self.rotation_error / self.rotation_tolerance if self.rotation_error else 0.0,
        )
        return math.inf if any(map(math.isnan, shares)) else max(shares)

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
        counts: Sentences about what was tried, for kernels that have more to them than errors.
    """

    reach: float
    comparisons: tuple[Comparison, ...]
    counts: tuple[str, ...] = ()

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
                    f"(accepted {comparison.rotation_tolerance:.3g}); nothing was written{_remedy(comparison)}"
                )


def _remedy(comparison: Comparison) -> str:
    """What builds the robot all the same, where kernels in float are what fails."""
    return "; --real double builds without float" if " float" in comparison.target else ""
