"""`kinegen workspace`: what it prints and writes, and what it refuses."""

from __future__ import annotations

import json
import sys
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kinegen.ui.cli import main
from tests.workspace import arms


@pytest.fixture
def two(tmp_path: Path) -> str:
    """Two links in a plane."""
    path = tmp_path / "two.yaml"
    path.write_text(arms.HEAD + arms.TWO_LINKS, encoding="utf-8")
    return str(path)


def refusal(capsys: pytest.CaptureFixture[str], *arguments: str | Path, status: int = 1) -> str:
    """What a call that fails says on stderr; nothing stands on stdout, and one line tells what is wrong."""
    assert main(["workspace", *map(str, arguments)]) == status
    said = capsys.readouterr()
    assert said.out == ""
    assert len([line for line in said.err.splitlines() if "rror: " in line]) == 1
    return said.err.splitlines()[-1]


def test_the_whole_report(two: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["workspace", two, "--samples", "1e5", "--voxel", "0.05"]) == 0
    lines = capsys.readouterr().out.splitlines()

    assert lines[0] == f"{two}: workspace of tool"
    assert lines[1].startswith("  100,000 samples of shoulder, elbow in ")
    assert lines[2:12] == [
        "  shoulder, elbow: no limits in the file, taken as a full turn",
        "",
        "                               least    most",
        "  x                          -0.8000  0.8000  m",
        "  y                          -0.8000  0.8000  m",
        "  z                           0.0000  0.0000  m",
        "  from the base               0.2000  0.8000  m",
        "  from the axis of shoulder   0.2000  0.8000  m",
        "",
        "                             voxel    poses  voxels hit      area",
    ]
    # How many poses the search takes may differ where processors round otherwise.
    assert [line[:34] for line in lines[12:16]] == [
        "  half of the samples       0.05 m",
        "  all samples               0.05 m",
        "  and searched at the rim   0.05 m",
        "  the same, finer          0.025 m",
    ]
    assert lines[16] == ""
    assert lines[17].startswith("  area 1.88")
    assert lines[17].endswith(" m², in the plane of x and y")
    assert lines[18:] == [
        "  between 1.803 m² and 2.083 m², if no voxel is missing: voxels with all neighbours, and all that were hit",
        "  the second half of the samples added 0.1% of the voxels; those that no sample hit are not counted",
        "  dexterous part: none, since the tip cannot turn about one line while it stays in place",
    ]


