"""What verification found: comparisons, proofs and costs, as records that reports read without all the rest."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, replace
from typing import Any

from kinegen.errors import ProofError
from kinegen.ir.program import Count
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import TOOL, Robot
from kinegen.support.dataclass import dataclass

NUMPY = "NumPy"
"""The language whose sines are those of a library."""

BEYOND_LIMITS = "beyond limits"
"""The case of joint values outside of the limits."""


@dataclass(frozen=True, slots=True)
class Invocation:
    """How a kernel was called, and for what; as a text, a sentence for people."""

    language: str  # `C`, `NumPy` or the title of another language
    scalar: str = ""  # Number type, `double`, `float` or `q30`; empty if it is not known
    form: str = ""  # `batch`, or empty for one configuration after the other
    layout: str = "4x4"  # Of a batch; the default one is `4x4`
    variant: str = ""  # Of a batch: the processor it was compiled for; empty where there is one alone
    case: str = ""  # What is special of it, such as `BEYOND_LIMITS`, or a solver's own trial; empty at the usual inputs
    is_moved: bool = False  # Whether the runtime parameters had other values than in the file

    @property
    def row(self) -> Invocation:
        """What it counts as in a report: the same for all layouts and variants, and in special cases for all forms."""
        if self.case not in ("", BEYOND_LIMITS):
            return self
        form = "" if self.case or self.is_moved else self.form
        return replace(self, form=form, layout="4x4", variant="")

    def __str__(self) -> str:
        form = (self.form, self.variant, self.layout if self.layout != "4x4" else "")
        parts = (f"{self.language} {self.scalar}", " ".join(filter(None, form)), self.case)
        return ", ".join(filter(None, (*map(str.strip, parts), "other parameters" * self.is_moved)))


@dataclass(frozen=True, slots=True)
class Comparison:
    """One kernel, called in one way, compared with the reference.

    Attributes:
        invocation: How it was called.
        position_error: Largest error of a coordinate, or of any other entry that is a length for each unit of what is
            differentiated by; in the file's length unit.
        rotation_error: Largest error of an entry of a rotation (for small errors, radians), or of any other entry.
        position_tolerance: What was accepted.
        rotation_tolerance: What was accepted.
        worst: Joint vector of the largest error, relative to its tolerance.
        worst_share: Largest share of an error in what is accepted of its entry, if each entry has a limit of its own;
            None where one limit holds for all, so that the largest error is the worst.
        compared: Number of entries that were compared; 0 where they are not counted.
        uncompared: Number of entries of which any value is accepted: those in which rounding leaves no digit.
        is_zero: Whether what it computes is 0 at all these joint vectors, so that little is proven of it.
    """

    invocation: Invocation
    quantity: Quantity
    poses: int
    position_error: float
    rotation_error: float
    position_tolerance: float
    rotation_tolerance: float
    worst: tuple[float, ...]
    frame: str
    worst_share: float | None = None
    compared: int = 0
    uncompared: int = 0
    is_zero: bool = False

    @property
    def target(self) -> str:
        """The sentence about what was called, such as `C double, batch`."""
        return str(self.invocation)

    @property
    def row(self) -> str:
        """What it counts as in a report, such as `C double, batch` for every layout."""
        return str(self.invocation.row)

    @property
    def real(self) -> str:
        """Number type, `double`, `float` or `q30`; empty if it is not known."""
        return self.invocation.scalar

    @property
    def share(self) -> float:
        """The error of the worst entry, as a share of its tolerance; infinite for a NaN."""
        if self.worst_share is not None:
            return math.inf if math.isnan(self.worst_share) else self.worst_share
        shares = (
            self.position_error / self.position_tolerance if self.position_error else 0.0,
            self.rotation_error / self.rotation_tolerance if self.rotation_error else 0.0,
        )
        return math.inf if any(map(math.isnan, shares)) else max(shares)

    @property
    def holds(self) -> bool:
        """Whether all errors are within their tolerances; a NaN is not."""
        within = self.position_error <= self.position_tolerance and self.rotation_error <= self.rotation_tolerance
        return within and self.share <= 1


def solver_comparison(
    invocation: Invocation,
    case: str,
    quantity: Quantity,
    poses: int,
    errors: Iterable[float],
    accepted: Iterable[float],
    worst: Iterable[float],
    frame: str = TOOL,
) -> Comparison:
    """Return what the trial of a solver comes to.

    `errors`, `accepted`: the largest error of a position and of a rotation, and what is accepted of them. `worst`: the
    joint vector of the worst error.
    """
    (position, rotation), (most, most_turned) = map(float, errors), map(float, accepted)
    way, place = replace(invocation, case=case), tuple(map(float, worst))
    return Comparison(way, quantity, poses, position, rotation, most, most_turned, place, frame)


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

        Raises `ProofError` naming the worst kernel, its error and the joint vector.
        """
        for comparison in self.comparisons:
            if not comparison.holds:
                if defect := _defect_of_file(robot, comparison):
                    raise ProofError(f"{robot.name}: {defect}; nothing was written")
                place = ", ".join(f"{entry:.6g}" for entry in comparison.worst)
                raise ProofError(
                    f"{robot.name}: {comparison.target} {comparison.quantity} differs from the reference at "
                    f"q = ({place}), frame {comparison.frame}: {comparison.position_error:.3g} {robot.units.length} "
                    f"(tolerance {comparison.position_tolerance:.3g}), rotation {comparison.rotation_error:.3g} "
                    f"(tolerance {comparison.rotation_tolerance:.3g}); nothing was written{_remedy(comparison)}"
                )


