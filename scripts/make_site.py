"""Makes the source of the site in build/site-source, and the site in build/site.

    python scripts/make_site.py           copies pages and what they link to, draws the arm, runs mkdocs
    python scripts/make_site.py --check   the same, and reads the result: nothing may be loaded from elsewhere

Pages keep their places in the repository, so that their links work in both. mkdocs.yml lists the pages.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "docs"))  # The scripts of the pages are in no package.

import make_commands  # noqa: E402

SOURCE, SITE = ROOT / "build" / "site-source", ROOT / "build" / "site"
ARM = ("robots/puma560.yaml", "arm/puma560.html", "20,-50,60,0,40,0")
"""The robot of the start page, its file in the site, and its joint values in degrees."""

UNSEARCHED = ("CHANGELOG.md",)
"""Pages that the search leaves out, since they name everything."""

TOP = ("CONTRIBUTING.md", "CHANGELOG.md", "LICENSE")
LINK = re.compile(r"\]\((?!https?:|#|mailto:)([^)\s#]+)")
LOADING = {"script": "src", "link": "href", "img": "src", "iframe": "src", "source": "src", "video": "src"}
"""What a browser loads without being asked, by tag."""


def main(arguments: list[str]) -> int:
    """Builds the site; returns the exit status."""
    stage(SOURCE)
    make_arm(SOURCE)
    command = [sys.executable, "-m", "mkdocs", "build", "--quiet", "--strict", "--clean"]
    done = subprocess.run(command, cwd=ROOT, check=False, stderr=subprocess.PIPE, text=True)
    # Advertising of the theme is no message about the site.
    kept = re.compile(r"\s*(WARNING|ERROR|Aborted|\S*Error)")
    sys.stderr.write("".join(line for line in done.stderr.splitlines(True) if kept.match(line)))
    if done.returncode != 0:
        return 1
    pages = sorted(SITE.rglob("*.html"))
    foreign = [f"{page.relative_to(SITE)}: {address}" for page in pages for address in loaded_from_elsewhere(page)]
    if not (SITE / "search" / "search_index.js").exists():
        foreign.append("a site opened from the disk has no search")
    print("\n".join(foreign) or f"{SITE.relative_to(ROOT)}/index.html and {len(pages) - 1} more pages")
    return int(bool(foreign) and "--check" in arguments)


def stage(folder: Path) -> None:
    """Copy the pages and all that they show or link to."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    ignored = shutil.ignore_patterns("__pycache__", "*.py", "site")
    shutil.copytree(ROOT / "docs", folder / "docs", ignore=ignored)
    # A reader of the site cannot ask the commands for their help.
    (folder / "docs" / "commands.md").write_text(make_commands.whole_page(), encoding="utf-8", newline="\n")
    (folder / "robots").mkdir()
    for path in (*sorted((ROOT / "robots").iterdir()), *(ROOT / name for name in TOP)):
        target = folder / path.relative_to(ROOT)
        target.write_bytes(path.read_bytes())
    (folder / "assets").mkdir()
    shutil.copy(ROOT / "docs" / "site" / "site.css", folder / "assets" / "site.css")
    shutil.copy(ROOT / "docs" / "site" / "search_worker.js", folder / "assets" / "iframe-worker.js")
    shutil.copy(ROOT / "docs" / "site" / "index.md", folder / "index.md")
    for page in sorted(folder.rglob("*.md")):
        bring_links(page, folder)
    for name in UNSEARCHED:
        page = folder / name
        head = "---\nsearch:\n  exclude: true\n---\n"
        page.write_text(head + page.read_text(encoding="utf-8"), encoding="utf-8", newline="\n")


def bring_links(page: Path, folder: Path) -> None:
    """Copy files of the repository that a page links to; links to README.md lead to the start page."""
    text = page.read_text(encoding="utf-8")
    for link in LINK.findall(text):
        target = (page.parent / link).resolve()
        if target == folder / "README.md":
            text = text.replace(f"]({link}", f"]({link.removesuffix('README.md')}index.md")
            continue
        original = ROOT / target.relative_to(folder) if target.is_relative_to(folder) else target
        if original.is_file() and not target.exists():
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(original, target)
    page.write_text(text, encoding="utf-8", newline="\n")


def make_arm(folder: Path) -> None:
    """The moving arm of the start page, as `kinegen view` writes it."""
    robot, page, joints = ARM
    (folder / page).parent.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", "kinegen", "view", robot, "-o", str(folder / page), "--q", joints]
    subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)


class _Loads(HTMLParser):
    """Collects the addresses that a browser loads with a page."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """One tag."""
        given = dict(attrs)
        # A canonical address is a name, and is not loaded.
        if tag in LOADING and given.get("rel") not in ("canonical", "next", "prev"):
            self.found.append(given.get(LOADING[tag]) or "")


def loaded_from_elsewhere(page: Path) -> list[str]:
    """The addresses outside the site that a browser would load with a page."""
    parser = _Loads()
    parser.feed(page.read_text(encoding="utf-8"))
    return [address for address in parser.found if re.match(r"([a-z]+:)?//", address)]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
