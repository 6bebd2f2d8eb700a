"""Kernels over data sets: the numbers of the module, whatever the file, the batch or the number of workers."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.dataset
import pyarrow.feather
import pyarrow.parquet
import pytest

import kinegen
from kinegen.errors import KinegenError
from kinegen.tools.datasets import evaluate
from kinegen.tools.datasets.plan import NAME

ROOT = Path(__file__).resolve().parent.parent.parent
ROBOT = ROOT / "robots" / "planar_3r.yaml"
JOINTS = ("joint_1", "joint_2", "joint_3")
OUTPUTS = "pose,position,jacobian"
ROWS = 1003

pytestmark = pytest.mark.usefixtures("machine")


@pytest.fixture
def q() -> Any:
    """Joint vectors, NaN in one of them."""
    found = np.random.default_rng(3).uniform(-3, 3, (ROWS, 3))
    found[17, 1] = np.nan
    return found


@pytest.fixture
def module(machine: None) -> ModuleType:
    """The compiled robot."""
    del machine
    return kinegen.compile(ROBOT, OUTPUTS, real="double")


def table(q: Any) -> Any:
    """Joint vectors in columns with the names of the joints, after another one."""
    return pa.table({"time": pa.array(np.arange(len(q)))} | {name: q[:, i] for i, name in enumerate(JOINTS)})


def write(path: Path, q: Any, rows: int = 200) -> Path:
    """A Parquet file whose row groups have so many rows."""
    pyarrow.parquet.write_table(table(q), path, row_group_size=rows)
    return path


def vectors(column: Any) -> Any:
    """A column of vectors, or numbers, as an array."""
    whole = column.combine_chunks()
    size = whole.type.list_size
    return whole.flatten().to_numpy(zero_copy_only=False).reshape(-1, size)


def test_the_names_of_the_joints_are_those_of_the_file() -> None:
    assert kinegen.load(ROBOT).joints == JOINTS


@pytest.mark.parametrize("kind", ["parquet", "arrow", "csv", "npy", "npz"])
def test_every_kind_of_file_gives_the_numbers_of_the_module(
    kind: str, q: Any, module: ModuleType, tmp_path: Path
) -> None:
    path = tmp_path / f"q.{kind}"
    if kind == "parquet":
        write(path, q)
    elif kind == "arrow":
        pyarrow.feather.write_feather(table(q), path, chunksize=100)
    elif kind == "csv":
        pyarrow.csv.write_csv(table(q), path)
    elif kind == "npy":
        np.save(path, q)
    else:
        np.savez(path, q=q, time=np.arange(ROWS))
    found = evaluate(ROBOT, path, tmp_path / "out.parquet", OUTPUTS)
    written = pyarrow.parquet.read_table(tmp_path / "out.parquet")

    # A text file cannot hold NaN: an empty field is null.
    assert (found.rows, found.written) == (ROWS, 1)
    right = np.arange(ROWS) != 17
    assert written.column("pose").null_count == (1 if kind == "csv" else 0)
    if kind != "csv":
        np.testing.assert_array_equal(vectors(written.column("pose")), module.fk(q)[:, :3].reshape(-1, 12))
    np.testing.assert_array_equal(
        vectors(written.column("jacobian").filter(pa.array(right))), module.jacobian(q[right]).reshape(-1, 18)
    )
    if kind not in ("npy", "npz"):
        assert written.column("time").to_pylist() == list(range(ROWS))


@pytest.mark.parametrize("kind", ["parquet", "arrow", "npz"])
def test_flat_columns_hold_the_same_numbers(kind: str, q: Any, module: ModuleType, tmp_path: Path) -> None:
    data, out = write(tmp_path / "q.parquet", q), tmp_path / f"out.{kind}"
    evaluate(ROBOT, data, out, OUTPUTS, flat=True, drop=["*"])
    if kind == "npz":
        with np.load(out) as arrays:
            found = {name: arrays[name] for name in arrays.files if name != "kinegen"}
    else:
        read = pyarrow.feather.read_table if kind == "arrow" else pyarrow.parquet.read_table
        found = {name: column.to_numpy() for name, column in zip(*_columns(read(out)), strict=True)}

    assert len(found) == 12 + 3 + 18
    np.testing.assert_array_equal(found["pose_1_3"], module.fk(q)[:, 1, 3])
    np.testing.assert_array_equal(found["position_0"], module.position(q)[:, 0])
    np.testing.assert_array_equal(found["jacobian_5_2"], module.jacobian(q)[:, 5, 2])


def _columns(found: Any) -> tuple[list[str], list[Any]]:
    return found.column_names, found.columns


def test_null_stays_null_and_nan_stays_nan(q: Any, tmp_path: Path) -> None:
    given = table(q).set_column(1, "joint_1", pa.array([None, *q[1:, 0]], pa.float64()))
    pyarrow.parquet.write_table(given, tmp_path / "q.parquet")
    lists = pa.FixedSizeListArray.from_arrays(pa.array(q.reshape(-1)), 3, mask=pa.array(np.arange(ROWS) == 0))
    pyarrow.parquet.write_table(pa.table({"q": lists}), tmp_path / "lists.parquet")
    for name, is_flat in (("q", False), ("q", True), ("lists", False), ("lists", True)):
        evaluate(ROBOT, tmp_path / f"{name}.parquet", tmp_path / "out.arrow", "position", flat=is_flat, force=True)
        written = pyarrow.feather.read_table(tmp_path / "out.arrow")
        column = written.column("position_0" if is_flat else "position")

        assert column.is_null().to_pylist() == [True] + [False] * (ROWS - 1)
        numbers = column.to_pylist()
        assert np.isnan(numbers[17] if is_flat else numbers[17][0])
        assert np.isfinite(numbers[16] if is_flat else numbers[16][0])


def test_columns_are_chosen_by_input(q: Any, tmp_path: Path) -> None:
    module = kinegen.compile(ROBOT, "twist", real="double")
    given = pa.table({"a": q[:, 0], "b": q[:, 1], "c": q[:, 2], "v": pa.FixedSizeListArray.from_arrays(q.ravel(), 3)})
    pyarrow.parquet.write_table(given, tmp_path / "q.parquet")
    chosen = {"q": ("a", "b", "c"), "qd": ("v",)}
    evaluate(ROBOT, tmp_path / "q.parquet", tmp_path / "out.parquet", "twist", columns=chosen, drop=["a", "v"])
    written = pyarrow.parquet.read_table(tmp_path / "out.parquet")

    assert written.column_names == ["b", "c", "twist"]
    np.testing.assert_array_equal(vectors(written.column("twist")), module.twist(q, q))


@pytest.mark.parametrize("is_flat", [False, True])
def test_targets_of_the_inverse_are_poses_of_12_or_16_numbers(is_flat: bool, q: Any, tmp_path: Path) -> None:
    module = kinegen.compile(ROBOT, "pose,inverse", real="double")
    poses = module.fk(np.where(np.isnan(q), 0.5, q))
    solutions, valid = module.inverse(poses)
    poses[5, :3, 0] *= 1.1
    poses[6, 0, 0] = np.nan
    for size, rows in ((12, poses[:, :3]), (16, poses)):
        column = pa.FixedSizeListArray.from_arrays(np.ascontiguousarray(rows).reshape(-1), size)
        pyarrow.parquet.write_table(pa.table({"base_T_tool": column}), tmp_path / f"T{size}.parquet")
        evaluate(ROBOT, tmp_path / f"T{size}.parquet", tmp_path / f"{size}.npz", "inverse", flat=is_flat)
        with np.load(tmp_path / f"{size}.npz") as arrays:
            found = arrays["inverse_valid_0" if is_flat else "inverse_valid"].reshape(ROWS, -1)
            angles = arrays["inverse_solutions_0_1" if is_flat else "inverse_solutions"].reshape(ROWS, -1)
        wanted = valid.copy()
        wanted[5:7] = False

        assert valid[5:7].any()
        np.testing.assert_array_equal(found, wanted[:, : found.shape[1]])
        reached = found.astype(bool)[:, 0]
        np.testing.assert_array_equal(angles[reached, 0], solutions[reached, 0, 1 if is_flat else 0])


@pytest.mark.parametrize("real", ["double", "float"])
def test_searches_take_poses_and_starts(real: str, tmp_path: Path) -> None:
    """The numeric inverse: a row for each target, and nothing where there is no pose."""
    module = kinegen.compile(ROBOT, "pose,numeric_inverse", real=real)
    kind = {"double": np.float64, "float": np.float32}[real]
    middle = np.array([(joint.lowest + joint.highest) / 2 for joint in module.numeric_inverse.joints])
    joints = (middle + np.random.default_rng(5).uniform(-0.7, 0.7, (40, 3))).astype(kind)
    poses, starts = module.fk(joints), (joints + 0.05).astype(kind)
    wanted = module.numeric_inverse(poses, starts)
    spoiled = poses.copy()
    spoiled[5, :3, 0] *= 1.1
    spoiled[6, 0, 0] = np.nan
    spoiled[7, 0, 3] = np.inf
    column = pa.FixedSizeListArray.from_arrays(np.ascontiguousarray(spoiled).reshape(-1), 16)
    start = pa.FixedSizeListArray.from_arrays(starts.reshape(-1), 3)
    pyarrow.parquet.write_table(pa.table({"pose": column, "start": start}), tmp_path / "T.parquet")
    chosen = {"base_T_tool": ["pose"]}
    evaluate(ROBOT, tmp_path / "T.parquet", tmp_path / "out.parquet", "numeric_inverse", columns=chosen, real=real)
    written = pyarrow.parquet.read_table(tmp_path / "out.parquet")
    solved, q = np.array(written.column("numeric_inverse_solved")), vectors(written.column("numeric_inverse_q"))

    assert wanted.solved.all()
    assert not solved[5:8].any()
    assert np.isnan(q[5:8]).all()
    rest = np.delete(np.arange(40), [5, 6, 7])
    assert solved[rest].all()
    np.testing.assert_array_equal(q[rest], wanted.q[rest])
    np.testing.assert_array_equal(
        np.array(written.column("numeric_inverse_position_error"))[rest], wanted.position_error[rest]
    )

    evaluate(
        ROBOT, tmp_path / "T.parquet", tmp_path / "flat.npz", "numeric_inverse", columns=chosen, real=real, flat=True
    )
    with np.load(tmp_path / "flat.npz") as arrays:
        np.testing.assert_array_equal(arrays["numeric_inverse_q_2"][rest], wanted.q[rest, 2])


def test_searches_give_the_same_bytes_with_workers_and_little_memory(tmp_path: Path) -> None:
    """Random descents begin by the number of a row in its batch, so batches must not depend on how a run is made."""
    module = kinegen.compile(ROBOT, "pose", real="double")
    far = module.fk(np.random.default_rng(8).uniform(-3, 3, (9000, 3)))[:, :3].reshape(-1, 12)
    column = pa.FixedSizeListArray.from_arrays(np.ascontiguousarray(far).reshape(-1), 12)
    pyarrow.parquet.write_table(pa.table({"base_T_tool": column}), tmp_path / "T.parquet", row_group_size=4500)
    evaluate(ROBOT, tmp_path / "T.parquet", tmp_path / "one", "numeric_inverse", part_rows=4500)
    how = {"memory": 64 << 20, "workers": 2, "part_rows": 4500}
    evaluate(ROBOT, tmp_path / "T.parquet", tmp_path / "two", "numeric_inverse", **how)
    written = pyarrow.dataset.dataset(tmp_path / "one", exclude_invalid_files=True).to_table()

    assert contents(tmp_path / "two") == contents(tmp_path / "one")
    assert np.array(written.column("numeric_inverse_solved")).all()


@pytest.mark.long
def test_all_solutions_of_an_arm_without_a_closed_form(tmp_path: Path) -> None:
    arm = ROOT / "robots" / "jaco2.yaml"
    module = kinegen.compile(arm, "pose,complete_inverse", real="double")
    poses = module.fk(np.random.default_rng(2).uniform(0.6, 3, (12, 6)))
    wanted = module.complete_inverse(poses)
    poses[3, 0, 0] = np.nan
    column = pa.FixedSizeListArray.from_arrays(np.ascontiguousarray(poses[:, :3]).reshape(-1), 12)
    pyarrow.parquet.write_table(pa.table({"base_T_tool": column}), tmp_path / "T.parquet")
    evaluate(arm, tmp_path / "T.parquet", tmp_path / "out.parquet", "complete_inverse")
    written = pyarrow.parquet.read_table(tmp_path / "out.parquet")
    valid = vectors(written.column("complete_inverse_valid"))
    solutions = vectors(written.column("complete_inverse_solutions")).reshape(12, 16, 6)

    assert not valid[3].any()
    rest = np.delete(np.arange(12), 3)
    assert wanted.valid[rest].any()
    np.testing.assert_array_equal(valid[rest], wanted.valid[rest])
    np.testing.assert_array_equal(solutions[rest], wanted.solutions[rest])


def test_the_size_of_a_batch_does_not_matter(q: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    data = write(tmp_path / "q.parquet", q)
    for rows in (7, 256, 100_000):
        monkeypatch.setattr("kinegen.tools.datasets.run.MOST_ROWS", rows)
        monkeypatch.setattr("kinegen.tools.datasets.run.LEAST_ROWS", rows)
        evaluate(ROBOT, data, tmp_path / f"{rows}.parquet", OUTPUTS)
    read = [pyarrow.parquet.read_table(tmp_path / f"{rows}.parquet").drop(["joint_2"]) for rows in (7, 256, 100_000)]

    assert pyarrow.parquet.ParquetFile(tmp_path / "7.parquet").num_row_groups > ROWS / 8
    for other in read[1:]:
        for name in other.column_names:
            left, right = read[0].column(name).combine_chunks(), other.column(name).combine_chunks()
            assert left.buffers()[-1].equals(right.buffers()[-1])


def test_the_metadata_says_what_the_numbers_are(q: Any, tmp_path: Path) -> None:
    evaluate(ROBOT, write(tmp_path / "q.parquet", q), tmp_path / "out.parquet", "pose", real="float")
    schema = pyarrow.parquet.read_schema(tmp_path / "out.parquet")
    about = json.loads(schema.metadata[b"kinegen"])

    assert about["robot"] == "planar_3r"
    assert about["joints"] == list(JOINTS)
    assert (about["angle"], about["length"], len(about["model"])) == ("rad", "m", 16)
    assert schema.field("pose").metadata[b"shape"] == b"[3, 4]"
    assert schema.field("pose").type == pa.list_(pa.float32(), 12)


def test_an_empty_file_gives_an_empty_one(tmp_path: Path) -> None:
    data = write(tmp_path / "q.parquet", np.empty((0, 3)))
    found = evaluate(ROBOT, data, tmp_path / "out.parquet", OUTPUTS)

    assert found.rows == 0
    assert pyarrow.parquet.read_table(tmp_path / "out.parquet").num_rows == 0
    assert evaluate(ROBOT, data, tmp_path / "folder", OUTPUTS).rows == 0
    assert "pose" in pyarrow.parquet.read_table(tmp_path / "folder").column_names


def test_a_folder_is_read_in_the_order_of_its_names(q: Any, module: ModuleType, tmp_path: Path) -> None:
    for place in (2, 0, 1):
        (tmp_path / "in" / f"run={place}").mkdir(parents=True)
        write(tmp_path / "in" / f"run={place}" / "q.parquet", q[place * 300 : (place + 1) * 300])
    (tmp_path / "in" / "_about.parquet").write_bytes(b"not data")
    evaluate(ROBOT, tmp_path / "in", tmp_path / "out.npz", "pose")
    evaluate(ROBOT, str(tmp_path / "in" / "run=*" / "*.parquet"), tmp_path / "again.npz", "pose")

    assert (tmp_path / "out.npz").read_bytes() == (tmp_path / "again.npz").read_bytes()
    with np.load(tmp_path / "out.npz") as arrays:
        np.testing.assert_array_equal(arrays["pose"], module.fk(q[:900])[:, :3].reshape(-1, 12))


def partitioned(folder: Path, q: Any, names: tuple[str, ...]) -> Path:
    """A data set of a hundred rows for each name of folders."""
    for place, name in enumerate(names):
        (folder / name).mkdir(parents=True)
        write(folder / name / "part-0.parquet", q[place * 100 : (place + 1) * 100])
    return folder


def test_names_of_folders_are_columns(q: Any, tmp_path: Path) -> None:
    """As pyarrow's own reader of such data sets has them, with the values behind the file's columns."""
    names = ("arm=left/day=3", "arm=left/day=12", "arm=right%2Fup/day=__HIVE_DEFAULT_PARTITION__")
    data = partitioned(tmp_path / "in", q, names)
    evaluate(ROBOT, data, tmp_path / "out.parquet", "position")
    evaluate(ROBOT, data, tmp_path / "other.parquet", "position", drop=["arm"])
    found = pyarrow.parquet.read_table(tmp_path / "out.parquet").sort_by("time")
    wanted = pyarrow.dataset.dataset(data, partitioning="hive").to_table().sort_by("time")

    assert found.column_names == [*wanted.column_names, "position"]
    assert found.column("day").to_pylist() == wanted.column("day").to_pylist()
    assert found.column("arm").to_pylist() == wanted.column("arm").to_pylist()
    assert found.column("day").type == pa.int64()
    assert "arm" not in pyarrow.parquet.read_table(tmp_path / "other.parquet").column_names
    one = tmp_path / "one.parquet"
    evaluate(ROBOT, data / names[0] / "part-0.parquet", one, "position")
    assert "arm" not in pyarrow.parquet.read_table(one).column_names


def test_a_run_over_named_folders_is_resumed(q: Any, tmp_path: Path) -> None:
    data, out = partitioned(tmp_path / "in", q, ("arm=left", "arm=right")), tmp_path / "out"
    evaluate(ROBOT, data, out, "position")
    whole = contents(out)
    (out / "part-00001.parquet").unlink()

    assert evaluate(ROBOT, data, out, "position", resume=True).written == 1
    assert contents(out) == whole


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (("arm=left", "leg=right"), "its folders name other columns than those of the first file ('arm')"),
        (("arm=left", "right"), "its folders name other columns than those of the first file ('arm')"),
        (("time=1", "time=2"), "its folders name a column 'time', which the file has too"),
    ],
)
def test_folders_that_do_not_fit_are_one_line(names: tuple[str, ...], message: str, q: Any, tmp_path: Path) -> None:
    data = partitioned(tmp_path / "in", q, names)

    with pytest.raises(KinegenError) as caught:
        evaluate(ROBOT, data, tmp_path / "out.parquet", "position")
    assert message in str(caught.value)
    assert not (tmp_path / "out.parquet").exists()


def test_the_search_of_a_tree_is_refused_before_anything_is_compiled(q: Any, tmp_path: Path) -> None:
    write(tmp_path / "q.parquet", q)
    with pytest.raises(
        KinegenError, match="numeric_inverse of hand takes a target for each of its 5 tips, which files"
    ):
        evaluate(ROOT / "robots" / "hand.yaml", tmp_path / "q.parquet", tmp_path / "out.parquet", "numeric_inverse")


def test_a_run_goes_on_where_it_stopped(q: Any, tmp_path: Path) -> None:
    data, whole, cut = write(tmp_path / "q.parquet", q), tmp_path / "whole", tmp_path / "cut"
    evaluate(ROBOT, data, whole, OUTPUTS, part_rows=200)
    done = 0

    def stop(rows: int, _all: int) -> None:
        nonlocal done
        done = rows
        if rows >= 600:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        evaluate(ROBOT, data, cut, OUTPUTS, part_rows=200, tell=stop)
    there = sorted(path.name for path in cut.iterdir())
    with pytest.raises(KinegenError, match="go on with --resume"):
        evaluate(ROBOT, data, cut, OUTPUTS, part_rows=200)
    found = evaluate(ROBOT, data, cut, OUTPUTS, part_rows=200, resume=True)

    assert there == [NAME, "part-00000.parquet", "part-00001.parquet"]
    assert (found.kept, found.written, found.rows) == (2, 4, ROWS - 400)
    assert contents(cut) == contents(whole)
    assert evaluate(ROBOT, data, cut, OUTPUTS, part_rows=200, resume=True).written == 0


def contents(folder: Path) -> dict[str, bytes]:
    """The files of a folder."""
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_what_changed_since_a_run_is_noticed(q: Any, tmp_path: Path) -> None:
    data, out = write(tmp_path / "q.parquet", q), tmp_path / "out"
    evaluate(ROBOT, data, out, OUTPUTS)
    other = tmp_path / "other.yaml"
    other.write_text(ROBOT.read_text(encoding="utf-8").replace("L2: 0.3", "L2: 0.35"), encoding="utf-8")

    with pytest.raises(KinegenError, match="whose model differs"):
        evaluate(other, data, out, OUTPUTS, resume=True)
    with pytest.raises(KinegenError, match="whose outputs differs"):
        evaluate(ROBOT, data, out, "pose", resume=True)
    write(data, q + 1)
    with pytest.raises(KinegenError, match="has changed since the run"):
        evaluate(ROBOT, data, out, OUTPUTS, resume=True)
    before = contents(out)
    assert evaluate(ROBOT, data, out, OUTPUTS, force=True).rows == ROWS
    assert contents(out) != before


def test_workers_write_the_same_bytes(q: Any, tmp_path: Path) -> None:
    data = write(tmp_path / "q.parquet", q)
    evaluate(ROBOT, data, tmp_path / "one", OUTPUTS, part_rows=200)
    found = evaluate(ROBOT, data, tmp_path / "two", OUTPUTS, part_rows=200, workers=2)

    assert (found.rows, found.written) == (ROWS, 6)
    assert contents(tmp_path / "two") == contents(tmp_path / "one")


def test_zarr_stores_come_in_and_go_out(q: Any, module: ModuleType, tmp_path: Path) -> None:
    """A group and a single array; a folder of stores that is resumed; what is not of numbers."""
    zarr = pytest.importorskip("zarr", reason="needs zarr (pip install 'kinegen[fleet]')")
    group = zarr.open_group(tmp_path / "q.zarr", mode="w")
    for name, values in {"q": q, "time": np.arange(ROWS)}.items():
        group.create_array(name, data=values)
    zarr.save_array(tmp_path / "alone.zarr", q)
    evaluate(ROBOT, tmp_path / "alone.zarr", tmp_path / "out.zarr", "pose")
    found = evaluate(ROBOT, tmp_path / "q.zarr", tmp_path / "out", OUTPUTS, format="zarr", part_rows=400)

    wanted = module.fk(q)[:, :3].reshape(-1, 12)
    np.testing.assert_array_equal(zarr.open(tmp_path / "out.zarr", mode="r")["pose"][:], wanted)
    stores = [zarr.open(tmp_path / "out" / f"part-0000{place}.zarr", mode="r") for place in range(3)]
    assert (found.rows, found.written, stores[2]["pose"].shape) == (ROWS, 3, (ROWS - 800, 12))
    np.testing.assert_array_equal(np.concatenate([store["pose"][:] for store in stores]), wanted)
    assert np.concatenate([store["time"][:] for store in stores]).tolist() == list(range(ROWS))
    assert json.loads(stores[0].attrs["kinegen"])["robot"] == "planar_3r"

    shutil.rmtree(tmp_path / "out" / "part-00001.zarr")
    again = evaluate(ROBOT, tmp_path / "q.zarr", tmp_path / "out", OUTPUTS, format="zarr", part_rows=400, resume=True)
    assert (again.rows, again.written, again.kept) == (400, 1, 2)
    over = evaluate(ROBOT, tmp_path / "q.zarr", tmp_path / "out", "pose", format="zarr", part_rows=2000, force=True)
    assert over.written == 1
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [NAME, "part-00000.zarr"]

    named = table(q).append_column("arm", pa.array(["left"] * ROWS))
    pyarrow.parquet.write_table(named, tmp_path / "named.parquet")
    with pytest.raises(KinegenError, match="column 'arm' is of type string; Zarr takes numbers"):
        evaluate(ROBOT, tmp_path / "named.parquet", tmp_path / "named.zarr", "pose")
    group.create_array("short", data=q[:5])
    with pytest.raises(KinegenError, match="its arrays do not have the same number of rows"):
        evaluate(ROBOT, tmp_path / "q.zarr", tmp_path / "other.zarr", "pose")
    assert not list(tmp_path.glob("*named.zarr*"))
    assert not list(tmp_path.glob(".*"))
