"""Packages of kernels other than poses: their files, and an example that calls what there is."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from kinegen.backends.firmware.ecosystem import Ecosystem
from kinegen.backends.firmware.project import emit_project
from kinegen.model.outputs import Quantity, parse_quantity
from kinegen.support.files.write import write_files
from kinegen.verify import reference
from kinegen.verify.reference import Kinematics
from tests.emit.emitted import kernels, texts, vectors
from tests.packages.packages import STUBS, need, run

FloatArray = NDArray[np.float64]


def quantities(outputs: str) -> tuple[Quantity, ...]:
    """The quantities of a list."""
    return tuple(map(parse_quantity, outputs.split(",")))


@cache
def project(robot: str, outputs: str, ecosystem: Ecosystem) -> Mapping[str, str]:
    """The files of a package with its usual number types."""
    wanted = quantities(outputs)
    return emit_project(
        kernels(robot, wanted), vectors(robot, wanted), texts(robot, wanted), ecosystem.reals, ecosystem
    )


def write(place: Path, robot: str, outputs: str, ecosystem: Ecosystem) -> Path:
    """Write a package and return its folder."""
    write_files(place / robot, project(robot, outputs, ecosystem))
    return place / robot


def compiled(folder: Path, sources: str, example: Path, *flags: str) -> str:
    """What the example prints, compiled as C++ with the C files of a package and warnings as errors."""
    need("gcc", "g++")
    warnings = ["-Wall", "-Wextra", "-Werror", *(f"-I{folder / name}" for name in ("include", "src"))]
    objects = []
    for source in sorted((folder / sources).rglob("*.c")):
        objects.append(folder / f"{source.stem}.o")
        run(["gcc", "-std=gnu11", "-O1", *warnings, "-c", source, "-o", objects[-1]], folder)
    run(["g++", *warnings, *flags, "-x", "c++", example, "-x", "none", *objects, "-o", "example"], folder)
    return run([folder / "example"], folder)


def built(folder: Path) -> tuple[str, str]:
    """What the tests and the example of a CMake package print."""
    need("cmake", "gcc")
    products = folder / "products"
    run(["cmake", "-S", folder, "-B", products, "-DCMAKE_C_FLAGS=-Wall -Wextra -Werror"], folder)
    run(["cmake", "--build", products], folder)
    told = run(["ctest", "--test-dir", products], folder)
    return told, run([products / f"{folder.name}_pose"], folder)


def numbers(text: str) -> FloatArray:
    """The numbers of one block that a program printed."""
    return np.array([[float(word) for word in line.split()] for line in text.strip().splitlines()])


def given(text: str, name: str) -> FloatArray:
    """An input that stands in an example."""
    found = re.search(rf" {name}\[.*?\] = \{{(.*?)\}};", text, re.S)

    assert found
    plain = re.sub(r"/\*.*?\*/|F\b", "", found[1], flags=re.S)
    return np.array([float(word) for word in plain.split(",")])


def test_a_package_with_several_results_prints_them_all(tmp_path: Path) -> None:
    folder = write(tmp_path, "puma560", "fk_jacobian,twist", Ecosystem.CMAKE)

    told, printed = built(folder)

    q = given((folder / "examples" / "pose.c").read_text(), "q")
    known = Kinematics(kernels("puma560").robot, [q])
    pose, jacobian = map(numbers, printed.split("\n\n"))
    assert "100% tests passed, 0 tests failed out of 3" in told
    np.testing.assert_allclose(pose, known.pose("tool")[0, :3], atol=1e-6)
    np.testing.assert_allclose(jacobian, known.jacobian("tool")[0], atol=1e-6)


def test_a_package_with_parameters_passes_those_of_the_file(tmp_path: Path) -> None:
    folder = write(tmp_path, "calibrated_2r", "parameter_jacobian", Ecosystem.CMAKE)

    told, printed = built(folder)

    robot = kernels("calibrated_2r").robot
    known = Kinematics(robot, [given((folder / "examples" / "pose.c").read_text(), "q")])
    names = tuple(parameter.name for parameter in robot.runtime_parameters)
    assert "100% tests passed" in told
    np.testing.assert_allclose(numbers(printed), known.parameter_jacobian("tool", names)[0], atol=1e-6)


def test_a_package_with_inverses_solves_for_a_pose_that_can_be_reached(tmp_path: Path) -> None:
    folder = write(tmp_path, "puma560", "inverse,numeric_inverse", Ecosystem.PLATFORMIO)
    example = folder / "examples" / "pose" / "pose.cpp"

    found, _, joints = compiled(folder, "src", example).partition("\n")

    target = given(example.read_text(), "base_T_tool").reshape(4, 4)
    assert found == "found"
    np.testing.assert_allclose(reference.pose(kernels("puma560").robot, numbers(joints))[0, 0], target, atol=1e-4)


@pytest.mark.parametrize("sketch", ["Pose", "SelfTest"])
def test_a_package_may_hold_nothing_that_takes_joints(sketch: str, tmp_path: Path) -> None:
    folder = write(tmp_path, "puma560", "inverse_pose", Ecosystem.ARDUINO)
    example = folder / "examples" / sketch / f"{sketch}.ino"

    told = compiled(folder, "src", example, f"-I{STUBS}", "-include", "Arduino.h")

    if sketch == "Pose":
        pose = given(example.read_text(), "a_T_b").reshape(4, 4)
        np.testing.assert_allclose(numbers(told.split("\n\n")[0]) @ pose, np.eye(4)[:3], atol=1e-5)
    else:
        assert told.count("passed") == 2 * len(re.findall(r"_selftest\w*\(\)", example.read_text()))


def test_the_sketch_solves_for_the_targets_of_the_inverse(tmp_path: Path) -> None:
    folder = write(tmp_path, "scara", "pose,inverse", Ecosystem.ARDUINO)
    example = folder / "examples" / "SelfTest" / "SelfTest.ino"

    told = compiled(folder, "src", example, f"-I{STUBS}", "-include", "Arduino.h")

    assert re.match(
        r"scara_f32_selftest: .*, passed\n"
        r"scara_f32_selftest_inverse: .*, passed\n"
        r"scara_f32_selftest_sincos: .*, passed\n",
        told,
    )


def test_an_esp_idf_project_of_a_tree_builds_and_passes(tmp_path: Path) -> None:
    need("cmake", "gcc")
    folder = write(tmp_path, "hand", "position,quaternion_wxyz", Ecosystem.ESP_IDF) / "examples" / "pose"
    products = tmp_path / "products"
    run(
        ["cmake", "-S", folder, "-B", products, "-DCMAKE_C_FLAGS=-Wall -Werror"],
        folder,
        IDF_PATH=str(STUBS / "esp_idf"),
    )
    run(["cmake", "--build", products], folder)

    told = run([products / "hand_pose"], tmp_path)

    q = given((folder / "main" / "main.c").read_text(), "q")
    robot = kernels("hand").robot
    passed, sincos, place = told.split("\n", 2)
    assert (passed, sincos) == ("hand_f32_selftest: passed", "hand_f32_selftest_sincos: passed")
    np.testing.assert_allclose(numbers(place)[0], reference.pose(robot, [q])[0, 0, :3, 3], atol=1e-5)


@pytest.mark.parametrize("ecosystem", Ecosystem)
def test_the_search_is_in_the_package_and_its_build_file(ecosystem: Ecosystem) -> None:
    files = project("puma560", "pose,numeric_inverse", ecosystem)
    stem = "puma560_f32_numeric_inverse"
    held = {path.rpartition("/")[2]: path for path in files}

    assert files[held[f"{stem}.c"]] == texts("puma560", quantities("pose,numeric_inverse"))[f"{stem}.c"]
    for build in ("CMakeLists.txt", "library.json", "library.properties"):
        if build in files:
            assert f"{stem}." in files[build]
    assert stem in files["README.md"]


def test_the_package_says_what_it_is_about() -> None:
    assert "Kinematics: Unimation" in project("puma560", "inverse_pose", Ecosystem.CMAKE)["README.md"]
