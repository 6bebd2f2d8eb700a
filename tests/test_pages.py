"""What README.md and the pages of docs/ show can be followed as rendered."""

from __future__ import annotations

import re
import shlex
from functools import cache
from pathlib import Path

import pytest

from docs import make_readme
from docs.make_readme import PAGES, ROOT

LINKED = (
    *sorted((ROOT / "docs").glob("*.md")),
    *sorted((ROOT / "docs" / "tutorials").glob("*.md")),
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "robots/README.md")),
)
"""The pages whose links are followed."""

NAMING = ("docs/architecture.md", "CONTRIBUTING.md")
"""The pages that name modules."""

PICTURES = sorted((ROOT / "docs").rglob("*.svg"))

QUICK = ("README.md", "docs/actuators.md", "docs/velocities.md")
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


@pytest.mark.parametrize("page", [*sorted((ROOT / "docs").rglob("*.md")), ROOT / "README.md"], ids=name)
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

    # A page without commands shows files.
    assert commands or "<!-- file: " in page.read_text(encoding="utf-8")
    for command in commands:
        if re.search(r"\bkinegen build\b", command):
            assert " -o " not in command or re.search(r" -o build(/\w+)?\b", command), command
        targets = re.findall(r"(?<![<0-9])>\s*(\S+)", command)
        assert all(target.startswith("build/") or target == "/dev/null" for target in targets), command
        assert "cd" not in shlex.split(command), command


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_what_a_command_reads_is_there_or_was_made_before(page: Path) -> None:
    for command in visible(page):
        for word in shlex.split(command):
            if re.match(r"(robots|examples|docs)/", word):
                assert (ROOT / word).exists(), command


@pytest.mark.long
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
    section = page[page.index("## Compilers and flags") : page.index("## Comparison with other tools")]
    rows = "".join(line for line in section.splitlines() if line.startswith("| "))

    for words in re.findall(r"\*([A-Z][\w ]+)\*", section):
        assert words.lower() in rows


def test_what_the_pages_say_of_a_package_without_compiled_kernels_is_what_it_says() -> None:
    engines = (ROOT / "kinegen" / "runtime" / "vendored" / "_engines.py").read_text(encoding="utf-8")

    assert "about 50 times slower" in engines
    for page in ("docs/tour.md", "docs/architecture.md"):
        text = " ".join((ROOT / page).read_text(encoding="utf-8").split())
        assert "about 50 times slower" in text
        assert "cffi" in text
        assert "NumPy alone and can be copied" not in text


def without_blocks(page: Path) -> str:
    """The text of a page without its code."""
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    return re.sub(r"`[^`\n]*`", lambda code: re.sub(r"[\[\]]", "", code[0]), text)


@cache
def anchors(page: Path) -> set[str]:
    """The anchors that hosting pages make of the headings of a page."""
    found: set[str] = set()
    for heading in re.findall(r"^#+ (.+)$", without_blocks(page), re.M):
        words = re.sub(r"[^\w\- ]", "", re.sub(r"\]\([^)]*\)", "", heading).lower()).replace(" ", "-")
        repeated = sum(re.fullmatch(rf"{re.escape(words)}(-\d+)?", known) is not None for known in found)
        found.add(f"{words}-{repeated}" if repeated else words)
    return found


def broken_links(page: Path) -> list[str]:
    """The relative links of a page that lead to no file or no heading."""
    broken = []
    for target in re.findall(r"\]\(([^)\s]+)\)", without_blocks(page)):
        if re.match(r"https?://", target):
            continue
        path, _, anchor = target.partition("#")
        file = page.parent / path if path else page
        if not file.exists() or not file.resolve().is_relative_to(ROOT) or (anchor and anchor not in anchors(file)):
            broken.append(target)
    return broken


@pytest.mark.parametrize("page", LINKED, ids=name)
def test_every_link_leads_to_a_file_and_a_heading(page: Path) -> None:
    assert broken_links(page) == []


def test_broken_links_are_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tests.test_pages.ROOT", tmp_path)
    page = tmp_path / "page.md"
    page.write_text(
        "# `a_b`: c, d\n\n## Two words\n\n## Two words\n\n```\n[code](gone.md)\n```\n"
        "[1](page.md#two-words) [2](#two-words-1) [3](#a_b-c-d) [4](https://example.com/x)\n"
        "[5](gone.md) [6](#two-words-2) [7](page.md#code) [8](../outside.md)\n",
        encoding="utf-8",
    )

    assert broken_links(page) == ["gone.md", "#two-words-2", "page.md#code", "../outside.md"]


@pytest.mark.parametrize("page", LINKED, ids=name)
def test_pictures_have_a_text_for_those_who_do_not_see_them(page: Path) -> None:
    assert all(text.strip() for text in re.findall(r"!\[([^\]]*)\]\(", page.read_text(encoding="utf-8")))


