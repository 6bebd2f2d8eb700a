"""Wrong velocities, orientations and derivatives cannot pass: formulas are exchanged on purpose, and proofs fail."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from kinegen.backends.scalar_types import ScalarType
from kinegen.errors import ProofError
from kinegen.io.load import loads
from kinegen.model.outputs import parse_quantity
from kinegen.runtime.extension import load_package
from kinegen.verify import samples
from kinegen.verify.proof import prove
from tests.builds.workshop import ARM, make, write_robot
from tests.verify.test_broken_kernels import break_emitter, first

pytestmark = pytest.mark.sabotage

Rows = list[Any]

QUANTITIES = tuple(
    parse_quantity(name)
    for name in (
        "jacobian",
        "jacobian_local",
        "jacobian_world",
        "fk_jacobian",
        "twist",
        "twist_local",
        "bias_acceleration",
        "acceleration",
        "hessian",
        "quaternion_wxyz",
        "quaternion_xyzw",
        "rpy_zyx",
        "rpy_xyz",
        "euler_zyz",
        "axis_angle",
        "quaternion_wxyz_jacobian",
        "rpy_zyx_jacobian",
        "axis_angle_jacobian",
        "parameter_jacobian",
        "inverse_pose",
        "transform_point",
        "adjoint",
    )
)


@pytest.fixture(scope="session")
def package(tmp_path_factory: pytest.TempPathFactory, cache_home: Path) -> ModuleType:
    """The small arm with all of them, in NumPy."""
    folder = tmp_path_factory.mktemp("velocities")
    make(write_robot(folder / "in"), folder / "out", quantities=QUANTITIES, compile=False, reals=(ScalarType.DOUBLE,))
    assert cache_home.is_dir()
    return load_package(folder / "out" / "arm")


def entry(place: int, change: Callable[[Any], Any]) -> Callable[[Rows], Rows]:
    """Change one number."""
    return lambda rows: [*rows[:place], change(rows[place]), *rows[place + 1 :]]


def order(*places: int) -> Callable[[Rows], Rows]:
    """Put the numbers in another order."""
    return lambda rows: [rows[place] for place in places]


def times(factors: Sequence[float]) -> Callable[[Rows], Rows]:
    """Multiply each number by a factor."""
    return lambda rows: [row * factor for row, factor in zip(rows, factors, strict=True)]


def past_half_a_turn(rows: Rows) -> Rows:
    """The same rotation, the long way round."""
    length = np.sqrt(sum(np.square(row) for row in rows))
    return [row * (1 - 2 * np.pi / length) for row in rows]


def other_wrist(rows: Rows) -> Rows:
    """The same rotation with a negative theta."""
    phi, theta, psi = rows
    return [phi + np.pi, -theta, psi + np.pi]


def other_pitch(rows: Rows) -> Rows:
    """The same rotation with a pitch beyond a quarter turn."""
    roll, pitch, yaw = rows
    return [roll - np.pi, np.pi - pitch, yaw - np.pi]


# The kernel, whose formula stands in its place, and what is done to the numbers.
BREAKS: dict[str, tuple[str, str, Callable[[Rows], Rows]]] = {
    "a sign": ("jacobian", "jacobian", entry(0, np.negative)),
    "the tenth digit": ("jacobian", "jacobian", entry(0, lambda row: row * (1 + 1e-10))),
    "angular rows first": ("jacobian", "jacobian", order(6, 7, 8, 9, 10, 11, 0, 1, 2, 3, 4, 5)),
    "columns exchanged": ("jacobian", "jacobian", order(1, 0, 3, 2, 5, 4, 7, 6, 9, 8, 11, 10)),
    "a matrix by columns": ("jacobian", "jacobian", order(0, 2, 4, 6, 8, 10, 1, 3, 5, 7, 9, 11)),
    "the axes of the frame": ("jacobian", "jacobian_local", list),
    "the origin of the base": ("jacobian", "jacobian_world", list),
    "the axes of the base": ("jacobian_local", "jacobian", list),
    "not the origin of the base": ("jacobian_world", "jacobian", list),
    "a Jacobian beside a right pose": ("fk_jacobian", "fk_jacobian", entry(12, np.negative)),
    "a pose beside a right Jacobian": ("fk_jacobian", "fk_jacobian", entry(0, np.negative)),
    "a twist in other axes": ("twist", "twist_local", list),
    "a twist of the opposite motion": ("twist", "twist", times([-1] * 6)),
    "no acceleration at constant rates": ("bias_acceleration", "bias_acceleration", times([0] * 6)),
    "half of the bias": ("bias_acceleration", "bias_acceleration", times([0.5] * 6)),
    "an angular acceleration": ("acceleration", "acceleration", entry(4, np.negative)),
    "a Hessian with its first axes exchanged": (
        "hessian",
        "hessian",
        order(*(12 * j + 2 * row + k for k in range(2) for row in range(6) for j in range(2))),
    ),
    "an entry of the Hessian": ("hessian", "hessian", entry(13, lambda row: row + 1e-9)),
    "w in the wrong place": ("quaternion_wxyz", "quaternion_xyzw", list),
    "w in the other wrong place": ("quaternion_xyzw", "quaternion_wxyz", list),
    "the inverse rotation": ("quaternion_wxyz", "quaternion_wxyz", times([1, -1, -1, -1])),
    "a negative w": ("quaternion_wxyz", "quaternion_wxyz", times([-1] * 4)),
    "not a unit quaternion": ("quaternion_wxyz", "quaternion_wxyz", times([1 + 1e-9] * 4)),
    "yaw, pitch, roll": ("rpy_zyx", "rpy_zyx", order(2, 1, 0)),
    "angles of another order": ("rpy_zyx", "rpy_xyz", list),
    "a pitch beyond a quarter turn": ("rpy_zyx", "rpy_zyx", other_pitch),
    "a negative theta": ("euler_zyz", "euler_zyz", other_wrist),
    "the inverse rotation vector": ("axis_angle", "axis_angle", times([-1] * 3)),
    "more than half a turn": ("axis_angle", "axis_angle", past_half_a_turn),
    "quaternion rates of twice the size": ("quaternion_wxyz_jacobian", "quaternion_wxyz_jacobian", times([2] * 8)),
    "an angle rate": ("rpy_zyx_jacobian", "rpy_zyx_jacobian", entry(3, lambda row: row * 1.001)),
    "angular velocities as rates": ("axis_angle_jacobian", "axis_angle_jacobian", entry(0, lambda row: row + 1e-6)),
    "parameters exchanged": ("parameter_jacobian", "parameter_jacobian", order(1, 0, 3, 2, *range(4, 12))),
    "a pose turned round without its position": ("inverse_pose", "inverse_pose", entry(3, np.negative)),
    "a point that is not turned": ("transform_point", "transform_point", order(1, 0, 2)),
    "an adjoint for the other order": ("adjoint", "adjoint", lambda rows: [*rows[18:], *rows[:18]]),
}


@pytest.mark.parametrize("case", BREAKS)
def test_a_wrong_formula_is_refused(case: str, package: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    name, source, change = BREAKS[case]
    formulas = sys.modules[f"{package.__name__}._numpy"]
    honest = getattr(formulas, source)
    monkeypatch.setattr(formulas, name, lambda *inputs: change(list(honest(*inputs))))
    monkeypatch.setattr(samples, "RANDOM", 500)

    with pytest.raises(ProofError, match=f"arm: NumPy double {name} differs from the reference at q = "):
        prove(ROBOT, package, (parse_quantity(name),), ("double",)).require(ROBOT)


ROBOT = loads(ARM, "arm.yaml")


def test_the_right_formulas_pass(package: ModuleType) -> None:
    proof = prove(ROBOT, package, QUANTITIES, ("double",))

    proof.require(ROBOT)
    assert {comparison.target for comparison in proof.comparisons} == {
        "NumPy double",
        "NumPy double, other parameters",
        "NumPy double, beyond limits",
        "NumPy double, 50 digits",
        "NumPy double, differences",
        "NumPy double, adjoint",
    }


COMPILED = {
    "a Jacobian beside a right pose": ("fk_jacobian", "emit_kernel", first(r"jacobian\[0\] = ", r"\g<0>-"), "C double"),
    "a batch of twists": (
        "twist",
        "emit_batch",
        first(r"qd\[i \* qd_pose \+ 1", "qd[i * qd_pose + 0"),
        "C double, batch",
    ),
    "the second result in another layout": (
        "fk_jacobian",
        "emit_batch",
        first(r"store_rows\(results \+ 12", "store_rows(results + 11"),
        "C double, batch joint_major",
    ),
    "a batch of points": (
        "transform_point",
        "emit_batch",
        first(r"b_p\[i \* b_p_pose \+ 1", "b_p[i * b_p_pose + 0"),
        "C double, batch",
    ),
    "a selection": ("quaternion_wxyz", "emit_kernel", first(r"\((t\d+) < 0\.0\)", r"(\1 < 0.5)"), "C double"),
}


@pytest.mark.parametrize("case", COMPILED)
def test_a_wrong_kernel_in_c_is_refused(case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    name, emitter, change, target = COMPILED[case]
    break_emitter(monkeypatch, emitter, ".c", change, ScalarType.DOUBLE)

    with pytest.raises(ProofError, match=f"arm: {target} {name} differs from the reference"):
        make(write_robot(tmp_path), tmp_path / "out", quantities=(parse_quantity(name),), reals=(ScalarType.DOUBLE,))

    assert not (tmp_path / "out").exists()
