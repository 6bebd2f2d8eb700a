"""The processors for which kernels are tried and measured, with their cross toolchains and emulated boards.

Boards are those that QEMU and simavr emulate. Counts are instructions, exact and repeatable, but no cycles: wait states
of the flash and the latency of an FPU are not in them. On the AVR they are cycles.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import field
from functools import cache
from pathlib import Path
from types import MappingProxyType

from kinegen.backends.scalar_types import ScalarType
from kinegen.errors import KinegenError, MissingToolError, nearest
from kinegen.runtime.compiler import Compiler
from kinegen.support.dataclass import dataclass

STRICT = ("-std=c99", "-ffp-contract=off")
"""Flags with which the results are the same bits on every machine."""


@dataclass(frozen=True, slots=True)
class Toolchain:
    """A cross compiler and the C of ours that stands in for an operating system.

    Attributes:
        prefix: What its commands begin with, such as `arm-none-eabi-`.
        package: The Debian packages that bring it.
        sources: The board's own files in `sources/`.
        layout: Linker script in `sources/`; none where the compiler's is good.
        libraries: What a kernel may need at link time: arithmetic where there is no FPU, no trigonometry.
        round_cost: Instructions or cycles of one round of `board_spin`.
        call_bytes: Stack that a call takes before the called function runs.
    """

    prefix: str
    packages: tuple[str, ...]
    sources: tuple[str, ...]
    layout: str | None = "board.ld"
    libraries: tuple[str, ...] = ("-lgcc",)
    round_cost: int = 2
    call_bytes: int = 0


@dataclass(frozen=True, slots=True)
class Emulator:
    """A command that runs a program for a board."""

    command: tuple[str, ...]  # Program and arguments; the name of the file to run follows
    package: str  # The Debian package that brings it
    stream: str = "stdout"  # Where it shows what the program writes, `stdout` or `stderr`


@dataclass(frozen=True, slots=True)
class Target:
    """A processor.

    Attributes:
        name: As `--target` takes it.
        title: What people call it, and its FPU.
        flags: What tells the compiler which processor it is.
        emulator: What runs programs.
        memory: Symbols for the layout: where flash and RAM begin, and the size of the RAM.
        reals: The number types that it has.
    """

    name: str
    title: str
    board: str
    toolchain: Toolchain
    flags: tuple[str, ...]
    emulator: Emulator
    memory: Mapping[str, int] = field(default_factory=dict)
    reals: tuple[ScalarType, ...] = tuple(ScalarType)
    unit: str = "instructions"

    def packages(self) -> dict[str, tuple[str, ...]]:
        """Returns the Debian packages behind each command that the target needs."""
        compiler = f"{self.toolchain.prefix}gcc"
        return {compiler: self.toolchain.packages, self.emulator.command[0]: (self.emulator.package,)}


_ARM = Toolchain("arm-none-eabi-", ("gcc-arm-none-eabi",), ("arm.c",))
_RISCV = Toolchain("riscv64-unknown-elf-", ("gcc-riscv64-unknown-elf",), ("riscv.c",))
_AVR = Toolchain("avr-", ("gcc-avr", "avr-libc"), ("avr.c",), None, ("-lm",), round_cost=4, call_bytes=3)

# Without a monitor and with the semihosting's text on stdout; by itself QEMU would write it to stderr.
_QUIET = ("-nographic", "-monitor", "none", "-serial", "none", "-chardev", "stdio,id=out")
_TEXT = ("-semihosting-config", "enable=on,target=native,chardev=out")


def _qemu(command: str, package: str, machine: tuple[str, ...], shift: int) -> Emulator:
    """One instruction takes 2^shift nanoseconds: longer than a tick of the board's clock, so that each one counts."""
    return Emulator((command, "-M", *machine, *_QUIET, *_TEXT, "-icount", f"shift={shift}", "-kernel"), package)


def _cortex(name: str, title: str, machine: str, flags: str, flash: int = 0, ram: int = 0x20000000) -> Target:
    return Target(
        name=name,
        title=title,
        board=machine,
        toolchain=_ARM,
        flags=("-mthumb", *flags.split()),
        emulator=_qemu("qemu-system-arm", "qemu-system-arm", (machine,), shift=6),
        memory={"BOARD_FLASH": flash, "BOARD_RAM": ram, "BOARD_RAM_SIZE": 0x4000},
    )


