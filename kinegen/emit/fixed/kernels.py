"""What the emitters of integer kernels are given."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from kinegen.emit.kernels import Kernels
from kinegen.ir.fixed.coarse import CoarsePair, coarse_pair
from kinegen.ir.fixed.plan import plan_fixed
from kinegen.ir.fixed.program import FixedProgram, Scales
from kinegen.ir.fixed.rounding import nearest_integer
from kinegen.ir.fixed.turns import TURN, binary_angle
from kinegen.robot.dimension import Dimension
from kinegen.robot.model import Robot


@dataclass(frozen=True, slots=True)
class FixedKernels:
    """A robot and its programs in integers.

    Attributes:
        kernels: The robot and its exact programs.
        scales: Fraction bits of lengths.
        programs: One integer program for each.
        coarse: What holds with a coarser sine and cosine; None where there is none.
    """

    kernels: Kernels
    scales: Scales
    programs: tuple[FixedProgram, ...]
    coarse: CoarsePair | None

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self.kernels.robot

    @property
    def defaults(self) -> tuple[int, ...]:
        """The file's values of the runtime parameters, as the kernels take them."""
        parameters = zip(self.robot.runtime_parameters, self.kernels.defaults, strict=True)
        return tuple(
            signed_angle(binary_angle(value))
            if parameter.dimension is Dimension.ANGLE
            else nearest_integer(value * 2**self.scales.parameter)
            for parameter, value in parameters
        )


@lru_cache(maxsize=8)
def fixed_kernels(kernels: Kernels) -> FixedKernels:
    """Write the programs of a robot in integers; their vectors, their text and their proof ask for the same ones.

    Raises:
        KinegenError: If integers cannot evaluate one; the message says why.
    """
    scales, programs = plan_fixed(kernels.robot, kernels.programs)
    return FixedKernels(kernels, scales, programs, coarse_pair(kernels.robot, programs, scales))


def signed_angle(angle: int) -> int:
    """A binary angle as the int32_t of the same bits."""
    return angle - TURN if angle >= TURN // 2 else angle