@pytest.mark.parametrize("picture", PICTURES, ids=name)
def test_a_picture_can_be_read_on_a_dark_page(picture: Path) -> None:
    """It brings its own background, and needs nothing from elsewhere."""
    text = picture.read_text(encoding="utf-8")

    assert re.search(r'<rect [^>]*fill="(#ffffff|white)"|<g id="patch_1">\s*<path [^>]*style="fill: #ffffff"', text)
    assert re.findall(r'(?:href|src)="(?!#)[^"]*"', text) == []


def test_what_the_first_picture_shows_is_what_commands_print() -> None:
    picture = (ROOT / "docs" / "overview.svg").read_text(encoding="utf-8")
    page = (ROOT / "README.md").read_text(encoding="utf-8")
    shown = re.findall(r"p[xy] = (.*?)<", picture)

    assert len(shown) == 2
    assert all(re.search(rf" {re.escape(formula)} \]", page) for formula in shown)


def test_the_first_page_answers_what_a_newcomer_asks() -> None:
    """What it is, how to install it, a result in six lines, how fast it is, and what other tools do better."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    first = text[: text.index("## A robot file")]
    (session,) = [block["body"] for block in make_readme.BLOCK.finditer(first) if block["kind"] == "pycon"]
    rows = [line.split("|")[1].strip() for line in first.splitlines() if line.startswith("| ")]

    assert text.count("\n") <= 158
    assert first.count("\n") <= 80
    for words in ("make demo ", "make test ", "pip install '.[all]'", "<!-- measured: speed -->"):
        assert words in first
    assert session.count(">>> ") <= 6
    for call in ("kinegen.load(", ".fk(", ".jacobian(", ".inverse("):
        assert call in session
    assert "kinegen.compile(" in first
    (robots,) = re.findall(r"\[(\d+) example robots\]\(robots/README.md\)", text)
    assert int(robots) == len(list((ROOT / "robots").glob("*.yaml")))
    assert {"dynamics", "collisions, meshes", "on the package index"} <= set(rows)
    assert re.findall(r"!\[[^\]]*\]\((.*?)\)", text) == ["docs/pictures/viewer.png", "docs/overview.svg"]


def test_the_first_page_shows_a_table_that_books_have_and_no_pipes() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    (path,) = re.findall(r"<!-- file: (robots/\S+) -->", text)
    convention = re.findall(r"^convention: (\w+)$", (ROOT / path).read_text(encoding="utf-8"), re.M)

    assert convention in (["standard"], ["modified"])
    assert [command for command in visible(ROOT / "README.md") if re.search(r"[|><]", command)] == []


def test_a_session_of_python_shows_what_it_prints(tmp_path: Path) -> None:
    page = "```pycon\n>>> a = 2\n>>> for each in range(a):\n...     print(each)\n... \nold\n>>> a + 3\n```\n"

    assert make_readme.refreshed(page, tmp_path).splitlines()[1:-1] == [
        *(">>> a = 2", ">>> for each in range(a):", "...     print(each)", "...", "0", "1", ">>> a + 3", "5")
    ]
    with pytest.raises(SystemExit, match="ZeroDivisionError"):
        make_readme.refreshed("```pycon\n>>> 1 / 0\n```\n", tmp_path)


@pytest.mark.parametrize("picture", sorted((ROOT / "docs").rglob("*.png")), ids=name)
def test_a_picture_has_all_its_colours(picture: Path) -> None:
    """A palette of 128 colours takes the red and blue of thin axes away; see the header of a PNG file."""
    data = picture.read_bytes()

    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    assert (data[24], data[25]) in ((8, 2), (8, 6))


@pytest.mark.parametrize("page", [ROOT / page for page in NAMING], ids=name)
def test_modules_that_pages_name_exist(page: Path) -> None:
    named = set(re.findall(r"`([\w/]+(?:\.py|/))`", page.read_text(encoding="utf-8"))) - {"build/", "dist/"}
    missing = [
        path
        for path in named
        if "NAME" not in path and not (ROOT / path).exists() and not list((ROOT / "kinegen").rglob(path.rstrip("/")))
    ]

    assert named
    assert missing == []


def test_the_modules_that_import_sympy_are_those_that_pages_name() -> None:
    modules = [
        path
        for path in (ROOT / "kinegen").rglob("*.py")
        if re.search(r"^\s*(import|from) sympy\b", path.read_text(encoding="utf-8"), re.M)
    ]
    outside = {str(path.relative_to(ROOT)) for path in modules if not {"derive", "textbook"} & {*path.parts}}

    assert outside == {"kinegen/ir/from_expressions.py"}
    for page in NAMING:
        assert re.search(r"ir/from_expressions\.py`[^`]*\blast\b", (ROOT / page).read_text(encoding="utf-8"))


def test_pages_and_templates_name_the_same_cost_of_the_sine() -> None:
    template = (ROOT / "templates" / "c" / "_sincos_f32.c.jinja").read_text(encoding="utf-8")
    page = " ".join((ROOT / "docs" / "firmware.md").read_text(encoding="utf-8").split())
    (count,) = re.findall(r"\((\d+) on a Cortex-M4F", template)

    assert re.findall(r"in (\d+) instructions on a Cortex-M4F", page) == [count]