def _risc_v(name: str, title: str, flags: str) -> Target:
    return Target(
        name=name,
        title=title,
        board="virt",
        toolchain=_RISCV,
        flags=(*flags.split(), "-mcmodel=medany", "-ffreestanding"),  # Debian's compiler has no C library
        emulator=_qemu("qemu-system-riscv32", "qemu-system-misc", ("virt", "-bios", "none"), shift=0),
        memory={"BOARD_FLASH": 0x80000000, "BOARD_RAM": 0x80400000, "BOARD_RAM_SIZE": 0x10000},
    )


_TARGETS = (
    _cortex("cortex-m0", "Cortex-M0, no FPU", "microbit", "-mcpu=cortex-m0 -mfloat-abi=soft"),
    _cortex("cortex-m3", "Cortex-M3, no FPU", "mps2-an385", "-mcpu=cortex-m3 -mfloat-abi=soft"),
    _cortex(
        "cortex-m4f", "Cortex-M4F, FPU for float", "mps2-an386", "-mcpu=cortex-m4 -mfloat-abi=hard -mfpu=fpv4-sp-d16"
    ),
    _cortex(
        "cortex-m7",
        "Cortex-M7, FPU for float and double",
        "mps2-an500",
        "-mcpu=cortex-m7 -mfloat-abi=hard -mfpu=fpv5-d16",
    ),
    # The board starts in the secure world, whose memory has addresses of its own.
    _cortex(
        "cortex-m33",
        "Cortex-M33, FPU for float",
        "mps2-an505",
        "-mcpu=cortex-m33 -mfloat-abi=hard -mfpu=fpv5-sp-d16",
        flash=0x10000000,
        ram=0x38000000,
    ),
    _risc_v("rv32imac", "RV32IMAC, no FPU", "-march=rv32imac -mabi=ilp32"),
    _risc_v("rv32imafc", "RV32IMAFC, FPU for float", "-march=rv32imafc -mabi=ilp32f"),
    Target(
        name="atmega2560",
        title="AVR ATmega2560, no FPU, double as short as float",
        board="atmega2560",
        toolchain=_AVR,
        flags=("-mmcu=atmega2560",),
        emulator=Emulator(("simavr", "-m", "atmega2560", "-f", "16000000"), "simavr", "stderr"),
        reals=(ScalarType.FLOAT,),
        unit="cycles",
    ),
)

TARGETS: Mapping[str, Target] = MappingProxyType({target.name: target for target in _TARGETS})
"""The processors by name, small ones first."""


def find_target(name: str) -> Target:
    """Returns the target of a name.

    Args:
        name: As the user wrote it.

    Returns:
        The target.

    Raises:
        KinegenError: If there is none; the message lists those that there are.
    """
    if name in TARGETS:
        return TARGETS[name]
    near = nearest(name, TARGETS)
    hint = f", perhaps {near!r}" if near else ""
    raise KinegenError(f"unknown target {name!r}{hint} (known: {', '.join(TARGETS)})")


SOURCES = Path(__file__).resolve().parent / "sources"
"""The C that comes with the boards."""


def missing(target: Target) -> dict[str, tuple[str, ...]]:
    """Returns the commands that a target needs and this machine lacks, each with its Debian packages."""
    return {command: packages for command, packages in target.packages().items() if shutil.which(command) is None}


def require(command: str, packages: Sequence[str]) -> None:
    """Check that a command is there.

    Raises `MissingToolError` if it is not; the message names the packages to install.
    """
    if shutil.which(command) is None:
        raise MissingToolError(f"there is no {command}: install it, on Debian with `apt install {' '.join(packages)}`")


def find_cross_compiler(target: Target) -> Compiler:
    """Returns the compiler of a target.

    Raises `MissingToolError` if it is not installed; the message names the packages to install.
    """
    name = f"{target.toolchain.prefix}gcc"
    require(name, target.toolchain.packages)
    return _compiler(name)


