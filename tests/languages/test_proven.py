"""The record of what has passed tries again exactly what has changed."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.languages import proven

DIGESTS = (
    "arm c 1\narm rust 2\narm cuda 3\narm dh rust 7\narm q30 refused: why\nscara c 4\nscara rust 5\nscara cuda 6\n"
)


@pytest.fixture
def files(tmp_path: Path) -> dict[str, Path]:
    """Digests of two robots, and the record after all of them have passed."""
    found = {"digests": tmp_path / "digests.txt", "proven": tmp_path / "proven.txt"}
    found["digests"].write_text(DIGESTS, encoding="utf-8")
    proven.add([(robot, language) for robot in ("arm", "scara") for language in ("rust", "cuda", proven.ALL)], **found)
    return found


def test_what_has_passed_is_not_due_but_one_robot_always_is(files: dict[str, Path]) -> None:
    assert proven.due("rust", **files) == ("scara",)
    assert proven.due("rust", every=True, **files) == ("arm", "scara")


@pytest.mark.parametrize(
    ("line", "other", "languages"),
    [
        ("arm rust 2", "arm rust 8", {"rust", proven.ALL}),
        ("arm c 1", "arm c 8", {"rust", "cuda", proven.ALL}),
        ("arm dh rust 7", "arm dh rust 8", set()),
    ],
)
def test_other_bytes_of_c_or_of_the_language_are_due(
    line: str, other: str, languages: set[str], files: dict[str, Path]
) -> None:
    files["digests"].write_text(DIGESTS.replace(line, other), encoding="utf-8")

    assert {
        language for language in ("rust", "cuda", proven.ALL) if "arm" in proven.due(language, **files)
    } == languages


def test_only_what_passes_is_recorded_and_old_lines_go(files: dict[str, Path]) -> None:
    files["digests"].write_text(DIGESTS.replace("arm c 1", "arm c 8"), encoding="utf-8")
    proven.add([("arm", "cuda")], **files)

    assert files["proven"].read_text(encoding="utf-8") == (
        "arm cuda 8 3\nscara rust 4 5\nscara cuda 4 6\nscara all 4 5 6\n"
    )
    assert proven.due("rust", **files) == ("arm", "scara")


def test_without_a_record_everything_is_due(files: dict[str, Path]) -> None:
    files["proven"].unlink()

    assert proven.due("cuda", **files) == ("arm", "scara")
