"""The Arduino library on an Uno: 32 KB of flash, half a kilobyte for the boot loader, 2 KB of RAM; simavr runs it."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from kinegen.backends.firmware.ecosystem import Ecosystem
from kinegen.backends.scalar_types import ScalarType
from kinegen.support.naming import Q30
from kinegen.verify.boards.targets import TARGETS, run_program
from tests.packages.packages import STUBS, example_pose, last_rows, need, run, write_package

pytestmark = pytest.mark.boards

UNO = replace(
    TARGETS["atmega2560"],
    board="atmega328p",
    flags=("-mmcu=atmega328p",),
    emulator=replace(TARGETS["atmega2560"].emulator, command=("simavr", "-m", "atmega328p", "-f", "16000000")),
)
FLASH, RAM = 32256, 2048
SERIAL = 175
"""RAM that the serial port of Arduino's own core takes: two buffers of 64 bytes and what goes with them."""


@dataclass(frozen=True)
class Sketch:
    """A linked sketch.

    Attributes:
        program: The file.
        flash: Bytes of flash.
        ram: Bytes of RAM for variables.
    """

    program: Path
    flash: int
    ram: int


def sketch(library: Path, name: str, folder: Path) -> Sketch:
    """Compile and link a sketch as the IDE does for an Uno."""
    need("avr-gcc")
    common = [*UNO.flags, "-Os", "-Wall", "-Wextra", "-Werror", "-ffunction-sections", "-fdata-sections"]
    paths = [f"-I{library / 'src'}", f"-I{STUBS / 'avr'}"]
    objects = []
    for source in sorted((library / "src").rglob("*.c")):
        objects.append(folder / f"{source.stem}.o")
        run(["avr-gcc", "-std=gnu11", *common, *paths, "-c", source, "-o", objects[-1]], library)
    ino = library / "examples" / name / f"{name}.ino"
    plus = ["avr-g++", "-std=gnu++11", "-fno-exceptions", *common, *paths, "-include", "Arduino.h", "-DF_CPU=16000000L"]
    run([*plus, "-x", "c++", "-c", ino, "-o", folder / "sketch.o"], library)
    program = folder / "sketch.elf"
    run(["avr-gcc", *UNO.flags, "-Wl,--gc-sections", folder / "sketch.o", *objects, "-lm", "-o", program], library)
    sections = {line.split()[0]: int(line.split()[1]) for line in _sizes(program) if line.startswith(".")}
    data = sections.get(".data", 0)
    return Sketch(program, sections[".text"] + data, data + sections.get(".bss", 0))


def _sizes(program: Path) -> list[str]:
    return run(["avr-size", "-A", program], program.parent).splitlines()


@cache
def _need_simavr() -> None:
    need("simavr")


@pytest.mark.parametrize("reals", [(ScalarType.FLOAT,), (Q30,)], ids="-".join)
@pytest.mark.parametrize("robot", ["puma560", "calibrated_2r"])
def test_an_uno_passes_the_self_test(robot: str, reals: tuple[str, ...], tmp_path: Path) -> None:
    """The vectors stay in flash; what is left of the RAM has room for the serial port of Arduino's core."""
    _need_simavr()
    made = sketch(write_package(tmp_path, robot, Ecosystem.ARDUINO, reals), "SelfTest", tmp_path)

    assert made.flash <= FLASH
    assert made.ram <= 100

    *told, left = run_program(UNO, made.program)

    assert told
    assert all(re.search(r"_selftest(_sincos)?: largest difference [\d.]+.*, passed$", line) for line in told)
    assert int(left.removeprefix("bytes of RAM left: ")) > SERIAL


@pytest.mark.parametrize("reals", [(ScalarType.FLOAT,), (Q30,)], ids="-".join)
def test_an_uno_notices_a_wrong_table(reals: tuple[str, ...], tmp_path: Path) -> None:
    _need_simavr()
    library = write_package(tmp_path, "puma560", Ecosystem.ARDUINO, reals)
    (vectors,) = library.rglob("*_vectors.h")
    text = vectors.read_text(encoding="utf-8")
    place = text.index("_fk_expected[")
    changed, count = re.subn(r"\{(-?[\d.e-]+)F?, ", "{12345, ", text[place:], count=1)
    assert count == 1
    vectors.write_text(text[:place] + changed, encoding="utf-8")

    told = run_program(UNO, sketch(library, "SelfTest", tmp_path).program)

    assert told[0].endswith("FAILED")


@pytest.mark.parametrize("reals", [(ScalarType.FLOAT,), (Q30,)], ids="-".join)
def test_an_uno_prints_the_pose(reals: tuple[str, ...], tmp_path: Path) -> None:
    _need_simavr()
    library = write_package(tmp_path, "puma560", Ecosystem.ARDUINO, reals)
    *told, _ = run_program(UNO, sketch(library, "Pose", tmp_path).program)

    pose = example_pose("puma560", (library / "examples" / "Pose" / "Pose.ino").read_text(encoding="utf-8"))
    np.testing.assert_allclose(last_rows("\n".join(told)), pose, atol=2e-5)
