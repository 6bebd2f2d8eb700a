"""The text of a file after a change: what a person would write, comments and columns kept."""

from __future__ import annotations

import numpy as np
import pytest

from kinegen.io.load import loads
from kinegen.io.robot_file.document import CannotRewriteError, Document
from kinegen.tools.doctor.edits import Edit, EditKind, edits, rarer_edits
from kinegen.tools.doctor.number_fit import number_edit
from kinegen.tools.doctor.numeric_table import Setting, Table, table_of
from kinegen.tools.doctor.rewrite import mirrored, mirrored_constant, negated, rewrite, turned, with_constant
from kinegen.verify import reference


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("90", "-90"),
        ("-90", "90"),
        ("- 0.5", "0.5"),
        ("a2", "-a2"),
        ("2*a2", "-2*a2"),
        ("pi/2", "-pi/2"),
        ("a2 + 1", "-(a2 + 1)"),
        ("-(a2 + 1)", "a2 + 1"),
        ("sqrt(2)", "-(sqrt(2))"),
        ("1e-3", "-1e-3"),
        ("-a + b", "-(-a + b)"),
    ],
)
def test_the_opposite_of_a_constant(text: str, expected: str) -> None:
    assert negated(text) == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("q", "-q"),
        ("-q", "q"),
        ("q - 90", "-q - 90"),
        ("-q + 90", "q + 90"),
        ("90 - q", "90 + q"),
        ("90 + 2*q", "90 - 2*q"),
        ("2/3*elbow", "-2/3*elbow"),
        ("q - atan2(1, 2)", "-q - atan2(1, 2)"),
        ("(q + 1)*2", "((-q) + 1)*2"),
    ],
)
def test_a_joint_that_runs_the_other_way(text: str, expected: str) -> None:
    assert mirrored(text, ("q", "elbow")) == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("q - 26.5", "q + 26.5"),
        ("-q + p", "-q - p"),
        ("q - atan2(1, 2)", "q + atan2(1, 2)"),
        ("26.5 - q", "-(26.5 - (-q))"),
    ],
)
def test_the_opposite_constant_of_a_moving_entry(text: str, expected: str) -> None:
    assert mirrored_constant(text, ("q",)) == expected


@pytest.mark.parametrize(
    ("text", "quarters", "unit", "expected"),
    [
        ("q", 1, "deg", "q + 90"),
        ("q", 2, "deg", "q + 180"),
        ("q", -1, "rad", "q - pi/2"),
        ("q - 90", 1, "deg", "q"),
        ("q + 90", 1, "deg", "q + 180"),
        ("q - 180", 1, "deg", "q - 90"),
        ("q + 180", 1, "deg", "q - 90"),
        ("q + 26.5", 1, "deg", "q + 116.5"),
        ("90 - q", 1, "deg", "180 - q"),
        ("90 - q", -1, "deg", "-q"),
        ("90 + q", -1, "deg", "q"),
        ("-90", 1, "deg", "0"),
        ("0", -1, "deg", "-90"),
        ("q + pi/2", 1, "rad", "q + pi"),
        ("q - pi", 1, "rad", "q - pi/2"),
        ("q + 3*pi/4", 1, "rad", "q - 3*pi/4"),
        ("q + 1.5708", 1, "rad", "q + 1.5708 + pi/2"),
        ("q + offset2", -1, "deg", "q + offset2 - 90"),
        ("q - atan2(1, 2)", 1, "deg", "q - atan2(1, 2) + 90"),
    ],
)
def test_a_quarter_turn_more(text: str, quarters: int, unit: str, expected: str) -> None:
    assert turned(text, quarters, unit) == expected


@pytest.mark.parametrize(
    ("text", "constant", "expected"),
    [
        ("q - 9", "-90", "q - 90"),
        ("q", "90", "q + 90"),
        ("-q + p", "0", "-q"),
        ("2*q - atan2(1, 2)", "12.5", "2*q + 12.5"),
        ("90 - q", "-pi/2", "-q - pi/2"),
    ],
)
def test_another_constant_of_a_moving_entry(text: str, constant: str, expected: str) -> None:
    assert with_constant(text, constant, ("q",)) == expected


TEXT = """\
kinegen: 1
name: arm        # of steel
convention: standard
units: {length: m, angle: deg}
parameters: {l1: 0.4}
joints:
  - {name: one,   theta: q,        d: 0.3, a: l1,   alpha: -90}   # the first
  - {name: two,   theta: "q - 90", d: 0,   a: 0.25, alpha: 17}
  - {name: three, theta: q, d: 0.1, a: 0, alpha: 90, offset: 45}
  - name: four
    theta: 0      # fixed
    d: -q + 0.2   # slides
    a: 2*l1
    alpha: 0
  - {name: five, ets: [Rz(30 - q), Tx(-0.2), Ry(40)]}
  - {name: six, theta: 0.5*one + 20, d: 0.1, a: 0.2, alpha: 10}
  - {name: seven, theta: q, d: 0.01*q/(2*pi) + 0.05, a: 0, alpha: 0}
tool:
  xyz: [0.1, 0, l1]   # the gripper
  rpy: [0, 30, -90]
"""


