"""The site: every page is listed, every link leads somewhere, and nothing is loaded from elsewhere."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
import yaml

from docs import make_commands, make_pictures
from kinegen.ui import cli
from scripts import make_site
from tests import test_pages

ROOT = Path(__file__).resolve().parent.parent
CONFIGURATION = ROOT / "mkdocs.yml"


class _Loader(yaml.SafeLoader):
    """Reads mkdocs.yml, whose Python objects are names here."""


_Loader.add_multi_constructor("tag:yaml.org,2002:python/", lambda *_: "python")


def configuration() -> dict[str, Any]:
    found = yaml.load(CONFIGURATION.read_text(encoding="utf-8"), Loader=_Loader)  # noqa: S506 - a loader made safe
    assert isinstance(found, dict)
    return found


def listed(nav: Any) -> list[str]:
    """The files that a part of the navigation names."""
    if isinstance(nav, str):
        return [nav]
    return [path for part in (nav.values() if isinstance(nav, dict) else nav) for path in listed(part)]


@pytest.fixture(scope="module")
def staged(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The source of the site, with an empty page instead of the arm."""
    folder = tmp_path_factory.mktemp("site")
    make_site.stage(folder)
    (folder / "arm").mkdir()
    (folder / make_site.ARM[1]).write_text("", encoding="utf-8")
    return folder


def test_the_navigation_lists_every_page_once(staged: Path) -> None:
    pages = sorted(str(path.relative_to(staged)) for path in staged.rglob("*.md"))

    assert sorted(listed(configuration()["nav"])) == pages
    assert len(pages) >= 30


def test_every_link_of_the_site_leads_to_a_file_and_a_heading(staged: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(test_pages, "ROOT", staged)

    broken = {str(page.relative_to(staged)): test_pages.broken_links(page) for page in sorted(staged.rglob("*.md"))}

    assert {page: links for page, links in broken.items() if links} == {}


def test_a_link_to_a_file_of_the_repository_brings_the_file(tmp_path: Path) -> None:
    page = tmp_path / "docs" / "page.md"
    page.parent.mkdir()
    page.write_text("[a](../examples/gimbal.yaml) [b](../README.md#install) [c](gone.md) [d](https://x.org/y)", "utf-8")

    make_site.bring_links(page, tmp_path)

    assert (tmp_path / "examples" / "gimbal.yaml").exists()
    assert "[b](../index.md#install)" in page.read_text(encoding="utf-8")
    assert sorted(path.name for path in tmp_path.rglob("*") if path.is_file()) == ["gimbal.yaml", "page.md"]


def test_the_theme_loads_no_fonts_and_the_site_has_no_counters() -> None:
    found = configuration()

    assert found["theme"]["font"] is False
    assert found["strict"] is True
    assert "analytics" not in found["extra"]
    assert "repo_url" not in found
    assert "extra_javascript" not in found


def test_a_site_opened_from_the_disk_can_be_searched(staged: Path) -> None:
    """Without a server there are no workers and no index to fetch: the plugin writes a script, and a frame runs it."""
    found = configuration()
    (worker,) = found["extra"]["polyfills"]

    assert {"search", "offline"} <= set(found["plugins"])
    assert found["use_directory_urls"] is False
    # The plugin adds a script from elsewhere unless one of this name is there.
    assert "iframe-worker" in worker
    text = (staged / worker).read_text(encoding="utf-8")
    assert "http" not in text
    assert 'location.protocol === "file:"' in text
    assert (staged / "CHANGELOG.md").read_text(encoding="utf-8").startswith("---\nsearch:\n  exclude: true\n---\n")


def test_long_lines_of_blocks_go_on_below(staged: Path) -> None:
    style = (staged / "assets" / "site.css").read_text(encoding="utf-8")

    assert re.search(r"pre > code \{ white-space: pre-wrap;", style)


@pytest.mark.parametrize(
    ("text", "foreign"),
    [
        ('<script src="https://a.b/c.js"></script>', ["https://a.b/c.js"]),
        ('<link rel="stylesheet" href="//a.b/c.css">', ["//a.b/c.css"]),
        ('<iframe src="http://a.b"></iframe><img src="x.png">', ["http://a.b"]),
        ('<link rel="canonical" href="https://a.b/"><a href="https://a.b">x</a><script>let a = 1</script>', []),
    ],
)
def test_what_a_browser_would_load_from_elsewhere_is_found(text: str, foreign: list[str], tmp_path: Path) -> None:
    (tmp_path / "page.html").write_text(text, encoding="utf-8")

    assert make_site.loaded_from_elsewhere(tmp_path / "page.html") == foreign


def test_the_page_of_commands_has_a_line_for_every_command_and_the_site_also_its_help(staged: Path) -> None:
    page = (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")
    whole = (staged / "docs" / "commands.md").read_text(encoding="utf-8")

    assert page == make_commands.page()
    assert re.findall(r"^\| `kinegen (\w+)` \| \w.*\. \| \[", page, re.M) == [*cli.COMMANDS]
    assert whole.startswith(page)
    assert re.findall(r"^## kinegen ?(.*)$", whole, re.M) == ["", *cli.COMMANDS]
    assert make_commands.section("view") in whole
    assert make_commands.section("show") in whole


def test_pictures_are_compared_by_their_marks() -> None:
    picture = (ROOT / "docs" / "pictures" / "elbow.svg").read_text(encoding="utf-8")
    (place,) = re.findall(r'<g id="axis-elbow-x">\s*<path d="M (\S+) ', picture)

    assert len(make_pictures.marks(picture)) > 20
    assert make_pictures.same(picture, picture)
    assert make_pictures.same(picture, picture.replace(f"M {place} ", f"M {float(place) + 0.01:.6f} "))
    assert not make_pictures.same(picture, picture.replace(f"M {place} ", f"M {float(place) + 1:.6f} "))
    assert not make_pictures.same(picture, picture.replace("a₂ = 0.4318", "a₂ = 0.4319"))


def test_the_page_of_pictures_shows_what_its_commands_write() -> None:
    text = (ROOT / "docs" / "pictures.md").read_text(encoding="utf-8")
    written = [words[words.index("-o") + 1] for words in make_pictures.commands(text)]

    assert [f"docs/{path}" for path in re.findall(r"!\[[^\]]*\]\((.*?)\)", text)] == written
    assert all((ROOT / path).exists() for path in written)
