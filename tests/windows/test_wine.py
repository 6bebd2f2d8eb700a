"""Programs for Windows give the words that the same programs give on Linux. They run in Wine."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from numpy.typing import NDArray

from kinegen.backends.firmware.ecosystem import Ecosystem
from kinegen.backends.languages import LANGUAGES, emit_language
from kinegen.backends.scalar_types import ScalarType
from kinegen.support.naming import prefix
from kinegen.verify.language_build import compare_bits
from tests.emit.emitted import kernels
from tests.packages.packages import write_package
from tests.windows.tools import BUILD, FLAGS, GCC, GXX, need, run, wine, wine_environment
from tests.windows.words import Robot, robot_of

pytestmark = [pytest.mark.windows, pytest.mark.usefixtures("wine_runs")]

COUNT = 40
"""Configurations at which C++ is compared with C."""


@pytest.fixture(scope="session")
def objects(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, str], Path]:
    """The folder with the files of a robot and what a compiler makes of each of them."""

    @cache
    def folder(compiler: str, name: str) -> Path:
        need("gcc", GCC)
        place, robot = tmp_path_factory.mktemp(f"{name}-{compiler}"), robot_of(name)
        robot.write(place)
        run([compiler, *FLAGS, "-c", *robot.sources], place)
        return place

    return folder


def words(compiler: str, folder: Path, robot: Robot) -> dict[str, NDArray[Any]]:
    """The words of each kernel, from the objects in a folder."""
    run([compiler, *(f"{Path(source).stem}.o" for source in robot.sources), "-o", "words.exe"], folder)
    run([*starter(compiler), "./words.exe", "rows", "found"], folder)
    return {entry.name: found for entry, found in robot.split((folder / "found").read_bytes())}


def starter(compiler: str) -> list[str]:
    """What runs the programs of a compiler."""
    return [wine()] if compiler == GCC else []


def test_no_word_differs(any_robot: str, objects: Callable[[str, str], Path]) -> None:
    """Every kernel, alone and in batches, and the searches: at the test vectors, and with numbers that are none."""
    robot = robot_of(any_robot)
    wanted, found = (words(compiler, objects(compiler, any_robot), robot) for compiler in ("gcc", GCC))
    differing = {name: int((found[name] != wanted[name]).sum()) for name in wanted}

    assert {name: count for name, count in differing.items() if count} == {}
    assert sum(map(len, wanted.values())) > 1000


def test_the_self_test_prints_the_same(any_robot: str, objects: Callable[[str, str], Path]) -> None:
    for stem in (prefix(any_robot, real) for real in ScalarType):
        said = []
        for compiler in ("gcc", GCC):
            folder = objects(compiler, any_robot)
            flags = [*FLAGS, "-DKINEGEN_SELFTEST_MAIN"]
            run([compiler, *flags, f"{stem}_selftest.c", f"{stem}.o", "-o", "test.exe"], folder)
            said.append(run([*starter(compiler), "./test.exe"], folder))

        assert said[0] == said[1]
        assert "passed" in said[1]
        assert "FAILED" not in said[1]


def test_a_word_that_differs_would_be_seen(objects: Callable[[str, str], Path], tmp_path: Path) -> None:
    robot = robot_of("scara")
    wanted = words("gcc", objects("gcc", "scara"), robot)
    folder = shutil.copytree(objects(GCC, "scara"), tmp_path / "altered")
    text = robot.files["scara.c"]
    assert " 0.25 /*" in text
    (folder / "scara.c").write_text(text.replace(" 0.25 /*", " 0.25000000000000006 /*"), encoding="utf-8")
    run([GCC, *FLAGS, "-c", "scara.c"], folder)
    found = words(GCC, folder, robot)

    assert {name for name in wanted if (found[name] != wanted[name]).any()} >= {"scara_fk", "scara_position"}


def test_cpp_gives_the_bits_of_c_on_linux(cpp_robot: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A compiler is put before the others whose programs are for Windows, behind a script that starts Wine."""
    need(GXX)
    script = tmp_path / "g++"
    script.write_text(
        "#!/bin/sh\n"
        "for name; do :; done\n"
        f'{GXX} -static "$@" || exit 1\n'
        f'printf \'#!/bin/sh\\nexec {wine()} "$(dirname "$0")/%s.exe" "$@"\\n\' "$name" >"$name"\n'
        'chmod +x "$name"\n',
        encoding="utf-8",
    )
    script.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    for variable in ("WINEPREFIX", "WINEDEBUG", "WINEDLLOVERRIDES"):
        monkeypatch.setenv(variable, wine_environment()[variable])
    cpp = LANGUAGES["cpp"]
    assert shutil.which("g++") == str(script)
    found = compare_bits(kernels(cpp_robot), cpp, emit_language(kernels(cpp_robot), cpp), COUNT)

    assert (found.differing, found.worst) == (0, "")
    assert found.words > COUNT * len(kernels(cpp_robot).programs)


def test_the_cmake_package_builds_and_passes_its_tests(tmp_path: Path) -> None:
    need("cmake", GCC, GXX)
    folder = write_package(tmp_path, "puma560", Ecosystem.CMAKE)
    options = ["-DCMAKE_SYSTEM_NAME=Windows", f"-DCMAKE_C_COMPILER={GCC}", f"-DCMAKE_CXX_COMPILER={GXX}"]
    options += [f"-DCMAKE_CROSSCOMPILING_EMULATOR={wine()}", "-DCMAKE_EXE_LINKER_FLAGS=-static"]
    run(["cmake", "-S", folder, "-B", "products", *options], tmp_path)
    run(["cmake", "--build", "products"], tmp_path)
    said = run(["ctest", "--test-dir", "products", "--output-on-failure"], tmp_path)

    assert "100% tests passed, 0 tests failed out of 3" in said
    assert sorted(path.name for path in (tmp_path / "products").rglob("*_selftest.exe"))


def test_words_of_wine_are_not_shown() -> None:
    """Its folder is in the build folder, and nothing of the user's."""
    assert wine_environment()["WINEPREFIX"].startswith(str(BUILD))
    done = subprocess.run(
        [wine(), "cmd", "/c", "echo", "hello"], env=wine_environment(), capture_output=True, check=False
    )

    assert (done.stdout.strip(), done.stderr) == (b"hello", b"")
