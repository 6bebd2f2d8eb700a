"""What kinds of files hold: exactly what was given, or a refusal that names the column."""

from __future__ import annotations

import datetime as dt
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.feather
import pyarrow.parquet
import pytest

import kinegen
from kinegen.errors import KinegenError
from kinegen.tools.datasets import evaluate
from tests.fleet.data import ROBOT, table_of, vectors_of, write

pytestmark = pytest.mark.usefixtures("machine")

BIG = 2**53 + 1
"""A whole number that no float64 is."""

ARRAYS = ("npz", "zarr")


def read(path: Path) -> dict[str, Any]:
    """The arrays of a file or a store."""
    if path.suffix == ".npz":
        with np.load(path, allow_pickle=False) as arrays:
            return {name: arrays[name] for name in arrays.files}
    zarr = pytest.importorskip("zarr", reason="needs zarr (pip install 'kinegen[fleet]')")
    return {name: array[:] for name, array in zarr.open(path, mode="r").arrays()}


def given(folder: Path, **columns: Any) -> Path:
    """Four joint vectors with other columns."""
    return write(folder / "q.parquet", table_of(vectors_of(4), **columns), 2)


def test_folders_of_an_output_are_made_and_a_run_that_is_refused_leaves_none(tmp_path: Path) -> None:
    data = given(tmp_path)
    with pytest.raises(KinegenError, match="there is no column 'q=missing'"):
        evaluate(ROBOT, data, tmp_path / "a" / "b" / "out.npz", "position", columns=["q=missing"])
    assert not (tmp_path / "a").exists()
    evaluate(ROBOT, data, tmp_path / "a" / "b" / "out.npz", "position")

    assert read(tmp_path / "a" / "b" / "out.npz")["position"].shape == (4, 3)
    with pytest.raises(KinegenError, match=r"a file, not a folder|[Nn]ot a directory|cannot be written"):
        evaluate(ROBOT, data, data / "below" / "out.npz", "position")


@pytest.mark.parametrize("kind", ARRAYS)
@pytest.mark.parametrize(
    ("column", "words"),
    [
        (pa.array([1, 2, None, BIG]), "has integers with nulls"),
        (pa.array([True, False, None, True]), "has Booleans with nulls"),
        (pa.array([[1, BIG], None, [3, 4], [5, 6]], pa.list_(pa.int64(), 2)), "has integers with nulls"),
        (pa.array([[1, BIG], [1, None], [3, 4], [5, 6]], pa.list_(pa.int64(), 2)), "has integers with nulls"),
        (pa.array(["a", "b", "c", "d"]), "is of type string"),
        (pa.array(["a", "b", "a", "b"]).dictionary_encode(), "is of type dictionary"),
        (pa.array([[1.0], [], None, [2.0]]), "is of type list"),
        (pa.array([0] * 4, pa.timestamp("us", "UTC")), "is of type timestamp"),
        (pa.array([None] * 4), "is of type null"),
    ],
)
def test_what_an_array_does_not_hold_is_refused(kind: str, column: Any, words: str, tmp_path: Path) -> None:
    data, out = given(tmp_path, extra=column), tmp_path / f"out.{kind}"
    with pytest.raises(KinegenError) as caught:
        evaluate(ROBOT, data, out, "position")

    assert f"column 'extra' {words}" in str(caught.value)
    assert "--drop it" in str(caught.value)
    assert not out.exists()
    evaluate(ROBOT, data, out, "position", drop=["extra"])
    assert read(out)["position"].shape == (4, 3)


@pytest.mark.parametrize("kind", ARRAYS)
def test_small_whole_numbers_with_nulls_are_refused_with_ways_out(kind: str, tmp_path: Path) -> None:
    """A part of a Zarr array is written before the next one is read, so that its type cannot depend on later rows."""
    data, out = given(tmp_path, extra=pa.array([1, None, 3, 4], pa.uint8())), tmp_path / f"out.{kind}"
    if kind == "npz":
        evaluate(ROBOT, data, out, "position")
        assert np.isnan(read(out)["extra"]).tolist() == [False, True, False, False]
        return
    with pytest.raises(KinegenError) as caught:
        evaluate(ROBOT, data, out, "position")

    assert str(caught.value) == (
        "column 'extra' has integers with nulls, which no array of uint8 holds; convert them to floating-point "
        "numbers, write .parquet or .arrow, or --drop it"
    )


@pytest.mark.parametrize("kind", ARRAYS)
def test_nulls_of_floating_point_numbers_are_nan_and_whole_numbers_stay_exact(kind: str, tmp_path: Path) -> None:
    columns = {
        "real": pa.array([1.5, None, 2.5, 3.5]),
        "pair": pa.array([[1.0, 2.0], None, [None, 4.0], [5.0, 6.0]], pa.list_(pa.float64(), 2)),
        "tick": pa.array([1, 2, 3, BIG]),
        "flag": pa.array([True, False, True, True]),
        "bits": pa.array([[True, False]] * 4, pa.list_(pa.bool_(), 2)),
    }
    evaluate(ROBOT, given(tmp_path, **columns), tmp_path / f"out.{kind}", "position")
    found = read(tmp_path / f"out.{kind}")

    nan = np.nan
    np.testing.assert_array_equal(found["real"], [1.5, nan, 2.5, 3.5])
    np.testing.assert_array_equal(found["pair"], [[1, 2], [nan, nan], [nan, 4], [5, 6]])
    assert found["tick"].tolist() == [1, 2, 3, BIG]
    assert found["flag"].tolist() == [True, False, True, True]
    assert found["bits"].tolist() == [[True, False]] * 4


