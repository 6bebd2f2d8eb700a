"""`kinegen build`: what is written, what is said, and when the exit status is 0."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from kinegen import pipeline as building
from kinegen.cli import main
from kinegen.cli.report import percentage
from kinegen.errors import CompileError, ProofError
from kinegen.native.flags import Flags
from kinegen.outputs import Quantity
from kinegen.results import BuildOptions, BuildResult
from kinegen.verify import proof, staging
from kinegen.verify.comparison import Comparison, Proof
from tests.cli.commands import BAD, ROBOTS, TWO

STAGES = ["load", "derive", "lower", "vectors", "emit", "compile", "prove", "write"]


@pytest.fixture
def two(tmp_path: Path) -> str:
    """A small robot."""
    path = tmp_path / "two.yaml"
    path.write_text(TWO, encoding="utf-8")
    return str(path)


@pytest.fixture
def out(tmp_path: Path) -> Path:
    """Where packages go."""
    return tmp_path / "out"


def build(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> str:
    """What a successful build without a compiler prints."""
    assert main(["build", "--no-compile", *map(str, arguments)]) == 0

    printed, err = capsys.readouterr()
    assert err == ""
    return printed


def document(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> Any:
    """The JSON document of a successful build without a compiler."""
    return json.loads(build(capsys, "--json", *arguments))


def test_stages_come_first_each_with_its_time(two: str, out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    head = build(capsys, two, "-o", out).split("\n\n")[0].splitlines()

    assert head[0] == two
    assert [re.match(r"  (\w+) +\d+\.\d\d s  \S", line)[1] for line in head[1:]] == STAGES  # type: ignore[index]


def test_operations_stand_beside_those_of_the_plain_product(out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    printed = build(capsys, ROBOTS / "puma560.yaml", "-o", out)

    assert (
        "  operations\n"
        "    pose      40 mul + 20 add + 6 sincos  a plain product of link matrices: 61 mul + 30 add + 6 sincos\n"
    ) in printed
    assert "  angle sums\n    c23 = cos(q2 + q3)\n" in printed


def test_each_file_is_named_with_what_became_of_it(two: str, out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def statuses(*more: str) -> dict[str, str]:
        lines = re.findall(r"^  (new|changed|untouched) +(.*)$", build(capsys, two, "-o", out, *more), re.M)
        return {Path(path).name: status for status, path in lines}

    first = statuses()
    assert set(first.values()) == {"new"}
    assert {"two.h", "two.c", "two_f32.c", "two_batch.c", "__init__.py"} <= set(first)
    assert sorted(first) == sorted(path.name for path in (out / "two").iterdir() if path.is_file())

    assert set(statuses().values()) == {"untouched"}

    (out / "two" / "two.c").write_text("something else", encoding="utf-8")
    again = statuses("--force")
    assert (again["two.c"], again["two.h"]) == ("changed", "untouched")


def test_the_proof_is_a_table_with_units_and_places(two: str, out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    *_, table = build(capsys, two, "-o", out).split("\n\n")
    lines = table.splitlines()

    assert lines[0].split("  ")[1] == "proof"
    assert "position [m]" in lines[0]
    assert [line.split("  ")[2] for line in lines if line.endswith("holds")] == [
        "NumPy double",
        "NumPy float",
        "NumPy double, beyond limits",
        "NumPy float, beyond limits",
        "NumPy double, 50 digits",
    ]
    assert re.search(
        r"^  worst double: \w+ of (turn|slide|tool), NumPy double.*, at\n    turn \S+, slide \S+$", table, re.M
    )
    assert re.search(r"^  worst float: ", table, re.M)


def test_several_robots_get_a_line_for_files_and_one_for_the_proof(
    two: str, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    printed = build(capsys, two, ROBOTS / "screw.yaml", "-o", out)

    assert re.findall(r"^  files (.*): \d+ new$", printed, re.M) == [str(out / "two"), str(out / "screw")]
    assert (
        len(re.findall(r"^  proof holds for [\d,]+ poses; worst \S+ % of the accepted error, in NumPy", printed, re.M))
        == 2
    )


def test_a_build_can_be_imported_from_its_folder(two: str, out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    build(capsys, two, "-o", out)
    code = "import two; print(two.backend, two.fk([0.0, 0.25])[:3, 3].tolist())"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=out, env=os.environ, capture_output=True, text=True, check=True
    )

    assert done.stdout == "numpy [0.5, 0.0, 0.25]\n"


@pytest.mark.parametrize(
    ("real", "present", "absent"),
    [
        ("double", "two.c two.h two_batch.c", "two_f32.c two_f32.h"),
        ("float", "two_f32.c two_f32.h two_f32_batch.c", "two.c two.h"),
        ("both", "two.c two_f32.c", "two_q30.c"),
        ("q30", "two.c two_q30.c two_q30.h two_q30_vectors.h two_q30_selftest.c", "two_f32.c two_f32.h"),
        ("float,q30", "two_f32.c two_q30.c", "two.c two.h"),
        ("all", "two.c two_f32.c two_q30.c", ""),
    ],
)
def test_number_types(
    real: str, present: str, absent: str, two: str, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    build(capsys, two, "-o", out, "--real", real)
    names = {path.name for path in (out / "two").iterdir()}

    assert set(present.split()) <= names
    assert not set(absent.split()) & names


@pytest.mark.parametrize(
    ("outputs", "expected"),
    [
        ("position", ["position"]),
        ("position,pose", ["pose", "position"]),
        ("frames, pose", ["pose", "frames"]),
        ("pose,frames,position", ["pose", "frames", "position"]),
    ],
)
def test_outputs(outputs: str, expected: list[str], two: str, out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (entry,) = document(capsys, two, "-o", out, "--outputs", outputs)["builds"]

    assert [name for name in entry["operations"] if name != "plain"] == expected
    assert list(dict.fromkeys(each["quantity"] for each in entry["proof"]["comparisons"])) == expected
    header = (out / "two" / "two.h").read_text(encoding="utf-8")
    assert ("two_frames(" in header) == ("frames" in expected)


def test_a_build_without_the_pose_still_shows_the_plain_product(
    two: str, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    printed = build(capsys, two, "-o", out, "--outputs", "position")

    assert re.search(r"^    pose +not built +a plain product of link matrices: ", printed, re.M)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--outputs", "pose,speed"], "unknown output 'speed' (expected pose, frames, position, "),
        (["--outputs", ""], "unknown output ''"),
        (["--real", "half"], "'half' is not one of 'double', 'float', 'both', 'q30', 'float,q30', 'all'"),
        (["--march", "haswell", "--portable"], "--march and --portable exclude each other"),
    ],
    ids=["output", "no output", "real", "processor"],
)
def test_wrong_options_are_wrong_usage(
    arguments: list[str], message: str, two: str, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["build", two, "-o", str(out), *arguments]) == 2
    assert message in capsys.readouterr().err
    assert not out.exists()


def test_json_has_stable_keys(two: str, out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = document(capsys, two, "-o", out)
    (entry,) = found["builds"]

    assert list(found) == ["kinegen", "format", "builds"]
    assert list(entry) == [
        *("file", "ok", "robot", "folder", "backend", "operations", "angle_sums", "files", "proof", "stages", "notes"),
    ]
    assert (entry["file"], entry["ok"], entry["backend"]) == (two, True, "numpy")
    assert list(entry["robot"]) == ["name", "digest", "joints", "units", "tips"]
    assert entry["robot"]["joints"] == [
        {"name": "turn", "type": "revolute"},
        {"name": "slide", "type": "prismatic"},
    ]
    assert list(entry["operations"]["pose"]) == [
        *("multiplications", "additions", "negations", "divisions", "sine_cosines"),
        *("roots", "arc_tangents", "selections"),
    ]
    assert {tuple(each) for each in entry["files"]} == {("path", "status")}
    assert [stage["name"] for stage in entry["stages"]] == STAGES
    assert {tuple(each) for each in entry["proof"]["comparisons"]} == {
        ("target", "quantity", "real", "poses", "holds", "share", "worst", "frame", "position", "rotation"),
    }
    assert entry["proof"]["holds"] is True


def test_json_of_a_failure_is_a_document_too(
    two: str, tmp_path: Path, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = tmp_path / "bad.yaml"
    bad.write_text(BAD, encoding="utf-8")

    assert main(["build", "--json", "--no-compile", str(bad), two, "-o", str(out)]) == 1

    printed, err = capsys.readouterr()
    first, second = json.loads(printed)["builds"]
    assert list(first) == ["file", "ok", "error"]
    assert first["error"].startswith(f"{bad}:10: joint 2 (slide)")
    assert second["ok"] is True
    assert err.startswith(f"error: {bad}:10: ")


def test_after_a_failure_the_others_are_built(
    two: str, tmp_path: Path, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = tmp_path / "bad.yaml"
    bad.write_text(BAD, encoding="utf-8")

    assert main(["build", "--no-compile", str(bad), two, "-o", str(out)]) == 1
    assert capsys.readouterr().err.splitlines()[-1] == f"1 of 2 builds failed: {bad}"
    assert (out / "two" / "two.c").exists()


def test_two_robots_of_one_name_do_not_share_a_folder(
    two: str, tmp_path: Path, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = tmp_path / "other.yaml"
    other.write_text(TWO.replace("0.5", "0.75"), encoding="utf-8")

    assert main(["build", "--no-compile", two, str(other), "-o", str(out)]) == 1
    assert capsys.readouterr().err.splitlines()[0] == (
        f"error: {other}: the robot is called 'two', as that of {two}, whose folder it would take"
    )


def test_a_failing_proof_exits_with_1_and_writes_nothing(
    two: str, out: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))  # where no proof is remembered
    honest = proof.prove

    def doubtful(*arguments: Any) -> Proof:
        found = honest(*arguments)
        worse: Comparison = replace(found.comparisons[0], position_error=0.25)
        return replace(found, comparisons=(worse, *found.comparisons[1:]))

    monkeypatch.setattr(staging, "prove", doubtful)

    assert main(["build", "--no-compile", two, "-o", str(out)]) == 1
    assert "two: NumPy double pose differs from the reference at q = (" in capsys.readouterr().err
    assert not out.exists()


def test_notes_are_printed(
    two: str, out: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    honest = building.build

    def noting(*arguments: Any) -> BuildResult:
        return replace(honest(*arguments), notes=("no C compiler was found",))

    monkeypatch.setattr(building, "build", noting)

    assert "  note: no C compiler was found\n" in build(capsys, two, "-o", out)


def test_an_unwritable_folder_is_an_error(two: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("in the way", encoding="utf-8")

    assert main(["build", "--no-compile", two, "-o", str(tmp_path / "file")]) == 1
    assert capsys.readouterr().err.startswith("error: cannot write ")


def test_debug_shows_where_a_proof_failed(
    two: str, out: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: Any) -> Proof:
        raise ProofError("it does not hold")

    monkeypatch.setattr(building, "proof_of", refuse)

    assert main(["--debug", "build", "--no-compile", two, "-o", str(out)]) == 1

    err = capsys.readouterr().err
    assert err.startswith("Traceback")
    assert err.endswith("error: it does not hold\n")


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ([], Flags()),
        (["--march", "haswell"], Flags(march="haswell")),
        (["--portable"], Flags(portable=True)),
        (["--reproducible"], Flags(contraction=False)),
    ],
    ids=["default", "march", "portable", "reproducible"],
)
def test_how_kernels_are_compiled(
    options: list[str], expected: Flags, two: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Flags] = []

    def refuse(_path: Path, options: BuildOptions, *_: object) -> BuildResult:
        asked.append(options.flags)
        raise CompileError("not now")

    monkeypatch.setattr(building, "build", refuse)

    assert main(["build", two, *options]) == 1
    assert capsys.readouterr().err == "error: not now\n"
    assert asked == [expected]


def test_compiled_kernels_are_proved_in_every_way(two: str, out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With a compiler, as users have it; without one the note says so and NumPy does the work."""
    assert main(["build", "--json", two, "-o", str(out)]) == 0

    (entry,) = json.loads(capsys.readouterr().out)["builds"]
    targets = list(dict.fromkeys(each["target"] for each in entry["proof"]["comparisons"]))
    if entry["backend"] == "numpy":
        assert entry["notes"]
        pytest.skip(entry["notes"][0])
    layouts = ("", ", batch", ", batch 3x4", ", batch joint_major")
    forms = [*(f"C {{}}{layout}" for layout in layouts), "NumPy {}"]
    beyond = [f"{form}, beyond limits" for form in ("C {}", "C {}, batch", "NumPy {}")]
    assert targets == [
        *(form.format(real) for real in ("double", "float") for form in forms),
        *(form.format(real) for real in ("double", "float") for form in beyond),
        "C double, 50 digits",
    ]


def test_a_link_as_output_folder_is_refused(two: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "target").mkdir()
    (tmp_path / "link").symlink_to("target")

    assert main(["build", "--no-compile", two, "-o", str(tmp_path / "link")]) == 1

    assert "link is a symbolic link; name the folder that it points to; nothing was written" in capsys.readouterr().err
    assert not any((tmp_path / "target").iterdir())


@pytest.mark.parametrize(("share", "text"), [(0.0642, "6.4 %"), (0.0996, "10 %"), (0.944, "94 %"), (0.999, "100 %")])
def test_shares_are_percentages(share: float, text: str) -> None:
    comparison = Comparison("C double", Quantity.POSE, 1, share, 0.0, 1.0, 1.0, (0.0,), "tool")

    assert percentage(comparison) == text