@cache
def _compiler(name: str) -> Compiler:
    return Compiler((name,), read_tool((name, "-dumpfullversion", "-dumpversion")).split()[0])


def compile_object(target: Target, folder: Path, source: Path, flags: Sequence[str]) -> Path:
    """Compile one file, each function in a section of its own.

    `folder`: where headers are found, and the object and its stack usage are written; `flags`: optimisation, and
    whatever else differs between files. Returns the object file; `NAME.su` beside it holds the stack usage. Raises
    `CompileError` if the compiler is missing or refuses the file.
    """
    made = folder / f"{source.stem}.o"
    fixed = (*target.flags, *STRICT, "-ffreestanding", "-ffunction-sections", "-fdata-sections", "-fstack-usage")
    paths = ("-I", str(folder), "-I", str(SOURCES), "-c", str(source), "-o", str(made))
    find_cross_compiler(target).run(folder, (*fixed, *flags, *paths), source.name)
    return made


def link(target: Target, folder: Path, objects: Sequence[Path], name: str, *, entry: str | None = None) -> Path:
    """Link objects, without what nothing refers to.

    `entry`: a function that is linked by itself, with what it needs; without it, a whole program for the board. Returns
    the program. Raises `CompileError` if the linker refuses.
    """
    made = folder / name
    toolchain = target.toolchain
    start = ["-nostdlib"] if toolchain.layout else ["-nostartfiles"] if entry else []
    layout = ["-T", str(SOURCES / toolchain.layout)] if toolchain.layout else []
    memory = [f"-Wl,--defsym={symbol}={value:#x}" for symbol, value in target.memory.items()]
    # Without a C library compilers still call two of its functions.
    own = [compile_object(target, folder, SOURCES / "memory.c", ("-Os",))] if toolchain.layout else []
    only = [f"-Wl,-e,{entry}", f"-Wl,-u,{entry}"] if entry else []
    files = [*(str(each) for each in (*objects, *own)), *toolchain.libraries, "-o", str(made)]
    arguments = (*target.flags, *start, *memory, *layout, "-Wl,--gc-sections", *only, *files)
    find_cross_compiler(target).run(folder, arguments, name)
    return made


def read_tool(command: Sequence[str]) -> str:
    """Returns what a command prints that came with a compiler and has no reason to fail."""
    return subprocess.run(command, capture_output=True, text=True, errors="replace", check=True).stdout


SECONDS = (120, 240)
"""After this time a program is taken to hang; on a busy machine it is given a second try."""

_COLOUR = re.compile(r"\x1b\[[0-9;]*m")


class HungError(KinegenError):
    """A program that did not end in time."""


def run_program(target: Target, program: Path) -> list[str]:
    """Run a program on the emulated board of a target.

    Returns the lines that it wrote. Raises `MissingToolError` if the emulator is not installed; `HungError` if the
    program has not ended in time, twice; `KinegenError` if it faults or ends with another status than 0.
    """
    command = target.emulator.command
    require(command[0], (target.emulator.package,))
    where = f"{program.name} on {target.board} ({command[0]})"
    done = next((ended for seconds in SECONDS if (ended := _ended((*command, str(program)), seconds))), None)
    if done is None:
        raise HungError(f"{where} has not ended after {SECONDS[0]} s, and not after {SECONDS[-1]} s")
    if done.returncode:
        last = (done.stdout + done.stderr).strip().splitlines()[-3:]
        raise KinegenError(f"{where} ended with status {done.returncode}: {'; '.join(last)}")
    text = done.stdout if target.emulator.stream == "stdout" else done.stderr
    return [line for line in map(_plain, text.splitlines()) if line]


def _ended(command: tuple[str, ...], seconds: float) -> subprocess.CompletedProcess[str] | None:
    """Returns what a command did; None if it has not ended after some seconds."""
    try:
        return subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=seconds,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return None


def _plain(line: str) -> str:
    """A line without the colours in which simavr shows what a serial port sends, and without its dot for a line end."""
    return _COLOUR.sub("", line).rstrip().removesuffix(".")
