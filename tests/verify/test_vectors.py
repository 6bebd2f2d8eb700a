"""Test vectors and self-tests of every kind of kernel: they pass, they find what is wrong, and they are certain."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from random import Random
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.c.test_vectors import Vectors, accepted_differences
from kinegen.backends.c.vectors import emit_vectors
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import lower_file
from kinegen.model.outputs import parse_quantity
from kinegen.runtime.compiler import find_compiler
from kinegen.verify.expected_results import FORMS
from kinegen.verify.reference import Orientation, pose
from kinegen.verify.selftests import worst_number
from kinegen.verify.vectors import FEW, SAFE, compute_vectors
from tests.builds.workshop import ROBOTS, make, write_robot

MOVING = ("pose", "fk_jacobian", "jacobian_local", "twist", "bias_acceleration", "acceleration_world", "hessian")
TURNED = tuple(name for form in FORMS for name in (form.value, f"{form}_jacobian"))
POSES = ("inverse_pose", "transform_point", "adjoint")
STRICT = ("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Wconversion", "-Wdouble-promotion", "-Wshadow", "-Werror")


@cache
def kernels(name: str, outputs: tuple[str, ...]) -> RobotPrograms:
    return lower_file(ROBOTS / f"{name}.yaml", tuple(parse_quantity(output) for output in outputs))


@cache
def vectors(name: str, outputs: tuple[str, ...]) -> Vectors:
    return compute_vectors(kernels(name, outputs))


def self_test(folder: Path, files: Mapping[str, str], stem: str) -> subprocess.CompletedProcess[str]:
    """Compile the self-test of some files for this machine and run it."""
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    sources = (f"{stem}_selftest.c", f"{stem}.c")
    find_compiler().run(folder, (*STRICT, "-O1", "-DKINEGEN_SELFTEST_MAIN", *sources, "-o", "selftest"), sources[0])
    return subprocess.run([folder / "selftest"], capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    ("name", "outputs", "real"),
    [
        ("puma560", MOVING + TURNED + POSES, ScalarType.DOUBLE),
        ("puma560", MOVING + TURNED + POSES, ScalarType.FLOAT),
        ("hand", ("twist", "jacobian@thumb_5", "quaternion_xyzw"), ScalarType.DOUBLE),
        ("calibrated_2r", ("parameter_jacobian", "fk_jacobian", "twist"), ScalarType.FLOAT),
        ("scara_class", TURNED, ScalarType.DOUBLE),
    ],
    ids=lambda value: str(value) if isinstance(value, str) else "",
)
def test_self_tests_pass(name: str, outputs: tuple[str, ...], real: ScalarType, tmp_path: Path) -> None:
    of = kernels(name, outputs)
    files = emit_kernel(of, real) | emit_vectors(of, vectors(name, outputs), real)
    stem = name if real is ScalarType.DOUBLE else f"{name}_f32"
    result = self_test(tmp_path, files, stem)

    assert result.returncode == 0, result.stdout
    assert ": passed" in result.stdout


WRONG = {
    "a Jacobian beside a right pose": ("fk_jacobian", "jacobian[0] = ", "jacobian[0] = -"),
    "a rate in another's place": ("twist", "qd[1]", "qd[2]"),
    "half of an acceleration": ("acceleration_world", "acceleration[5] = ", "acceleration[5] = 0.5 * "),
    "the sign of a quaternion": ("quaternion_wxyz", "quaternion_wxyz[0] = ", "quaternion_wxyz[0] = -"),
    "an angle by more than rounding": ("rpy_zyx", "rpy_zyx[2] = ", "rpy_zyx[2] = 1e-9 + "),
    "a position": ("inverse_pose", "b_T_a[3] = ", "b_T_a[3] = 2 * "),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_self_test_finds_what_is_wrong(case: str, tmp_path: Path) -> None:
    output, right, wrong = WRONG[case]
    of = kernels("puma560", (output,))
    files = emit_kernel(of, ScalarType.DOUBLE) | emit_vectors(of, vectors("puma560", (output,)), ScalarType.DOUBLE)
    assert right in files["puma560.c"]
    result = self_test(tmp_path, files | {"puma560.c": files["puma560.c"].replace(right, wrong, 1)}, "puma560")

    assert result.returncode == 1
    assert "FAILED" in result.stdout


def test_whole_turns_of_an_angle_do_not_matter(tmp_path: Path) -> None:
    of = kernels("puma560", ("rpy_zyx",))
    files = emit_kernel(of, ScalarType.DOUBLE) | emit_vectors(of, vectors("puma560", ("rpy_zyx",)), ScalarType.DOUBLE)
    text = files["puma560.c"].replace("rpy_zyx[2] = ", "rpy_zyx[2] = 6.283185307179586 + ", 1)

    assert self_test(tmp_path, files | {"puma560.c": text}, "puma560").returncode == 0


@pytest.mark.parametrize("form", FORMS)
def test_vectors_stay_away_from_jumps(form: str) -> None:
    found = vectors("puma560", (str(form),))
    q = np.array(found.inputs["q"], dtype=float)
    rotation = pose(kernels("puma560", (str(form),)).robot, q)[:, 0, :3, :3]

    assert len(q) == 16
    assert Orientation(rotation).margin(form).min() > SAFE  # type: ignore[arg-type]


def test_large_results_have_fewer_rows() -> None:
    found = vectors("puma560", MOVING + TURNED + POSES)
    rows = {str(quantity): len(results[0].rows) for quantity, results in found.expected.items()}

    assert rows.pop("hessian") == FEW
    assert set(rows.values()) == {16}


def test_inputs_are_held_exactly_by_floats() -> None:
    found = vectors("puma560", MOVING + TURNED + POSES)

    assert set(found.inputs) == {"q", "qd", "qdd", "a_T_b", "b_p"}
    for rows in found.inputs.values():
        values = np.array(rows, dtype=float)
        assert (values.astype(np.float32) == values).all()
    assert np.abs(np.array(found.inputs["qd"], dtype=float)).max() <= 1


FLIPPED = """\
kinegen: 1
name: flipped
convention: standard
units: {length: m, angle: rad}
joints:
  - {name: j, ets: [Rx(0.3), Rz(q), Rx(pi), Rx(-0.3)]}
