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

from kinegen.driver import pipeline as building
from kinegen.driver.results import BuildOptions, BuildResult
from kinegen.errors import CompileError, ProofError
from kinegen.model.outputs import Quantity
from kinegen.runtime.flags import Flags
from kinegen.ui.api.options import build_options
from kinegen.ui.cli import main
from kinegen.ui.cli.build_record import percentage
from kinegen.ui.cli.robot_command import _joined
from kinegen.verify import package_proof, proof
from kinegen.verify.records import Calls, Comparison, Cost, Invocation, Proof
from tests.cli.commands import BAD, ROBOTS, TWO, start

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


def test_the_verdict_comes_first_then_how_to_use_what_was_built(
    two: str, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = build(capsys, two, "-o", out).splitlines()

    assert len(lines) <= 8
    assert re.fullmatch(
        r"two: built and verified in \d+\.\d s with NumPy alone; the C files are not compiled", lines[0]
    )
    assert re.fullmatch(r"  verified  pose, [\w, ]+: [\d,]+ results against an .* reference", lines[1])
    assert re.fullmatch(
        r"  errors    within tolerance; worst share of it \d.* % in double .*, \d.* % in float .*", lines[2]
    )
    assert lines[3] == f'  Python    PYTHONPATH={out} python -c "import two; print(two.fk([0, 0]))"'
    assert lines[4] == f"  firmware  {out / 'two' / 'two_f32.h'}, two_f32.c (C99, no heap, no libm)"
    assert re.fullmatch(rf"  files     \d+ new in {re.escape(str(out / 'two'))}", lines[5])
    assert lines[6] == "details: -v (stages, operations, table of errors, files)"


def test_other_languages_and_packages_are_named(two: str, out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = build(capsys, two, "-o", out, "--real", "double", "--languages", "javascript,rust").splitlines()

    assert f"  C         {out}/two/two.h, two.c (C99, no heap, no libm)" in lines
    assert f"  languages {out}/two/javascript, {out}/two/rust" in lines
    lines = build(capsys, two, "-o", out / "lib", "--package", "platformio").splitlines()

    assert f"  package   {out}/lib/two/README.md says how to use it" in lines
    assert f"  firmware  {out}/lib/two/include/two_f32.h, {out}/lib/two/src/two_f32.c (C99, no heap, no libm)" in lines


def test_flash_and_instructions_stand_in_the_verdict_where_they_were_measured(
    two: str, out: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    cost = Cost("cortex-m4f", "gcc", Quantity.POSE, "float", "-Os", 100, 432, 24, Calls(150, 157), "instructions", None)
    honest = building.build

    def measured(*arguments: Any) -> BuildResult:
        return replace(honest(*arguments), costs=(cost,))

    monkeypatch.setattr(building, "build", measured)
    printed = build(capsys, two, "-o", out, "--real", "float")

    assert "  flash     432 B, 150 to 157 instructions (pose on cortex-m4f)\n" in printed
    assert printed.count("\n") <= 8


def test_the_line_for_python_runs(two: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "with a space"
    for outputs, printed in (("pose", "[[ 1.   0.   0.   0.5]"), ("position", "Help on package two")):
        (line,) = re.findall("^  Python    (.*)$", build(capsys, two, "-o", out, "--outputs", outputs), re.M)
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        done = subprocess.run(
            ["sh", "-c", line], env=os.environ | {"PATH": path}, capture_output=True, text=True, check=True
        )

        assert done.stdout.startswith(printed)


def test_packages_go_to_build_unless_told_otherwise(
    two: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)

    assert "PYTHONPATH=build python" in build(capsys, two)
    assert (tmp_path / "build" / "two" / "two.c").exists()


@pytest.mark.parametrize(
    ("options", "measured"),
    [
        ({"real": None}, False),
        ({"real": "both"}, False),
        ({"real": "float"}, True),
        ({"real": "float,q30"}, True),
        ({"real": None, "package": "arduino"}, True),
        ({"real": None, "measure": True}, True),
    ],
    ids=str,
)
def test_kernels_are_measured_where_firmware_is_asked_for(options: dict[str, Any], measured: bool) -> None:
    assert build_options(None, outputs="pose", **options).measure is measured


def test_a_reader_that_goes_away_does_not_stop_a_build(two: str, out: Path) -> None:
    process = start("build", two, "-o", out, "--no-compile", "--real", "double", "-v")
    assert process.stdout is not None
    process.stdout.close()
    _, err = process.communicate(timeout=120)

    assert (process.returncode, err) == (0, "")
    assert (out / "two" / "kinegen-manifest.json").exists()


def test_a_build_that_changes_nothing_says_so(two: str, out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    build(capsys, two, "-o", out)
    first, *_, files, _details = build(capsys, two, "-o", out).splitlines()

    assert first == "two: up to date, nothing has changed since the last verified build"
    assert re.fullmatch(r"  files     \d+ untouched in .*", files)


def test_stages_have_their_times(two: str, out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    _, stages, *_ = build(capsys, two, "-o", out, "-v").split("\n\n")
    words = ["verify" if name == "prove" else name for name in STAGES]

    assert re.findall(r"^    (\w+) +\d+\.\d\d s  \S", stages, re.M) == words


def test_operations_stand_beside_those_of_the_plain_product(out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    printed = build(capsys, ROBOTS / "puma560.yaml", "-o", out, "-v")

    assert (
        "  operations\n"
        "    pose      38 mul + 20 add + 6 sincos  a plain product of link matrices: 61 mul + 30 add + 6 sincos\n"
    ) in printed
    assert "  angle sums\n    c23 = cos(q2 + q3)\n" in printed


def test_each_file_is_named_with_what_became_of_it(two: str, out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def statuses(*more: str) -> dict[str, str]:
        lines = re.findall(r"^  (new|changed|untouched) +(.*)$", build(capsys, two, "-o", out, "-v", *more), re.M)
        return {Path(path).relative_to(out / "two").as_posix(): status for status, path in lines}

    first = statuses()
    assert set(first.values()) == {"new"}
    assert {"two.h", "two.c", "two_f32.c", "two_batch.c", "__init__.py"} <= set(first)
    files = (path for path in (out / "two").rglob("*") if path.is_file() and "__pycache__" not in path.parts)
    assert sorted(first) == sorted(path.relative_to(out / "two").as_posix() for path in files)

    assert set(statuses().values()) == {"untouched"}

    (out / "two" / "two.c").write_text("something else", encoding="utf-8")
    again = statuses("--force")
    assert (again["two.c"], again["two.h"]) == ("changed", "untouched")


def test_errors_are_a_table_with_units_and_places(two: str, out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    *_, table = build(capsys, two, "-o", out, "-v", "--outputs", "pose,frames,position").split("\n\n")
    lines = table.splitlines()

    assert lines[0].split() == [
        *("verified", "poses", "positions", "tolerance", "unit", "rotations", "tolerance", "unit", "worst", "output")
    ]
    assert [line.split("  ")[2] for line in lines if line.endswith("pass")] == [
        "NumPy double",
        "NumPy float",
        "NumPy double, outside joint limits",
        "NumPy float, outside joint limits",
        "NumPy double, against 50 digits",
    ]
    assert all(line.split()[-8:-4:3] == ["m", "rad"] for line in lines if line.endswith("pass"))
    assert re.search(
        r"^  worst double: \w+ of (turn|slide|tool), NumPy double.*, at\n    turn \S+, slide \S+$", table, re.M
    )
    assert re.search(r"^  worst float: ", table, re.M)


def test_the_form_of_mounts_and_of_the_rotation_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mounts = "base: {xyz: [0, 0, 0.2], rpy: [20, 35, 50]}\ntool: {xyz: [0, 0, 0.2], rpy: [10, 25, 40]}"
    lines = [
        "kinegen: 1",
        "name: inclined",
        "convention: modified",
        "units: {length: m, angle: deg}",
        mounts,
        "joints:",
    ]
    for number, row in enumerate(("d: 0.1, a: 0, alpha: 0", "d: 0, a: 0.1, alpha: 90", "d: 0.1, a: 0.3, alpha: 0"), 1):
        lines.append(f"- {{name: j{number}, theta: q, {row}}}")
    path = tmp_path / "inclined.yaml"
    path.write_text("\n".join(lines), encoding="utf-8")

    printed = build(capsys, path, "-o", tmp_path, "-v", "--real", "double", "--outputs", "pose")

    (choice,) = re.findall(r"kept of \d+ ways: (.*)", printed)
    assert "mounts as one turn each, between offsets of joints" in choice
    assert "one sine and cosine for angles that differ by a constant" in choice


def test_one_robot_and_several_are_reported_alike(two: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def lines(folder: str, *files: str | Path) -> list[str]:
        printed = build(capsys, *files, "-o", tmp_path / folder)
        return re.sub(r"in \d+\.\d s", "", printed).replace(folder, "").splitlines()

    screw = ROBOTS / "screw.yaml"
    *first, hint = lines("first", two)
    *second, _ = lines("second", screw)

    assert lines("both", two, screw) == [*first, *second, hint]


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
    printed = build(capsys, two, "-o", out, "--outputs", "position", "-v")

    assert re.search(r"^    pose +not built +a plain product of link matrices: ", printed, re.M)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--outputs", "pose,speed"], "unknown output 'speed' (expected pose, frames, position, "),
        (["--outputs", "pose, jacobain"], "unknown output 'jacobain'; did you mean jacobian?"),
        (["--outputs", ""], "the name of an output is missing"),
        (["--real", "half"], "'half' is not one of 'double', 'float', 'both', 'q30', 'float,q30', 'all'"),
        (["--march", "haswell", "--portable"], "--march and --portable exclude each other"),
    ],
    ids=["output", "nearly an output", "no output", "real", "processor"],
)
def test_wrong_options_are_wrong_usage(
    arguments: list[str], message: str, two: str, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["build", two, "-o", str(out), *arguments]) == 2
    assert message in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.parametrize("name", ["arm.csv", "arm.yaml", "arm.C", "arm.whl"])
def test_the_name_of_a_file_is_no_folder_for_packages(
    name: str, two: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["build", two, "-o", str(tmp_path / name)]) == 2
    assert f"-o takes a folder, and {tmp_path / name} looks like the name of a file" in capsys.readouterr().err

    (tmp_path / name).mkdir()
    assert main(["build", two, "--no-compile", "--real", "double", "-o", str(tmp_path / name)]) == 0


def test_json_has_stable_keys(two: str, out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = document(capsys, two, "-o", out)
    (entry,) = found["builds"]

    assert list(found) == ["kinegen", "format", "builds"]
    assert list(entry) == [
        *("file", "ok", "robot", "folder", "backend", "operations", "angle_sums", "files"),
        *("verification", "proof", "stages", "notes"),
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
        (
            *("target", "quantity", "real", "poses", "holds", "share", "compared", "uncompared", "is_zero", "worst"),
            *("frame", "position", "rotation"),
        ),
    }
    assert entry["proof"]["holds"] is True


def test_json_has_the_words_of_the_field_beside_those_before(
    two: str, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (entry,) = document(capsys, two, "-o", out)["builds"]
    new, old = entry["verification"], entry["proof"]
    pairs = list(zip(new["comparisons"], old["comparisons"], strict=True))

    assert (new["passes"], new["reach"]) == (old["holds"], old["reach"])
    assert {(one["target"], other["target"]) for one, other in pairs} >= {
        ("NumPy double, outside joint limits", "NumPy double, beyond limits"),
        ("NumPy double", "NumPy double"),
    }
    for one, other in pairs:
        assert (one["passes"], one["share"]) == (other["holds"], other["share"])
        assert one["position"]["tolerance"] == other["position"]["accepted"]
        assert "holds" not in one
    assert ("verify", "prove") in [(stage["title"], stage["name"]) for stage in entry["stages"]]


@pytest.mark.parametrize("words", [["--outputs", "pose,", "position"], ["--outputs=pose,", "position"]], ids=str)
def test_blanks_behind_the_commas_of_a_list_change_nothing(
    words: list[str], two: str, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["build", two, "--no-compile", "--real", "double", "-o", str(out), "--json", *words]) == 0
    (entry,) = json.loads(capsys.readouterr().out)["builds"]

    assert list(entry["operations"]) == ["pose", "position", "plain"]


def test_lists_of_numbers_may_have_blanks_too() -> None:
    assert _joined(["a.yaml", "--q", "30,", "-40,", ".5", "-o", "x"]) == ["a.yaml", "--q", "30,-40,.5", "-o", "x"]
    assert _joined(["a,", "b", "--outputs", "pose,", "--force"]) == ["a,", "b", "--outputs", "pose,", "--force"]


def test_a_file_that_is_named_twice_is_built_once(two: str, out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    again = str(Path(two).parent / "." / "nowhere" / ".." / Path(two).name)
    found = document(capsys, two, again, two, "-o", out)

    assert [(each["file"], each["ok"]) for each in found["builds"]] == [(two, True)]


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


@pytest.mark.parametrize(
    ("name", "but", "where"),
    [("two", "", ""), ("Two", " but for capitals (it is 'two')", " on Windows and macOS")],
)
def test_two_robots_of_one_name_do_not_share_a_folder(
    name: str, but: str, where: str, two: str, tmp_path: Path, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = tmp_path / "other.yaml"
    other.write_text(TWO.replace("0.5", "0.75").replace("name: two", f"name: {name}"), encoding="utf-8")

    assert main(["build", "--no-compile", two, str(other), "-o", str(out)]) == 1
    assert capsys.readouterr().err.splitlines()[0] == (
        f"error: {other}: the robot is called {name!r}, as that of {two}{but}, whose folder it would take{where}"
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

    monkeypatch.setattr(package_proof, "prove", doubtful)

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

    monkeypatch.setattr(building, "cached_proof", refuse)

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
    assert main(["build", "--json", two, "-o", str(out), "--outputs", "pose,frames,position"]) == 0

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
    comparison = Comparison(Invocation("C", "double"), Quantity.POSE, 1, share, 0.0, 1.0, 1.0, (0.0,), "tool")

    assert percentage(comparison) == text
