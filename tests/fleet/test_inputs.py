"""What data comes in as: types that change along a file, byte orders, names that occur twice, files without rows."""

from __future__ import annotations

import bz2
import gzip
import re
from decimal import Decimal
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.feather
import pyarrow.parquet
import pytest

import kinegen
from kinegen.errors import KinegenError
from kinegen.model.outputs import parse_quantity
from kinegen.model.robot import Units
from kinegen.tools.datasets import evaluate
from kinegen.tools.datasets.binding import Binding, bind, in_kernel_units
from kinegen.ui.cli import main
from tests.fleet.data import JOINTS, ROBOT, ROOT, table_of, vectors_of, write

pytestmark = pytest.mark.usefixtures("machine")

STILL = 200_000
"""Rows of whole numbers that fill more than the block from which types are taken."""


def positions(q: Any) -> Any:
    """What the module gives, shape (rows, 3)."""
    return kinegen.compile(ROBOT, "position", real="double").position(np.asarray(q, float))


def found(data: Path | str, **options: Any) -> Any:
    """What eval gives for data, a `pyarrow.Table`."""
    base = data.parent if isinstance(data, Path) else Path(data).parent
    evaluate(ROBOT, data, base / "found.parquet", "position", force=True, **options)
    return pyarrow.parquet.read_table(base / "found.parquet")


def rows_of(table: Any) -> Any:
    """The positions of a table, shape (rows, 3)."""
    return table.column("position").combine_chunks().flatten().to_numpy().reshape(-1, 3)


def csv(path: Path, lines: list[str], head: str = ",".join(JOINTS)) -> Path:
    """A text file."""
    path.write_text("\n".join([head, *lines]) + "\n", encoding="utf-8")
    return path


def test_a_robot_that_stands_still_for_a_while_is_read(tmp_path: Path) -> None:
    lines = ["0,0,0,7,,1"] * STILL + ["0.5,-0.25,1e-3,2.5,x,9007199254740993"]
    data = csv(tmp_path / "still.csv", lines, ",".join((*JOINTS, "speed", "word", "tick")))
    table = found(data)

    right = positions([[0, 0, 0], [0.5, -0.25, 1e-3]])
    np.testing.assert_array_equal(rows_of(table)[[0, -1]], right)
    assert [table.column(name)[-1].as_py() for name in ("joint_2", "speed", "word")] == [-0.25, 2.5, "x"]
    assert [table.column(name)[0].as_py() for name in ("speed", "word")] == [7.0, ""]
    assert table.column("tick")[-1].as_py() == 9007199254740993


LATE = {
    "decimal comma": "0,5;-0,25;1e-3",
    "minus": "0,5;\u22120,25;1e-3",
    "comment": "# by hand\n0,5;-0,25;1e-3",
    "blanks": "  \n0,5;-0,25;1e-3\n ",
    "decimal point": "0.5;\u22120.25;1e-3",
}
"""What is not plain, behind a block of whole numbers."""


@pytest.mark.parametrize("name", LATE)
def test_what_is_first_behind_the_first_block_is_read(name: str, tmp_path: Path) -> None:
    data = csv(tmp_path / "still.csv", ["0;0;0"] * STILL + [LATE[name]], ";".join(JOINTS))
    table = found(data)

    np.testing.assert_array_equal(rows_of(table)[[0, -1]], positions([[0, 0, 0], [0.5, -0.25, 1e-3]]))
    assert table.num_rows == STILL + 1


@pytest.mark.parametrize("rows", [3, STILL])
def test_lines_that_end_in_cr_alone_are_read_with_comments(rows: int, tmp_path: Path) -> None:
    data = tmp_path / "mac.csv"
    lines = ["# of an old program", ";".join(JOINTS), *["0;0;0"] * rows, "# by hand", LATE["minus"]]
    data.write_bytes("\r".join([*lines, ""]).encode())
    table = found(data)

    np.testing.assert_array_equal(rows_of(table)[[0, -1]], positions([[0, 0, 0], [0.5, -0.25, 1e-3]]))
    assert table.num_rows == rows + 1
    data.write_bytes("\r".join([*lines, "0;0;wrist"]).encode())
    with pytest.raises(KinegenError, match=rf"mac\.csv:{rows + 5}: 'wrist' in column 'joint_3' is not a number"):
        found(data)