"""
"""It always hangs upside down, so that w is zero, but not by what any single term says."""


def test_what_rounding_decides_has_no_vectors(tmp_path: Path) -> None:
    of = lower_file(write_robot(tmp_path, FLIPPED), (parse_quantity("pose"), parse_quantity("quaternion_wxyz")))
    found = compute_vectors(of)
    header = emit_vectors(of, found, ScalarType.DOUBLE)["flipped_vectors.h"]

    assert [str(quantity) for quantity in found.expected] == ["pose"]
    assert "/* flipped_quaternion_wxyz has no vectors: at every pose, rounding decides" in header
    assert len(found.inputs["q"]) == 16


FOUR_BAR = """\
kinegen: 1
name: bars
convention: modified
units: {{length: m, angle: deg}}
joints:
  - {{name: a, theta: q, d: 0, a: 0.3, alpha: 0}}
  - {{name: b, theta: q, d: 0, a: 0.4, alpha: 0}}
actuators:
  readings:
    m1: {{dimension: angle, limits: [40, {end}]}}
    m2: {{dimension: angle, limits: [-90, 90]}}
  joints:
    - {{joint: a, form: four_bar, actuator: m1, ground: 0.5, crank: 0.4, coupler: 0.2, rocker: 0.3, branch: open}}
    - {{joint: b, form: gear, actuator: m2, ratio: 1}}
"""
STRAIGHT = 66.41182153179816
"""Where coupler and rocker lie in one line, in degrees."""


@pytest.mark.parametrize("before", [1e-3, *(pytest.param(before, marks=pytest.mark.long) for before in (0.1, 1e-8))])
def test_self_tests_of_machines_near_a_dead_centre_pass(before: float, tmp_path: Path) -> None:
    path = write_robot(tmp_path, FOUR_BAR.format(end=STRAIGHT - before))
    names = ("actuators_to_joints", "joints_to_actuators", "jacobian_actuators")
    of = lower_file(path, tuple(map(parse_quantity, names)))
    make(path, tmp_path / "out", quantities=tuple(map(parse_quantity, names)), reals=(ScalarType.DOUBLE,))
    found = compute_vectors(of)

    for results in found.expected.values():
        for result in results:
            assert max(result.spreads[ScalarType.DOUBLE]) < 1e-12, "a wrong digit is found in every entry"
    assert len(found.expected) == 3


def test_differences_of_a_long_chain_follow_rounding(tmp_path: Path) -> None:
    """The proven bound is far too wide; a number that is wrong in the tenth digit is found all the same."""
    number = Random(1).randint
    rows = [
        f"  - {{name: j{i}, theta: q, d: {number(1, 99) / 1000}, a: {number(1, 99) / 1000}, "
        f"alpha: {number(1, 89)}.{number(1, 99)}}}"
        for i in range(20)
    ]
    head = "kinegen: 1\nname: lengthy\nconvention: modified\nunits: {length: m, angle: deg}\njoints:\n"
    of = lower_file(write_robot(tmp_path, head + "\n".join(rows) + "\n"), (parse_quantity("jacobian"),))
    program = of.programs[0]
    found = compute_vectors(of)
    (accepted,) = accepted_differences(of, program, found, ScalarType.DOUBLE)

    assert max(accepted) < 1e-11


def test_a_self_test_that_fails_names_its_worst_number(tmp_path: Path) -> None:
    of = kernels("puma560", ("jacobian",))
    header = emit_vectors(of, vectors("puma560", ("jacobian",)), ScalarType.DOUBLE)["puma560_vectors.h"]
    package = SimpleNamespace(jacobian=_Wrong(vectors("puma560", ("jacobian",))))
    found = worst_number(of.robot, package, header, (parse_quantity("jacobian"),), "double")  # type: ignore[arg-type]

    assert re.fullmatch(r": number 7 of jacobian is off by 0\.001 at vector 3, tolerance \S+e-1\d", found)
    assert (
        worst_number(
            of.robot,
            SimpleNamespace(jacobian=_Wrong(vectors("puma560", ("jacobian",)), 0.0)),
            header,
            (parse_quantity("jacobian"),),
            "double",
        )
        == ""
    )  # type: ignore[arg-type]


class _Wrong:
    """What returns the test vectors, but for one number."""

    inputs = (SimpleNamespace(shape=(6,)),)

    def __init__(self, found: Vectors, error: float = 1e-3) -> None:
        self.error, self.rows = error, np.array(found.expected[parse_quantity("jacobian")][0].rows, dtype=float)

    def __call__(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        rows = self.rows.copy()
        rows[3, 7] += self.error
        return rows.reshape(len(q), 6, 6)
