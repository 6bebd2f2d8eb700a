"""`kinegen size`: what it says, and what it says where it cannot measure."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from kinegen.ui.cli import main
from kinegen.verify.boards.targets import TARGETS
from tests.boards.conftest import require

ROBOT = Path(__file__).parents[2] / "robots" / "scara.yaml"


def test_an_unknown_target_lists_the_known_ones(capsys: pytest.CaptureFixture[str]) -> None:
    status = main(["size", str(ROBOT), "--target", "cortex-m5"])
    said = capsys.readouterr().err

    assert status == 2
    assert "unknown target 'cortex-m5'" in said
    assert "cortex-m0, cortex-m3, cortex-m4f, cortex-m7, cortex-m33, rv32imac, rv32imafc, atmega2560" in said


def test_a_missing_compiler_names_its_package(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    status = main(["size", str(ROBOT)])

    assert status == 1
    assert capsys.readouterr().err == (
        "error: there is no arm-none-eabi-gcc: install it, on Debian with `apt install gcc-arm-none-eabi`\n"
    )


def test_a_bad_file_is_told_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status = main(["size", str(tmp_path / "none.yaml")])

    assert status == 1
    assert capsys.readouterr().err.startswith("error: ")


@pytest.mark.boards
def test_the_table_has_two_rows_for_each_kernel_and_names_the_better(capsys: pytest.CaptureFixture[str]) -> None:
    require(TARGETS["cortex-m4f"])
    status = main(["size", str(ROBOT), "--outputs", "pose,position"])
    lines = capsys.readouterr().out.splitlines()

    assert status == 0
    assert lines[0].endswith("scara.yaml on cortex-m4f: Cortex-M4F, FPU for float")
    assert lines[2].split()[-2:] == ["instructions", "operations"]
    assert [line.split()[0] for line in lines[3:]] == ["pose", "-O2", "position", "-O2"]
    assert sum("better" in line for line in lines) == 2


@pytest.mark.boards
def test_entries_of_the_table_as_arguments_are_measured(capsys: pytest.CaptureFixture[str]) -> None:
    require(TARGETS["cortex-m4f"])
    status = [main(["size", str(ROBOT), "--outputs", "pose", "--json", *more]) for more in ([], ["--wrt", "dh"])]
    constant, varied = (json.loads(line) for line in capsys.readouterr().out.replace("}\n{", "}\0{").split("\0"))
    unknown = main(["size", str(ROBOT), "--wrt", "a_nothing"])

    assert status == [0, 0]
    assert varied["costs"][0]["calls"]["most"] > 1.5 * constant["costs"][0]["calls"]["most"]
    assert unknown == 1
    assert "a_nothing" in capsys.readouterr().err


@pytest.mark.boards
def test_the_choice_among_solutions_is_measured_beside_them(capsys: pytest.CaptureFixture[str]) -> None:
    require(TARGETS["cortex-m4f"])
    status = main(["size", str(ROBOT), "--outputs", "inverse", "--json"])
    costs = json.loads(capsys.readouterr().out)["costs"]

    assert status == 0
    assert [cost["quantity"] for cost in costs] == ["inverse"] * 2 + ["inverse_nearest"] * 2
    for alone, chosen in zip(costs[:2], costs[2:], strict=True):
        assert alone["calls"]["most"] < chosen["calls"]["most"] < 3 * alone["calls"]["most"]
        assert alone["stack"] < chosen["stack"]


@pytest.mark.boards
def test_the_document_holds_everything(capsys: pytest.CaptureFixture[str]) -> None:
    require(TARGETS["atmega2560"])
    status = main(["size", str(ROBOT), "--target", "atmega2560", "--real", "both", "--outputs", "position", "--json"])
    document = json.loads(capsys.readouterr().out)

    assert status == 0
    assert document["robot"] == "scara"
    assert [(cost["real"], cost["optimisation"], cost["unit"]) for cost in document["costs"]] == [
        ("float", "-Os", "cycles"),
        ("float", "-O2", "cycles"),
    ]
    assert all(0 < cost["calls"]["least"] <= cost["calls"]["most"] for cost in document["costs"])
    assert document["costs"][0]["operations"]["sine_cosines"] == 2


def test_help_explains_the_columns(capsys: pytest.CaptureFixture[str]) -> None:
    status = main(["size", "--help"])
    lines = [line.strip() for line in capsys.readouterr().out.splitlines()]

    assert status == 0
    assert "function       bytes of the kernel function itself" in lines


@pytest.mark.boards
def test_integers_are_measured_beside_floats(capsys: pytest.CaptureFixture[str]) -> None:
    require(TARGETS["cortex-m0"])
    command = ["size", str(ROBOT), "--target", "cortex-m0", "--real", "all", "--outputs", "position", "--json"]
    status = main(command)
    costs = {cost["real"]: cost for cost in json.loads(capsys.readouterr().out)["costs"]}

    assert status == 0
    assert list(costs) == ["double", "float", "q30"]
    assert 5 * costs["q30"]["calls"]["most"] < costs["float"]["calls"]["least"]


@pytest.mark.boards
def test_a_kernel_that_integers_do_not_compute_is_refused_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    if shutil.which("arm-none-eabi-gcc") is None:
        pytest.skip("needs arm-none-eabi-gcc (apt install gcc-arm-none-eabi)")
    status = main(["size", str(ROBOT.with_name("screw.yaml")), "--real", "q30"])
    said = capsys.readouterr().err

    assert status == 1
    assert said.count("\n") == 1
    assert "no q30 kernels for screw: a length follows the angle" in said
