"""CSV files and `--pose` texts: what is understood, and one line with the place for everything else."""

from __future__ import annotations

from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kinegen.errors import KinegenError
from kinegen.io.columns import MAX_BYTES
from kinegen.io.load import loads
from kinegen.tools.doctor.observed_poses import Line, Observations, Said, observations, read_pose
from kinegen.tools.doctor.pose_file import read_poses
from tests.cli.commands import TWO

ROBOT = loads(TWO, "two.yaml")
HEAD = "turn,slide,x,y,z"


def read(tmp_path: Path, text: str | bytes) -> tuple[tuple[Line, ...], str]:
    path = tmp_path / "poses.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_poses(ROBOT, path, Said())[:2]


def test_a_table_with_comments_blank_lines_and_columns_in_any_order(tmp_path: Path) -> None:
    text = "# measured\n\nx,y,z, slide ,turn\n1,2,3,0.5,-90\n# again\n4,5,6,1e-1,45.0\n"
    found, form = read(tmp_path, text)

    assert form == ""
    assert found[0] == Line((Decimal(-90), Decimal("0.5")), (Decimal(1), Decimal(2), Decimal(3)), (), 4)
    assert found[1].line == 6
    assert found[1].joints[1] == Decimal("0.1")


@pytest.mark.parametrize("mark", [";", "\t"])
def test_other_separators_and_a_byte_order_mark(tmp_path: Path, mark: str) -> None:
    text = f"\ufeff{HEAD}\r\n-90,0.5,1,2,3\r\n".replace(",", mark)
    found, _ = read(tmp_path, text)

    assert found[0].position == (Decimal(1), Decimal(2), Decimal(3))


@pytest.mark.parametrize(
    ("columns", "form", "expected"),
    [
        ("yaw,pitch,roll", "rpy", (3, 2, 1)),
        ("rx,ry,rz", "rotation_vector", (1, 2, 3)),
        ("qx,qy,qz,qw", "wxyz", (1, 0, 0, 0)),
    ],
)
def test_orientations_are_sorted_by_the_names_of_their_columns(
    tmp_path: Path, columns: str, form: str, expected: tuple[int, ...]
) -> None:
    numbers = "0,0,0,1" if form == "wxyz" else "1,2,3"
    found, named = read(tmp_path, f"{HEAD},{columns}\n0,0,1,2,3,{numbers}\n")

    assert named == form
    assert found[0].orientation == tuple(map(Decimal, expected))


def test_a_pose_without_orientation_among_others(tmp_path: Path) -> None:
    found, form = read(tmp_path, f"{HEAD},roll,pitch,yaw\n0,0,1,2,3,4,5,6\n0,0,1,2,3,,,\n")
    observed = observations(ROBOT, found, Said(), form)

    assert found[1].orientation == ()
    assert np.isnan(observed.orientations[1]).all()


def test_joints_by_number_capitals_and_the_angles_of_kuka(tmp_path: Path) -> None:
    found, form = read(tmp_path, "q1,Q2,X,Y,Z,A,B,C\n-90,0.5,1,2,3,4,5,6\n")
    named, _ = read(tmp_path, "Turn,SLIDE,X,Y,Z\n-90,0.5,1,2,3\n")

    assert form == "rpy"
    assert found[0].joints == named[0].joints == (Decimal(-90), Decimal("0.5"))
    assert found[0].position == named[0].position == (Decimal(1), Decimal(2), Decimal(3))
    assert found[0].orientation == (Decimal(6), Decimal(5), Decimal(4))


@pytest.mark.parametrize("mark", [";", "\t"])
def test_decimal_commas_a_printed_minus_and_a_row_of_empty_cells(tmp_path: Path, mark: str) -> None:
    text = f"{HEAD}\n\N{MINUS SIGN}90|0,5|-1,25|+2,0e1|,5\n||||\n".replace("|", mark).replace(
        HEAD, HEAD.replace(",", mark)
    )
    found, _ = read(tmp_path, text)
    (plain,), _ = read(tmp_path, f"{HEAD}\n\N{MINUS SIGN}90,0.5,1,2,3\n,,,,\n")

    assert [(line.joints, line.position) for line in found] == [
        ((Decimal(-90), Decimal("0.5")), (Decimal("-1.25"), Decimal(20), Decimal("0.5")))
    ]
    assert plain.joints[0] == read_pose(ROBOT, "\N{MINUS SIGN}90 0.5 = 1 2 3", 1).joints[0] == Decimal(-90)


def test_joints_called_x_leave_the_position_other_names(tmp_path: Path) -> None:
    robot = loads(TWO.replace("slide", "x"), "two.yaml")
    path = tmp_path / "poses.csv"
    path.write_text("turn,x,px,py,pz\n90,0.5,1,2,3\n", encoding="utf-8")

    assert read_poses(robot, path, Said())[0][0].position == (Decimal(1), Decimal(2), Decimal(3))
    path.write_text("turn,x,y,z\n90,0.5,1,2\n", encoding="utf-8")
    with pytest.raises(KinegenError, match=r"poses.csv:1: columns x, y and z are missing .*write px, py, pz"):
        read_poses(robot, path, Said())


