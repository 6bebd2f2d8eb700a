"""The table of targets, and what it says of missing tools."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.backends.scalar_types import ScalarType
from kinegen.errors import KinegenError
from kinegen.verify.boards.targets import SOURCES, TARGETS, Target, find_target, missing
from scripts import install_boards


@pytest.mark.parametrize("target", TARGETS.values(), ids=list(TARGETS))
def test_a_target_finds_its_sources_and_names_its_packages(target: Target) -> None:
    names = [*target.toolchain.sources, *([target.toolchain.layout] if target.toolchain.layout else [])]

    assert all((SOURCES / name).is_file() for name in names)
    assert find_target(target.name) is target
    assert ScalarType.FLOAT in target.reals
    assert len(target.packages()) == 2
    assert all(packages for packages in target.packages().values())


def test_an_unknown_target_is_told_the_known_ones() -> None:
    with pytest.raises(KinegenError) as caught:
        find_target("cortex-m4")

    assert str(caught.value) == (
        "unknown target 'cortex-m4', perhaps 'cortex-m4f' (known: cortex-m0, cortex-m3, cortex-m4f, cortex-m7, "
        "cortex-m33, rv32imac, rv32imafc, atmega2560)"
    )


def test_a_machine_without_tools_is_told_all_packages(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))

    assert missing(TARGETS["rv32imac"]) == {
        "riscv64-unknown-elf-gcc": ("gcc-riscv64-unknown-elf",),
        "qemu-system-riscv32": ("qemu-system-misc",),
    }
    assert install_boards.wanted() == [
        "avr-libc",
        "clang",
        "gcc",
        "gcc-arm-none-eabi",
        "gcc-avr",
        "gcc-riscv64-unknown-elf",
        "libc6-dev",
        "qemu-system-arm",
        "qemu-system-misc",
        "simavr",
    ]


def test_who_may_not_install_is_told_how(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    status = install_boards.main()
    said = capsys.readouterr().out

    assert status == 0
    assert said.startswith("missing: avr-libc clang gcc")
    assert "as root: apt-get -y -qq -o Acquire::Retries=3 install --no-install-recommends avr-libc" in said
