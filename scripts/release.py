"""Builds the wheel and the source distribution, tries them as a user would, and prints what a maintainer has to type.

    python scripts/release.py

Nothing is uploaded and no tag is made. `dist/` holds the files afterwards. The tutorials run with the installed wheel:
those that need no extra after `pip install kinegen`, the others after `pip install kinegen[all]`.
"""

from __future__ import annotations

import hashlib
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
DIST, BARE = ROOT / "dist", ROOT / "build" / "release"
TUTORIALS = sorted((ROOT / "docs" / "tutorials").glob("*.md"))

VERSIONS = {
    "kinegen/__init__.py": r'^__version__ = "(.+)"$',
    "CITATION.cff": r"^version: (.+)$",
    "scripts/conda/recipe.yaml": r"^  version: (\d.*)$",
    "CHANGELOG.md": r"^## \[(\d.*)\] - \d{4}-\d\d-\d\d$",
}
"""Where the version is written; in the changelog the first dated section counts."""


def main() -> int:
    """Makes and checks the files; returns the exit status."""
    found = versions()
    if len(set(found.values())) != 1:
        print("the versions differ:", *(f"{path}: {version}" for path, version in found.items()), sep="\n  ")
        return 1
    version = found["CHANGELOG.md"]
    wheel, source = build(version)
    run(sys.executable, "-m", "twine", "check", "--strict", wheel, source)
    if strays := differing(wheel, source):
        print("a wheel made from the source distribution is another one:", *strays, sep="\n  ")
        return 1
    try_out(wheel, version)
    print(next_steps(version, source))
    return 0


def versions() -> dict[str, str]:
    """The version as each file has it; empty where it has none."""
    found = {}
    for path, pattern in VERSIONS.items():
        match = re.search(pattern, (ROOT / path).read_text(encoding="utf-8"), re.M)
        found[path] = match[1] if match else ""
    return found


def build(version: str) -> tuple[Path, Path]:
    """The wheel and the source distribution, alone in dist/."""
    shutil.rmtree(DIST, ignore_errors=True)
    run(sys.executable, "-m", "hatchling", "build", "-d", DIST)
    return DIST / f"kinegen-{version}-py3-none-any.whl", DIST / f"kinegen-{version}.tar.gz"


def differing(wheel: Path, source: Path) -> list[str]:
    """The files in which the wheel and one that is built from the sources differ."""
    again = BARE / "again"
    shutil.rmtree(again, ignore_errors=True)
    run(sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "-w", again, source)
    first, second = (
        {info.filename: info.CRC for info in zipfile.ZipFile(path).infolist()} for path in (wheel, again / wheel.name)
    )
    return sorted(name for name, _ in first.items() ^ second.items())


def try_out(wheel: Path, version: str) -> None:
    """Install the wheel in a new environment and follow the tutorials in it, first without extras."""
    shutil.rmtree(BARE / "environment", ignore_errors=True)
    run(sys.executable, "-m", "venv", BARE / "environment")
    python = BARE / "environment" / "bin" / "python"
    for what, pages in ((f"{wheel}", plain()), (f"{wheel}[all]", [page for page in TUTORIALS if page not in plain()])):
        run(python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", what)
        told = subprocess.run(
            [python, "-m", "kinegen", "--version"], check=True, capture_output=True, text=True, cwd=BARE
        )
        if version not in told.stdout:
            raise SystemExit(f"the installed kinegen has another version: {told.stdout}")
        run(python, ROOT / "docs" / "make_readme.py", "--run", *(page.relative_to(ROOT) for page in pages))


def plain() -> list[Path]:
    """The tutorials that need no extra."""
    return [page for page in TUTORIALS if not needs(page.read_text(encoding="utf-8"))]


def needs(page: str) -> set[str]:
    """The extras that a tutorial says that it needs: `Needs: ... pip install '.[plot]' ...`."""
    line = re.search(r"^Needs: .*?`pip install '?\.(?:\[([\w,]+)\])?'?`", page, re.M)
    if line is None:
        raise SystemExit("a tutorial does not say what it needs")
    return set(filter(None, (line[1] or "").split(",")))


def next_steps(version: str, source: Path) -> str:
    """What is left to do by hand."""
    digest = hashlib.sha256(source.read_bytes()).hexdigest()
    return f"""
dist/ is ready. To publish version {version}, from a clean checkout of main where 'make full' has passed:

  git tag -a v{version} -m "kinegen {version}"
  git push origin v{version}
  python -m twine upload dist/kinegen-{version}*

Then, in the conda feedstock, the source of scripts/conda/recipe.yaml:

  source:
    url: https://pypi.org/packages/source/k/kinegen/{source.name}
    sha256: {digest}
"""


def run(*command: str | Path) -> None:
    """Run a command and stop if it fails; what it prints goes to the screen."""
    done = subprocess.run(command, cwd=ROOT, check=False)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, command))}: exit status {done.returncode}")


if __name__ == "__main__":
    sys.exit(main())
