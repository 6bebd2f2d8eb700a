"""Registers, spills and contractions of the CUDA kernels, compiled by NVRTC: no GPU and no toolkit are needed.

    python -m pip install --target build/nvrtc nvidia-cuda-nvrtc-cu12
    python -m benchmarks.cuda                             # PUMA 560, UR5, Panda and iiwa, all outputs, sm_70 and sm_90
    python -m benchmarks.cuda puma560 --outputs fk,inverse --architectures sm_80

The table has the registers of each output: in double and in float, the most among its kernels and architectures.
"""

from __future__ import annotations

import argparse
import ctypes
import re
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from benchmarks.cpp import ROOT, kernels_of
from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.languages import LANGUAGES, emit_language

LIBRARY = Path("nvidia") / "cuda_nvrtc" / "lib"
FOLDER = ROOT / "build" / "nvrtc"
"""Where the package nvidia-cuda-nvrtc-cu12 is looked for, before the modules of this Python."""

FOUR = ("puma560", "ur5", "panda", "iiwa14")
ARCHITECTURES = ("sm_70", "sm_90")

OPTIONS = ("-fmad=false", "--std=c++17", "--ptxas-options=-v")

_KERNEL = re.compile(
    r"Compiling entry function '(\w+)'.*?(\d+) bytes stack frame, (\d+) bytes spill stores, (\d+) bytes spill loads"
    r".*?Used (\d+) registers",
    re.DOTALL,
)


@dataclass(frozen=True, slots=True)
class Compiled:
    """What ptxas says of one kernel.

    Attributes:
        name: Its name.
        registers: Registers of a thread.
        stack: Bytes of its stack frame.
        spilled: Bytes that it stores and loads because registers are too few.
    """

    name: str
    registers: int
    stack: int
    spilled: int


def nvrtc_file() -> Path | None:
    """The library of NVRTC from its package; None where that is not installed."""
    for place in (FOLDER, *map(Path, sys.path)):
        found = sorted((place / LIBRARY).glob("libnvrtc.so.*"))
        if found:
            return found[0]
    return None


@cache
def _library() -> Any:
    file = nvrtc_file()
    if file is None:
        raise RuntimeError(f"this takes NVRTC (pip install --target {FOLDER} nvidia-cuda-nvrtc-cu12)")
    return ctypes.CDLL(str(file))


def compile_kernels(
    kernels: RobotPrograms, architecture: str, outputs: Iterable[str] = (), options: Sequence[str] = OPTIONS
) -> tuple[tuple[Compiled, ...], str]:
    """Compile the kernels of a robot.

    Args:
        kernels: The robot and its programs.
        architecture: Such as `sm_90`.
        outputs: Names of functions; all of them if there are none.
        options: Of NVRTC.

    Returns:
        What ptxas says of each, and their PTX.

    Raises:
        RuntimeError: If there is no NVRTC, or it refuses them.
    """
    robot = kernels.robot.name
    files = {path.rpartition("/")[2]: text for path, text in emit_language(kernels, LANGUAGES["cuda"]).items()}
    macro = f"-DKINEGEN_{robot.upper()}"
    chosen = [f"{macro}_WITH_{name}" for name in outputs]
    words = [f"-arch={architecture}", *options, *([f"{macro}_ONLY", *chosen] if chosen else [])]
    library, program = _library(), ctypes.c_void_p()
    header = (ctypes.c_char_p * 1)(files[f"{robot}.cuh"].encode())
    name = (ctypes.c_char_p * 1)(f"{robot}.cuh".encode())
    source = files[f"{robot}.cu"].encode()
    library.nvrtcCreateProgram(ctypes.byref(program), source, f"{robot}.cu".encode(), 1, header, name)
    listed = (ctypes.c_char_p * len(words))(*(word.encode() for word in words))
    failed = library.nvrtcCompileProgram(program, len(words), listed)
    log = _text(program, "ProgramLog")
    ptx = "" if failed else _text(program, "PTX")
    library.nvrtcDestroyProgram(ctypes.byref(program))
    if failed:
        raise RuntimeError(log[:2000])
    found = (
        Compiled(one, int(used), int(stack), int(out) + int(back))
        for one, stack, out, back, used in _KERNEL.findall(log)
    )
    return tuple(found), ptx


def _text(program: ctypes.c_void_p, what: str) -> str:
    size, library = ctypes.c_size_t(), _library()
    getattr(library, f"nvrtcGet{what}Size")(program, ctypes.byref(size))
    buffer = ctypes.create_string_buffer(size.value)
    getattr(library, f"nvrtcGet{what}")(program, buffer)
    return buffer.value.decode("utf-8", "replace")


def registers(kernels: RobotPrograms, compiled: Iterable[Compiled]) -> dict[str, tuple[int, int]]:
    """The most registers of each output, in double and in float."""
    robot, most = kernels.robot.name, dict[str, tuple[int, int]]()
    for each in compiled:
        name = re.sub(r"_(rows|rows_3x4|joint_major)$", "", each.name.removeprefix(f"{robot}_"))
        output = name.removeprefix("f32_")
        double, single = most.get(output, (0, 0))
        is_single = name != output
        most[output] = (double, max(single, each.registers)) if is_single else (max(double, each.registers), single)
    return most


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a table for the page; 1 if a kernel spills or has a contraction."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("robots", nargs="*", default=FOUR)
    parser.add_argument("--outputs", default="")
    parser.add_argument("--architectures", default=",".join(ARCHITECTURES))
    chosen = parser.parse_args(arguments)
    outputs, tables, wrong = [name for name in chosen.outputs.split(",") if name], [], 0
    for robot in chosen.robots:
        kernels, all_found = kernels_of(robot), list[Compiled]()
        for architecture in chosen.architectures.split(","):
            found, ptx = compile_kernels(kernels, architecture, outputs)
            spilled = [each.name for each in found if each.spilled]
            contracted = len(re.findall(r"\bfma\.", ptx))
            wrong += len(spilled) + contracted
            print(f"{robot} {architecture}: {len(found)} kernels, spills {spilled}, {contracted} fma", flush=True)
            all_found += found
        tables.append(registers(kernels, all_found))
    print(f"\n| output | {' | '.join(chosen.robots)} |\n| --- |{' --- |' * len(tables)}")
    for output in dict.fromkeys(name for table in tables for name in table):
        cells = (" / ".join(map(str, table[output])) if output in table else "-" for table in tables)
        print(f"| `{output}` | {' | '.join(cells)} |")
    return int(wrong > 0)


if __name__ == "__main__":
    raise SystemExit(main())
