"""`kinegen view`: a robot file in, a page out, and nothing of the user's lost."""

from __future__ import annotations

import webbrowser
from pathlib import Path

import pytest

from kinegen.ui.cli import main
from tests.cli.commands import BAD, TWO
from tests.viewer.pages import model_of


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to be in, with a robot file of two joints."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "two.yaml").write_text(TWO, encoding="utf-8")
    return tmp_path


def test_the_page_is_named_after_the_robot_and_replaced_the_next_time(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["view", "two.yaml"]) == 0
    assert "wrote two.html" in capsys.readouterr().out
    first = (folder / "two.html").read_text(encoding="utf-8")

    assert main(["view", "two.yaml", "--q", "-90, 0.5"]) == 0
    second = (folder / "two.html").read_text(encoding="utf-8")

    assert model_of(first)["start"] is None
    assert model_of(second)["start"] == pytest.approx([-1.5707963267948966, 0.5])
    assert sorted(path.name for path in folder.iterdir()) == ["two.html", "two.yaml"]


def test_a_file_of_the_user_is_not_replaced(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["view", "two.yaml", "-o", "edited.html"]) == 0
    edited = (folder / "edited.html").read_bytes().replace(b"<title>", b"<title>my ", 1)
    for name, content in (("mine.html", b"<p>mine</p>"), ("mine.htm", b"\xff\xfe\x00"), ("edited.html", edited)):
        (folder / name).write_bytes(content)

        assert main(["view", "two.yaml", "-o", name]) == 1
        assert "kinegen did not write this file, or it was changed since" in capsys.readouterr().err
        assert (folder / name).read_bytes() == content

    assert main(["view", "two.yaml", "-o", "mine.html", "--force"]) == 0
    assert model_of((folder / "mine.html").read_text(encoding="utf-8"))["name"] == "two"


def test_the_robot_file_is_never_replaced(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "two.html").symlink_to("two.yaml")

    assert main(["view", "two.yaml", "--force"]) == 1

    assert "this is an input, which is never overwritten" in capsys.readouterr().err
    assert (folder / "two.yaml").read_text(encoding="utf-8") == TWO


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        (["two.yaml", "-o", "sub.html"], 1, "this is a folder"),
        (["two.yaml", "--q", "1"], 2, "two needs 2 joint values (turn [deg], slide [m]), 1 given"),
        (["two.yaml", "--q", ""], 2, "none given"),
        (["two.yaml", "--q", "nan,0"], 2, "is not a number"),
        (["two.yaml", "--q", "1", "--angle", "rad"], 2, "two needs 2 joint values (turn [rad], slide [m]), 1 given"),
        (["two.yaml", "--angle", "rad"], 2, "--angle is for the joint values of --q"),
        (["two.yaml", "--q", "1e999,0"], 2, "out of bounds"),
        (["two.yaml", "--outputs", "pos"], 1, "unknown output 'pos' (expected pose, position)"),
        (["two.yaml", "--outputs", "pose@nowhere"], 1, "nowhere"),
        (["two.yaml", "--outputs", "numeric_inverse"], 1, "not an output of a page"),
        (["bad.yaml"], 1, "alhpa"),
        (["missing.yaml"], 1, "missing.yaml"),
        (["two.yaml", "-o", "two.yaml/x.html"], 1, "two.yaml: this is a file, not a folder"),
    ],
)
def test_bad_arguments_are_one_line_and_write_nothing(
    folder: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], status: int, words: str
) -> None:
    (folder / "bad.yaml").write_text(BAD, encoding="utf-8")
    (folder / "sub.html").mkdir()

    assert main(["view", *arguments]) == status

    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1
    assert not [path for path in folder.glob("*.html") if path.is_file()]


@pytest.mark.parametrize(("text", "angle"), [("90,0.1", "deg"), ("pi/2,0.1", "rad")])
def test_joint_values_have_the_unit_that_is_stated(folder: Path, text: str, angle: str) -> None:
    assert main(["view", "two.yaml", "-o", "stated.html", "--q", text, "--angle", angle]) == 0
    assert main(["view", "two.yaml", "-o", "usual.html", "--q", "90,0.1"]) == 0

    assert (folder / "stated.html").read_bytes() == (folder / "usual.html").read_bytes()


@pytest.mark.parametrize("opened", [True, False])
def test_open_shows_the_page_or_says_that_it_cannot(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, opened: bool
) -> None:
    addresses: list[str] = []
    monkeypatch.setattr(webbrowser, "open", lambda address: addresses.append(address) or opened)

    assert main(["view", "two.yaml", "--open"]) == 0

    assert addresses == [(folder / "two.html").as_uri()]
    assert ("no browser was found" in capsys.readouterr().err) is not opened