BAD = {
    "": "the file is empty (expected a header and a row for each measurement)",
    "# nothing\n": "the file is empty (expected a header and a row for each measurement)",
    HEAD: ":1: there are no poses below the header",
    f"{HEAD}\n0,0,1,2\n": ":2: 4 cells, but the header has 5",
    f"{HEAD}\n0,0,1,2,\n": ":2: z: '' is not a number",
    f"{HEAD}\n\n# c\n0,0,1,2,x\n": ":4: z: 'x' is not a number",
    f"{HEAD}\n0,nan,1,2,3\n": ":2: slide: 'nan' is not a finite number",
    f"{HEAD}\n0,0,inf,2,3\n": ":2: x: 'inf' is not a finite number",
    f"{HEAD}\n0,0,1e999999,2,3\n": ":2: x: '1e999999' is too large (at most 1e+9)",
    f"{HEAD};\n0;0;1,5;2;3;\n": ":2: 2 cells, but the header has 5",
    f"{HEAD}\n0,0,1,5,2,3\n": ":2: 6 cells, but the header has 5; is the comma a decimal separator?",
    "turn;slide;x;y;z\n0;0;1,5,2;2;3\n": ":2: x: '1,5,2' is not a number (the decimal separator is a point)",
    f"{HEAD},x[mm]\n0,0,1,2,3,4\n": "column 'x' occurs twice",
    f"{HEAD},tool[mm]\n0,0,1,2,3,4\n": "unknown column 'tool' (expected joint names, x, y, z, roll",
    f"{HEAD.replace('turn', 'turn[mm]')}\n0,0,1,2,3\n": "column 'turn[mm]' is in 'mm' (expected rad, mrad, deg)",
    f"{HEAD.replace('x,y', 'x[mm],y [in]')}\n0,0,1,2,3\n": "'x[mm]' and 'y [in]' have different units",
    f"{HEAD.replace('turn,slide', 'turn,slide[um]')}\n0,0,1,2,3\n": "state it in all titles, as in 'x[um]'",
    "turn,slide,x[mm],y,z[mm]\n0,0,1,2,3\n": ":1: column 'x[mm]' has a unit, and column 'slide' has none; "
    "state it in all titles, as in 'slide[mm]', or in none and with --length mm",
    "turn[rad],slide,x,y,z,roll,pitch,yaw\n0,0,1,2,3,4,5,6\n": ":1: column 'turn[rad]' has a unit, and column 'roll' "
    "has none; state it in all titles, as in 'roll[rad]', or in none and with --angle rad",
    f"{HEAD},rx[deg],ry,rz\n0,0,1,2,3,4,5,6\n": ":1: column 'rx[deg]' has a unit, and column 'ry' has "
    "none; state it in all titles, as in 'ry[deg]'",
    f"{HEAD},rx[deg],ry[deg],rz[deg]\n0,0,1,2,3,4,5,6\n": ":1: rotation vectors in deg are not read; "
    "write them in rad, or roll, pitch, yaw in deg",
    "turn,x,y,z\n0,1,2,3\n": ":1: column 'slide' is missing (expected turn, slide, or q1 to q2, and x, y, z)",
    "turn,slide,x,y\n0,0,1,2\n": ":1: columns x, y and z are missing",
    f"{HEAD},x\n0,0,1,2,3,4\n": ":1: column 'x' occurs twice",
    f"{HEAD},elbow\n0,0,1,2,3,4\n": ":1: unknown column 'elbow' (expected joint names, x, y, z, roll, pitch, yaw,",
    f"{HEAD},roll,pitch\n0,0,1,2,3,4,5\n": ":1: column 'yaw' is missing",
    f"{HEAD},roll,pitch,yaw,qw\n0,0,1,2,3,4,5,6,7\n": ":1: the header has two forms of orientation; keep one",
    f"{HEAD},roll,pitch,yaw\n0,0,1,2,3,4,,6\n": ":2: some of roll, pitch, yaw are empty; fill all or none",
    "0,0,1,2,3\n": ":1: the first row must be a header with names of columns, but it has numbers",
    '"turn,slide\n': ":1: this row cannot be read: unexpected end of data",
}


@pytest.mark.parametrize(
    ("titles", "said"),
    [
        ("turn[deg],slide,x[m],y,z", Said("deg", "m")),
        ("turn[rad],slide,x,y,z,rx,ry,rz", Said("rad")),
        ("turn,slide,x,y,z,rx[rad],ry,rz", Said()),
        ("turn,slide_mm,x_mm,y_mm,z_mm", Said(length="mm")),
    ],
)
def test_a_unit_counts_for_the_columns_that_share_it(tmp_path: Path, titles: str, said: Said) -> None:
    """The file has degrees and metres; rotation vectors are in radians."""
    path = tmp_path / "poses.csv"
    path.write_text(f"{titles}\n{','.join('0' * len(titles.split(',')))}\n", encoding="utf-8")

    assert read_poses(ROBOT, path, Said())[2] == said


