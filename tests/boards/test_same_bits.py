"""Every compiler, optimisation level and processor computes the same bits, and NaN where an angle is none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from kinegen.backends.scalar_types import ScalarType
from kinegen.errors import CompileError, KinegenError
from kinegen.ir.program import Program, Temporary, Variable
from kinegen.model.robot import JointType
from kinegen.support.naming import function
from kinegen.verify.boards.programs import build_program, write_kernels
from kinegen.verify.boards.targets import SOURCES, TARGETS, Target, compile_object, run_program
from tests.boards.conftest import NAMES, OTHERS, checked, kernels, require, run_on_host

pytestmark = pytest.mark.boards

ON_BOARDS = [(target, real) for target in TARGETS.values() for real in target.reals]
BAD_ANGLES = ("nan", "infinity", "-infinity", "beyond", "-beyond", "1e30")

HostLines = Callable[[ScalarType], list[str]]


@pytest.mark.parametrize("level", ["-O0", "-O1", "-O2", "-O3"])
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
@pytest.mark.parametrize("real", list(ScalarType))
def test_every_compiler_and_level_gives_the_same_bits(
    real: ScalarType, compiler: str, level: str, host_lines: HostLines, tmp_path: Path
) -> None:
    assert run_on_host(tmp_path, real, compiler, level) == host_lines(real)


@pytest.mark.parametrize("level", ["-Os", "-O2"])
@pytest.mark.parametrize(
    ("target", "real"), ON_BOARDS, ids=lambda value: value.name if isinstance(value, Target) else value.value
)
def test_every_board_gives_the_bits_of_the_host(
    target: Target, real: ScalarType, level: str, host_lines: HostLines, tmp_path: Path
) -> None:
    require(target)
    files = write_kernels(tmp_path, [checked(name) for name in NAMES], real)
    program = build_program(target, tmp_path, files, SOURCES / "bits.c", real, (level,))

    assert run_program(target, program) == host_lines(real)


@pytest.mark.parametrize("real", list(ScalarType))
def test_what_depends_on_a_bad_angle_is_nan(real: ScalarType, host_lines: HostLines) -> None:
    """The boards print the same counts; here they are held against the programs themselves."""
    found = _counts(host_lines(real))
    for name in NAMES:
        robot = kernels(name).robot
        revolute = [variable.index for variable in robot.variables if variable.type is not JointType.PRISMATIC]
        for program in checked(name).programs:
            if program.quantity == OTHERS[-1]:
                continue  # a selection need not take what is NaN
            dependent = _dependent_outputs(program)
            for bad in BAD_ANGLES:
                counts = found[function(name, program.quantity.function, real), bad]

                assert [counts[joint] for joint in revolute] == [len(dependent[joint]) for joint in revolute]
                assert counts[-1] >= len(set().union(*(dependent[joint] for joint in revolute)))


def test_contraction_would_show(host_lines: HostLines, tmp_path: Path) -> None:
    """A Cortex-M33 fuses products and sums if it may, and then rounds them once instead of twice."""
    target, real = TARGETS["cortex-m33"], ScalarType.FLOAT
    require(target)
    files = write_kernels(tmp_path, [checked(name) for name in NAMES], real)
    flags = ("-O2", "-ffp-contract=fast")
    lines = run_program(target, build_program(target, tmp_path, files, SOURCES / "bits.c", real, flags))
    differing = [line.split()[1] for line, other in zip(lines, host_lines(real), strict=True) if line != other]

    assert set(differing) == {"hash"}
    assert len(differing) > len(NAMES)


def test_a_fault_is_an_error_and_no_endless_loop(tmp_path: Path) -> None:
    """A Cortex-M3 has no FPU."""
    target, real = TARGETS["cortex-m4f"], ScalarType.FLOAT
    without = replace(TARGETS["cortex-m3"], toolchain=target.toolchain)
    require(target)
    files = write_kernels(tmp_path, [kernels("scara")], real)
    program = build_program(target, tmp_path, files, SOURCES / "bits.c", real, ("-O2",))

    with pytest.raises(KinegenError, match=r"bits\.elf on mps2-an385 \(qemu-system-arm\) ended with status 1"):
        run_program(without, program)


def test_an_avr_refuses_doubles_in_words(tmp_path: Path) -> None:
    target = TARGETS["atmega2560"]
    require(target)
    files = write_kernels(tmp_path, [kernels("scara")], ScalarType.DOUBLE)

    with pytest.raises(CompileError, match="need a double of 64 bits"):
        compile_object(target, tmp_path, files[0], ("-Os",))


def _counts(lines: list[str]) -> dict[tuple[str, str], list[int]]:
    """How many results are NaN, for each kernel and bad number: joint by joint, and with all joints bad."""
    split = [line.split() for line in lines]
    return {(words[0], words[1]): [int(word) for word in words[2:]] for words in split if words[1] != "hash"}


def _dependent_outputs(program: Program) -> list[set[int]]:
    """For each joint, the outputs that depend on it."""
    reads: dict[str, set[int]] = {}
    for statement in program.statements:
        found: set[int] = set()
        for operand in statement.operands:
            if isinstance(operand, Variable):
                found.add(operand.index)
            elif isinstance(operand, Temporary):
                found |= reads[operand.name]
        reads |= dict.fromkeys(statement.results, found)
    joints = [
        reads[output.name]
        if isinstance(output, Temporary)
        else {output.index}
        if isinstance(output, Variable)
        else set()
        for output in program.outputs
    ]
    return [{place for place, read in enumerate(joints) if joint in read} for joint in range(program.signature.dof)]
