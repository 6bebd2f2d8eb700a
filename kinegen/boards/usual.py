"""What a build says of firmware without being asked: the cost on the usual microcontroller, where it can be measured.

Emulators take seconds, so the figures are remembered in the user's cache, by the text of the kernels and the compiler.
"""

from __future__ import annotations

from dataclasses import dataclass

from kinegen.boards.cost import better, measure
from kinegen.boards.figures import Cost
from kinegen.boards.targets import find_target
from kinegen.boards.toolchain import find_cross_compiler
from kinegen.emit.c.kernel import emit_kernel
from kinegen.emit.c.numeric_inverse import emit_numeric_inverse
from kinegen.emit.kernels import Kernels
from kinegen.emit.reals import Real
from kinegen.errors import MissingToolError
from kinegen.native.cache import Cache
from kinegen.native.identity import identity

USUAL_TARGET = "cortex-m4f"
"""The microcontroller that most arms are driven by; its FPU is for floats."""


def can_measure() -> bool:
    """Whether the compiler of the usual target is installed."""
    try:
        find_cross_compiler(find_target(USUAL_TARGET))
    except MissingToolError:
        return False
    return True


def usual_costs(kernels: Kernels) -> tuple[Cost, ...]:
    """The cost of the float kernels on the usual target.

    Args:
        kernels: The robot and its programs.

    Returns:
        For each kernel the better of the optimisation levels.

    Raises:
        MissingToolError: If there is no compiler for the target.
    """
    target = find_target(USUAL_TARGET)
    store = Cache()
    search = emit_numeric_inverse(kernels, Real.FLOAT) if kernels.numeric_inverse else {}
    texts = sorted((emit_kernel(kernels, Real.FLOAT) | search).items())
    key = store.key("cost", identity(), texts, find_cross_compiler(target))
    known = store.load_record(key, _Kept)
    if known is not None:
        return known.costs
    costs = measure(kernels, Real.FLOAT, target)
    names = dict.fromkeys(cost.name for cost in costs)
    chosen = tuple(better([cost for cost in costs if cost.name == name]) for name in names)
    if all(cost.calls is not None for cost in chosen):
        store.save_record(key, _Kept(chosen))
    return chosen


@dataclass(frozen=True, slots=True)
class _Kept:
    """Figures as they are kept."""

    costs: tuple[Cost, ...]
