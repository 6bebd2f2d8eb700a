"""What `kinegen size` measures is what the processor does, and within the figures that firmware was promised."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from kinegen.boards import cost as cost_module
from kinegen.boards.cost import better, measure
from kinegen.boards.figures import Cost
from kinegen.boards.programs import build_program, write_measured
from kinegen.boards.targets import TARGETS, Target
from kinegen.boards.toolchain import SOURCES, read_tool
from kinegen.emit.reals import Real
from kinegen.errors import KinegenError, MissingToolError
from kinegen.outputs import USUAL, Quantity
from tests.boards.conftest import kernels, require

M4F = TARGETS["cortex-m4f"]


def best(name: str, quantity: Quantity = Quantity.POSE) -> Cost:
    """The better of -Os and -O2 on a Cortex-M4F."""
    require(M4F)
    return better(measure(kernels(name, quantity), Real.FLOAT, M4F))


@pytest.mark.boards
def test_a_pose_of_the_puma_takes_few_instructions_whatever_the_angles() -> None:
    calls = best("puma560").calls

    assert calls is not None
    assert calls.most <= 480
    assert calls.most - calls.least <= 2


@pytest.mark.boards
@pytest.mark.parametrize("quantity", list(USUAL))
def test_the_puma_takes_little_stack(quantity: Quantity) -> None:
    assert best("puma560", quantity).stack <= 96


@pytest.mark.boards
def test_the_puma_takes_little_flash() -> None:
    assert best("puma560").flash <= 800


@pytest.mark.boards
def test_the_function_of_the_ur5_is_short() -> None:
    assert best("ur5").function_flash < 450


@pytest.mark.boards
def test_the_count_is_that_of_the_listing(tmp_path: Path) -> None:
    """No branch but calls and returns, so every instruction of the listing runs once; the pair once for each angle."""
    require(M4F)
    single = kernels("puma560", Quantity.POSE)
    files = write_measured(tmp_path, single, Real.FLOAT).files
    build_program(M4F, tmp_path, files, SOURCES / "cost.c", Real.FLOAT, ("-Os", "-DREPEATS=8"))
    listing = read_tool(("arm-none-eabi-objdump", "-d", "--no-show-raw-insn", str(files[0].with_suffix(".o"))))
    pair, kernel = (
        listing.split(f"<{name}>:")[1].split("\n\n")[0] for name in ("puma560_f32_sincos", "puma560_f32_fk")
    )
    # Padding behind the return, and the constants behind that, are no instructions.
    lengths = [len(re.findall(r"^ +[0-9a-f]+:\t(?!\.word|nop)", text, re.MULTILINE)) for text in (pair, kernel)]
    (cost, _) = measure(single, Real.FLOAT, M4F)

    assert str(cost.calls) == str(6 * lengths[0] + lengths[1])


@pytest.mark.boards
@pytest.mark.parametrize("name", ["cortex-m4f", "cortex-m7", "cortex-m33", "rv32imafc"])
def test_the_stack_in_use_is_the_one_that_the_compiler_accounts_for(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    target = TARGETS[name]
    require(target)
    used = measure(kernels("thumb", Quantity.POSE), Real.FLOAT, target)
    monkeypatch.setattr(cost_module, "run_program", _no_emulator)
    accounted = measure(kernels("thumb", Quantity.POSE), Real.FLOAT, target)

    assert [cost.calls for cost in accounted] == [None, None]
    assert [cost.stack for cost in used] == [cost.stack for cost in accounted]


def _no_emulator(_target: Target, _program: Path) -> list[str]:
    raise MissingToolError("none")


@pytest.mark.boards
@pytest.mark.parametrize("name", ["cortex-m0", "rv32imac", "atmega2560"])
def test_without_an_fpu_the_arithmetic_is_counted_too(name: str) -> None:
    target = TARGETS[name]
    require(target)
    cost = better(measure(kernels("scara", Quantity.POSE), Real.FLOAT, target))

    assert cost.calls is not None
    assert cost.calls.least > 3000
    assert cost.calls.most > cost.calls.least
    assert cost.flash > cost.function_flash + 1000


def test_a_missing_compiler_is_named_with_its_package(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))

    with pytest.raises(MissingToolError, match=r"no avr-gcc: .*`apt install gcc-avr avr-libc`"):
        measure(kernels("scara", Quantity.POSE), Real.FLOAT, TARGETS["atmega2560"])


def test_a_number_type_that_a_target_lacks_is_refused() -> None:
    with pytest.raises(KinegenError, match="atmega2560 has no double of 64 bits: use --real float"):
        measure(kernels("scara", Quantity.POSE), Real.DOUBLE, TARGETS["atmega2560"])