BAD_CELLS = {
    "0,5;0;0\n0;1.5;0": r"data\.csv:3: '1\.5' in column 'joint_2' has a decimal point; .* a decimal comma",
    "0.5;0;0\n" * STILL + "0;0;1,5": r":200002: '1,5' in column 'joint_3' has a decimal comma; .* have a decimal point",
    "0.5;0;0\n0;0;0;": r"data\.csv:3: 4 cells, but the header has 3",
    "0.5;0;0\n" * STILL + "0;0": r"data\.csv:200002: 2 cells, but the header has 3",
    "0.5;0;0\n1_0;0;0": r"data\.csv:3: '1_0' in column 'joint_1' is not a number",
    "0.5;0;0\n0;\uff11;0": r"data\.csv:3: '\uff11' in column 'joint_2' is not a number",
}


@pytest.mark.parametrize("text", BAD_CELLS, ids=["point", "comma", "long row", "short row", "underscore", "digit"])
def test_a_cell_that_does_not_fit_is_named_with_its_line(text: str, tmp_path: Path) -> None:
    with pytest.raises(KinegenError, match=BAD_CELLS[text]):
        found(csv(tmp_path / "data.csv", [text], ";".join(JOINTS)))


def test_whole_numbers_in_one_text_file_and_others_in_the_next_are_one_data_set(tmp_path: Path) -> None:
    folder = tmp_path / "days"
    folder.mkdir()
    csv(folder / "a.csv", ["0,0,0,1,1"], ",".join((*JOINTS, "n", "word")))
    csv(folder / "b.csv", ["0.1,0.2,0.3,2.5,x"], ",".join((*JOINTS, "n", "word")))
    csv(folder / "c.csv", [], ",".join((*JOINTS, "n", "word")))
    for options in ({}, {"drop": ["*"]}):
        table = found(folder, **options)
        np.testing.assert_array_equal(rows_of(table), positions([[0, 0, 0], [0.1, 0.2, 0.3]]))
    evaluate(ROBOT, folder, tmp_path / "all.parquet", "position")
    table = pyarrow.parquet.read_table(tmp_path / "all.parquet")
    assert (table.column("n").to_pylist(), table.column("word").to_pylist()) == ([1.0, 2.5], ["1", "x"])

    csv(folder / "d.csv", ["1,2,3"])
    with pytest.raises(KinegenError, match=r"d\.csv: its columns are not those of"):
        evaluate(ROBOT, folder, tmp_path / "all.parquet", "position", force=True)


def test_packed_text_semicolons_and_decimal_commas_are_read(tmp_path: Path) -> None:
    q = np.round(vectors_of(300), 3)
    plain = csv(tmp_path / "q.csv", [",".join(map(str, row)) for row in q])
    (tmp_path / "q.csv.gz").write_bytes(gzip.compress(plain.read_bytes()))
    (tmp_path / "q.CSV.bz2").write_bytes(bz2.compress(plain.read_bytes()))
    semicolons = csv(tmp_path / "s.csv", [";".join(map(str, row)) for row in q], "\ufeff" + ";".join(JOINTS))
    commas = [";".join(["0", *map(str, row)]).replace(".", ",") for row in q]
    german = csv(tmp_path / "g.csv", commas, ";".join(("Zeit", *JOINTS)))
    tabs = csv(tmp_path / "t.csv", ["\t".join(map(str, row)) for row in q], "\t".join(JOINTS))
    numbered = csv(tmp_path / "n.csv", [",".join(map(str, row)) for row in q], "q1,q2,q3")

    for data in (plain, tmp_path / "q.csv.gz", tmp_path / "q.CSV.bz2", semicolons, german, tabs, numbered):
        np.testing.assert_array_equal(rows_of(found(data)), positions(q))


def test_a_text_file_without_rows_gives_none(tmp_path: Path) -> None:
    assert found(csv(tmp_path / "head.csv", [])).num_rows == 0
    assert found(csv(tmp_path / "void.csv", [",,"] * 3)).column("position").null_count == 3


