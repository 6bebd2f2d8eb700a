"""What `kinegen size` measures is what the processor does, and within the figures that firmware was promised."""

from __future__ import annotations

import re
from collections.abc import Container, Sequence
from pathlib import Path

import pytest

from kinegen.backends.scalar_types import ScalarType
from kinegen.errors import KinegenError, MissingToolError
from kinegen.model.outputs import USUAL, Quantity, parse_quantity
from kinegen.verify.boards import cost as cost_module
from kinegen.verify.boards import programs as programs_module
from kinegen.verify.boards.cost import OPTIMISATIONS, _accounted_stack, better, measure
from kinegen.verify.boards.programs import build_program, write_measured
from kinegen.verify.boards.targets import SOURCES, TARGETS, Target, read_tool
from kinegen.verify.records import Cost
from tests.boards.conftest import kernels, require

M4F = TARGETS["cortex-m4f"]


def best(name: str, quantity: Quantity = Quantity.POSE) -> Cost:
    """The better of -Os and -O2 on a Cortex-M4F."""
    require(M4F)
    return better(measure(kernels(name, quantity), ScalarType.FLOAT, M4F))


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
    files = write_measured(tmp_path, single, ScalarType.FLOAT).files
    build_program(M4F, tmp_path, files, SOURCES / "cost.c", ScalarType.FLOAT, ("-Os", "-DREPEATS=8"))
    listing = read_tool(("arm-none-eabi-objdump", "-d", "--no-show-raw-insn", str(files[0].with_suffix(".o"))))
    pair, kernel = (
        listing.split(f"<{name}>:")[1].split("\n\n")[0] for name in ("puma560_f32_sincos", "puma560_f32_fk")
    )
    # Padding behind the return, and the constants behind that, are no instructions.
    lengths = [len(re.findall(r"^ +[0-9a-f]+:\t(?!\.word|nop)", text, re.MULTILINE)) for text in (pair, kernel)]
    (cost, _) = measure(single, ScalarType.FLOAT, M4F)

    assert str(cost.calls) == str(6 * lengths[0] + lengths[1])


@pytest.mark.boards
@pytest.mark.parametrize("name", ["cortex-m4f", "cortex-m7", "cortex-m33", "rv32imafc"])
def test_the_stack_in_use_is_the_one_that_the_compiler_accounts_for(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    target = TARGETS[name]
    require(target)
    used = measure(kernels("thumb", Quantity.POSE), ScalarType.FLOAT, target)
    monkeypatch.setattr(cost_module, "run_program", _no_emulator)
    accounted = measure(kernels("thumb", Quantity.POSE), ScalarType.FLOAT, target)

    assert [cost.calls for cost in accounted] == [None, None]
    assert [cost.stack for cost in used] == [cost.stack for cost in accounted]


@pytest.mark.boards
@pytest.mark.parametrize("name", ["cortex-m3", "cortex-m4f", "rv32imac"])
def test_functions_that_a_kernel_does_not_call_use_none_of_its_stack(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A source also has functions about limits; the account is that of the pose and of the pair."""
    target = TARGETS[name]
    require(target)
    seen: list[dict[str, int]] = []

    def account(usage: Path, called: Container[str]) -> int:
        rows = [line.split("\t") for line in usage.read_text(encoding="utf-8").splitlines()]
        seen.append({place.rpartition(":")[2]: int(size) for place, size, *_ in rows})
        return _accounted_stack(usage, called)

    monkeypatch.setattr(cost_module, "run_program", _no_emulator)
    monkeypatch.setattr(cost_module, "_accounted_stack", account)
    (cost, _) = measure(kernels("puma560", Quantity.POSE), ScalarType.FLOAT, target)

    assert {"puma560_f32_within_limits", "puma560_f32_clamp"} < seen[0].keys()
    assert cost.stack == seen[0]["puma560_f32_fk"] + seen[0]["puma560_f32_sincos"]


@pytest.mark.boards
@pytest.mark.parametrize("name", ["cortex-m4f", "rv32imac"])
def test_a_kernel_whose_array_the_compiler_clears_by_a_call_is_measured(name: str) -> None:
    """Of an arm whose joint 1 a target can leave free, gcc clears the joint values with memset."""
    target = TARGETS[name]
    require(target)
    costs = measure(kernels("kr5", parse_quantity("inverse")), ScalarType.FLOAT, target)

    assert [cost.name for cost in costs] == 2 * ["inverse"] + 2 * ["inverse_nearest"]
    assert all(cost.calls is not None for cost in costs)


def _no_emulator(_target: Target, _program: Path) -> list[str]:
    raise MissingToolError("none")


@pytest.mark.boards
@pytest.mark.parametrize("name", ["cortex-m0", "rv32imac", "atmega2560"])
def test_without_an_fpu_the_arithmetic_is_counted_too(name: str) -> None:
    target = TARGETS[name]
    require(target)
    cost = better(measure(kernels("scara", Quantity.POSE), ScalarType.FLOAT, target))

    assert cost.calls is not None
    assert cost.calls.least > 3000
    assert cost.calls.most > cost.calls.least
    assert cost.flash > cost.function_flash + 1000


def test_a_missing_compiler_is_named_with_its_package(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))

    with pytest.raises(MissingToolError, match=r"no avr-gcc: .*`apt install gcc-avr avr-libc`"):
        measure(kernels("scara", Quantity.POSE), ScalarType.FLOAT, TARGETS["atmega2560"])


def test_a_number_type_that_a_target_lacks_is_refused() -> None:
    with pytest.raises(KinegenError, match="atmega2560 has no double of 64 bits: use --real float"):
        measure(kernels("scara", Quantity.POSE), ScalarType.DOUBLE, TARGETS["atmega2560"])


@pytest.mark.boards
def test_what_surrounds_a_kernel_is_compiled_once_for_all_levels(monkeypatch: pytest.MonkeyPatch) -> None:
    """A cold build measures every kernel, and most of that time is in the compiler."""
    compiled: list[str] = []
    original = programs_module.compile_object

    def counted(target: Target, folder: Path, source: Path, flags: Sequence[str]) -> Path:
        compiled.append(source.name)
        return original(target, folder, source, flags)

    require(M4F)
    monkeypatch.setattr(programs_module, "compile_object", counted)
    measure(kernels("puma560", Quantity.POSE), ScalarType.FLOAT, M4F)

    assert compiled.count("kernels.c") == compiled.count("nothing.c") == 1
    assert compiled.count("puma560_f32.c") == len(OPTIMISATIONS)