def test_json_holds_all_of_it(two: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["workspace", two, "--samples", "1e5", "--seed", "3", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)

    assert (found["robot"], found["tip"], found["unit"], found["samples"], found["seed"]) == (
        "arm",
        "tool",
        "m",
        10**5,
        3,
    )
    assert found["shape"]["kind"] == "planar region"
    assert found["extremes"]["axis"] == [pytest.approx(0.2), pytest.approx(0.8)]
    assert found["counts"][2]["measure"] == pytest.approx(pi * (0.8**2 - 0.2**2), rel=0.01)
    assert [joint["limited"] for joint in found["joints"]] == [False, False]


def test_files_are_written(two: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture, cloud = tmp_path / "new" / "slices.SVG", tmp_path / "cloud.npz"

    assert main(["workspace", two, "--samples", "1e4", "--slices", str(picture), "--cloud", str(cloud)]) == 0

    assert picture.read_bytes().startswith(b"<?xml")
    assert np.load(cloud)["q"].shape[1] == 2
    assert capsys.readouterr().out.splitlines()[-2:] == [f"  wrote {picture}", f"  wrote {cloud}"]


def test_limits_of_another_file(two: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    other = tmp_path / "other.yaml"
    other.write_text(arms.HEAD + arms.SECTOR, encoding="utf-8")

    assert main(["workspace", two, "--samples", "1e5", "--limits-from", str(other), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)

    assert found["counts"][2]["measure"] == pytest.approx(pi / 2 * (0.8**2 - 0.2**2), rel=0.01)


def dexterous(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    """What a call says of the dexterous part."""
    assert main(["workspace", "--samples", "1e4", "--json", *arguments]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)["dexterous"]
    return found


def test_the_dexterous_part(capsys: pytest.CaptureFixture[str]) -> None:
    """Links of 0.4, 0.3 and 0.2 m: all orientations from 0.3 to 0.5 m, and up to 0.1 m."""
    planar = str(arms.ROBOTS / "planar_3r.yaml")

    assert dexterous(capsys, planar)["measure"] == pytest.approx(pi * (0.5**2 - 0.3**2 + 0.1**2), rel=0.1)
    main(["workspace", planar, "--samples", "1e4"])
    assert "dexterous part 0.5" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("robot", "reason"),
    [
        ("iiwa14", "not measured, since iiwa14 has no closed-form inverse"),
        ("cartesian", "none, since the tip has only one orientation"),
        ("al5d", "none, since the tip cannot turn to every orientation while it stays in place"),
        ("spherical_arm", "none, since the arm cannot turn the tip to every orientation"),
        ("blocks", "none, since the tip has only one orientation"),
    ],
)
def test_why_there_is_no_dexterous_part(robot: str, reason: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert dexterous(capsys, str(arms.ROBOTS / f"{robot}.yaml"))["reason"].startswith(reason)


def test_an_inverse_does_not_serve_the_limits_of_another_file(capsys: pytest.CaptureFixture[str]) -> None:
    planar = str(arms.ROBOTS / "planar_3r.yaml")

    assert "limits of its own file" in dexterous(capsys, planar, "--limits-from", planar)["reason"]


def test_limits_of_a_file_with_other_joints(two: str, capsys: pytest.CaptureFixture[str]) -> None:
    said = refusal(capsys, two, "--limits-from", arms.ROBOTS / "iiwa14.yaml")

    assert said == "error: iiwa14.yaml has no joint variable 'shoulder', expected a revolute one as in two.yaml"


def test_a_tree_needs_a_tip(capsys: pytest.CaptureFixture[str]) -> None:
    said = refusal(capsys, arms.ROBOTS / "hand.yaml")

    assert "tips; choose one with --tip (" in said


def test_a_tip_of_a_tree(capsys: pytest.CaptureFixture[str]) -> None:
    tip = arms.robot("hand").tips[1]

    assert main(["workspace", str(arms.ROBOTS / "hand.yaml"), "--tip", tip, "--samples", "1e4"]) == 0
    assert f"workspace of {tip}\n" in capsys.readouterr().out


def test_a_screw_without_limits_is_searched_within_a_turn(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["workspace", str(arms.ROBOTS / "screw.yaml"), "--samples", "2000"]) == 0
    said = capsys.readouterr().out

    assert "  z              -0.002500  0.002500  m\n" in said
    assert "inf" not in said


def test_a_slide_that_follows_an_endless_joint_stays_within_a_turn(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "climb.yaml"
    path.write_text(arms.HEAD + arms.CLIMB, encoding="utf-8")

    assert main(["workspace", str(path), "--samples", "2000", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["extremes"]["z"] == [pytest.approx(-0.1 * pi), pytest.approx(0.1 * pi)]


@pytest.mark.parametrize(
    ("tip", "low", "high"),
    [("wrist_centre", 346.1, 878.1), ("wrist_bend", 346.1, 878.1), ("elbow", 437.7, 476.1), ("tool", 291.2, 934.3)],
)
def test_links_and_the_wrist_centre_are_tips(
    tip: str, low: float, high: float, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = str(arms.ROBOTS / "puma560_mm.yaml")

    assert main(["workspace", robot, "--samples", "1e4", "--tip", tip, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)

    assert found["tip"] == {"wrist_centre": "forearm"}.get(tip, tip)
    assert found["extremes"]["base"] == [pytest.approx(low, abs=1), pytest.approx(high, abs=1)]


def test_volumes_of_a_file_in_mm_are_in_cubic_metres(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["workspace", str(arms.ROBOTS / "puma560_mm.yaml"), "--samples", "1e5"]) == 0
    said = capsys.readouterr().out

    assert "\n  volume 3." in said
    assert "mm³" not in said
    assert " m³\n" in said


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--tip", "nose"], "error: unknown tip 'nose' (expected shoulder, elbow, tool, wrist_centre)"),
        (
            ["--slices", "a.jpg"],
            "error: a.jpg: slices are written as .png or .svg, expected a name with such an ending",
        ),
        (
            ["--cloud", "a.csv"],
            "error: a.csv: clouds are written as .npz or .parquet, expected a name with such an ending",
        ),
        (["--voxel", "1e-7"], "are too small for a region of 1.6 m: expected "),
        (["--voxel", "20"], "error: voxels of 20 m are too large for a region of 1.6 m: expected 0.16 m or less"),
        (["--tip", "wrist_centre"], "arm has no frame where the axes of its last three joints meet"),
        (["--samples", "1e4", "--slices", "a.svg", "--plane", "y=0"], "stays in one plane, which is drawn as a whole"),
        (["--samples", "1e4", "--slices", "/proc/none/a.svg"], "error: cannot write /proc/none/a.svg: "),
        (
            ["--samples", "1e4", "--cloud", "/dev/null/a.npz"],
            "error: /dev/null: this is a file, not a folder; choose",
        ),
    ],
)
def test_what_cannot_be_done_is_said_in_a_line(
    two: str, arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert message in refusal(capsys, two, *arguments)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--samples", "0"], "0 is not an integer from 1 to 1e11"),
        (["--samples", "-5"], "-5 is not an integer from 1 to 1e11"),
        (["--samples", "1.5"], "1.5 is not an integer from 1 to 1e11"),
        (["--samples", "nan"], "nan is not an integer from 1 to 1e11"),
        (["--samples", "many"], "'many' is not a number"),
        (
            ["--plane", "y=0"],
            "name its file with --slices; see 'kinegen workspace --help'",
        ),
        (["--plane", "0"], "'0' is not a plane (expected x=..., y=... or z=..., such as y=0)"),
        (["--plane", "xy=0"], "'xy=0' is not a plane (expected x=..., y=... or z=..., such as y=0)"),
        (["--plane", "y=inf"], "'y=inf' is not a plane (expected a finite number)"),
        (["--voxel", "0"], "0 is not the edge of a voxel (expected more than 0)"),
        (["--voxel", "-1"], "-1 is not the edge of a voxel (expected more than 0)"),
        (["--voxel", "nan"], "nan is not the edge of a voxel (expected more than 0)"),
        (["--voxel", "inf"], "inf is not the edge of a voxel (expected more than 0)"),
    ],
)
def test_numbers_that_make_no_sense(
    two: str, arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert refusal(capsys, two, *arguments, status=2).endswith(message)


@pytest.mark.parametrize(
    ("option", "file", "module", "message"),
    [
        ("--slices", "a.png", "matplotlib", "drawing slices needs matplotlib, which is not installed"),
        ("--cloud", "a.parquet", "pyarrow", "a Parquet cloud needs pyarrow, which is not installed"),
    ],
)
def test_a_missing_library_is_named_before_anything_is_computed(
    option: str,
    file: str,
    module: str,
    message: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in [name for name in sys.modules if name.partition(".")[0] == module]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, module, None)

    said = refusal(capsys, "no_such_robot.yaml", option, file)

    assert said == f"error: {message} (pip install 'kinegen[workspace]')"


def test_without_a_compiler_numpy_gives_the_same(
    two: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    arguments = ["workspace", two, "--samples", "1e4", "--json"]
    main(arguments)
    compiled = json.loads(capsys.readouterr().out)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)

    assert main(arguments[:-1]) == 0
    assert "there is no C compiler" in capsys.readouterr().err
    main(arguments)

    assert json.loads(capsys.readouterr().out)["counts"] == compiled["counts"]


def test_processes_find_what_threads_find(
    two: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Runs of two blocks, so that workers hit the same voxels in many of them; joint vectors and voxels are equal."""
    pytest.importorskip("distributed", reason="needs Dask (pip install 'kinegen[fleet]')")
    monkeypatch.setattr("kinegen.tools.datasets.workspace_cluster._RUN", 2)
    found = []
    for name, options in (("threads", ["--threads", "2"]), ("processes", ["--workers", "2"])):
        cloud = tmp_path / f"{name}.npz"
        assert main(["workspace", two, "--samples", "7e5", "--json", "--cloud", str(cloud), *options]) == 0
        told = json.loads(capsys.readouterr().out)
        with np.load(cloud) as arrays:
            found.append(({key: told[key] for key in told if key not in ("seconds", "written")}, dict(arrays)))

    assert found[0][0] == found[1][0]
    assert found[0][1].keys() == found[1][1].keys()
    for key, array in found[0][1].items():
        np.testing.assert_array_equal(array, found[1][1][key])


def test_a_scheduler_that_is_not_there_is_one_line(
    two: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("distributed", reason="needs Dask (pip install 'kinegen[fleet]')")
    monkeypatch.setattr("kinegen.tools.datasets.cluster._PATIENCE", 1)

    assert "there is no scheduler at tcp://127.0.0.1:9" in refusal(capsys, two, "--scheduler", "tcp://127.0.0.1:9")


def test_too_few_samples_measure_nothing(two: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["workspace", two, "--samples", "1"]) == 0
    said = capsys.readouterr().out
    assert "  area not measured: there are too few samples" in said
    assert "dexterous part: not measured, because the region is not measured" in said
    assert " 0 m²" not in said

    assert main(["workspace", two, "--samples", "1", "--json"]) == 0
    assert [each["measure"] for each in json.loads(capsys.readouterr().out)["counts"]] == [None] * 4
