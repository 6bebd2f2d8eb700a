"""A robot file becomes the robot that it describes: conventions, joints, parents, frames, names and digest."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from kinegen.errors import RobotFileError
from kinegen.io.load import load, loads
from kinegen.model.expression_values import Dimension
from kinegen.model.robot import Convention, JointType, Robot, StepKind, Units
from tests.robot.files import entry, exact, robot, row_of

ROBOTS = sorted((Path(__file__).resolve().parents[2] / "robots").glob("*.yaml"))
WAIST = "{name: waist, a: 0, alpha: 90, d: 0.4, theta: q}"
ELBOW = "{name: elbow, a: 0.3, alpha: 0, d: 0, theta: q}"
THUMB = "{name: thumb, parent: waist, a: 0.1, alpha: 0, d: 0, theta: q}"

WHOLE = """# A comment.
kinegen: 1
name: whole
description: >
  Every part
  of the format
convention: modified
units: {length: mm, angle: deg}
parameters:
  a2: 431.8
  a3: {value: 20.3, runtime: true}
joints:
  - {name: waist, alpha: 0, a: 0, d: 0, theta: q, limits: [-160, 160]}
  - name: elbow
    type: revolute
    alpha: -90
    a: a2
    d: 0
    theta: 90 - q
  - {name: lift, alpha: 90, a: a3, d: q, theta: 0, limits: [0, 250]}
base: {xyz: [0, 0, 600]}
tool: {xyz: [0, 0, 100], rpy: [10, 20, 30]}
frames:
  goal: {parent: station, ets: [Tx(a2), Rz(90)]}
  station: {parent: base, xyz: [1000, 0, 0]}
  hand: {parent: wrist}
