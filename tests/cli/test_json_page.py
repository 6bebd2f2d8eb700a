"""The page about JSON documents names every field, and each document says what it is."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from kinegen import __version__
from kinegen.ui.cli import main
from tests.cli.commands import ROOT, TWO

PAGE = (ROOT / "docs" / "json.md").read_text(encoding="utf-8")


def named(command: str) -> set[str]:
    """The fields that the page names for a command."""
    page = (ROOT / "docs" / "compare.md").read_text(encoding="utf-8") if command == "compare" else PAGE
    section = page if command == "compare" else re.split(r"^## ", page, flags=re.M)[order(command)]
    rows = re.findall(r"^\| (`[^|]*) \|", section, re.M)
    return {name for row in rows for name in re.findall(r"`(\w+)`", row)}


def order(command: str) -> int:
    """The place of a command's section."""
    return [part.partition("\n")[0] for part in re.split(r"^## ", PAGE, flags=re.M)].index(command)


@pytest.mark.parametrize(
    "words",
    [
        "build two.yaml --outputs position --real float --no-compile -o out",
        "build none.yaml -o out",
        "check two.yaml",
        "check none.yaml",
        "inspect two.yaml",
        "inspect none.yaml",
        "fk two.yaml 0 1",
        "compare two.yaml two.yaml",
        "compare two.yaml none.yaml",
        "convert two.yaml",
        "workspace two.yaml --samples 1e4",
        "doctor two.yaml --pose 0,1=0.5,0,1",
    ],
)
def test_every_field_is_on_the_page(
    words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "two.yaml").write_text(TWO, encoding="utf-8")
    command, *arguments = [word.replace("=", " = ").replace(",", " ") for word in words.split()]
    main([command, *arguments, "--json"])
    document = json.loads(capsys.readouterr().out)

    assert (document["kinegen"], document["format"]) == (__version__, 1)
    fields = document.keys() - {"kinegen", "format"}
    for entries in {"builds", "files"} & fields:
        fields |= document[entries][0].keys()
    assert fields <= named(command)
    assert fields


@pytest.mark.parametrize(
    "words",
    [
        "fk none.yaml 0 1",
        "convert none.yaml",
        "convert two.yaml -o two.yaml",
        "workspace none.yaml",
        "doctor none.yaml --pose 0,1=0.5,0,1",
        "calibrate none.yaml none.csv --fit d",
        "size none.yaml",
        "prove none.yaml",
        "build none.yaml --package wheel -o out",
    ],
)
def test_an_error_is_a_document_too(
    words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The message that stderr has, whatever it is of: without Frama-C `prove` does not read the file."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "two.yaml").write_text(TWO, encoding="utf-8")
    command, *arguments = [word.replace("=", " = ").replace(",", " ") for word in words.split()]
    status = main([command, *arguments, "--json"])
    out, err = capsys.readouterr()
    document = json.loads(out)

    assert status in (1, 2)
    assert document == {"kinegen": __version__, "format": 1, "error": err.strip().removeprefix("error: ")}


def test_wrong_usage_is_no_document(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fk", "--json"]) == 2
    assert capsys.readouterr().out == ""
