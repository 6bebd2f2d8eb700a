"""What kernels cost: records alone, which reports read without all that measuring takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from kinegen.ir.program import Count
from kinegen.outputs import Quantity


@dataclass(frozen=True, slots=True)
class Calls:
    """What calls with different inputs took, the call itself not counted.

    Attributes:
        least: The cheapest one.
        most: The dearest one.
    """

    least: int
    most: int

    def __str__(self) -> str:
        return f"{self.least}" if self.least == self.most else f"{self.least} to {self.most}"


@dataclass(frozen=True, slots=True)
class Cost:
    """What one kernel costs on one target.

    Attributes:
        target: Name of the target.
        compiler: Compiler and version.
        quantity: What the kernel computes.
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
        """The same in plain values, for JSON."""
        return asdict(self) | {"quantity": self.name}


def reasons(costs: Sequence[Cost]) -> tuple[str, ...]:
    """Why some of the counts are missing, each reason once, in order."""
    return tuple(dict.fromkeys(f"no {cost.unit}: {cost.missing}" for cost in costs if cost.missing))
