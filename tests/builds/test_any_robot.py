"""Any robot that loads builds: its kernels are proved, whatever the table."""

from __future__ import annotations

from hypothesis import given, settings

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.files import emit_files
from kinegen.backends.scalar_types import ScalarType
from kinegen.derive.dispatch import derive
from kinegen.ir.lower import lower, runtime_defaults
from kinegen.model.outputs import USUAL
from kinegen.model.robot import Robot
from kinegen.verify.package_proof import prove_package
from kinegen.verify.vectors import compute_vectors
from tests.chains import robots


@given(robots(most_rows=5))
@settings(max_examples=12)
def test_any_robot_that_loads_is_proved(robot: Robot) -> None:
    programs = tuple(lower(derive(robot, quantity)) for quantity in USUAL)
    kernels = RobotPrograms(robot, programs, runtime_defaults(robot))
    emitted = emit_files(kernels, tuple(ScalarType), compute_vectors(kernels))
    proof, backend = prove_package(robot, emitted.files, USUAL, tuple(ScalarType))

    assert proof.holds
    assert backend == "numpy"
