"""The figures in docs/firmware.md are those that the boards give."""

from __future__ import annotations

import pytest

from docs import make_firmware
from kinegen.verify.boards.targets import TARGETS
from tests.boards.conftest import require


@pytest.mark.boards
def test_the_page_is_current(capsys: pytest.CaptureFixture[str]) -> None:
    for target in TARGETS.values():
        require(target)
    status = make_firmware.main(["--check"])

    assert (status, capsys.readouterr().out) == (0, "")


def test_numbers_stand_to_the_right() -> None:
    rows = [("scara", "157", "3528 to 4545"), ("panda", "531", "16494 to 18611")]

    assert make_firmware.table(("robot", "calls", "range"), rows) == (
        "| robot | calls | range |\n"
        "| --- | ---: | ---: |\n"
        "| scara | 157 | 3528 to 4545 |\n"
        "| panda | 531 | 16494 to 18611 |\n"
    )


def test_every_target_has_its_line_on_the_page() -> None:
    page = make_firmware.PAGE.read_text(encoding="utf-8").splitlines()

    assert [line for line in make_firmware.targets_table().splitlines() if line not in page] == []


def test_a_machine_without_compilers_leaves_the_page_alone(
    monkeypatch: pytest.MonkeyPatch, tmp_path: object, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    before = make_firmware.PAGE.read_bytes()
    status = make_firmware.main([])

    assert status == 0
    assert capsys.readouterr().out.startswith(
        "docs/firmware.md is left as it is; measuring needs arm-none-eabi-gcc, avr-gcc"
    )
    assert make_firmware.PAGE.read_bytes() == before
