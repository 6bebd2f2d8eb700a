"""Runs that share a folder, are killed or are resumed: nobody loses a file, and what is kept is whole."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pyarrow as pa
import pytest

import kinegen
from kinegen.errors import KinegenError
from kinegen.tools.datasets import evaluate
from kinegen.tools.datasets.cluster import way_of
from kinegen.tools.datasets.plan import NAME
from kinegen.tools.datasets.writing import alone, unfinished, writing
from kinegen.ui.cli import main
from tests.fleet.data import ROBOT, ROOT, contents, table_of, vectors_of, write

pytestmark = pytest.mark.usefixtures("machine")

LOCK = ".kinegen-lock"


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """500 joint vectors in row groups of 100."""
    return write(tmp_path / "q.parquet", table_of(vectors_of(500)))


def test_runs_in_one_folder_leave_each_other_and_foreign_files_alone(data: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / ".notes.unfinished-draft").write_text("mine", encoding="utf-8")
    began: list[int] = []

    def meanwhile(rows: int, _all: int) -> None:
        if rows and not began:
            began.append(rows)
            evaluate(ROBOT, data, out / "b.parquet", "position")

    first = evaluate(ROBOT, data, out / "a.parquet", "position", tell=meanwhile)

    assert first.rows == 500
    assert began
    assert set(contents(out)) == {"a.parquet", "b.parquet", ".notes.unfinished-draft"}
    assert (out / "a.parquet").read_bytes() == (out / "b.parquet").read_bytes()


@pytest.mark.parametrize("option", ["resume", "force"])
def test_a_second_run_on_the_same_output_is_refused(option: str, data: Path, tmp_path: Path) -> None:
    out, errors = tmp_path / "out", list[str]()

    def meanwhile(rows: int, _all: int) -> None:
        if rows == 100:
            with pytest.raises(KinegenError) as caught:
                evaluate(ROBOT, data, out, "position", part_rows=100, **{option: True})  # type: ignore[arg-type]
            errors.append(str(caught.value))

    found = evaluate(ROBOT, data, out, "position", part_rows=100, tell=meanwhile)

    assert (found.rows, found.written) == (500, 5)
    holder = f"another run (process {os.getpid()} on {socket.gethostname()})"
    assert errors == [f"{out / LOCK}: {holder} writes here; wait until it has ended"]
    assert not (out / LOCK).exists()
    with alone(tmp_path, "one.parquet"), pytest.raises(KinegenError, match=r"another run .* writes here"):
        evaluate(ROBOT, data, tmp_path / "one.parquet", "position")


def test_what_a_killed_run_left_is_removed_and_nothing_else(data: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    evaluate(ROBOT, data, out, "position", part_rows=100)
    whole = contents(out)
    holder = {"token": "0123456789abcdef", "pid": 1, "host": socket.gethostname()}
    (out / LOCK).write_text(json.dumps(holder), encoding="utf-8")
    left, other = unfinished(out / "part-00001.parquet", holder["token"]), out / ".part-00001.unfinished-1-2"
    for path in (left, other):
        path.write_bytes(b"half")
    (out / "part-00001.parquet").unlink()

    assert evaluate(ROBOT, data, out, "position", part_rows=100, resume=True).written == 1
    assert contents(out) == whole | {other.name: b"half"}


def test_files_of_the_user_with_the_names_of_a_run_are_kept(data: Path, tmp_path: Path) -> None:
    out, mine = tmp_path / "out", tmp_path / "mine.txt"
    out.mkdir()
    mine.write_text("mine", encoding="utf-8")
    for put in (lambda lock: lock.symlink_to(mine), lambda lock: lock.symlink_to("nowhere"), os.mkfifo, Path.mkdir):
        put(out / LOCK)
        with pytest.raises(KinegenError, match=f"{LOCK}: this is not what a run writes; move it away"):
            evaluate(ROBOT, data, out, "position")
        (out / LOCK).rmdir() if (out / LOCK).is_dir() else (out / LOCK).unlink()
    for name in (LOCK, ".kinegen-parts"):
        (out / name).write_text("mine", encoding="utf-8")
        with pytest.raises(KinegenError, match=r"this is not what a run writes|this folder has other files in it"):
            evaluate(ROBOT, data, out, "position")
        assert contents(out) == {name: b"mine"}
        (out / name).unlink()

    assert mine.read_text(encoding="utf-8") == "mine"


def test_a_file_system_without_locks_goes_by_process_and_host(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(_handle: int, _how: int) -> None:
        raise OSError(95, "Operation not supported")

    monkeypatch.setattr("fcntl.flock", refuse)
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    for holder, is_free in (
        ({"pid": os.getpid(), "host": socket.gethostname()}, False),
        ({"pid": ended.pid, "host": "elsewhere"}, False),
        ({"pid": ended.pid, "host": socket.gethostname()}, True),
        ({}, True),
    ):
        (tmp_path / LOCK).write_text(json.dumps(holder) if holder else "", encoding="utf-8")
        if is_free:
            with alone(tmp_path) as token:
                assert json.loads((tmp_path / LOCK).read_text(encoding="utf-8"))["token"] == token
            continue
        with pytest.raises(KinegenError, match="or remove this file if it has"), alone(tmp_path):
            pass


def test_a_part_is_kept_only_while_it_is_what_was_written(data: Path, tmp_path: Path) -> None:
    """As after a power cut: the name is there, and the content is not; and as after a kill before the record."""
    out = tmp_path / "out"
    evaluate(ROBOT, data, out, "position", part_rows=100)
    whole = contents(out)
    manifest = json.loads(whole[NAME])
    assert manifest["complete"]["part-00000.parquet"]["rows"] == 100
    assert manifest["complete"]["part-00000.parquet"]["bytes"] == len(whole["part-00000.parquet"])

    (out / "part-00000.parquet").write_bytes(b"")
    flipped = bytearray(whole["part-00001.parquet"])
    flipped[200] ^= 1
    (out / "part-00001.parquet").write_bytes(flipped)
    manifest["complete"]["part-00002.parquet"]["rows"] = 99
    del manifest["complete"]["part-00003.parquet"]
    (out / NAME).write_text(json.dumps(manifest), encoding="utf-8")
    found = evaluate(ROBOT, data, out, "position", part_rows=100, resume=True)

    assert (found.kept, found.written, found.damaged) == (1, 4, 2)
    assert contents(out) == whole


def test_a_killed_run_is_resumed_from_its_journal(data: Path, tmp_path: Path) -> None:
    evaluate(ROBOT, data, tmp_path / "whole", "position", part_rows=100)
    out = tmp_path / "out"
    script = (
        "import os, sys\n"
        "from kinegen.tools.datasets import evaluate\n"
        "tell = lambda rows, _: os._exit(9) if rows >= 300 else None\n"
        f"evaluate({str(ROBOT)!r}, {str(data)!r}, {str(out)!r}, 'position', part_rows=100, tell=tell)\n"
    )
    ended = subprocess.run([sys.executable, "-c", script], cwd=ROOT, check=False)
    there = set(contents(out))
    found = evaluate(ROBOT, data, out, "position", part_rows=100, resume=True)

    assert ended.returncode == 9
    assert {LOCK, ".kinegen-parts", NAME} < there
    assert any(".unfinished-" in name for name in there)
    assert (found.kept, found.written) == (2, 3)
    assert contents(out) == contents(tmp_path / "whole")


def test_files_are_on_the_disk_before_they_get_their_names(
    data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps, sync, rename = list[tuple[str, str]](), os.fsync, Path.replace

    def noted_sync(handle: int) -> None:
        steps.append(("sync", str(Path(f"/proc/self/fd/{handle}").readlink())))
        sync(handle)

    def noted_rename(path: Path, target: Any) -> Any:
        steps.append(("rename", str(path)))
        return rename(path, target)

    monkeypatch.setattr(os, "fsync", noted_sync)
    monkeypatch.setattr(Path, "replace", noted_rename)
    for name in ("a.parquet", "a.zarr"):
        steps.clear()
        evaluate(ROBOT, data, tmp_path / name, "position")
        place = next(i for i, (step, path) in enumerate(steps) if step == "rename" and Path(path).parent == tmp_path)
        draft = steps[place][1]
        assert ("sync", draft) in steps[:place]
        assert ("sync", str(tmp_path)) in steps[place:]
        inside = [path for step, path in steps[:place] if step == "sync" and path.startswith(f"{draft}/")]
        assert bool(inside) == name.endswith("zarr")


def test_a_worker_that_is_slower_than_its_run_replaces_nothing(tmp_path: Path) -> None:
    path, schema = tmp_path / "part.parquet", pa.schema([("x", pa.float64())])
    path.write_bytes(b"of the next run")
    with alone(tmp_path) as token:
        pass
    with pytest.raises(KinegenError, match="its run has ended"), writing(path, "parquet", schema, "none", token):
        pass

    assert contents(tmp_path) == {path.name: b"of the next run"}


def test_another_way_of_compiling_is_noticed(data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = kinegen.compile(ROBOT, "position", real="double")
    ways = {way_of(module, reproducible=True), way_of(module, reproducible=False)}
    plain = ModuleType("plain")
    plain.backend = "numpy"  # type: ignore[attr-defined]
    ways |= {way_of(plain, reproducible=True)}
    monkeypatch.setattr("kinegen.tools.datasets.cluster.processor", lambda: module)
    monkeypatch.setattr(module, "describe", lambda: "another one", raising=False)
    assert len(ways | {way_of(module, reproducible=False)}) == 4
    assert way_of(module, reproducible=True) in ways
    monkeypatch.undo()

    evaluate(ROBOT, data, tmp_path / "out", "position", part_rows=100)
    (tmp_path / "out" / "part-00002.parquet").unlink()
    with pytest.raises(KinegenError, match="the results here are of another run, whose way of compiling differs"):
        # Refused before the scheduler is asked for.
        evaluate(ROBOT, data, tmp_path / "out", "position", part_rows=100, resume=True, scheduler="tcp://127.0.0.1:9")


def test_workers_leave_nothing_behind_and_take_no_port(
    data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = tmp_path / "tmp"
    place.mkdir()
    monkeypatch.setenv("TMPDIR", str(place))
    with socket.socket() as taken:
        # The usual port of a dashboard is in use; a warning would be an error here.
        try:
            taken.bind(("127.0.0.1", 8787))
            taken.listen()
        except OSError:
            pass
        found = evaluate(ROBOT, data, tmp_path / "out", "position", part_rows=100, workers=2)
    evaluate(ROBOT, data, tmp_path / "one", "position", part_rows=100)

    assert found.rows == 500
    assert contents(tmp_path / "out") == contents(tmp_path / "one")
    assert not [path for path in place.rglob("kinegen-shipped-*") if path.exists()]


def test_ctrl_c_with_workers_is_two_lines(tmp_path: Path) -> None:
    data = write(tmp_path / "q.parquet", table_of(vectors_of(60_000)), 20)
    command = ["eval", str(ROBOT), str(data), "-o", "out", "--outputs", "position", "--part-rows", "20"]
    kinegen.compile(ROBOT, "position", real="double")
    run = subprocess.Popen(
        [sys.executable, "-m", "kinegen", *command, "--workers", "2"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    end = time.monotonic() + 60
    while not list((tmp_path / "out").glob("part-*")) and time.monotonic() < end:
        time.sleep(0.05)
    os.killpg(run.pid, signal.SIGINT)  # as a terminal sends it: to the workers too
    _, errors = run.communicate(timeout=60)

    assert run.returncode == 130
    assert [line.partition(";")[0] for line in errors.splitlines()] == ["stopped", "interrupted"]
    assert not list((tmp_path / "out").glob(".*"))


def test_a_folder_is_looked_at_before_anything_is_compiled(
    data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def never(*_: object, **__: object) -> None:
        raise AssertionError("this compiles")

    monkeypatch.setattr("kinegen.tools.datasets.run.compiled", never)
    monkeypatch.chdir(tmp_path)
    other = tmp_path / "full"
    other.mkdir()
    (other / "mine.txt").write_text("mine", encoding="utf-8")
    (tmp_path / "begun").mkdir()
    (tmp_path / "begun" / NAME).write_text('{"parts": [], "about": {}, "input": []}', encoding="utf-8")
    np.savez(tmp_path / "old.npz", q=1)
    for arguments, words in (
        (["-o", "full"], "this folder has other files in it"),
        (["-o", "begun"], "a run began here; go on with --resume"),
        (["-o", "old.npz"], "the file exists; choose another name, or overwrite it with --force"),
        (["-o", "z.csv"], "files called .csv are not written (expected .parquet"),
        (["-o", "z.csv.gz"], "files called .gz are not written (expected .parquet"),
        (["-o", "z.parqet"], "files called .parqet are not written (did you mean .parquet?"),
        (["-o", "new", "--columns", "a,b,c"], "there is no column 'a' (there are 'joint_1'"),
        (["-o", "new", "--drop", "time"], "--drop: there is no column 'time'"),
        (["-o", "new", "--outputs", "pose,inverse"], "there is no column for base_T_tool"),
        (["-o", "new", "--memory", "63MB"], "expected at least 64 MB"),
    ):
        assert main(["eval", str(ROBOT), str(data), *arguments]) == 1
        errors = capsys.readouterr().err
        assert words in errors
        assert errors.count("\n") == 1
    with pytest.raises(AssertionError, match="this compiles"):
        main(["eval", str(ROBOT), str(data), "-o", "run.2024", "--memory", "64MB"])
