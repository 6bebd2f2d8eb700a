"""The digest of all that decides a result changes with it, and with nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest

from scripts import sources

FILES = {
    "templates/c.h": "",
    "robots/arm.yaml": "",
    "kinegen/__init__.py": "",
    "kinegen/build.py": "import kinegen.derive\n",
    "kinegen/derive.py": "def late() -> None:\n    from kinegen.deep import part\n",
    "kinegen/deep/__init__.py": "",
    "kinegen/deep/part.py": "import numpy\n",
    "kinegen/other.py": "",
    "script.py": "from kinegen import build\n",
    "docs/page.md": "",
}

CHANGED = "changed = 1\n"


@pytest.fixture
def root(tmp_path: Path) -> Path:
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize("name", FILES)
def test_what_is_imported_counts_and_nothing_else(name: str, root: Path) -> None:
    before = sources.digest(["script.py"], root=root)
    (root / name).write_text(FILES[name] + CHANGED, encoding="utf-8")

    assert (sources.digest(["script.py"], root=root) != before) is (name not in ("docs/page.md", "kinegen/other.py"))


def test_modules_that_are_named_count_too(root: Path) -> None:
    before = sources.digest(["script.py"], ["kinegen.other"], root)
    (root / "kinegen" / "other.py").write_text(CHANGED, encoding="utf-8")

    assert sources.digest(["script.py"], ["kinegen.other"], root) != before


def test_other_libraries_give_another_digest(root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = sources.digest(["script.py"], root=root)
    monkeypatch.setattr(sources, "libraries", lambda: ("another version",))

    assert sources.digest(["script.py"], root=root) != before


@pytest.mark.parametrize(
    ("name", "comment"),
    [("kinegen/build.py", "# told\n"), ("templates/c.h", "/* told */\n// told\n"), ("script.py", '"""Told."""\n')],
)
def test_comments_and_docstrings_decide_nothing(name: str, comment: str, root: Path) -> None:
    before = sources.digest(["script.py"], root=root)
    (root / name).write_text(FILES[name] + comment, encoding="utf-8")

    assert sources.digest(["script.py"], root=root) == before
