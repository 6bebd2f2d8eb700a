"""Any robot that loads builds: its kernels are proved, whatever the table."""

from __future__ import annotations

from hypothesis import given, settings

from kinegen.emit.files import emit_files
from kinegen.emit.kernels import Kernels
from kinegen.emit.reals import Real
from kinegen.ir.lower import lower, runtime_defaults
from kinegen.outputs import USUAL
from kinegen.robot.model import Robot
from kinegen.symbolic.derive import derive
from kinegen.verify.staging import prove_package
from kinegen.verify.vectors import compute_vectors
from tests.chains import robots


@given(robots(most_rows=5))
@settings(max_examples=12)
def test_any_robot_that_loads_is_proved(robot: Robot) -> None:
    programs = tuple(lower(derive(robot, quantity)) for quantity in USUAL)
    kernels = Kernels(robot, programs, runtime_defaults(robot))
    emitted = emit_files(kernels, tuple(Real), compute_vectors(kernels))
    proof, backend = prove_package(robot, emitted.files, USUAL, tuple(Real))

    assert proof.holds
    assert backend == "numpy"
