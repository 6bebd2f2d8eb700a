"""The processors for which kernels are tried and measured, and what that takes on Debian 12.

Boards are those that QEMU and simavr emulate. Counts are instructions, exact and repeatable, but no cycles: wait states
of the flash and the latency of an FPU are not in them. On the AVR they are cycles.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from kinegen.emit.reals import Real
from kinegen.errors import KinegenError

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
    """A command that runs a program for a board.

    Attributes:
        command: Program and arguments; the name of the file to run follows.
        package: The Debian package that brings it.
        stream: Where it shows what the program writes, `stdout` or `stderr`.
    """

    command: tuple[str, ...]
    package: str
    stream: str = "stdout"


@dataclass(frozen=True, slots=True)
class Target:
    """A processor.

    Attributes:
        name: As `--target` takes it.
        title: What people call it, and its FPU.
        board: The emulated board.
        toolchain: Its compiler.
        flags: What tells the compiler which processor it is.
        emulator: What runs programs.
        memory: Symbols for the layout: where flash and RAM begin, and the size of the RAM.
        reals: The number types that it has.
        unit: What is counted.
    """

    name: str
    title: str
    board: str
    toolchain: Toolchain
    flags: tuple[str, ...]
    emulator: Emulator
    memory: Mapping[str, int] = field(default_factory=dict)
    reals: tuple[Real, ...] = tuple(Real)
    unit: str = "instructions"

    def packages(self) -> dict[str, tuple[str, ...]]:
        """The Debian packages behind each command that the target needs."""
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
        flags=(*flags.split(), "-mcmodel=medany"),
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
        reals=(Real.FLOAT,),
        unit="cycles",
    ),
)

TARGETS: Mapping[str, Target] = MappingProxyType({target.name: target for target in _TARGETS})
"""The processors by name, small ones first."""


def find_target(name: str) -> Target:
    """The target of a name.

    Args:
        name: As the user wrote it.

    Returns:
        The target.

    Raises:
        KinegenError: If there is none; the message lists those that there are.
    """
    if name in TARGETS:
        return TARGETS[name]
    near = difflib.get_close_matches(name, TARGETS, 1)
    hint = f", perhaps {near[0]!r}" if near else ""
    raise KinegenError(f"unknown target {name!r}{hint} (known: {', '.join(TARGETS)})")
