"""Files of measurements: what is read, and the line that says what is wrong."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from kinegen.errors import KinegenError
from kinegen.io.columns import RADIANS
from kinegen.io.load import load
from kinegen.tools.calibrate.measurement_file import read_cells
from kinegen.tools.calibrate.measurements import Kind, Measurements, read_measurements
from kinegen.tools.calibrate.options import Settings, quantity

ARM = """\
kinegen: 1
name: arm
convention: standard
units: {length: m, angle: deg}
joints:
  - {name: turn, theta: q, d: 0.2, a: 0.3, alpha: 90}
  - {name: bend, theta: q, d: 0, a: 0.4, alpha: 0}
  - {name: slide, theta: 0, d: q, a: 0, alpha: 0}
"""


def read(folder: Path, text: str | bytes, settings: Settings | None = None) -> Measurements:
    """The measurements in a file."""
    arm, file = folder / "arm.yaml", folder / "m.csv"
    arm.write_text(ARM, encoding="utf-8")
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_measurements(read_cells(file), load(arm), settings or Settings())


def test_units_of_headers_options_and_the_file(tmp_path: Path) -> None:
    text = "turn[rad];bend[deg];q3 (mm);x_mm;y[m];z(cm)\n0.5;90;20;100;0.2;30\n"
    optional = "turn;bend;q3;x;y;z\n0.5;1.5;20;100;200;300\n"

    found = read(tmp_path, text)
    asked = read(tmp_path, optional, Settings(length="mm", angle="rad"))

    assert asked.q[0] == pytest.approx([0.5, 1.5, 0.02])
    assert asked.positions[0] == pytest.approx([0.1, 0.2, 0.3])
    assert found.q[0] == pytest.approx([0.5, math.pi / 2, 0.02])
    assert (found.angles, asked.angles) == ("deg and rad", "")
    assert found.positions[0] == pytest.approx([0.1, 0.2, 0.3])
    assert found.kinds == (Kind.POSITION,)
    assert not found.stated


def test_decimal_commas_kuka_angles_and_a_row_of_empty_cells(tmp_path: Path) -> None:
    found = read(tmp_path, "turn;bend;slide;X;Y;Z;A;B;C\n10;\N{MINUS SIGN}95,5;0,1;1;2;3;90;0;0\n;;;;;;;;\n")

    assert found.q[0] == pytest.approx([math.radians(10), math.radians(-95.5), 0.1])
    # A is the turn about z.
    assert found.rotations[0] == pytest.approx(np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]), abs=1e-12)


def test_every_kind_of_row_and_comments(tmp_path: Path) -> None:
    text = """\
# tracker, Monday
turn,bend,slide,x,y,z,qw,qx,qy,qz,distance,to_turn,to_bend,to_slide,anchor,plane,sphere,radius,sigma,sigma_angle
1,92,0.1,1,2,3,0.6,0.8,0,0,,,,,,,,,0.01,0.5
1,92,0.1,1,2,3,,,,,,,,,,,,,0.01,0.5

