"""The scripts that `make` runs: the environment, and the pages with real output."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from docs import make_readme, make_robots
from kinegen.io.load import load
from scripts import make_venv

PAGE = """\
Before.
```sh
make nothing
echo made > made  # where the next command looks
```
```console
$ echo turned in 0.30 s, \\
    worst 2.2e-16
{body}$ cat made
made
```
After.
"""
PRINTED = "turned in 0.30 s, worst 2.2e-16\n"


def refreshed(body: str, folder: Path) -> str:
    """A page whose first output was a body, after its commands ran."""
    return make_readme.refreshed(PAGE.format(body=body), folder)


def test_a_page_takes_up_what_a_command_prints(tmp_path: Path) -> None:
    assert refreshed("something else\n", tmp_path) == PAGE.format(body=PRINTED)
    assert refreshed("", tmp_path) == PAGE.format(body=PRINTED)


def test_a_page_keeps_its_times_and_rounding_errors(tmp_path: Path) -> None:
    body = "turned in 1.71 s, worst 4.4e-16\n"

    assert refreshed(body, tmp_path) == PAGE.format(body=body)


def test_a_page_shows_a_file_or_some_of_its_lines(tmp_path: Path) -> None:
    path = "docs/examples/batch.py"
    lines = (make_readme.ROOT / path).read_text(encoding="utf-8").splitlines(keepends=True)

    for part, body in (("", lines), (", lines 3 to 4", lines[2:4])):
        page = f"<!-- file: {path}{part} -->\n```python\n{{}}```\n"
        assert make_readme.refreshed(page.format("old\n"), tmp_path) == page.format("".join(body))


PROOF = """\
  errors    within tolerance; worst share of it 67 % in double (jacobian)
    compile   2.11 s  _native.abi3.so

  verified          poses  positions  tolerance  unit   rotations  tolerance  unit  worst  output
    C double       31,731    3.3e-16    1.0e-13  m        6.7e-16    1.0e-13  rad    44 %  pose      pass
    NumPy double   31,731    3.3e-16    1.0e-13  m        6.9e-16    1.0e-13  rad    49 %  frames    pass
  worst double: pose of tool, NumPy double, at
    waist -1.63731, shoulder -2.42598,
    flange -0.584126
"""


def test_a_page_keeps_the_place_of_the_largest_error() -> None:
    elsewhere = PROOF.replace("2.11 s  _native.abi3.so", "0.01 s  cached").replace("frames ", "position ")
    elsewhere = (
        elsewhere.replace("pose of tool", "frames of elbow").replace("-1.63731", "0.1").replace("6.9e-16", "1e-15")
    )

    assert make_readme.comparable(PROOF) == make_readme.comparable(elsewhere)


@pytest.mark.parametrize(
    ("before", "after"),
    [("31,731", "31,730"), ("C double ", "C float"), ("rotations", "rotation"), (" pass", " FAILS")],
)
def test_a_page_does_not_keep_what_a_proof_says(before: str, after: str) -> None:
    assert make_readme.comparable(PROOF) != make_readme.comparable(PROOF.replace(before, after))


def test_a_page_does_not_show_a_command_that_fails(tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match="exit status 3\nno such robot"):
        make_readme.output("echo no such robot; exit 3", tmp_path)
    with pytest.raises(SystemExit, match="exit status 1\nTraceback"):
        make_readme.output("echo Traceback; exit 1", tmp_path)


def test_a_page_may_show_an_error_message(tmp_path: Path) -> None:
    assert make_readme.output("echo error: no such robot; exit 1", tmp_path) == "error: no such robot\n"


@pytest.mark.parametrize(
    ("name", "joints"),
    [("puma560", "6R"), ("stanford", "2R P 3R"), ("screw", "H"), ("blocks", "none"), ("hand", "17R, 5 tips")],
)
def test_the_list_of_robots_names_their_joints(name: str, joints: str) -> None:
    assert make_robots.joints(load(make_robots.FOLDER / f"{name}.yaml")) == joints


def test_a_usable_environment_is_left_alone(tmp_path: Path) -> None:
    """pip comes from this environment: the one that is tried needs its own only to count as usable."""
    folder = tmp_path / "environment"
    make_venv.run(sys.executable, "-m", "venv", "--without-pip", folder)
    assert not make_venv.is_usable(folder)

    (site,) = folder.glob("lib/python3*/site-packages")
    (site / "pip.py").touch()

    assert make_venv.main(folder) == 0
    assert (site / "pip.py").exists()


def test_a_wheel_of_pip_with_other_bytes_is_not_run(tmp_path: Path) -> None:
    wheel = tmp_path / "pip.whl"
    wheel.write_bytes(b"something else")

    with pytest.raises(ValueError, match="is not the file it should be"):
        make_venv.install_pip(Path("never-run"), wheel.as_uri(), make_venv.PIP_SHA256)
