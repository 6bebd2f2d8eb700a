"""The C++ header as its users compile it: both compilers, all standards, Eigen, CMake; and its bits beside C."""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path

import pytest

from benchmarks.cpp import measure
from kinegen.backends.cpp.syntax import number
from kinegen.backends.languages import LANGUAGES, emit_language, kept
from kinegen.driver.pipeline import lower_file
from kinegen.errors import KinegenError
from kinegen.model.outputs import NUMERIC_INVERSE, parse_quantity
from kinegen.verify.runners.cpp import FLAGS
from kinegen.verify.vectors import compute_vectors
from tests.emit.emitted import ROBOTS, everything, kernels, run
from tests.emit.handwritten import KERNELS

CPP = LANGUAGES["cpp"]
FOLDER = Path(__file__).parent
OUTPUTS = {
    "puma560": ("pose", "frames", "fk_jacobian", "twist", "rpy_zyx", "inverse"),
    "calibrated_2r": ("pose",),
    "hand": ("pose",),
}
EIGEN = Path("/usr/include/eigen3")

needs_gcc = pytest.mark.skipif(shutil.which("g++") is None, reason="needs g++ (Debian: apt-get install g++)")
needs_eigen = pytest.mark.skipif(not EIGEN.exists(), reason="needs Eigen (Debian: apt-get install libeigen3-dev)")
needs_cmake = pytest.mark.skipif(shutil.which("cmake") is None, reason="needs CMake (Debian: apt-get install cmake)")