1,92,0.1,,,,,,,,0.5,20,30,0.1,,,,,0.01,0.5
# a comment in between
1,92,0.1,,,,,,,,0.5,,,,post,,,,0.01,0.5
1,92,0.1,,,,,,,,,,,,,floor,,,0.01,0.5
1,92,0.1,,,,,,,,,,,,,,ball,0.03,0.02,0.5
"""

    found = read(tmp_path, text)

    assert found.kinds == (Kind.POSE, Kind.POSITION, Kind.DISTANCE, Kind.ANCHOR, Kind.PLANE, Kind.SPHERE)
    assert found.lines == (3, 4, 6, 8, 9, 10)
    assert found.fixtures == ("", "", "", "post", "floor", "ball")
    assert found.rotations[0] == pytest.approx(np.array([[1, 0, 0], [0, -0.28, -0.96], [0, 0.96, -0.28]]))
    assert found.to_q[2] == pytest.approx([*np.radians([20, 30]), 0.1])
    assert found.sigma == pytest.approx([0.01] * 5 + [0.02])
    assert found.sigma_angle == pytest.approx(math.radians(0.5))
    assert found.stated
    assert found.residuals == 6 + 3 + 4


@pytest.mark.parametrize("columns", ["roll,pitch,yaw", "rx,ry,rz"])
def test_a_quarter_turn_about_z_in_every_form(columns: str, tmp_path: Path) -> None:
    found = read(tmp_path, f"q1,q2,q3,x,y,z,{columns}\n1,90,0,0,0,0,0,0,90\n")

    assert found.rotations[0] == pytest.approx(np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]))


def test_roll_comes_first_about_fixed_axes(tmp_path: Path) -> None:
    found = read(tmp_path, "q1,q2,q3,x,y,z,roll,pitch,yaw\n1,90,0,0,0,0,90,0,90\n")

    # Roll takes y to z; yaw leaves z.
    assert found.rotations[0] @ [0, 1, 0] == pytest.approx([0, 0, 1])


def test_parquet_holds_the_same(tmp_path: Path) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    columns = {
        "turn": [10.0, 20.5],
        "bend": [1.0, 95.0],
        "slide": [0.1, 0.2],
        "x": [1, 2],
        "y": [0.1, None],
        "z": [0.0, 0.3],
    }
    parquet.write_table(pyarrow.table(columns), tmp_path / "m.parquet")
    (tmp_path / "arm.yaml").write_text(ARM, encoding="utf-8")

    with pytest.raises(KinegenError, match=r"m\.parquet: row 2: y is empty beside the others of x, y, z"):
        read_measurements(read_cells(tmp_path / "m.parquet"), load(tmp_path / "arm.yaml"), Settings())
    columns["y"][1] = 0.25
    parquet.write_table(pyarrow.table(columns), tmp_path / "m.parquet")
    found = read_measurements(read_cells(tmp_path / "m.parquet"), load(tmp_path / "arm.yaml"), Settings())
    assert found.q[1] == pytest.approx([*np.radians([20.5, 95]), 0.2])


HEAD = "turn,bend,slide,x,y,z\n"
ROW = "10,95,0.1,1,2,3\n"

BAD = {
    "empty": ("", r"m\.csv: the file is empty"),
    "only comments": ("# nothing\n\n", r"the file is empty"),
    "only a header": (HEAD, r"m\.csv:1: there is a header but no measurement"),
    "no header": (ROW, r"m\.csv:1: the first row must be a header"),
    "a missing joint": ("turn,bend,x,y,z\n1,2,3,4,5\n", r":1: the column of joint slide is missing"),
    "a missing coordinate": ("turn,bend,slide,x,z\n1,2,3,4,5\n", r":1: column y is missing beside x, y, z"),
    "nothing measured": ("turn,bend,slide\n1,2,3\n", r":1: no column says what was measured"),
    "an unknown column": ("trun,bend,slide,x,y,z\n" + ROW, r":1: unknown column 'trun' .*did you mean turn\?"),
    "a column twice": ("turn,turn,bend,slide,x,y,z\n1,1,2,3,4,5,6\n", r":1: column 'turn' occurs twice"),
    "a joint by two names": ("turn,q1,bend,slide,x,y,z\n1,1,2,3,4,5,6\n", r":1: column 'q1' occurs twice"),
    "a ragged row": (HEAD + ROW + "1,2,3,4\n", r":3: 4 cells, but the header has 6"),
    "decimal commas": (HEAD + "1,5,2,3,4,5,6\n", r":2: 7 cells.*is the comma a decimal separator"),
    "two decimal commas": (
        HEAD.replace(",", ";") + "1,5,2;2;3;4;5;6\n",
        r":2: column 'turn' has '1,5,2', which is not",
    ),
    "a word": (HEAD + ROW + "1,2,0.1,1,here,3\n", r":3: column 'y' has 'here', which is not a number"),
    "NaN": (HEAD + "nan,2,0.1,1,2,3\n", r":2: column 'turn' has 'nan'"),
    "infinity": (HEAD + "1,2,0.1,inf,2,3\n", r":2: column 'x' has 'inf'"),
    "an empty joint": (HEAD + "1,,0.1,1,2,3\n", r":2: column 'bend' is empty"),
    "half a position": (HEAD + "1,2,0.1,1,,3\n", r":2: y is empty beside the others of x, y, z"),
    "nothing in a row": (HEAD + ROW + "1,2,0.1,,,\n", r":3: this row measures nothing"),
    "a wrong unit": ("turn[mm],bend,slide,x,y,z\n" + ROW, r":1: column 'turn\[mm\]' is in 'mm' \(expected rad"),
    "an angle of a length": ("turn,bend,slide,x[deg],y,z\n" + ROW, r":1: column 'x\[deg\]' is in 'deg' \(expected m"),
    "a unit of a quaternion": (
        "turn,bend,slide,x,y,z,qw[rad],qx,qy,qz\n1,90,0,1,2,3,1,0,0,0\n",
        r":1: column 'qw\[rad\]' has no unit",
    ),
    "a long quaternion": (
        "turn,bend,slide,x,y,z,qw,qx,qy,qz\n1,90,0,1,2,3,1,1,0,0\n",
        r":2: the quaternion has length 1\.414",
    ),
    "two orientations": (
        "turn,bend,slide,x,y,z,qw,qx,qy,qz,rx,ry,rz\n1,90,0,1,2,3,1,0,0,0,0,0,0\n",
        r":1: the orientation is given in two forms",
    ),
    "no position": ("turn,bend,slide,rx,ry,rz\n1,90,0,1,2,3\n", r":1: there is an orientation but no position"),
    "one end": ("turn,bend,slide,distance\n1,90,0,1\n", r":1: column 'distance' needs the other end"),
    "half a second configuration": (
        "turn,bend,slide,distance,to_turn,to_bend\n1,90,0,1,2,3\n",
        r":1: the column of joint to_slide is missing",
    ),
    "a negative distance": ("turn,bend,slide,distance,anchor\n1,90,0,-1,a\n", r":2: distance is negative"),
    "two things": ("turn,bend,slide,x,y,z,plane\n1,90,0,1,2,3,floor\n", r":2: this row measures more than one thing"),
    "no uncertainty": ("turn,bend,slide,x,y,z,sigma\n1,90,0,1,2,3,0\n", r":2: sigma must be positive"),
    "an open quote": (HEAD + '1,2,"0.1,1,2,3\n', r":2: this row cannot be read"),
    "UTF-16": (HEAD.encode("utf-16"), "this is UTF-16 text; save the file as UTF-8"),
    "binary": (b"\0\1\2", "this is a binary file"),
    "bad Parquet": (b"PAR1 and nothing", "this Parquet file cannot be read"),
    "radians": (HEAD + "1,2,0.1,1,2,3\n" * 5, r":1: no joint turns by more than 2 degrees; if these are radians"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_gets_one_line_with_its_place(name: str, tmp_path: Path) -> None:
    text, message = BAD[name]

    with pytest.raises(KinegenError, match=message) as caught:
        read(tmp_path, text)

    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(str(tmp_path / "m.csv"))


def test_a_column_can_be_left_out(tmp_path: Path) -> None:
    text = "time," + HEAD + "noon," + ROW

    with pytest.raises(KinegenError, match="--ignore leaves a column out"):
        read(tmp_path, text)
    assert len(read(tmp_path, text, Settings(ignore=("time",))).kinds) == 1


@pytest.mark.parametrize(("text", "value"), [("0.1mrad", 1e-4), ("1 deg", math.pi / 180)])
def test_uncertainties_have_units(text: str, value: float) -> None:
    assert quantity(text, RADIANS, "0.1mrad") == pytest.approx(value)


@pytest.mark.parametrize("text", ["0.1", "0.1mm", "mrad", "-1mrad", "0rad", "nanrad", "infrad", ""])
def test_uncertainties_that_are_none(text: str) -> None:
    with pytest.raises(KinegenError, match="is not an uncertainty"):
        quantity(text, RADIANS, "0.1mrad")
