"""What README.md and the pages of docs/ show can be followed as rendered."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from docs import make_readme
from docs.make_readme import PAGES, ROOT

QUICK = ("docs/actuators.md", "docs/velocities.md")
"""The pages that run here; `make docs-current` runs all of them."""


def name(page: Path) -> str:
    return str(page.relative_to(ROOT))


def visible(page: Path) -> list[str]:
    """Every command of a page, in order."""
    found: list[str] = []
    for block in make_readme.BLOCK.finditer(page.read_text(encoding="utf-8")):
        if block["kind"] == "sh":
            found += make_readme.commands(block["body"])
        if block["kind"] == "console":
            found += [match["text"].replace("\\\n", "") for match in make_readme.COMMAND.finditer(block["body"])]
    return found


@pytest.mark.parametrize("page", [*sorted((ROOT / "docs").glob("*.md")), ROOT / "README.md"], ids=name)
def test_no_command_hides_in_a_comment(page: Path) -> None:
    assert not re.search("<!-- (output|command|run)", page.read_text(encoding="utf-8"))


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_every_line_of_a_console_belongs_to_a_command(page: Path) -> None:
    for block in make_readme.BLOCK.finditer(page.read_text(encoding="utf-8")):
        if block["kind"] == "console":
            assert "".join(match[0] for match in make_readme.COMMAND.finditer(block["body"])) == block["body"]
            # Long commands go on in lines of their own.
            assert all(len(line) <= 110 for line in block["body"].splitlines() if line.startswith("$"))


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_nothing_is_written_but_below_build(page: Path) -> None:
    """Builds of a reader in a checkout must not alter files that git tracks."""
    commands = visible(page)

    assert commands
    for command in commands:
        if re.search(r"\bkinegen build\b", command):
            assert re.search(r" -o build(/\w+)?\b", command), command
        assert all(target.startswith("build/") for target in re.findall(r"(?<![<0-9])>\s*(\S+)", command)), command
        assert "cd" not in shlex.split(command), command


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_what_a_command_reads_is_there_or_was_made_before(page: Path) -> None:
    for command in visible(page):
        for word in shlex.split(command):
            if re.match(r"(robots|examples|docs)/", word):
                assert (ROOT / word).exists(), command


@pytest.mark.parametrize("page", [page for page in PAGES if name(page) in QUICK], ids=name)
def test_the_commands_of_a_page_run_in_an_empty_folder_in_order(page: Path, tmp_path: Path) -> None:
    folder = make_readme.fresh_folder(tmp_path / "reader")
    before = page.read_text(encoding="utf-8")

    after = make_readme.refreshed(before, folder)

    assert {path.name for path in folder.iterdir()} == {*make_readme.COPIED, "build", ".cache"}
    assert after == before


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_a_page_shows_files_as_they_are(page: Path) -> None:
    shown = [block for block in make_readme.BLOCK.finditer(page.read_text(encoding="utf-8")) if block["path"]]

    for block in shown:
        assert block["body"] == make_readme.shown(block), block["path"]


def test_what_the_page_on_speed_explains_is_in_its_tables() -> None:
    page = (ROOT / "docs" / "performance.md").read_text(encoding="utf-8")
    section = page[page.index("## Compilers and flags") : page.index("## What people use instead")]
    rows = "".join(line for line in section.splitlines() if line.startswith("| "))

    for words in re.findall(r"\*([A-Z][\w ]+)\*", section):
        assert words.lower() in rows


def test_what_the_pages_say_of_a_package_without_compiled_kernels_is_what_it_says() -> None:
    engines = (ROOT / "kinegen" / "native" / "runtime" / "_engines.py").read_text(encoding="utf-8")

    assert "about 50 times slower" in engines
    for page in ("README.md", "docs/architecture.md"):
        text = " ".join((ROOT / page).read_text(encoding="utf-8").split())
        assert "about 50 times slower" in text
        assert "cffi" in text
        assert "NumPy alone and can be copied" not in text
