"""The CMake package, taken in every way that CMake projects take one."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

from kinegen.backends.firmware.ecosystem import Ecosystem
from kinegen.backends.scalar_types import ScalarType
from kinegen.verify import reference
from tests.emit.emitted import COMPILERS, kernels
from tests.packages.packages import (
    INTEGERS,
    STUBS,
    example_pose,
    is_semantic_version,
    last_rows,
    need,
    project,
    run,
    write_package,
)

CONSUMER = """\
#include "{robot}.h"
#include "{robot}_f32.h"

#include <cstdio>

int main()
{{
    const double q[PUMA560_DOF] = {{0.1, 0.2, 0.3, 0.4, 0.5, 0.6}};
    double base_T_tool[16];
    {robot}_fk(q, base_T_tool);
    std::printf("%.17g\\n", base_T_tool[3]);
}}
"""
LISTS = "cmake_minimum_required(VERSION 3.14)\nproject(user LANGUAGES CXX)\n"
LINK = "add_executable(user user.cpp)\ntarget_link_libraries(user PRIVATE kinegen::puma560)\n"
TAKEN = {
    "add_subdirectory": "add_subdirectory(external/puma560)\n",
    "FetchContent": "include(FetchContent)\n"
    "FetchContent_Declare(puma560 SOURCE_DIR ${CMAKE_SOURCE_DIR}/external/puma560)\n"
    "FetchContent_MakeAvailable(puma560)\n",
    "find_package": f"find_package(puma560 {kernels('puma560').robot.release} REQUIRED)\n",
}


def configure(folder: Path, *options: str) -> Path:
    """Configure and build a project, and return the folder of its products."""
    need("cmake", "gcc", "g++")
    products = folder.parent / "products"
    run(["cmake", "-S", folder, "-B", products, *options], folder)
    run(["cmake", "--build", products, "--parallel", "2"], folder)
    return products


def user(place: Path, taking: str) -> Path:
    """Write a C++ project that uses the package."""
    folder = place / "user"
    folder.mkdir()
    (folder / "CMakeLists.txt").write_text(LISTS + taking + LINK)
    (folder / "user.cpp").write_text(CONSUMER.format(robot="puma560"))
    return folder


@pytest.mark.parametrize("reals", [(ScalarType.DOUBLE, ScalarType.FLOAT), *INTEGERS], ids="-".join)
@pytest.mark.parametrize("robot", ["puma560", "calibrated_2r"])
def test_alone_it_builds_and_its_own_test_passes(robot: str, reals: tuple[str, ...], tmp_path: Path) -> None:
    products = configure(write_package(tmp_path, robot, Ecosystem.CMAKE, reals))

    told = run(["ctest", "--test-dir", products, "--output-on-failure"], tmp_path)
    shown = last_rows(run([products / f"{robot}_pose"], tmp_path))

    assert f"100% tests passed, 0 tests failed out of {len(reals) + 1}" in told
    np.testing.assert_allclose(
        shown, example_pose(robot, project(robot, Ecosystem.CMAKE, reals)["examples/pose.c"]), atol=1e-5
    )


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize(
    "relaxed", ["-Ofast", "-ffast-math", "-funsafe-math-optimizations", "-O2 -fsingle-precision-constant"]
)
def test_what_a_project_relaxes_is_taken_back_for_its_files(relaxed: str, compiler: str, tmp_path: Path) -> None:
    if compiler == "clang" and "single" in relaxed:
        relaxed = "-freciprocal-math -fno-signed-zeros"
    folder = write_package(tmp_path, "calibrated_2r", Ecosystem.CMAKE)
    products = configure(folder, f"-DCMAKE_C_FLAGS={relaxed}", f"-DCMAKE_C_COMPILER={compiler}")

    told = run(["ctest", "--test-dir", products, "--output-on-failure"], tmp_path)

    assert "100% tests passed, 0 tests failed out of 3" in told


def test_its_files_stay_apart_in_a_unity_build(tmp_path: Path) -> None:
    products = configure(write_package(tmp_path, "calibrated_2r", Ecosystem.CMAKE), "-DCMAKE_UNITY_BUILD=ON")

    assert list(products.rglob("unity_*")) == []
    assert list(products.rglob("lib*calibrated_2r.a"))


def test_the_test_fails_if_a_kernel_is_wrong(tmp_path: Path) -> None:
    folder = write_package(tmp_path, "puma560", Ecosystem.CMAKE)
    source = folder / "src" / "puma560.c"
    source.write_text(source.read_text().replace("0.4318", "0.4319"))
    products = configure(folder)

    done = subprocess.run(["ctest", "--test-dir", products], capture_output=True, text=True, check=False)

    assert done.returncode != 0
    assert re.search(r"puma560_selftest \.*\*+Failed", done.stdout)


@pytest.mark.parametrize("way", ["add_subdirectory", "FetchContent"])
def test_another_project_takes_it_as_a_folder(way: str, tmp_path: Path) -> None:
    folder = user(tmp_path, TAKEN[way])
    write_package(folder / "external", "puma560", Ecosystem.CMAKE)

    products = configure(folder)

    known = reference.pose(kernels("puma560").robot, [0.1, 0.2, 0.3, 0.4, 0.5, 0.6])[0, 0, 0, 3]
    assert float(run([products / "user"], tmp_path)) == pytest.approx(known, abs=1e-12)
    assert not list(products.rglob("puma560_selftest*.o")), "inside another project the tests are not built"


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The place where the package is installed."""
    place = tmp_path_factory.mktemp("package")
    products = configure(write_package(place, "puma560", Ecosystem.CMAKE), "-DPUMA560_TESTS=OFF")
    run(["cmake", "--install", products, "--prefix", place / "prefix"], place)
    return place / "prefix"


