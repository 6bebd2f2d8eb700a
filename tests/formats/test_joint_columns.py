"""Columns of joint values and their cells, as people and spreadsheets write them, are read alike by all commands."""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest
from pyarrow.parquet import read_table

from kinegen.errors import KinegenError
from kinegen.io.columns import METRES, RADIANS, csv_cells, named_so, numbered, unit_of, unit_of_values
from kinegen.io.load import load
from kinegen.tools.calibrate.measurement_file import read_cells
from kinegen.tools.calibrate.measurements import read_measurements
from kinegen.tools.calibrate.options import Settings
from kinegen.tools.datasets import evaluate
from kinegen.tools.datasets.csv_text import PlainLines, opened, require_numbers
from kinegen.tools.datasets.sources import find_sources
from kinegen.tools.doctor.observed_poses import Said, observations
from kinegen.tools.doctor.pose_file import read_poses
from tests.cli.commands import TWO

PLAIN = "turn,slide,x,y,z\n10,0.25,0.49,0.08,0.25\n-30,0.1,0.43,-0.25,0.1\n"
MINUS = "\u2212"


def with_capitals() -> str:
    return PLAIN.replace("turn,slide,x,y,z", "TURN,Slide,X,Y,Z")


def by_number(text: str = PLAIN) -> str:
    return text.replace("turn,slide", "Q1,q2")


def with_decimal_commas() -> str:
    return "\ufeff" + PLAIN.replace(",", ";").replace(".", ",")


def from_print() -> str:
    return PLAIN.replace("-", MINUS)


def from_print_with_decimal_commas() -> str:
    return with_decimal_commas().replace("-", MINUS)


def with_empty_columns() -> str:
    return PLAIN.replace("\n", ",,\n")


def with_tabs_and_decimal_commas() -> str:
    return with_decimal_commas().replace(";", "\t")


def with_blanks_in_names() -> str:
    return PLAIN.replace("turn,slide,x", " turn , slide ,x ")


def with_comments() -> str:
    return "# measured\n\n" + PLAIN.replace("\n-30", "\n # again, by hand, with, a, gauge\n\n-30")


def with_units() -> str:
    return PLAIN.replace("turn,slide,x,y,z", "turn[deg],slide (m),x_m,y [m],z")


def as_windows_writes_it() -> str:
    return with_decimal_commas().replace("\n", "\r\n")


FORMS = (
    with_capitals,
    by_number,
    with_decimal_commas,
    from_print,
    from_print_with_decimal_commas,
    with_empty_columns,
    with_tabs_and_decimal_commas,
    with_blanks_in_names,
    with_comments,
    with_units,
    as_windows_writes_it,
)


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.__name__)
def test_every_command_reads_the_same_numbers(form: Callable[[], str], tmp_path: Path) -> None:
    (tmp_path / "two.yaml").write_text(TWO, encoding="utf-8")
    path = tmp_path / "poses.csv"
    path.write_text(form(), encoding="utf-8")
    robot = load(tmp_path / "two.yaml")
    poses, *_ = read_poses(robot, path, Said())
    measured = read_measurements(read_cells(path), robot, Settings())
    (source,) = find_sources([path])
    joints = [each.name for each in robot.variables]
    columns = named_so(joints, source.schema.names) or named_so(numbered(2), source.schema.names)
    with opened(str(path), {}) as reader:
        table = reader.read_all()

    assert [tuple(map(float, each.joints)) for each in poses] == [(10, 0.25), (-30, 0.1)]
    assert [tuple(map(float, each.position)) for each in poses] == [(0.49, 0.08, 0.25), (0.43, -0.25, 0.1)]
    np.testing.assert_allclose(measured.q, [[np.radians(10), 0.25], [np.radians(-30), 0.1]])
    assert columns is not None
    assert [table[name].to_pylist() for name in columns] == [[10, -30], [0.25, 0.1]]
    assert [str(kind) for kind in source.schema.types[:2]] == ["int64", "double"]


def test_a_title_states_its_unit() -> None:
    assert [unit_of(title) for title in ("A1[deg]", "x (mm)", "x_mm", "y [µm]", "A1", "a_b")] == [
        ("A1", "deg"),
        ("x", "mm"),
        ("x", "mm"),
        ("y", "um"),
        ("A1", None),
        ("a_b", None),
    ]
    assert named_so(("a", "x_mm"), ("A[deg]", "x_mm")) == ("A[deg]", "x_mm")
    assert named_so(("a", "b"), ("A[deg]", "b[m]")) == ("A[deg]", "b[m]")
    assert named_so(("a",), ("a[deg]", "a[rad]")) is None
    assert named_so(("a",), ("a[deg]", "a[deg/s]", "a[0]")) == ("a[deg]",)
    assert [unit_of(title)[1] for title in ("a[°]", "a[deg/s^2]", "a[0]", "a [ mm ]")] == ["deg", "deg/s^2", None, "mm"]


