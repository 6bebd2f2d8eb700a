"""On every processor the integer kernels give the bits of the host; without an FPU they take an eighth of the time."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import pytest

from kinegen.backends.scalar_types import ScalarType
from kinegen.model.outputs import USUAL, Quantity
from kinegen.support.naming import Q30, c_file, prefix
from kinegen.verify.boards.cost import better, measure
from kinegen.verify.boards.targets import SOURCES, STRICT, TARGETS, Target, compile_object, link, run_program
from tests.boards.conftest import kernels, require
from tests.fixed.kernels import SPLIT, fixed, run, texts

pytestmark = pytest.mark.boards

HERE = Path(__file__).resolve().parent
NAMES = ("puma560", "ur5", "scara", "panda", "thumb", "hand", "stanford")
SMALL = ("cortex-m0", "cortex-m3")
REPEATS = 8


@dataclass(frozen=True)
class Run:
    """What a board printed.

    Attributes:
        digest: Of the bits of all results.
        least: Instructions of the cheapest call of the pose, with the loop that makes it.
        most: Of the dearest one.
    """

    digest: int
    least: Fraction
    most: Fraction


def defines(name: str) -> list[str]:
    """The macros of the program for a robot."""
    robot = fixed(name).robot
    stem = prefix(name, Q30)
    macros = {
        "REAL": "int32_t",
        "HEADER": f'"{c_file(name, "h", Q30)}"',
        "DOF": robot.dof,
        "TIPS": len(robot.tips),
        "FRAME_COUNT": len(robot.frame_names),
        **{quantity.function.upper(): f"{stem}_{quantity.function}" for quantity in USUAL},
    }
    return [f"-D{macro}={value}" for macro, value in macros.items()]


def write(folder: Path, name: str) -> list[Path]:
    """The C of a robot; the source and the program's main file."""
    for file in (c_file(name, "h", Q30), c_file(name, "c", Q30)):
        (folder / file).write_text(texts(name)[file], encoding="utf-8")
    return [folder / c_file(name, "c", Q30), HERE / "board.c"]


def on_board(folder: Path, name: str, target: Target, *flags: str) -> Run:
    """Run a robot's kernels on an emulated board."""
    require(target)
    sources = [*write(folder, name), *(SOURCES / source for source in target.toolchain.sources)]
    # The functions are called through pointers to what they fill, whatever its shape.
    objects = [compile_object(target, folder, source, (*flags, *defines(name))) for source in sources]
    printed = dict(line.split() for line in run_program(target, link(target, folder, objects, "board.elf")))
    tick = Fraction(int(printed["spin"]), 10_000 * target.toolchain.round_cost)
    least, most = (Fraction(int(printed[label]), REPEATS) / tick for label in ("least", "most"))
    return Run(int(printed["digest"]), least, most)


def on_host(folder: Path, name: str, *flags: str) -> int:
    """The digest on this machine."""
    sources = [*write(folder, name), SOURCES / "host.c"]
    (folder / "clock.c").write_text(
        '#include "board.h"\nvoid board_clock_start(void) {}\nuint32_t board_clock_read(void) { return 0; }\n'
        "void board_spin(uint16_t rounds) { (void)rounds; }\n",
        encoding="utf-8",
    )
    program = folder / "host"
    paths = ["-I", folder, "-I", SOURCES]
    run(["gcc", *STRICT, "-O1", *flags, *defines(name), *paths, *sources, folder / "clock.c", "-o", program])
    return int(dict(line.split() for line in run([program]).splitlines())["digest"])


@pytest.mark.parametrize("level", ["-Os", "-O3"])
@pytest.mark.parametrize("target", TARGETS.values(), ids=lambda target: target.name)
def test_every_board_gives_the_bits_of_the_host(target: Target, level: str, tmp_path: Path) -> None:
    names = NAMES[:5] if target.unit == "instructions" else NAMES[:2]  # simavr takes long
    for name in names:
        assert on_board(tmp_path, name, target, level).digest == on_host(tmp_path, name), name


@pytest.mark.parametrize("name", NAMES)
def test_halves_and_whole_products_give_the_same_bits(name: str, tmp_path: Path) -> None:
    m3 = TARGETS["cortex-m3"]

    assert on_board(tmp_path, name, m3, "-O2", SPLIT).digest == on_host(tmp_path, name)
    assert on_host(tmp_path, name, SPLIT) == on_host(tmp_path, name)


@pytest.mark.parametrize("target", [TARGETS[name] for name in SMALL], ids=SMALL)
def test_without_an_fpu_integers_take_an_eighth_of_the_time_of_floats(target: Target, tmp_path: Path) -> None:
    require(target)
    floats = better(measure(kernels("puma560", Quantity.POSE), ScalarType.FLOAT, target)).calls
    integers = min(on_board(tmp_path, "puma560", target, level).most for level in ("-Os", "-O2"))

    assert floats is not None
    assert 8 * integers <= floats.least


@pytest.mark.parametrize("target", [TARGETS[name] for name in SMALL], ids=SMALL)
@pytest.mark.parametrize("level", ["-Os", "-O2"])
def test_the_time_hardly_depends_on_the_angles(target: Target, level: str, tmp_path: Path) -> None:
    found = on_board(tmp_path, "puma560", target, level)

    assert found.most - found.least <= 6