@pytest.mark.parametrize("text", BAD)
def test_bad_files_are_one_line_with_the_place(tmp_path: Path, text: str) -> None:
    with pytest.raises(KinegenError) as caught:
        read(tmp_path, text)

    assert str(caught.value).startswith(f"{tmp_path}/poses.csv:")
    assert BAD[text] in str(caught.value)
    assert "\n" not in str(caught.value)


def test_files_that_cannot_be_a_table(tmp_path: Path) -> None:
    with pytest.raises(KinegenError, match="is not UTF-8 text"):
        read(tmp_path, b"turn,slide\n\xff\xfe")
    with pytest.raises(KinegenError, match="larger than 64 MiB"):
        read(tmp_path, b"#" * (MAX_BYTES + 1))
    with pytest.raises(KinegenError, match="more than 10000 rows"):
        read(tmp_path, f"{HEAD}\n" + "0,0,1,2,3\n" * 10_001)
    with pytest.raises(KinegenError, match=r"nowhere\.csv: cannot be read: no such file"):
        read_poses(ROBOT, tmp_path / "nowhere.csv", Said())
    with pytest.raises(KinegenError, match="this is a folder; expected CSV with poses"):
        read_poses(ROBOT, tmp_path, Said())


def test_one_pose_on_the_command_line() -> None:
    assert read_pose(ROBOT, "-90 0.5 = 1 2 3", 1) == Line(
        (Decimal(-90), Decimal("0.5")), (Decimal(1), Decimal(2), Decimal(3)), (), 1
    )
    assert read_pose(ROBOT, "-90,0.5=1,2,3, 4,5,6", 2).orientation == (Decimal(4), Decimal(5), Decimal(6))
    assert len(read_pose(ROBOT, "-90 0.5 = 1 2 3 1 0 0 0", 2).orientation) == 4


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0 0 1 2 3", "expected joint values, '=' and a position"),
        ("0 = 1 2 3", "two takes 2 joint values (turn, slide), 1 given"),
        ("0 0 = 1 2", "2 numbers after '=' (expected x y z"),
        ("0 0 = 1 2 q", "'q' is not a number"),
        ("0 0 = 1 2 nan", "'nan' is not a finite number"),
    ],
)
def test_a_bad_pose_is_named(text: str, message: str) -> None:
    with pytest.raises(KinegenError) as caught:
        read_pose(ROBOT, text, 1)

    assert message in str(caught.value)


def made(*texts: str, said: Said | None = None, form: str = "") -> Observations:
    lines = [read_pose(ROBOT, text, place) for place, text in enumerate(texts, start=1)]
    return observations(ROBOT, lines, said or Said(), form)


def test_the_last_printed_digit_decides_the_rounding() -> None:
    found = made("10.50 0.5 = 1 2 3.25 10 20.5 30", "20 0.25 = 1 2 3 0 0 0")

    assert found.joint_digit.tolist() == [0.005, 0.005]
    assert found.position_digit == 0.005
    assert found.orientation_digit == 0.05


def test_whole_joint_values_are_exact() -> None:
    assert made("10 1 = 1 2 3").joint_digit.tolist() == [0, 0]


def test_units_are_those_of_the_file_unless_stated() -> None:
    assert (made("0 0 = 1 2 3").angle, made("0 0 = 1 2 3").length) == ("deg", "m")
    found = made("0 0 = 1 2 3", said=Said("rad", "mm"))
    assert (found.angle, found.length, found.stated_angle, found.stated_length) == ("rad", "mm", True, True)


def test_forms_that_do_not_suit_the_numbers() -> None:
    with pytest.raises(KinegenError, match="some orientations have 3 numbers and some have 4"):
        made("0 0 = 1 2 3 4 5 6", "0 0 = 1 2 3 1 0 0 0")
    with pytest.raises(KinegenError, match="the orientations have 3 numbers, but --orientation wxyz is given"):
        made("0 0 = 1 2 3 4 5 6", said=Said(form="wxyz"))
    with pytest.raises(KinegenError, match="the poses have no orientation, but --orientation rpy is given"):
        made("0 0 = 1 2 3", said=Said(form="rpy"))
    with pytest.raises(KinegenError, match="the quaternion has length 2"):
        made("0 0 = 1 2 3 2 0 0 0")
    with pytest.raises(KinegenError, match="there are no poses"):
        observations(ROBOT, [], Said())


@given(st.one_of(st.binary(max_size=200), st.text(alphabet='turnslidexyz,;\t\n0123456789.-e#" ', max_size=200)))
def test_any_bytes_give_a_table_or_one_line(tmp_path_factory: pytest.TempPathFactory, content: bytes | str) -> None:
    path = tmp_path_factory.getbasetemp() / "any.csv"
    path.write_bytes(content if isinstance(content, bytes) else f"{HEAD}\n{content}".encode())
    try:
        lines, _, _ = read_poses(ROBOT, path, Said())
        found = all(len(line.joints) == 2 for line in lines)
    except KinegenError as error:
        found = "\n" not in str(error)
    assert found