def test_units_of_titles_are_those_of_the_numbers(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The file has degrees and metres; these are radians and millimetres."""
    (tmp_path / "two.yaml").write_text(TWO, encoding="utf-8")
    path = tmp_path / "poses.csv"
    robot = load(tmp_path / "two.yaml")
    path.write_text("turn[rad],slide[mm],x[mm],y[mm],z[mm]\n0.5,250,490,80,250\n", encoding="utf-8")
    lines, form, said = read_poses(robot, path, Said())
    observed = observations(robot, lines, said, form)
    measured = read_measurements(read_cells(path), robot, Settings(length="mm"))
    evaluate(tmp_path / "two.yaml", path, tmp_path / "named.parquet", "position", angle="")
    path.write_text(
        f"turn,slide\n{np.degrees(0.5)!r},0.25\n".replace("np.float64(", "").replace(")", ""), encoding="utf-8"
    )
    evaluate(tmp_path / "two.yaml", path, tmp_path / "usual.parquet", "position", angle="")
    named, usual = (read_table(tmp_path / f"{name}.parquet")["position"].to_pylist() for name in ("named", "usual"))

    assert (observed.angle, observed.length, observed.stated_angle, observed.stated_length) == ("rad", "mm", True, True)
    np.testing.assert_allclose(measured.q, [[0.5, 0.25]])
    np.testing.assert_allclose(named, usual, rtol=1e-15)
    assert capsys.readouterr().out == ""


UNITS_OF_ONE_KIND = (
    ("turn[mrad],slide[um],x[um],y[um],z[um]", "500,250000,490000,80000,250000"),
    ("turn[mrad],slide[mm],x[cm],y[um],z[m]", "500,250,49,80000,0.25"),
    ("q1_mrad,q2_um,x_mm,y_cm,z_m", "500,250000,490,8,0.25"),
)


@pytest.mark.parametrize(("titles", "row"), UNITS_OF_ONE_KIND)
def test_every_command_reads_small_units_and_several_of_them(titles: str, row: str, tmp_path: Path) -> None:
    """The file has degrees and metres."""
    (tmp_path / "two.yaml").write_text(TWO, encoding="utf-8")
    robot, found = load(tmp_path / "two.yaml"), {}
    for name, text in (("units", f"{titles}\n{row}\n"), ("plain", "turn[rad],slide,x,y,z\n0.5,0.25,0.49,0.08,0.25\n")):
        path = tmp_path / f"{name}.csv"
        path.write_text(text, encoding="utf-8")
        evaluate(tmp_path / "two.yaml", path, tmp_path / f"{name}.npz", "position", angle="")
        lines, form, said = read_poses(robot, path, Said())
        seen, measured = observations(robot, lines, said, form), read_measurements(read_cells(path), robot, Settings())
        scale = METRES[seen.length]
        found[name] = [
            RADIANS[seen.angle] * seen.joints[0, 0],
            scale * seen.joints[0, 1],
            *(scale * seen.positions[0]),
            *measured.q[0],
            *measured.positions[0],
            *np.load(tmp_path / f"{name}.npz")["position"][0],
        ]

    np.testing.assert_allclose(found["units"], found["plain"], rtol=1e-12)


@pytest.mark.parametrize(
    ("titles", "reason"),
    [
        ("turn[grad],slide,x,y,z", "column 'turn[grad]' is in 'grad' (expected rad, mrad, deg)"),
        ("Q1 (grad),q2,x,y,z", "column 'Q1 (grad)' is in 'grad' (expected rad, mrad, deg)"),
        ("turn,slide[kg],x,y,z", "column 'slide[kg]' is in 'kg' (expected m, cm, mm, um, in)"),
        ("turn[um],slide,x,y,z", "column 'turn[um]' is in 'um' (expected rad, mrad, deg)"),
        ("turn_mm,slide,x,y,z", "column 'turn_mm' is in 'mm' (expected rad, mrad, deg)"),
    ],
)
def test_every_command_names_a_unit_that_it_does_not_know(titles: str, reason: str, tmp_path: Path) -> None:
    (tmp_path / "two.yaml").write_text(TWO, encoding="utf-8")
    path = tmp_path / "poses.csv"
    path.write_text(f"{titles}\n0,0,1,2,3\n", encoding="utf-8")
    robot = load(tmp_path / "two.yaml")

    for read in (
        lambda: read_poses(robot, path, Said()),
        lambda: read_measurements(read_cells(path), robot, Settings()),
        lambda: evaluate(tmp_path / "two.yaml", path, tmp_path / "out.npz", "position", angle=""),
    ):
        with pytest.raises(KinegenError, match=re.escape(reason)):
            read()


CONTRADICTIONS = {
    ("turn[rad],slide,x,y,z", "deg"): "column 'turn[rad]' is in rad, and --angle deg is given; leave one of them out",
    ("turn[deg],lift,slide,x,y,z", ""): "",
    ("turn[rad],lift,slide,x,y,z", ""): "column 'turn[rad]' has a unit, and column 'lift' has none; "
    "state it in all titles, as in 'lift[rad]', or in none and with --angle rad",
    ("turn[rad],lift,slide,x,y,z", "rad"): "",
    ("turn[rad],lift[rad],slide,x[m],y,z", ""): "",
    ("turn,lift,slide[mm],reach,x,y,z", ""): "column 'slide[mm]' has a unit, and column 'reach' has none; "
    "state it in all titles, as in 'reach[mm]'",
}
"""Titles of columns and what --angle says of them, for a file in degrees and metres, and what is wrong."""


@pytest.mark.parametrize(("titles", "angle"), CONTRADICTIONS)
def test_every_command_refuses_units_that_leave_a_doubt(titles: str, angle: str, tmp_path: Path) -> None:
    names = [unit_of(title)[0] for title in titles.split(",")]
    joints = names[: names.index("x")]
    rows = [
        f"  - {{name: {name}, theta: {'q' if turns else 0}, d: {0 if turns else 'q'}, a: 1, alpha: 90}}\n"
        for name in joints
        for turns in [name in ("turn", "lift")]
    ]
    (tmp_path / "arm.yaml").write_text(f"{TWO.partition('parameters:')[0]}joints:\n{''.join(rows)}", encoding="utf-8")
    path = tmp_path / "poses.csv"
    path.write_text(f"{titles}\n{','.join('0' * len(names))}\n", encoding="utf-8")
    robot, reason = load(tmp_path / "arm.yaml"), CONTRADICTIONS[titles, angle]
    ways: tuple[Callable[[], object], ...] = (
        lambda: read_poses(robot, path, Said(angle=angle or None)),
        lambda: read_measurements(read_cells(path), robot, Settings(angle=angle or None)),
        lambda: evaluate(tmp_path / "arm.yaml", path, tmp_path / "out.npz", "position", angle=angle, force=True),
    )

    for way in ways:
        with pytest.raises(KinegenError, match=re.escape(reason)) if reason else nullcontext():
            way()


@pytest.mark.parametrize("title", ["qw[deg]", "qz (rad)", "qx_mm"])
def test_numbers_of_a_quaternion_have_no_unit(title: str, tmp_path: Path) -> None:
    (tmp_path / "two.yaml").write_text(TWO, encoding="utf-8")
    path = tmp_path / "poses.csv"
    head = "turn,slide,x,y,z,qw,qx,qy,qz".replace(title[:2], title)
    path.write_text(f"{head}\n0,0,1,2,3,1,0,0,0\n", encoding="utf-8")
    robot = load(tmp_path / "two.yaml")

    for read in (
        lambda: read_poses(robot, path, Said()),
        lambda: read_measurements(read_cells(path), robot, Settings()),
    ):
        with pytest.raises(KinegenError, match=rf"poses.csv:1: column '{re.escape(title)}' has no unit"):
            read()


def test_a_column_to_leave_out_has_to_be_there(tmp_path: Path) -> None:
    (tmp_path / "two.yaml").write_text(TWO, encoding="utf-8")
    path = tmp_path / "poses.csv"
    path.write_text("turn,slide,x,y,z,time\n0,0,1,2,3,9\n", encoding="utf-8")
    robot = load(tmp_path / "two.yaml")

    assert read_measurements(read_cells(path), robot, Settings(ignore=("time",))).positions.shape == (1, 3)
    with pytest.raises(KinegenError, match=r":1: --ignore: there is no column 'tine' .*'time'; did you mean time"):
        read_measurements(read_cells(path), robot, Settings(ignore=("tine",)))


NAMED = TWO.replace("turn", "turn_rad").replace("slide", "slide_mm")
"""Joints whose own names end as units do."""


@pytest.mark.parametrize("names", ["turn_rad,slide_mm", "Turn_Rad,SLIDE_MM", "turn_rad[deg],slide_mm_m"])
def test_the_end_of_a_name_of_a_joint_is_no_unit(names: str, tmp_path: Path) -> None:
    """The file has degrees and metres."""
    for name, text in (("two", TWO), ("named", NAMED)):
        (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")
    (tmp_path / "usual.csv").write_text(PLAIN, encoding="utf-8")
    path = tmp_path / "named.csv"
    path.write_text(PLAIN.replace("turn,slide", names), encoding="utf-8")
    robot = load(tmp_path / "named.yaml")
    poses, _, header = read_poses(robot, path, Said())
    measured = read_measurements(read_cells(path), robot, Settings())
    found = {}
    for file, arm in (("usual", "two"), ("named", "named")):
        evaluate(tmp_path / f"{arm}.yaml", tmp_path / f"{file}.csv", tmp_path / f"{file}.npz", "position", angle="")
        found[file] = np.load(tmp_path / f"{file}.npz")["position"].tolist()

    assert found["named"] == found["usual"]
    assert [tuple(map(float, each.joints)) for each in poses] == [(10, 0.25), (-30, 0.1)]
    assert header == (Said("deg", "m") if "[" in names else Said())
    np.testing.assert_allclose(measured.q, [[np.radians(10), 0.25], [np.radians(-30), 0.1]])


def test_the_end_of_another_name_is_no_unit(tmp_path: Path) -> None:
    """Unless a unit follows the name of a joint, or is in brackets."""
    names = ("turn", "q1")
    titles = ("turn_rad", "Q1_rad", "turn", "u_in", "u_rad", "u[rad]", "u (rad)", "_rad")

    assert [unit_of_values(title, names) for title in titles] == ["rad", "rad", None, None, None, "rad", "rad", None]
    (tmp_path / "two.yaml").write_text(TWO, encoding="utf-8")
    (tmp_path / "q.csv").write_text("u_in,v_in\n10,0.25\n", encoding="utf-8")
    columns = ["u_in", "v_in"]
    evaluate(tmp_path / "two.yaml", tmp_path / "q.csv", tmp_path / "o.npz", "position", columns=columns, angle="deg")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("turn,slide\n1,2\n3,x\n", r"poses\.csv:3: 'x' in column 'slide' is not a number"),
        ("# by hand\nturn;slide\n1,5;2\n3;4;5\n", r"poses\.csv:4: 3 cells, but the header has 2"),
        ("turn,slide\n" + f"{1:030},2\n" * 40_000 + "1,two\n", r"poses\.csv:40002: 'two' in column 'slide'"),
    ],
    ids=["a word", "a long row", "a word after the first block"],
)
def test_a_cell_without_a_number_is_named_with_its_line(text: str, reason: str, tmp_path: Path) -> None:
    (tmp_path / "two.yaml").write_text(TWO, encoding="utf-8")
    path = tmp_path / "poses.csv"
    path.write_text(text, encoding="utf-8")

    with pytest.raises(KinegenError, match=reason):
        evaluate(tmp_path / "two.yaml", path, tmp_path / "found.parquet", "position")
    with pytest.raises(KinegenError, match=reason):
        require_numbers(str(path), ["slide"])


def test_capitals_do_not_decide_between_two_columns() -> None:
    assert named_so(("a", "b"), ("A", "B")) == ("A", "B")
    assert named_so(("a", "b"), ("a", "A", "b")) == ("a", "b")
    assert named_so(("a", "b"), ("A", "a", "B")) is None
    assert named_so(("a", "A"), ("A", "a")) == ("a", "A")
    assert named_so(("a", "b"), ("A", "c")) is None


def test_columns_without_a_name_are_left_out_only_where_they_are_empty() -> None:
    path = Path("poses.csv")

    with pytest.raises(KinegenError, match="2 cells, but the header has 4"):
        csv_cells(b"a,b,,\n1,2,,\n3,4\n", path, "CSV")
    assert csv_cells(b"a,b\n1,2,,\n", path, "CSV").rows == (("1", "2"),)
    assert csv_cells(b"a,b,\n1,2,5\n", path, "CSV").header == ("a", "b", "")
    with pytest.raises(KinegenError, match="3 cells, but the header has 2"):
        csv_cells(b"a,b\n1,2,3\n", path, "CSV")


@pytest.mark.parametrize("name", ["poses.xlsx", "poses.ods", "poses.csv"])
def test_a_workbook_is_named_as_one(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(b"PK\x03\x04" + bytes(40))

    with pytest.raises(KinegenError, match=r"workbook of a spreadsheet.*; save the sheet with the table as CSV"):
        find_sources([path])


@pytest.mark.parametrize("size", [1, 2, 3, 5, 64])
def test_lines_are_plain_where_chunks_break_them(size: int) -> None:
    text = f"# {MINUS}1\na,b\n{MINUS}1,{MINUS}.5\n #c\n{MINUS}x,e{MINUS}2\n{MINUS}".encode()
    plain = PlainLines()
    found = b"".join(plain(text[place : place + size]) for place in range(0, len(text), size)) + plain(b"")

    assert found.decode() == f"a,b\n-1,-.5\n{MINUS}x,e-2\n{MINUS}"