@cache
def header(name: str) -> str:
    return emit_language(kernels(name, tuple(map(parse_quantity, OUTPUTS[name]))), CPP)[f"cpp/{name}.hpp"]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the headers."""
    for name in OUTPUTS:
        (tmp_path / f"{name}.hpp").write_text(header(name), encoding="utf-8")
    return tmp_path


def compiled(folder: Path, source: str, *options: str, compiler: str = "g++", standard: str = "c++17") -> None:
    """Compile a program of this folder with every warning, and run it."""
    program = folder / "program"
    run([compiler, f"-std={standard}", *FLAGS[1:], *options, f"-I{folder}", FOLDER / source, "-o", program])
    run([program])


@needs_gcc
def test_users_compile_what_they_expect(folder: Path) -> None:
    alone = (f"-D{name.upper()}_NO_EIGEN" for name in OUTPUTS)
    compiled(folder, "user.cpp", "-O1", "-ffp-contract=off", *alone)


@pytest.mark.languages
@pytest.mark.parametrize("standard", ["c++17", "c++20", "c++2b"])
@pytest.mark.parametrize("compiler", ["g++", "clang++"])
def test_both_compilers_take_every_standard(compiler: str, standard: str, folder: Path) -> None:
    if shutil.which(compiler) is None:
        pytest.skip(f"needs {compiler} (Debian: apt-get install g++ clang)")
    eigen = [f"-isystem{EIGEN}"] if EIGEN.exists() else []
    for level in ("-O0", "-O2"):
        compiled(folder, "user.cpp", level, "-Wshadow", *eigen, compiler=compiler, standard=standard)
    if eigen:
        compiled(folder, "eigen.cpp", "-O1", *eigen, compiler=compiler, standard=standard)


@needs_gcc
def test_the_example_of_the_page_compiles_and_runs(folder: Path) -> None:
    example = Path(__file__).resolve().parents[2] / "docs" / "examples" / "pose.cpp"
    run(["g++", "-std=c++17", *FLAGS[1:], "-DPUMA560_NO_EIGEN", f"-I{folder}", example, "-o", folder / "pose"])

    assert "position 0.3043 0.1500 -0.2909\n" in run([folder / "pose"])


@needs_gcc
@needs_eigen
def test_matrices_of_eigen_are_taken_and_returned(folder: Path) -> None:
    compiled(folder, "eigen.cpp", f"-isystem{EIGEN}")


@needs_gcc
def test_wrong_sizes_and_flags_that_change_numbers_do_not_compile(folder: Path) -> None:
    code = '#define PUMA560_NO_EIGEN\n#include "puma560.hpp"\nint main() {{ {} }}\n'
    cases = {
        "std::array<double, 5> q{}; return puma560::fk(q)(3, 3) > 0;": ("no matching", ()),
        "double q[6] = {}, T[12]; puma560::fk(puma560::View(q), puma560::View(T));": ("no matching", ()),
        "return puma560::fk({})(3) > 0;": ("one index for each axis", ()),
        "return 0;": ("-ffast-math breaks", ("-ffast-math",)),
        "return 1;": ("compile without -fsingle-precision-constant", ("-fsingle-precision-constant",)),
    }
    for text, (message, options) in cases.items():
        (folder / "wrong.cpp").write_text(code.format(text), encoding="utf-8")
        command = ["g++", "-std=c++17", *options, "-fsyntax-only", "wrong.cpp"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode, text
        assert message in done.stderr, text


@needs_gcc
@needs_cmake
@pytest.mark.languages
def test_the_folder_is_a_cmake_package(tmp_path: Path) -> None:
    given = kernels("scara", tuple(map(parse_quantity, ("pose", "fk_jacobian", "inverse"))))
    place = tmp_path / "cpp"
    place.mkdir()
    for path, text in emit_language(given, CPP, compute_vectors(given)).items():
        (tmp_path / path).write_text(text, encoding="utf-8")
    run(["cmake", "-S", place, "-B", tmp_path / "build", f"-DCMAKE_INSTALL_PREFIX={tmp_path / 'installed'}"])
    run(["cmake", "--build", tmp_path / "build"])
    assert "100% tests passed" in run(["ctest", "--test-dir", tmp_path / "build"])
    run(["cmake", "--install", tmp_path / "build"])
    use = tmp_path / "use"
    use.mkdir()
    (use / "use.cpp").write_text("#include <scara.hpp>\nint main() { return scara::fk({})(3, 3) == 1.0 ? 0 : 1; }\n")
    (use / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.14)\nproject(use LANGUAGES CXX)\nfind_package(scara REQUIRED)\n"
        "add_executable(use use.cpp)\ntarget_link_libraries(use PRIVATE scara::scara)\n"
    )
    run(["cmake", "-S", use, "-B", use / "build", f"-DCMAKE_PREFIX_PATH={tmp_path / 'installed'}"])
    run(["cmake", "--build", use / "build"])
    run([use / "build" / "use"])


def test_every_operator_is_printed() -> None:
    text = emit_language(KERNELS, CPP)["cpp/made_up.hpp"]

    for line in (
        "const Real t2 = params.far / params.lambda;",
        "const Real t6 = square_root(t2);",
        "const Real t7 = angle_of(t3, t6);",
        "const Real t8 = q[0] < Real(0.5) ? t3 : t7;",
    ):
        assert f"    {line}\n" in text


def test_numbers_are_those_of_both_types() -> None:
    """Once where a double rounds to the float that C has, twice where it is another one."""
    halfway = Fraction(1) + Fraction(1, 2**24) + Fraction(1, 2**80)

    assert number(Fraction(1, 4)) == "Real(0.25)"
    assert number(Fraction(-1, 3)) == "Real(-0.3333333333333333)"
    assert number(halfway) == "detail::either<Real>(1.0000000596046448, 1.0000001F)"
    assert number(Fraction(1, 10**9), Fraction(1, 10**4)) == "detail::either<Real>(1e-09, 0.0001F)"


@pytest.mark.parametrize("name", ["std", "Eigen", "index", "sinf", "read"])
def test_names_of_the_library_are_refused(name: str) -> None:
    given = kernels("scara")
    renamed = replace(given, robot=replace(given.robot, name=name))
    with pytest.raises(KinegenError, match=rf"robot name '{name}' is a word of C\+\+"):
        emit_language(renamed, CPP)


@pytest.mark.parametrize("name", ["gamma", "index", "Real"])
def test_parameters_may_have_names_of_the_library_but_not_of_the_type(name: str, tmp_path: Path) -> None:
    path = tmp_path / "calibrated_2r.yaml"
    path.write_text(re.sub(r"\btilt\b", name, (ROBOTS / path.name).read_text(encoding="utf-8")), encoding="utf-8")
    given = lower_file(path, (parse_quantity("pose"),))
    if name == "Real":
        with pytest.raises(KinegenError, match=r"parameter name 'Real' is a word of C\+\+"):
            emit_language(given, CPP)
    else:
        assert f"    Real {name} = " in emit_language(given, CPP)["cpp/calibrated_2r.hpp"]


def test_the_search_is_refused_with_a_reason() -> None:
    assert "calls that of C" in CPP.refuses(NUMERIC_INVERSE)


@needs_gcc
@pytest.mark.languages
@pytest.mark.proves("cpp")
def test_every_robot_has_the_bits_of_c(language: str, name: str) -> None:
    """Every output in both number types, with NaN and numbers out of range among the inputs."""
    found = measure(kept(everything(name), LANGUAGES[language]), 300)

    assert found["words"]
    assert found["wrong"] == 0