def test_another_project_finds_it_once_installed(installed: Path, tmp_path: Path) -> None:
    products = configure(user(tmp_path, TAKEN["find_package"]), f"-DCMAKE_PREFIX_PATH={installed}")

    assert run([products / "user"], tmp_path)
    names = {path.name for path in installed.rglob("*.*")}
    assert {"puma560.h", "puma560_f32.h", "puma560-config.cmake", "puma560-config-version.cmake"} <= names


def test_another_minor_version_is_not_taken_for_it(installed: Path, tmp_path: Path) -> None:
    release = kernels("puma560").robot.release
    folder = user(tmp_path, TAKEN["find_package"].replace(release, "0.2"))

    command: list[str | Path] = ["cmake", "-S", folder, "-B", tmp_path / "products", f"-DCMAKE_PREFIX_PATH={installed}"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)

    assert done.returncode != 0
    assert f"version: {release}" in done.stderr


def test_it_builds_for_a_cortex_m4f_and_needs_nothing(tmp_path: Path) -> None:
    """Kernels and self-test, with the flags that the package promises; the float objects miss no symbol."""
    need("cmake", "arm-none-eabi-gcc")
    folder = write_package(tmp_path, "puma560", Ecosystem.CMAKE)
    products = tmp_path / "products"
    run(["cmake", "-S", folder, "-B", products, f"-DCMAKE_TOOLCHAIN_FILE={STUBS / 'cortex_m4f.cmake'}"], tmp_path)
    told = run(["cmake", "--build", products, "--verbose", "--target", "all", "kinegen_puma560_selftest"], tmp_path)

    compiled = [line for line in told.splitlines() if " -c " in line and "puma560" in line]
    assert len(compiled) == 4
    assert all("-std=c99" in line and "-ffp-contract=off" in line for line in compiled)
    kernel: Path = next(products.rglob("puma560_f32.c.o*"))
    assert run(["arm-none-eabi-nm", "-u", kernel], tmp_path) == ""


def test_on_a_board_whose_double_is_a_float_the_float_package_is_asked_for(tmp_path: Path) -> None:
    files = project("puma560", Ecosystem.CMAKE, (ScalarType.FLOAT,))

    assert not any(path.endswith("/puma560.c") for path in files)
    assert "src/puma560.c" not in files["CMakeLists.txt"]


def test_two_packages_stand_side_by_side(tmp_path: Path) -> None:
    folder = user(tmp_path, "add_subdirectory(external/puma560)\nadd_subdirectory(external/screw)\n")
    lists = folder / "CMakeLists.txt"
    lists.write_text(lists.read_text().replace("kinegen::puma560", "kinegen::puma560 kinegen::screw"))
    for robot in ("puma560", "screw"):
        write_package(folder / "external", robot, Ecosystem.CMAKE)

    products = configure(folder, "-DPUMA560_TESTS=ON", "-DSCREW_TESTS=ON")

    assert run([products / "user"], tmp_path)


def test_the_version_is_one_that_cmake_takes() -> None:
    found = re.search(
        r"project\(puma560 VERSION (\S+) LANGUAGES C\)", project("puma560", Ecosystem.CMAKE)["CMakeLists.txt"]
    )

    assert found
    assert is_semantic_version(found[1])
    assert re.fullmatch(r"\d+\.\d+\.\d+", found[1])