@pytest.mark.parametrize("kind", [">f8", ">f4", ">i2", "<f8"])
def test_arrays_of_any_byte_order_are_read(kind: str, tmp_path: Path) -> None:
    zarr = pytest.importorskip("zarr", reason="needs zarr (pip install 'kinegen[fleet]')")
    q = vectors_of(50).astype(kind)
    np.save(tmp_path / "q.npy", q)
    np.savez(tmp_path / "q.npz", q=q, about=np.array("words"), count=np.array(3))
    zarr.save_array(tmp_path / "q.zarr", q, zarr_format=2)

    for name in ("q.npy", "q.npz", "q.zarr"):
        table = found(tmp_path / name)
        assert table.column_names == ["q", "position"]
        np.testing.assert_array_equal(rows_of(table), positions(q))


def test_numbers_that_no_column_holds_are_one_line(tmp_path: Path) -> None:
    q = vectors_of(5)
    np.save(tmp_path / "long.npy", q.astype(np.longdouble))
    np.savez(tmp_path / "long.npz", q=q, more=q.astype(np.longdouble))
    np.savez(tmp_path / "complex.npz", q=q, more=q.astype(complex))
    (tmp_path / "cut.npz").write_bytes((tmp_path / "long.npz").read_bytes()[:200])
    (tmp_path / "empty.csv").write_bytes(b"")
    (tmp_path / "wide.csv").write_text("joint_1,joint_2,joint_3\n1,2,3\n", encoding="utf-16")
    (tmp_path / "latin.csv").write_bytes("joint_1,joint_2,joint_3,Zähler\n1,2,3,4\n".encode("latin-1"))
    for name, words in (
        ("long.npy", "array 'q' is of type"),
        ("long.npz", "array 'more' is of type"),
        ("complex.npz", "array 'more' is of type complex128; save it as float64"),
        ("cut.npz", "it cannot be read: File is not a zip file"),
        ("latin.csv", "latin.csv:1: this is not UTF-8 text; expected CSV with a header"),
        ("empty.csv", "empty.csv: the file is empty"),
        ("wide.csv", "wide.csv: this is UTF-16 text; save the file as UTF-8"),
    ):
        with pytest.raises(KinegenError) as caught:
            found(tmp_path / name)
        assert words in str(caught.value)
        assert "\n" not in str(caught.value)


def test_decimals_are_joint_values(tmp_path: Path) -> None:
    texts = ["0.125", "-1.500", "2.875"]
    column = pa.array([Decimal(text) for text in texts], pa.decimal128(10, 3))
    data = write(tmp_path / "q.parquet", pa.table(dict.fromkeys(JOINTS, column)))
    table = found(data)

    np.testing.assert_array_equal(rows_of(table), positions(np.repeat([[float(text)] for text in texts], 3, axis=1)))
    assert table.column("joint_1").type == pa.decimal128(10, 3)


def test_names_that_occur_twice_are_refused_unless_they_are_dropped(tmp_path: Path) -> None:
    q = vectors_of(5)
    columns = [*(pa.array(q[:, i]) for i in range(3)), pa.array(q[:, 0]), pa.array(q[:, 1])]
    data = write(tmp_path / "q.parquet", pa.table(columns, names=[*JOINTS, "x", "x"]))
    with pytest.raises(KinegenError, match="there are 2 columns 'x'; leave them out with --drop x"):
        found(data)

    np.testing.assert_array_equal(rows_of(found(data, drop=["x"])), positions(q))


def test_a_vector_of_one_number_with_a_null_is_a_null_row(tmp_path: Path) -> None:
    one = tmp_path / "one.yaml"
    one.write_text(
        "kinegen: 1\nname: one\nconvention: standard\nunits: {length: m, angle: deg}\n"
        "joints:\n  - {name: turn, alpha: 0, a: 1, d: 0, theta: q}\n",
        encoding="utf-8",
    )
    column = pa.array([[0.0], [None], [1.0], None], pa.list_(pa.float64(), 1))
    pyarrow.parquet.write_table(pa.table({"q": column}), tmp_path / "q.parquet")
    evaluate(one, tmp_path / "q.parquet", tmp_path / "out.parquet", "position")
    written = pyarrow.parquet.read_table(tmp_path / "out.parquet").column("position")

    assert written.is_null().to_pylist() == [False, True, False, True]