"""


@pytest.mark.parametrize("path", ROBOTS, ids=lambda path: str(path.stem))
def test_every_robot_of_the_house_loads(path: Path) -> None:
    assert load(path).source == path.name


def test_a_whole_file() -> None:
    found = loads(WHOLE, "some/folder/whole.yaml")

    assert (found.name, found.description, found.source) == ("whole", "Every part of the format", "whole.yaml")
    assert found.convention is Convention.MODIFIED
    assert found.units == Units("mm", "deg")
    assert [(p.name, p.value, p.runtime) for p in found.parameters] == [
        ("a2", exact("431.8"), False),
        ("a3", exact("20.3"), True),
    ]
    assert [row.type for row in found.rows] == [JointType.REVOLUTE, JointType.REVOLUTE, JointType.PRISMATIC]
    assert [row.parent for row in found.rows] == ["base", "waist", "elbow"]
    assert [row.number for row in found.rows] == [1, 2, 3]
    assert [row.line for row in found.rows] == [13, 14, 20]
    assert [variable.limits for variable in found.variables] == [
        (exact("-8/9*pi"), exact("8/9*pi")),
        None,
        (exact("0"), exact("250")),
    ]
    assert found.tips == ("tool",)
    assert found.frame_names == ("waist", "elbow", "lift", "tool", "station", "hand", "goal")


def test_bytes_text_windows_lines_and_a_byte_order_mark_are_all_one_robot() -> None:
    plain = loads(WHOLE, "arm.yaml")

    assert loads(WHOLE.encode(), "arm.yaml") == plain
    assert loads("\ufeff" + WHOLE, "arm.yaml") == plain
    assert loads(WHOLE.replace("\n", "\r\n").encode(), "arm.yaml") == plain
    assert loads(WHOLE.encode("utf-8-sig"), "arm.yaml") == plain


# What moves ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("entries", "kind"),
    [
        ("a: 0, alpha: 0, d: 0, theta: q", JointType.REVOLUTE),
        ("a: 0, alpha: 0, d: 0.1, theta: 90 - q", JointType.REVOLUTE),
        ("a: 0, alpha: 0, d: 0, theta: q/2 + one", JointType.REVOLUTE),
        ("a: 0, alpha: 0, d: 0.1*one, theta: q", JointType.REVOLUTE),
        ("a: 0, alpha: 0, d: q, theta: 0", JointType.PRISMATIC),
        ("a: 0, alpha: 0, d: 0.2 - q, theta: 90", JointType.PRISMATIC),
        ("a: 0, alpha: 0, d: 0.1*q, theta: q", JointType.SCREW),
        ("a: 0, alpha: 0, d: 0, theta: 0.5*one + 10", JointType.FOLLOWER),
        ("a: 0, alpha: 0, d: 0.2*slide, theta: one", JointType.FOLLOWER),
        ("a: 0, alpha: 0, d: 0.1, theta: 0", JointType.FIXED),
        ("ets: [Rz(q), Tx(0.1)]", JointType.REVOLUTE),
        ("ets: [Ry(-q)]", JointType.REVOLUTE),
        ("ets: [Ty(2*q)]", JointType.PRISMATIC),
        ("ets: [Rx(q), Tx(0.1*q)]", JointType.SCREW),
        ("ets: [Tz(0.1*q), Ty(1), Rz(30), Rz(q)]", JointType.SCREW),
        ("ets: [Ry(one + two)]", JointType.FOLLOWER),
        ("ets: [Ry(90)]", JointType.FIXED),
        ("ets: []", JointType.FIXED),
    ],
)
def test_where_the_variable_stands_decides_what_the_joint_is(entries: str, kind: JointType) -> None:
    row = row_of(entries)

    assert row.type is kind
    assert row.variable == ("last" if kind in (JointType.REVOLUTE, JointType.PRISMATIC, JointType.SCREW) else None)
    assert row_of(f"{entries}, type: {kind}") == row


def test_only_moving_rows_have_a_place_in_the_joint_vector() -> None:
    found = robot(
        WAIST,
        "{name: plate, a: 0.1, alpha: 0, d: 0, theta: 0}",
        ELBOW,
        "{name: belt, a: 0.1, alpha: 0, d: 0, theta: -elbow}",
        "{name: lift, a: 0, alpha: 0, d: q, theta: 0}",
    )

    assert [(v.name, v.index) for v in found.variables] == [("waist", 0), ("elbow", 1), ("lift", 2)]
    assert found.dof == 3


def test_a_row_may_follow_a_joint_that_stands_below_it() -> None:
    found = robot("{name: belt, a: 0.1, alpha: 0, d: 0, theta: 2*elbow}", ELBOW)

    assert found.rows[0].theta == exact("2*elbow")


def test_an_empty_table_is_a_robot() -> None:
    found = robot(more="tool: {xyz: [1, 2, 3]}")

    assert (found.dof, found.rows, found.tips) == (0, (), ("tool",))


# Conventions --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("convention", ["standard", "modified", "modified_prev_d"])
def test_table_rows_have_four_entries(convention: str) -> None:
    row = robot(WAIST, convention=convention).rows[0]

    assert row.convention == convention
    assert (row.a, row.alpha, row.d, row.theta) == (exact("0"), exact("pi/2"), exact("0.4"), exact("waist"))
    assert (row.beta, row.steps) == (None, ())


def test_hayati_rows_have_beta_in_place_of_d() -> None:
    row = robot("{name: waist, theta: q, a: 0.3, alpha: 0.01, beta: 0.02}", convention="hayati").rows[0]

    assert row.convention is Convention.HAYATI
    assert (row.d, row.beta) == (None, exact("pi/9000"))


def test_one_row_may_have_a_convention_of_its_own() -> None:
    found = robot(WAIST, "{name: elbow, convention: hayati, theta: q, a: 0.3, alpha: 0, beta: 0}")

    assert [row.convention for row in found.rows] == [Convention.STANDARD, Convention.HAYATI]
    assert found.convention is Convention.STANDARD


def test_elementary_steps_stay_in_order() -> None:
    row = row_of("ets: [Rz(q), Tx(0.1), Ry(-90), Tz(slide)]")

    assert row.convention is Convention.ETS
    assert [(step.kind, step.value) for step in row.steps] == [
        (StepKind.RZ, exact("last")),
        (StepKind.TX, exact("0.1")),
        (StepKind.RY, exact("-1/2*pi")),
        (StepKind.TZ, exact("slide")),
    ]
    assert (row.a, row.alpha, row.d, row.theta, row.beta) == (None,) * 5


# Trees and frames ---------------------------------------------------------------------------------------------------


def test_a_parent_makes_a_tree_and_every_leaf_a_tip() -> None:
    found = robot(WAIST, ELBOW, THUMB, "{name: nail, a: 0.1, alpha: 0, d: 0, theta: 0}")

    assert [row.parent for row in found.rows] == ["base", "waist", "waist", "thumb"]
    assert found.is_tree
    assert found.tips == ("elbow", "nail")


def test_a_tree_may_begin_twice_at_the_base() -> None:
    assert robot(WAIST, "{name: left, parent: base, a: 0, alpha: 0, d: 0, theta: q}").tips == ("waist", "left")


def test_rpy_turns_about_fixed_axes_after_the_shift() -> None:
    found = robot(WAIST, more="tool: {xyz: [1, 2, 3], rpy: [10, 20, 30]}")

    assert [(step.kind, step.value) for step in found.tool] == [
        (StepKind.TX, exact("1")),
        (StepKind.TY, exact("2")),
        (StepKind.TZ, exact("3")),
        (StepKind.RZ, exact("pi/6")),
        (StepKind.RY, exact("pi/9")),
        (StepKind.RX, exact("pi/18")),
    ]


@pytest.mark.parametrize("tool", ["{}", "{xyz: [0, 0, 0]}", "{rpy: [0, 0, 0]}", "{ets: []}"])
def test_a_transform_that_does_nothing_has_no_steps(tool: str) -> None:
    assert robot(WAIST, more=f"tool: {tool}").tool == ()


def test_frames_come_after_their_parents() -> None:
    more = "frames: {c: {parent: b}, b: {parent: a}, a: {parent: wrist}, d: {parent: tool}, e: {parent: waist}}"
    found = robot(WAIST, ELBOW, more=more)

    assert [(frame.name, frame.parent) for frame in found.frames] == [
        ("a", "wrist"),
        ("d", "tool"),
        ("e", "waist"),
        ("b", "a"),
        ("c", "b"),
    ]


def test_parameters_may_stand_in_frames() -> None:
    found = robot(WAIST, more="parameters: {h: 0.2, tilt: 30}\nbase: {xyz: [0, 0, h], rpy: [tilt, 0, 0]}")

    assert [step.value for step in found.base] == [exact("h"), exact("tilt")]
    assert [p.dimension for p in found.parameters] == [Dimension.LENGTH, Dimension.ANGLE]


# Names --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["I", "S", "N", "Q", "E", "O", "beta", "gamma", "lambda", "zeta", "l_I", "Q1", "in1"])
def test_words_of_sympy_and_python_are_ordinary_names(name: str) -> None:
    found = robot(
        f"{{name: {name}, a: p, alpha: 0, d: 0, theta: q}}",
        f"{{name: other, a: 0, alpha: 0, d: 0, theta: q + {name}}}",
        more="parameters: {p: 1}",
    )

    assert found.rows[1].theta == exact(f"other + {name}")
    assert entry("a", f"2*{name}", more=f"parameters: {{{name}: 0.5}}") == exact(f"2*{name}")


def test_a_body_of_twenty_one_joints_with_awkward_names_loads() -> None:
    rows = [f"{{name: Q{i}, a: l_I, alpha: 90, d: I, theta: q - 90}}" for i in range(1, 22)]
    found = robot(*rows, more="parameters: {l_I: 0.3, I: 0.1}")

    assert found.dof == 21


@pytest.mark.parametrize("name", ["on", "off", "yes", "no", "null", "y"])
def test_words_that_yaml_takes_for_values_are_names_too(name: str) -> None:
    assert robot(f"{{name: {name}, a: 0, alpha: 0, d: 0, theta: q}}").rows[0].name == name


def test_the_last_row_of_a_chain_may_be_the_wrist() -> None:
    assert robot(WAIST, ELBOW.replace("elbow", "wrist")).rows[-1].name == "wrist"


def test_a_quoted_expression_is_an_expression() -> None:
    assert entry("theta", "'q - 90'") == entry("theta", "q - 90")


def test_a_value_may_be_an_alias() -> None:
    found = robot("{name: waist, a: &length 0.3, alpha: 0, d: *length, theta: q}")

    assert found.rows[0].d == exact("0.3")


# Digest -------------------------------------------------------------------------------------------------------------


def test_the_digest_sees_the_robot_and_not_the_file() -> None:
    plain = loads(WHOLE, "arm.yaml")
    shuffled = WHOLE.replace("# A comment.\n", "\n\n# Another.\n").replace("90 - q", "-q + pi/2")

    assert loads(shuffled, "other.yaml").digest == plain.digest
    assert len(plain.digest) == 16
    assert set(plain.digest) <= set("0123456789abcdef")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("431.8", "431.80001"),
        ("runtime: true", "runtime: false"),
        ("90 - q", "89 - q"),
        ("length: mm", "length: m"),
        ("[-160, 160]", "[-160, 161]"),
        ("hand: {parent: wrist}", "hand: {parent: elbow}"),
        ("of the format", "of the formats"),
        ("convention: modified", "convention: standard"),
    ],
)
def test_the_digest_sees_every_change(old: str, new: str) -> None:
    assert loads(WHOLE.replace(old, new), "arm.yaml").digest != loads(WHOLE, "arm.yaml").digest


def test_the_digest_is_the_same_everywhere() -> None:
    """A stored value: the digest may not hang on the Python in use, the folder or the order of a set."""
    assert robot(WAIST, ELBOW).digest == "8872bf6377955c1d"


def test_a_robot_is_frozen() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        robot(WAIST).name = "other"  # type: ignore[misc]


def test_every_error_of_loads_names_its_source() -> None:
    with pytest.raises(RobotFileError) as caught:
        loads("kinegen: 1\n", "made/up.yaml")

    assert caught.value.path == "made/up.yaml"
    assert caught.value.line == 1


def test_a_robot_can_be_compared(tmp_path: Path) -> None:
    (tmp_path / "whole.yaml").write_text(WHOLE, encoding="utf-8")
    found: Robot = load(tmp_path / "whole.yaml")

    assert found == load(str(tmp_path / "whole.yaml"))


def test_an_odd_file_name_is_safe_to_print(tmp_path: Path) -> None:
    """It goes into the banners of generated files."""
    path = tmp_path / "a\nb\x1b.yaml"
    path.write_text(WHOLE, encoding="utf-8")

    assert load(path).source == r"a\nb\x1b.yaml"


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-be"])
def test_utf_16_is_called_by_its_name(encoding: str) -> None:
    mark = "" if encoding == "utf-16" else "\ufeff"

    with pytest.raises(RobotFileError, match="this is UTF-16 text; save the file as UTF-8"):
        loads((mark + "kinegen: 1\n").encode(encoding), "arm.yaml")


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (("a: 0.3", "a: 175,5"), r"joint 2 \(elbow\): '175,5': a decimal point is written '.', as in 175.5"),
        (("a: 0.3", "a: -1,5"), r"joint 2 \(elbow\): '-1,5': a decimal point is written '.', as in -1.5"),
        (("a: 0.3", "a: 1.2,5"), r"unknown key '5'"),
        (("theta: q", "theta: q2"), r"undefined name 'q2'; the joint variable of every row is q, without a number"),
        (("theta: q", "theta: q_2 + 90"), r"undefined name 'q_2'; the joint variable of every row is q, without"),
        (("theta: q", "theta: p2"), r"undefined name 'p2' \(expected q, "),
    ],
)
def test_slips_of_those_who_begin_are_named(change: tuple[str, str], reason: str) -> None:
    with pytest.raises(RobotFileError, match=reason):
        robot(WAIST, ELBOW.replace(*change))


def test_a_minus_sign_of_a_printed_table_is_read() -> None:
    sign = "\N{MINUS SIGN}"

    assert robot(WAIST.replace("90", f"{sign}90")).digest == robot(WAIST.replace("90", "-90")).digest


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (("units:", "  units:"), "arm.yaml:8: .* not allowed here .is this line indented too far.."),
        (("  - name: elbow", "    - name: elbow"), "arm.yaml:14: .*; is this line indented as those before it."),
        (("name: whole", "name: made by: me"), "arm.yaml:3: .* .text that contains ': ' must be quoted"),
    ],
)
def test_lines_that_are_indented_wrongly_are_asked_about(change: tuple[str, str], reason: str) -> None:
    with pytest.raises(RobotFileError, match=reason):
        loads(WHOLE.replace(*change, 1), "arm.yaml")