def test_whole_numbers_with_nulls_are_floating_point_numbers_where_that_is_exact(tmp_path: Path) -> None:
    columns = {
        "byte": pa.array([1, None, 255, 0], pa.uint8()),
        "large": pa.array([-(2**53), None, 2**53, 0]),
        "pair": pa.array([[1, 2], None, [3, None], [5, 6]], pa.list_(pa.int32(), 2)),
        "day": pa.array([dt.date(2020, 1, 2), None, None, None]),
        "at": pa.array([1, None, 2, 3], pa.timestamp("us")),
    }
    evaluate(ROBOT, given(tmp_path, **columns), tmp_path / "out.npz", "position")
    found = read(tmp_path / "out.npz")

    nan = np.nan
    np.testing.assert_array_equal(found["byte"], [1, nan, 255, 0])
    np.testing.assert_array_equal(found["large"], [-(2.0**53), nan, 2.0**53, 0])
    np.testing.assert_array_equal(found["pair"], [[1, 2], [nan, nan], [3, nan], [5, 6]])
    assert found["day"][0] == np.datetime64("2020-01-02")
    assert np.isnat(found["day"][1])
    assert found["at"][2] == np.datetime64(2, "us")


@pytest.mark.parametrize("kind", ARRAYS)
@pytest.mark.parametrize("is_flat", [False, True])
def test_rows_without_a_target_have_no_valid_branch_in_arrays(kind: str, is_flat: bool, tmp_path: Path) -> None:
    module = kinegen.compile(ROBOT, "pose,inverse", real="double")
    poses = [None if row == 1 else [*pose] for row, pose in enumerate(module.fk(vectors_of(4))[:, :3].reshape(4, 12))]
    data = write(tmp_path / "T.parquet", pa.table({"base_T_tool": pa.array(poses, pa.list_(pa.float64(), 12))}))
    evaluate(ROBOT, data, tmp_path / f"out.{kind}", "inverse", flat=is_flat, drop=["*"])
    found = read(tmp_path / f"out.{kind}")
    valid = found["inverse_valid_0"] if is_flat else found["inverse_valid"].any(axis=1)
    solutions = found["inverse_solutions_0_0"] if is_flat else found["inverse_solutions"][:, 0]

    assert valid.dtype == bool
    assert valid.tolist() == [True, False, True, True]
    assert np.isnan(solutions).tolist() == [False, True, False, False]


def test_arrays_of_any_name_are_written_and_read_again(tmp_path: Path) -> None:
    data = given(tmp_path, file=pa.array([1, 2, 3, 4]), allow_pickle=pa.array([5, 6, 7, 8]))
    evaluate(ROBOT, data, tmp_path / "out.npz", "pose")
    found = read(tmp_path / "out.npz")
    assert (found["file"].tolist(), found["allow_pickle"].tolist()) == ([1, 2, 3, 4], [5, 6, 7, 8])

    module = kinegen.compile(ROBOT, "pose,inverse", real="double")
    chosen = {"base_T_tool": ["pose"]}
    evaluate(ROBOT, tmp_path / "out.npz", tmp_path / "solved.npz", "inverse", columns=chosen, drop=["pose"])
    _, valid = module.inverse(module.fk(vectors_of(4)))
    np.testing.assert_array_equal(read(tmp_path / "solved.npz")["inverse_valid"], valid)

    with pytest.raises(KinegenError, match="column 'kinegen' has the name of the metadata"):
        evaluate(ROBOT, given(tmp_path, kinegen=pa.array([1, 2, 3, 4])), tmp_path / "other.npz", "pose")
    evaluate(ROBOT, tmp_path / "q.parquet", tmp_path / "other.parquet", "pose")
    assert pyarrow.parquet.read_table(tmp_path / "other.parquet").column("kinegen").to_pylist() == [1, 2, 3, 4]


def test_categories_that_differ_between_files_are_written_to_arrow_and_parquet(tmp_path: Path) -> None:
    folder, words = tmp_path / "in", [["left", "right", None, "left"], ["up", "left", "up", "up"]]
    folder.mkdir()
    for name, column in zip("ab", words, strict=True):
        table = table_of(vectors_of(4), arm=pa.array(column).dictionary_encode())
        write(folder / f"{name}.parquet", table, 2)
    for ending, load in ((".arrow", pyarrow.feather.read_table), (".parquet", pyarrow.parquet.read_table)):
        evaluate(ROBOT, folder, tmp_path / f"out{ending}", "position")
        assert load(tmp_path / f"out{ending}").column("arm").to_pylist() == words[0] + words[1]

    nested = pa.array([["a"], ["b"], [], None]).cast(pa.list_(pa.dictionary(pa.int32(), pa.string())))
    with pytest.raises(KinegenError, match=r"column 'arm' is of type list.*--drop it"):
        evaluate(ROBOT, given(tmp_path, arm=nested), tmp_path / "nested.arrow", "position")