def test_wide_rows_are_read_in_smaller_batches(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Memory is counted by what rows hold, not by the number of columns; the results are the same."""
    q = vectors_of(3000)
    texts = [str(i) * (2000 if i % 1000 < 500 else 1) for i in range(3000)]
    data = write(tmp_path / "q.parquet", table_of(q, note=pa.array(texts)), 3000)
    monkeypatch.setattr("kinegen.tools.datasets.run._COPIES", 64)
    table = found(data, memory=64 * 10**6)
    groups = pyarrow.parquet.ParquetFile(tmp_path / "found.parquet").metadata
    sizes = [groups.row_group(place) for place in range(groups.num_row_groups)]

    np.testing.assert_array_equal(rows_of(table), positions(q))
    assert table.column("note").to_pylist() == texts
    assert len(sizes) > 3
    assert max(each.total_byte_size for each in sizes) < 3 * 10**6
    assert max(each.num_rows for each in sizes) >= 500


def test_angles_of_columns_may_be_in_degrees(tmp_path: Path) -> None:
    """Joint values and rates; strokes stay lengths, and what passes through stays as it is."""
    scara = ROOT / "robots" / "scara.yaml"
    q = np.random.default_rng(4).uniform(-1, 1, (20, 3))
    degrees = q * np.degrees([1.0, 1.0, np.radians(1.0)])
    names = kinegen.load(scara).joints
    found = {}
    for unit, values in (("rad", q), ("deg", degrees)):
        columns = {name: values[:, place] for place, name in enumerate(names)}
        rates = pa.FixedSizeListArray.from_arrays(values.ravel(), 3)
        pyarrow.parquet.write_table(pa.table(columns | {"qd": rates}), tmp_path / f"{unit}.parquet")
        output = tmp_path / f"{unit}_out.parquet"
        evaluate(scara, tmp_path / f"{unit}.parquet", output, "pose,twist", angle=unit)
        found[unit] = pyarrow.parquet.read_table(output)
    for name in ("pose", "twist"):
        one, other = (each[name].combine_chunks().flatten().to_numpy() for each in found.values())
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-14)
    np.testing.assert_array_equal(found["deg"][names[0]].to_numpy(), degrees[:, 0])


def test_angles_in_degrees_are_those_of_joints_alone(tmp_path: Path) -> None:
    schema = pa.schema([("m1", pa.float64()), ("m2", pa.float64())])
    in_degrees = [Units("m", "deg"), {"j1": True, "j2": True}, schema]
    with pytest.raises(KinegenError, match="joint values and their rates; the output takes m_T_p, whose angles"):
        in_kernel_units([Binding("m_T_p", ("m1", "m2"), 2, (2,), has_angles=True)], *in_degrees)
    without = Binding("actuators", ("m1",), 3, (3,))
    assert in_kernel_units([without], *in_degrees) == (without,)
    with pytest.raises(KinegenError, match="--angle is rad, deg, not 'gon'"):
        evaluate(ROBOT, write(tmp_path / "q.parquet", table_of(vectors_of(3))), tmp_path / "o.parquet", angle="gon")


def test_what_has_angles_is_asked_of_the_input_and_not_of_its_name() -> None:
    """The frames of a machine may be called so that a name looks like that of a pose."""
    point, direction, near = (
        SimpleNamespace(name=name, shape=(size,), size=size, is_pose=False) for name, size in NAMED
    )
    for each in (point, direction, near):
        each.laid_out = lambda _layout, each=each: each.shape
    module = ModuleType("mill")
    module.JOINTS, module.axis_inverse = tuple("XYZAC"), SimpleNamespace(inputs=(point, direction, near))  # type: ignore[attr-defined]
    schema = pa.schema([(name, pa.list_(pa.float64(), size)) for name, size in NAMED])

    found = bind(module, [parse_quantity("axis_inverse")], schema, {})

    assert [each.has_angles for each in found] == [False, False, True]


NAMED = (("part_p_tool", 3), ("part_z_tool", 3), ("q_near_p_tool", 5))


def commanded(tmp_path: Path, capsys: pytest.CaptureFixture[str], *words: str) -> tuple[Any, str, str]:
    """The output of `kinegen eval` for the SCARA, whose file is in degrees, and what is said about angles."""
    arguments = ["eval", str(ROOT / "robots" / "scara.yaml"), *words]
    assert main([*arguments, "-o", str(tmp_path / "out.parquet"), "--force"]) == 0
    printed, errors = capsys.readouterr()
    return pyarrow.parquet.read_table(tmp_path / "out.parquet"), printed.partition("\n")[2].rstrip(), errors


def test_the_command_takes_the_unit_of_the_robot_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """And says so; an option states another one, and results of an earlier run keep theirs."""
    names = ("shoulder", "elbow", "stroke")
    degrees = np.random.default_rng(4).uniform(-90, 90, (20, 3)) * [1, 1, 0.001]
    data = write(tmp_path / "q.parquet", pa.table({name: degrees[:, i] for i, name in enumerate(names)}))
    radians = write(tmp_path / "r.parquet", pa.table({name: np.radians(degrees)[:, i] for i, name in enumerate(names)}))
    found, said, errors = commanded(tmp_path, capsys, str(data), "--outputs", "pose")
    stated, other, _ = commanded(tmp_path, capsys, str(data), "--outputs", "pose", "--angle", "deg")

    assert (said, errors) == ("joint values taken in deg, the unit of the file", "")
    assert other == "joint values taken in deg, as asked"
    assert found["pose"].equals(stated["pose"])
    _, _, note = commanded(tmp_path, capsys, str(radians), "--outputs", "pose")
    assert re.match(r"note: no joint of the first rows turns by more than 1\.\d+ deg; .* add --angle rad\n", note)


@pytest.mark.parametrize(
    ("titles", "words", "said"),
    [
        (
            ("shoulder[deg]", "elbow[deg]", "stroke"),
            (),
            "joint values taken in deg, as their titles state",
        ),
        (
            ("shoulder[rad]", "elbow[deg]", "stroke"),
            (),
            "joint values taken in deg and rad, as their titles state",
        ),
        (("shoulder", "elbow[deg]", "stroke"), (), "joint values taken in deg, the unit of the file"),
        (("shoulder", "elbow[deg]", "stroke"), ("--angle", "deg"), "joint values taken in deg, as asked"),
        (
            ("shoulder[rad]", "elbow[rad]", "stroke"),
            ("--angle", "rad"),
            "joint values taken in rad, as their titles state",
        ),
    ],
)
def test_the_command_says_which_units_it_took(
    titles: tuple[str, ...], words: tuple[str, ...], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A displacement has none of them, whatever its title says."""
    data = write(tmp_path / "q.parquet", pa.table({title: [0.05] for title in titles}))
    _, found, _ = commanded(tmp_path, capsys, str(data), *words)

    assert found == said


SCARA = ROOT / "robots" / "scara.yaml"
"""Two joints that turn and one that slides, in metres and degrees."""


def vectors(values: list[float]) -> pa.FixedSizeListArray:
    """A column with one vector."""
    return pa.FixedSizeListArray.from_arrays(pa.array(values), len(values))


def of_scara(tmp_path: Path, columns: dict[str, Any], outputs: str, named: dict[str, list[str]]) -> Any:
    """What eval gives for the SCARA and one row, an array."""
    pyarrow.parquet.write_table(pa.table(columns), tmp_path / "in.parquet")
    options: dict[str, Any] = {"columns": named, "angle": "", "force": True}
    evaluate(SCARA, tmp_path / "in.parquet", tmp_path / "o.npz", outputs, **options)
    return np.load(tmp_path / "o.npz")[outputs]


@pytest.mark.parametrize("title", ["q[rad]", "q_rad", "q", "q [mrad]"])
def test_the_unit_of_a_column_of_vectors_is_that_of_its_angles(title: str, tmp_path: Path) -> None:
    q = {"q[rad]": [0.1, 0.2, 0.03], "q_rad": [0.1, 0.2, 0.03], "q [mrad]": [100.0, 200.0, 0.03]}
    values = q.get(title, [float(np.degrees(0.1)), float(np.degrees(0.2)), 0.03])
    named = {"q": [title]}

    right = kinegen.compile(SCARA, "position", real="double").position([0.1, 0.2, 0.03])
    found = of_scara(tmp_path, {title: vectors(values)}, "position", named)
    np.testing.assert_allclose(found[0], right, rtol=1e-14)
    with pytest.raises(KinegenError, match=r"column 'q\[mm\]' is in 'mm' \(expected rad, mrad, deg\)"):
        of_scara(tmp_path, {"q[mm]": vectors(values)}, "position", {"q": ["q[mm]"]})


def test_the_name_of_the_input_may_have_a_unit(tmp_path: Path) -> None:
    """Of an arm of one joint this is a number, of others a vector; an exact name and those of joints come first."""
    head = "kinegen: 1\nname: one\nconvention: standard\nunits: {length: m, angle: deg}\njoints:\n"
    (tmp_path / "one.yaml").write_text(f"{head}  - {{name: elbow, theta: q, d: 0, a: 1, alpha: 0}}\n", "utf-8")
    for title, value in (("q[rad]", 0.1), ("q_mrad", 100.0), ("Q[rad]", 0.1)):
        data = csv(tmp_path / "in.csv", [f"{value},7"], f"{title},time[s]")
        evaluate(tmp_path / "one.yaml", data, tmp_path / "o.npz", "position", angle="", force=True)
        np.testing.assert_allclose(np.load(tmp_path / "o.npz")["position"][0, :2], [np.cos(0.1), np.sin(0.1)])
    right = kinegen.compile(SCARA, "position", real="double").position([0.1, 0.2, 0.03])
    np.testing.assert_allclose(of_scara(tmp_path, {"q[rad]": vectors([0.1, 0.2, 0.03])}, "position", {})[0], right)
    numbers = {"q1[rad]": [0.1], "q2[rad]": [0.2], "q3": [0.03], "Q": [5.0]}
    np.testing.assert_allclose(of_scara(tmp_path, numbers, "position", {})[0], right)


@pytest.mark.parametrize(
    ("titles", "reason"),
    [
        (("v1[rad/s]", "v2 (rad/s)", "v3[mm/s]"), ""),
        (("v1[mrad/s]", "v2[°/s]", "v3"), ""),
        (("v1[rad]", "v2", "v3"), r"'v1\[rad\]' is in 'rad' \(expected rad/s, mrad/s, deg/s\)"),
        (("v1[rpm]", "v2", "v3"), r"'v1\[rpm\]' is in 'rpm' \(expected rad/s"),
        (("v1", "v2", "v3[rad/s]"), r"'v3\[rad/s\]' is in 'rad/s' \(expected m/s, cm/s, mm/s"),
    ],
)
def test_rates_have_units_of_their_own(titles: tuple[str, ...], reason: str, tmp_path: Path) -> None:
    """A file of joint values and rates of the same names has both."""
    q, rates = {"shoulder[rad]": [0.1], "elbow[deg]": [20.0], "stroke": [0.03], "elbow[deg/s]": [9.0]}, [1.0, 2.0, 3.0]
    scales = {"v1[rad/s]": 1, "v1[mrad/s]": 1e-3, "v2[°/s]": np.radians(1), "v3[mm/s]": 1e-3}
    named = {"qd": list(titles)}
    columns = q | {title: [rate] for title, rate in zip(titles, rates, strict=True)}
    if reason:
        with pytest.raises(KinegenError, match=reason):
            of_scara(tmp_path, columns, "twist", named)
        return
    qd = [scales.get(title, 1) * rate for title, rate in zip(titles, rates, strict=True)]

    right = kinegen.compile(SCARA, "twist", real="double").twist([0.1, np.radians(20), 0.03], qd)
    np.testing.assert_allclose(of_scara(tmp_path, columns, "twist", named)[0], right, rtol=1e-13)


def test_units_of_accelerations_and_of_poses() -> None:
    titles = ("a[rad/s2]", "b [deg/s^2]", "c(mm/s²)")
    schema = pa.schema([(name, pa.float64()) for name in (*titles, "v[rad/s]", "T[mm]", "T[m]")])
    turns = {"one": True, "two": True, "three": False}
    (found,) = in_kernel_units([Binding("qdd", titles, 3, (3,))], Units("m", "deg"), turns, schema)
    one = {"one": True}

    assert found.factors == (1.0, float(np.radians(1)), 1e-3)
    with pytest.raises(KinegenError, match=r"expected rad/s2, mrad/s2, deg/s2"):
        in_kernel_units([Binding("qdd", ("v[rad/s]",), 1, (1,))], Units("m", "deg"), one, schema)
    pose = Binding("base_T_tool", ("T[m]",), 12, (12,))
    assert in_kernel_units([pose], Units("m", "deg"), one, schema) == (pose,)
    with pytest.raises(KinegenError, match=r"column 'T\[mm\]' is in 'mm'; base_T_tool is read in m and rad"):
        in_kernel_units([Binding("base_T_tool", ("T[mm]",), 12, (12,))], Units("m", "deg"), one, schema)


def test_results_of_an_earlier_run_are_read_in_radians(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Also for a robot whose file is in degrees."""
    names = ("shoulder", "elbow", "stroke")
    degrees = np.random.default_rng(4).uniform(-90, 90, (20, 3)) * [1, 1, 0.001]
    data = write(tmp_path / "q.parquet", pa.table({name: degrees[:, i] for i, name in enumerate(names)}))
    found, _, _ = commanded(tmp_path, capsys, str(data))
    pyarrow.parquet.write_table(found, tmp_path / "poses.parquet")
    scara = ROOT / "robots" / "scara.yaml"
    evaluate(
        scara,
        tmp_path / "poses.parquet",
        tmp_path / "solved.parquet",
        "inverse",
        flat=True,
        drop=["*"],
        columns={"base_T_tool": ["pose"]},
    )
    columns = ",".join(f"inverse_solutions_0_{i}" for i in range(3))
    again, said, _ = commanded(tmp_path, capsys, str(tmp_path / "solved.parquet"), "--columns", columns)
    valid = again["inverse_valid_0"].to_numpy()
    one, two = (np.stack(table["pose"].to_pylist()) for table in (found, again))

    assert valid.any()
    assert said == ""
    # A branch of this arm has the position of the target, and one of two directions.
    np.testing.assert_allclose(one[valid][:, 3::4], two[valid][:, 3::4], atol=1e-12)


def test_joint_values_of_the_other_unit_are_noted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arm = tmp_path / "arm.yaml"
    arm.write_text(
        "kinegen: 1\nname: arm\nconvention: standard\nunits: {length: m, angle: rad}\njoints:\n"
        "  - {name: turn, theta: q, d: 0, a: 1, alpha: 0, limits: [-2, 2]}\n",
        encoding="utf-8",
    )
    (tmp_path / "q.csv").write_text("Turn\n30\n45\n1\n", encoding="utf-8")
    words = ["eval", str(arm), str(tmp_path / "q.csv"), "-o", str(tmp_path / "out.parquet")]

    assert main(words) == 0
    assert capsys.readouterr().err == (
        "note: 67% of the first rows are outside the joint limits; if their angles are in deg, add --angle deg\n"
    )


def test_a_run_is_not_resumed_with_another_unit(tmp_path: Path) -> None:
    source = write(tmp_path / "q.parquet", table_of(vectors_of(30)))
    evaluate(ROBOT, source, tmp_path / "out", "position")
    with pytest.raises(KinegenError, match="angle_of_columns"):
        evaluate(ROBOT, source, tmp_path / "out", "position", angle="deg", resume=True)


@pytest.mark.parametrize(
    ("titles", "outputs", "options", "reason"),
    [
        (("shoulder[rad]", "elbow[deg]", "stroke"), "pose", {"angle": "deg"}, "--angle deg is given"),
        (("shoulder[rad]", "elbow", "stroke"), "pose", {"angle": ""}, "state it in all titles"),
        (("shoulder", "elbow", "stroke[deg]"), "pose", {"angle": ""}, "is in 'deg'"),
        (("shoulder", "elbow", "stroke"), "jacobain", {}, "did you mean jacobian"),
        (("shoulder", "elbow", "reach"), "pose", {}, "there is no column for q"),
    ],
)
def test_what_is_refused_is_refused_before_anything_is_compiled(
    titles: tuple[str, ...],
    outputs: str,
    options: dict[str, Any],
    reason: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """And leaves no folder behind."""
    data = write(tmp_path / "q.parquet", pa.table({title: [0.05] for title in titles}))
    monkeypatch.setattr("kinegen.tools.datasets.run.compiled", None)

    with pytest.raises(KinegenError, match=reason):
        evaluate(SCARA, data, tmp_path / "made" / "below", outputs, **options)
    assert sorted(tmp_path.iterdir()) == [data]


def test_a_unit_of_rates_is_read_before_anything_is_compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    titles = ("shoulder", "elbow", "stroke", "v1[rpm]", "v2", "v3")
    data = write(tmp_path / "q.parquet", pa.table({title: [0.05] for title in titles}))
    monkeypatch.setattr("kinegen.tools.datasets.run.compiled", None)

    with pytest.raises(KinegenError, match=r"'v1\[rpm\]' is in 'rpm'"):
        evaluate(SCARA, data, tmp_path / "out", "twist", columns={"qd": titles[3:]})