def table() -> Table:
    return table_of(loads(TEXT, "arm.yaml"), "tool")


def plain(of: Table) -> Setting:
    return Setting(of.robot.convention, "deg", "m", "rad", "rad", "m", "")


def numbers(of: Table) -> list[Edit]:
    """Another number in every place."""
    found = [number_edit(of, place, 0.35 + place / 100, "deg") for place in range(len(of.slots))]
    return [edit for edit in found if edit is not None]


EDITS = (*edits(table()), *rarer_edits(table()), *numbers(table()))


@pytest.mark.parametrize("edit", EDITS, ids=lambda edit: edit.words)
def test_every_edit_of_every_kind_of_row_means_what_was_evaluated(edit: Edit) -> None:
    """The text is read again by the loader, and evaluated by the reference."""
    from kinegen.tools.doctor.residual import Batch, predicted_poses

    start = table()
    text = rewrite(TEXT, start, (), (edit,), plain(start)).text
    q = np.random.default_rng(1).uniform(-1, 1, (5, start.robot.dof))
    expected = reference.frames(loads(text, "arm.yaml"), q)["tool"][:, :3]
    constants, gains = edit.apply(start.constants[None], np.ones((1, len(start.slots))))
    ours = np.stack(predicted_poses(start, plain(start), Batch(constants, gains), q), axis=-1)[:, 0].transpose(1, 0, 2)

    assert np.abs(ours - expected).max() < 1e-12
    assert text != TEXT
    assert text.count("#") == TEXT.count("#")


def test_every_kind_of_edit_is_among_them() -> None:
    assert {edit.kind for edit in EDITS} == set(EditKind)


def test_columns_of_a_table_stay_in_line() -> None:
    start = table()
    found = next(edit for edit in edits(start) if edit.words == "joint 1 (one): the other sign of a")
    text = rewrite(TEXT, start, (), (found,), plain(start)).text

    assert "a: -l1,  alpha: -90}   # the first" in text


def test_the_lines_of_a_block_are_removed_or_replaced_whole() -> None:
    assert Document(TEXT).without("tool").text == TEXT[: TEXT.index("tool:")]
    assert Document(TEXT).with_mapping("tool", "{xyz: [1, 2, 3]}").text == (
        TEXT[: TEXT.index("tool:")] + "tool: {xyz: [1, 2, 3]}\n"
    )
    assert Document("a: 1").with_mapping("base", "{rpy: [0, 0, 1]}").text == "a: 1\nbase: {rpy: [0, 0, 1]}\n"


def test_what_a_text_does_not_take_is_refused() -> None:
    with pytest.raises(CannotRewriteError, match="there is no entry beta"):
        Document(TEXT).words("joints", 0, "beta")
    with pytest.raises(CannotRewriteError, match="between braces"):
        Document("{a: 1}").without("a")


def test_a_transform_that_is_an_alias_is_refused() -> None:
    text = "a: &end {xyz: [1, 2, 3]}\ntool: *end\n"
    for change in (lambda: Document(text).without("tool"), lambda: Document(text).with_mapping("a", "{}")):
        with pytest.raises(CannotRewriteError, match="is shared by a YAML alias"):
            change()


@pytest.mark.parametrize(
    ("parameters", "entry", "changed"),
    [
        ("{l: 0.4}", "l", "{l: 0.53}"),
        ("{l: 0.4}   # of l", "-l", "{l: -0.53}   # of l"),
        ("{l: {value: 0.4, runtime: true}}", "l", "{l: {value: 0.53, runtime: true}}"),
    ],
)
def test_a_parameter_of_one_entry_gets_its_number(parameters: str, entry: str, changed: str) -> None:
    """With the number in the row nothing would use the parameter, which the reader refuses."""
    text = (
        f"kinegen: 1\nname: arm\nconvention: standard\nunits: {{length: m, angle: deg}}\nparameters: {parameters}\n"
        f"joints:\n  - {{name: one, theta: q, d: 0.1, a: {entry}, alpha: 90}}\n"
    )
    start = table_of(loads(text, "arm.yaml"), "tool")
    edit = number_edit(start, start.rows[0].slots["a"], 0.53, "deg")
    assert edit is not None
    found = rewrite(text, start, (), (edit,), plain(start)).text
    assert found == text.replace(f"parameters: {parameters}", f"parameters: {changed}")
    assert table_of(loads(found, "arm.yaml"), "tool").constants[start.rows[0].slots["a"]] == pytest.approx(0.53)
