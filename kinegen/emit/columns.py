"""What the columns of a parameter Jacobian stand for, which headers and modules have to say."""

from __future__ import annotations

from kinegen.emit.kernels import Kernels
from kinegen.outputs import Kind


def varied_names(kernels: Kernels) -> tuple[str, ...]:
    """The parameters that the columns of `parameter_jacobian` stand for; none where it is not built."""
    if not any(program.quantity.kind is Kind.PARAMETER_JACOBIAN for program in kernels.programs):
        return ()
    return tuple(parameter.name for parameter in kernels.robot.varied_parameters)
