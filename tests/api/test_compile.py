"""`kinegen.compile`: the proven module from the cache, whole whatever happens to it; and `kinegen.build`."""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

import kinegen
from kinegen.model.outputs import every_quantity, parse_quantity
from kinegen.runtime import compiled
from kinegen.ui.api import module_cache

ROOT = Path(__file__).resolve().parents[2]


def arm(length: float) -> dict[str, Any]:
    """A small robot."""
    return {
        "kinegen": 1,
        "name": "arm",
        "convention": "standard",
        "units": {"length": "m", "angle": "deg"},
        "joints": [
            {"name": "turn", "theta": "q", "d": 0.1, "a": length, "alpha": 90},
            {"name": "lift", "theta": "q", "d": 0, "a": 0.25, "alpha": 0},
        ],
    }


QUICK: dict[str, Any] = {"outputs": "pose", "real": "double", "compile": False}


@pytest.fixture
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache, and nothing of it in memory."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(module_cache, "_loaded", {})
    monkeypatch.setattr(compiled, "__path__", [])
    return tmp_path / "cache"


def again(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in another process: nothing is in memory."""
    monkeypatch.setattr(module_cache, "_loaded", {})
    for name in [name for name in sys.modules if name.startswith("kinegen.runtime.compiled.")]:
        monkeypatch.delitem(sys.modules, name)


def folders(cache: Path) -> list[Path]:
    """The modules in a cache, and whatever else is beside them."""
    return sorted((cache / "kinegen" / "modules").iterdir())


@pytest.fixture
def builds(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The names of the robots that were built."""
    from kinegen.driver import pipeline

    names, own = [], pipeline.build

    def noted(robot: Any, *rest: Any) -> Any:
        names.append(robot.name)
        return own(robot, *rest)

    monkeypatch.setattr(pipeline, "build", noted)
    return names


def test_a_compiled_module_is_that_of_a_build(tmp_path: Path) -> None:
    module = kinegen.compile(arm(0.5), "pose,jacobian", real="double")
    result = kinegen.build(arm(0.5), tmp_path, outputs=["jacobian", "pose"], real="double")
    kept_files = {
        path.name: path.read_bytes() for path in Path(str(module.__file__)).parent.iterdir() if path.is_file()
    }

    assert module.backend == "c"
    assert kept_files.pop("kinegen-kept.json")
    assert kept_files == {path.name: path.read_bytes() for path in result.folder.iterdir() if path.is_file()}
    q = np.random.default_rng(1).uniform(-1, 1, (50, 2))
    assert np.abs(module.fk(q) - kinegen.reference.fk(kinegen.load(arm(0.5)), q)).max() < 1e-15
    assert "__init__.pyi" in kept_files


def test_the_same_request_is_the_same_module(own_cache: Path, builds: list[str]) -> None:
    first = kinegen.compile(arm(0.5), **QUICK)

    assert kinegen.compile(kinegen.load(arm(0.5)), **QUICK) is first
    assert kinegen.compile(arm(0.6), **QUICK) is not first
    assert kinegen.compile(arm(0.5), **{**QUICK, "outputs": "pose,position"}) is not first
    assert builds == ["arm"] * 3


def test_an_output_may_be_named_as_its_function(own_cache: Path, builds: list[str]) -> None:
    first = kinegen.compile(arm(0.5), **QUICK)

    assert kinegen.compile(arm(0.5), **{**QUICK, "outputs": "fk"}) is first
    assert kinegen.compile(arm(0.5), **{**QUICK, "outputs": ["fk", "pose"]}) is first
    assert builds == ["arm"]
    assert {parse_quantity(each.function) for each in every_quantity()} == {*every_quantity()}
    assert parse_quantity("fk@elbow/table") == parse_quantity("pose@elbow/table")


def test_a_module_names_the_call_that_has_what_it_lacks(own_cache: Path) -> None:
    module = kinegen.compile(arm(0.5), **QUICK)

    assert not hasattr(module, "jacobian")
    with pytest.raises(AttributeError) as caught:
        _ = module.jacobian
    told = str(caught.value)
    assert told == 'arm was compiled without jacobian: kinegen.compile(robot, "pose,jacobian")'
    names = {
        "kinegen": SimpleNamespace(compile=partial(kinegen.compile, real="double", compile=False)),
        "robot": arm(0.5),
    }
    made = eval(told.partition(": ")[2], names)  # noqa: S307 - our own text
    assert made.jacobian([0.0, 0.0]).shape == (6, 2)


def test_another_process_finds_it_and_nothing_is_written_elsewhere(
    own_cache: Path, builds: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    first = kinegen.compile(arm(0.5), **QUICK)
    again(monkeypatch)
    second = kinegen.compile(arm(0.5), **QUICK)

    assert second is not first
    assert second.__name__ == first.__name__
    assert builds == ["arm"]
    assert [path.name for path in folders(own_cache)] == [first.__name__.rpartition(".")[2]]
    assert list((tmp_path / "here").iterdir()) == []
    assert {path.name for path in tmp_path.iterdir()} == {"cache", "here"}


@pytest.mark.parametrize("damage", ["cut", "missing", "changed", "seal", "nonsense", "empty"])
def test_a_damaged_entry_is_made_again(
    damage: str, own_cache: Path, builds: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    kinegen.compile(arm(0.5), **QUICK)
    (folder,) = folders(own_cache)
    code, seal = folder / "_numpy.py", folder / "kinegen-kept.json"
    text = code.read_text(encoding="utf-8")
    match damage:
        case "cut":
            code.write_text(text[:100], encoding="utf-8")
        case "missing":
            code.unlink()
        case "changed":
            code.write_text(text.replace("0.25", "0.26"), encoding="utf-8")
        case "seal":
            seal.unlink()
        case "nonsense":
            seal.write_text("[" * 100_000, encoding="utf-8")
        case "empty":
            for path in folder.iterdir():
                if path.is_file():
                    path.unlink()
    again(monkeypatch)
    module = kinegen.compile(arm(0.5), **QUICK)

    assert builds == ["arm", "arm"]
    assert len(folders(own_cache)) == 1
    assert code.read_text(encoding="utf-8") == text
    assert module.fk([0.0, 0.0])[0, 3] == 0.75


def test_a_folder_that_was_never_finished_is_not_used(own_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kinegen.compile(arm(0.5), **QUICK)
    home = own_cache / "kinegen" / "modules"
    unfinished = home / ".new-abc"
    unfinished.mkdir()
    os.utime(unfinished, (1, 1))
    kinegen.compile(arm(0.6), **QUICK)

    assert not unfinished.exists()
    assert len(folders(own_cache)) == 2


def test_what_fails_leaves_nothing(own_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from kinegen.driver import pipeline

    def refuse(*_arguments: Any) -> Any:
        raise kinegen.KinegenError("the proof does not hold")

    monkeypatch.setattr(pipeline, "require_written", refuse)
    with pytest.raises(kinegen.KinegenError, match="the proof does not hold"):
        kinegen.compile(arm(0.5), **QUICK)

    assert folders(own_cache) == []


@pytest.mark.parametrize("home", ["missing", "open to all"])
def test_without_a_cache_the_module_is_there_all_the_same(
    home: str, tmp_path: Path, own_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if home == "missing":
        monkeypatch.setenv("XDG_CACHE_HOME", "")
        monkeypatch.setenv("HOME", str(tmp_path / "nowhere"))
    else:
        (own_cache / "kinegen").mkdir(parents=True)
        (own_cache / "kinegen").chmod(0o777)
    module = kinegen.compile(arm(0.5), **QUICK)

    assert module.fk([0.0, 0.0])[0, 3] == 0.75
    assert not (own_cache / "kinegen" / "modules").exists()


def test_eight_threads_get_modules_of_their_own(own_cache: Path, builds: list[str]) -> None:
    lengths = [0.5, 0.6, 0.7, 0.8] * 2
    barrier = threading.Barrier(8)

    def make(length: float) -> ModuleType:
        barrier.wait()
        return kinegen.compile(arm(length), **QUICK)

    with ThreadPoolExecutor(8) as pool:
        modules = list(pool.map(make, lengths))

    assert len(builds) == 4
    assert [round(float(module.fk([0.0, 0.0])[0, 3]), 12) for module in modules] == [each + 0.25 for each in lengths]
    assert modules[0] is modules[4]


def test_two_processes_at_once_are_safe_and_kernels_are_pickled(own_cache: Path) -> None:
    code = (
        "import json, pickle, sys, kinegen; m = kinegen.compile(json.loads(sys.argv[1]), 'pose', real='double', "
        "compile=False); sys.stdout.buffer.write(pickle.dumps(m.fk))"
    )
    command = [sys.executable, "-W", "error", "-c", code, json.dumps(arm(0.9))]
    running = [subprocess.Popen(command, stdout=subprocess.PIPE, cwd=ROOT) for _ in range(2)]
    kernels = [process.communicate()[0] for process in running]
    load = "import pickle, sys; print(pickle.load(sys.stdin.buffer)([0.0, 0.0])[0, 3])"
    command = [sys.executable, "-W", "ignore", "-c", load]
    done = subprocess.run(command, input=kernels[0], capture_output=True, check=True, cwd=ROOT)

    assert [process.returncode for process in running] == [0, 0]
    assert kernels[0] == kernels[1]
    assert float(done.stdout) == 1.15
    assert len(folders(own_cache)) == 1


def test_the_numbers_of_a_pickle_are_those_of_the_module(own_cache: Path) -> None:
    module = kinegen.compile(arm(0.5), **QUICK)

    assert pickle.loads(pickle.dumps(module.fk)) is module.fk  # noqa: S301 - our own bytes


def test_nan_joints_are_nan_results(own_cache: Path) -> None:
    found = kinegen.compile(arm(0.5), **QUICK).fk(np.array([[np.nan, 0.0], [0.0, 0.0]]))

    assert np.isnan(found[0, 0, 3])
    assert np.isfinite(found[1]).all()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"outputs": "pose,flight"}, "unknown output 'flight'"),
        ({"outputs": ""}, "the name of an output is missing"),
        ({"outputs": [3]}, "expected words, not '3'"),
        ({"outputs": "inverse", "wrt": "nothing"}, "nothing"),
        ({"real": "q30"}, "double, float or both, not 'q30'"),
        ({"outputs": "jacobian@nowhere"}, "nowhere"),
    ],
)
def test_wrong_options_are_named(options: dict[str, Any], message: str, own_cache: Path) -> None:
    with pytest.raises(kinegen.KinegenError, match=message) as caught:
        kinegen.compile(arm(0.5), **{**QUICK, **options})

    assert "\n" not in str(caught.value)


def test_a_build_that_changes_nothing_is_not_made(tmp_path: Path, builds: list[str]) -> None:
    file = kinegen.load(arm(0.5)).save(tmp_path / "arm.yaml")
    stages: list[str] = []
    options: dict[str, Any] = {"outputs": "pose", "real": "double", "compile": False}
    first = kinegen.build(file, tmp_path / "out", **options, report=lambda stage: stages.append(stage.name))
    second = kinegen.build(str(file), str(tmp_path / "out"), **options)

    assert stages[:2] == ["load", "derive"]
    assert {each.status for each in first.written} == {"new"}
    assert [stage.name for stage in second.stages] in (["compare"], [stage.name for stage in first.stages])
    assert first.proof == second.proof


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"package": "maven"}, "unknown package 'maven'"),
        ({"real": "half"}, "unknown number type 'half'"),
        ({"languages": "cobol"}, "unknown language 'cobol'"),
        ({"march": "haswell", "portable": True}, "march and portable exclude each other"),
        ({"package": "cmake", "languages": "javascript"}, "package writes C alone"),
    ],
)
def test_wrong_options_of_a_build_are_named(options: dict[str, Any], message: str, tmp_path: Path) -> None:
    with pytest.raises(kinegen.KinegenError, match=message):
        kinegen.build(arm(0.5), tmp_path / "out", **options)

    assert not (tmp_path / "out").exists()


def test_a_build_of_a_file_that_is_missing_says_so(tmp_path: Path) -> None:
    with pytest.raises(kinegen.KinegenError, match="cannot be read"):
        kinegen.build(tmp_path / "none.yaml", tmp_path / "out")
