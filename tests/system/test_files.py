"""Robot files and folders as they are on Windows: line ends, backslashes, drive letters, capitals."""

from __future__ import annotations

from pathlib import Path

import pytest

import kinegen
from kinegen.driver.results import BuildOptions
from kinegen.errors import KinegenError
from kinegen.io.load import load
from kinegen.tools.wheels.build import make_wheels
from kinegen.ui.cli import main
from tests.builds.workshop import ARM


def write(path: Path, text: str = ARM, end: str = "\n") -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(text.replace("\n", end).encode())
    return path


@pytest.mark.parametrize("end", ["\r\n", "\r"])
def test_line_ends_make_no_difference(end: str, tmp_path: Path) -> None:
    plain, other = write(tmp_path / "a" / "arm.yaml"), write(tmp_path / "b" / "arm.yaml", end=end)

    assert load(other) == load(plain)


@pytest.mark.parametrize("name", ["C:\\My Robots\\arm.yaml", "my robots\\arm 1.yaml", "\\\\server\\share\\arm.yaml"])
def test_messages_name_files_of_any_drive_with_the_line(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """On a system that has no drives, such a path is a name of a file."""
    monkeypatch.chdir(tmp_path)
    path = Path(name)
    write(path, ARM.replace("d: 0.25", "d: height"))

    assert main(["check", name]) == 1
    assert capsys.readouterr().err.startswith(f"error: {name}:9: joint 1 (shoulder): d: undefined name 'height'")
    with pytest.raises(KinegenError) as caught:
        kinegen.load(name)
    assert (caught.value.path, caught.value.line) == (name, 9)


def test_a_missing_file_of_a_drive_is_not_taken_for_a_text() -> None:
    with pytest.raises(KinegenError, match=r"C:\\robots\\none.yaml: there is no such file"):
        kinegen.load("C:\\robots\\none.yaml")


def test_a_wheel_has_no_two_packages_that_differ_in_capitals_alone(tmp_path: Path) -> None:
    files = [write(tmp_path / "a.yaml"), write(tmp_path / "b.yaml", ARM.replace("name: arm", "name: Arm"))]
    with pytest.raises(KinegenError, match="two robots are called 'arm' and 'Arm', which differ in capitals alone"):
        make_wheels(files, tmp_path / "out", BuildOptions(output=tmp_path, compile=False), bundle="arms")