def _defect_of_file(robot: Robot, comparison: Comparison) -> str:
    """Returns what is wrong in the file where the kernel is not to blame; empty if it is."""
    if comparison.quantity.kind is not Kind.JOINTS_TO_ACTUATORS:
        return ""
    from kinegen.verify.reference.actuators import inverse_defect

    return inverse_defect(robot, comparison.worst)


def _remedy(comparison: Comparison) -> str:
    """Returns what builds the robot all the same, where kernels in float are what fails."""
    return "; --real double builds without float" if comparison.invocation.scalar == "float" else ""


@dataclass(frozen=True, slots=True)
class Calls:
    """What calls with different inputs took, the call itself not counted."""

    least: int  # The cheapest one
    most: int  # The dearest one

    def __str__(self) -> str:
        return f"{self.least}" if self.least == self.most else f"{self.least} to {self.most}"


@dataclass(frozen=True, slots=True)
class Cost:
    """What one kernel costs on one target.

    Attributes:
        real: Its number type: `double`, `float` or `q30`.
        optimisation: Flag it was compiled with.
        function_flash: Bytes of the kernel function and its constants.
        flash: Bytes of all that a call needs: the function, the sine-cosine pair, arithmetic of the compiler's library.
        stack: Bytes below the caller's.
        calls: Instructions or cycles, from the first of the function to its return; none where they were not measured.
        unit: `instructions` or `cycles`.
        operations: Operations of the program; none for a search, which takes as many as it needs.
        missing: Why there are no `calls`; empty where there are.
        part: What the function has in its name after the kernel's: `nearest` for the choice among its solutions.
    """

    target: str
    compiler: str
    quantity: Quantity
    real: str
    optimisation: str
    function_flash: int
    flash: int
    stack: int
    calls: Calls | None
    unit: str
    operations: Count | None
    missing: str = ""
    part: str = ""

    @property
    def name(self) -> str:
        """What was measured, as reports name it."""
        return f"{self.quantity}_{self.part}" if self.part else str(self.quantity)

    def record(self) -> dict[str, Any]:
        """Returns the same in plain values, for JSON."""
        return asdict(self) | {"quantity": self.name}


def reasons(costs: Sequence[Cost]) -> tuple[str, ...]:
    """Why some of the counts are missing, each reason once, in order."""
    return tuple(dict.fromkeys(f"no {cost.unit}: {cost.missing}" for cost in costs if cost.missing))
