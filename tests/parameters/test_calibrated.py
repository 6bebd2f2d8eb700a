"""Entries of the table as runtime parameters: the same robot, and the errors of names that cannot be."""

from __future__ import annotations

from pathlib import Path

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kinegen.errors import KinegenError
from kinegen.io.load import loads
from kinegen.model.expression_parser import number
from kinegen.model.expression_values import Dimension
from kinegen.model.outputs import parse_quantity
from kinegen.model.robot import ROW_ENTRIES, JointType, Robot
from kinegen.model.runtime_entries import DH, with_runtime_entries
from kinegen.verify import reference
from tests.builds.workshop import make, write_robot
from tests.chains import robots

ARM = """
kinegen: 1
name: arm
convention: standard
units: {length: mm, angle: deg}
parameters: {d1: 89, a2: -425, reach: 100, twice: 2*reach}
joints:
  - {name: waist, theta: 90 - q, d: d1, a: 0, alpha: 90}
  - {name: lift, theta: 45, d: 2*q + 10, a: a2, alpha: 0}
  - {name: elbow, convention: hayati, theta: q, a: a2, alpha: 0.02, beta: 0}
  - {name: crank, theta: 0.5*waist + 10, d: 0, a: twice, alpha: 0}
  - {name: wrist_1, ets: [Rz(q), Tx(d1)]}
"""
SEQUENCE = """
kinegen: 1
name: steps
convention: standard
units: {length: m, angle: rad}
parameters: {l1: 0.3}
joints:
  - {name: hip, ets: [Rz(q), Tx(l1)]}
"""


def arm() -> Robot:
    return loads(ARM, "arm.yaml")


@given(robots(), st.integers(0, 3))
@settings(max_examples=40)
def test_the_defaults_are_the_robot_exactly(robot: Robot, seed: int) -> None:
    if not any(ROW_ENTRIES[row.convention] for row in robot.rows):
        return
    varied = with_runtime_entries(robot, (DH,))
    q = np.random.default_rng(seed).uniform(-3, 3, robot.dof)

    with mpmath.workdps(reference.DIGITS):
        for before, after in zip(reference.pose_mp(robot, q), reference.pose_mp(varied, q), strict=True):
            assert mpmath.mnorm(before - after) < mpmath.mpf(10) ** (4 - reference.DIGITS)
    assert varied.variables == robot.variables
    assert [row.type for row in varied.rows] == [row.type for row in robot.rows]


def test_every_entry_gets_a_name_and_its_value_in_kernel_units() -> None:
    robot = with_runtime_entries(arm(), (DH,))
    names = [parameter.name for parameter in robot.varied_parameters]
    values = dict(zip(names, robot.varied_parameters, strict=True))

    assert names[:4] == ["a_waist", "alpha_waist", "d_waist", "theta_waist"]
    assert names[8:12] == ["a_elbow", "alpha_elbow", "theta_elbow", "beta_elbow"]
    assert len(names) == 4 * 4
    assert values["d_lift"].value == number(10)
    assert values["a_lift"].value == values["a_elbow"].value == number(-425)
    assert values["a_crank"].value == number(200)
    assert values["theta_waist"].dimension is Dimension.ANGLE
    assert values["d_waist"].dimension is Dimension.LENGTH
    assert all(parameter.runtime for parameter in robot.varied_parameters)


def test_joint_variables_keep_their_sign_and_factor() -> None:
    robot = with_runtime_entries(arm(), (DH,))
    q = np.array([0.3, 20.0, -0.4, 0.5])
    delta = 0.01

    moved = reference.pose(robot, q, {"d_lift": 10 + 2 * delta})
    np.testing.assert_allclose(moved, reference.pose(robot, q + np.eye(4)[1] * delta), atol=1e-12)
    turned = reference.pose(robot, q, {"theta_waist": np.pi / 2 - delta, "theta_crank": np.pi / 18 + delta / 2})
    np.testing.assert_allclose(turned, reference.pose(robot, q + np.eye(4)[0] * delta), atol=1e-12)
    assert [row.type for row in robot.rows][3] is JointType.FOLLOWER


def test_a_parameter_of_the_file_stays_where_an_elementary_sequence_names_it() -> None:
    robot = with_runtime_entries(arm(), (DH,))

    assert [parameter.name for parameter in robot.parameters if not parameter.chosen] == ["d1"]
    assert not robot.parameters[0].runtime


def test_a_parameter_of_the_actuators_stays_too() -> None:
    robot = loads(
        ARM.replace("reach: 100", "reach: 100, ratio: 50")
        + """
actuators:
  readings: {m1: {dimension: angle}, m2: {dimension: length}, m3: {dimension: angle}, m4: {dimension: angle}}
  joints:
    - {joint: waist, form: gear, actuator: m1, ratio: ratio}
    - {joint: lift, form: gear, actuator: m2, ratio: 1}
    - {joint: elbow, form: gear, actuator: m3, ratio: 1}
    - {joint: wrist_1, form: gear, actuator: m4, ratio: 1}
""",
        "arm.yaml",
    )

    kept = [parameter.name for parameter in with_runtime_entries(robot, (DH,)).parameters if not parameter.chosen]
    assert kept == ["d1", "ratio"]


def test_named_parameters_become_runtime_parameters_in_the_order_of_the_file() -> None:
    robot = with_runtime_entries(arm(), ("alpha_elbow", "a2", "d1"))

    assert [parameter.name for parameter in robot.varied_parameters] == ["d1", "a2", "alpha_elbow"]
    assert robot.runtime_parameters == robot.varied_parameters
    assert robot.digest != arm().digest


def test_a_chosen_parameter_is_told_from_other_runtime_parameters() -> None:
    robot = loads(ARM.replace("d1: 89", "d1: {value: 89, runtime: true}"), "arm.yaml")

    assert [parameter.name for parameter in robot.varied_parameters] == ["d1"]
    chosen = with_runtime_entries(robot, ("a2",))
    assert [parameter.name for parameter in chosen.runtime_parameters] == ["d1", "a2"]
    assert [parameter.name for parameter in chosen.varied_parameters] == ["a2"]


def test_a_parameter_that_is_called_like_its_entry_is_that_entry() -> None:
    robot = with_runtime_entries(loads(ARM.replace("a2", "a_elbow"), "arm.yaml"), (DH,))

    assert [parameter.name for parameter in robot.varied_parameters].count("a_elbow") == 1
    assert "a_lift" in [parameter.name for parameter in robot.varied_parameters]


@pytest.mark.parametrize(
    ("text", "wrt", "message"),
    [
        (
            ARM,
            ("a_wist",),
            (
                "there is no parameter 'a_wist' (expected d1, a2, reach, twice; an entry, such as a_waist, of rows "
                "waist, lift, elbow, crank; dh for all entries; did you mean a_waist?)"
            ),
        ),
        (ARM, ("d_elbow",), "there is no parameter 'd_elbow'"),
        (SEQUENCE, ("a_hip",), "there is no parameter 'a_hip' (expected l1)"),
        (SEQUENCE, (DH,), "the table has no entries, only elementary sequences; name parameters of the file"),
        (ARM, (DH, "a2"), "parameter 'a2' is replaced by a_lift, a_elbow; leave it out"),
        (ARM, ("reach",), "parameter 'twice' is computed from 'reach', which is to be set at run time"),
        (
            ARM.replace("d1", "A_crank"),
            (DH,),
            "entry a of joint 'crank' would be called 'a_crank', too close to parameter 'A_crank'",
        ),
        (ARM.replace("wrist_1", "a_waist"), ("a_waist",), "too close to joint 'a_waist'"),
    ],
)
def test_names_that_cannot_be_are_refused_with_those_that_can(text: str, wrt: tuple[str, ...], message: str) -> None:
    with pytest.raises(KinegenError) as caught:
        with_runtime_entries(loads(text, "arm.yaml"), wrt)

    assert message in caught.value.message


@pytest.mark.parametrize(
    ("value", "entries", "more", "where"),
    [
        ("0.5", "a: 0.1, alpha: 0, d: sqrt(p - 0.5), theta: q", "", r"arm.yaml:7: joint 1 \(turn\): 'p'"),
        ("0", "a: p*sqrt(p), alpha: 0, d: 0, theta: q", "", r"arm.yaml:7: joint 1 \(turn\): 'p'"),
        ("0.2", "a: sqrt(1 + sqrt(5*p - 1)), alpha: 0, d: 0, theta: q", "", r"arm.yaml:7: joint 1 \(turn\): 'p'"),
        ("0.2", "a: p, alpha: 0, d: 0, theta: q", "tool: {xyz: [sqrt(p - 0.2), 0, 0]}", "arm.yaml: tool: 'p'"),
    ],
)
def test_a_root_that_is_zero_has_no_derivative(value: str, entries: str, more: str, where: str, tmp_path: Path) -> None:
    head = "kinegen: 1\nname: arm\nconvention: modified\nunits: {length: m, angle: deg}\n"
    text = f"{head}parameters: {{p: {value}}}\njoints:\n  - {{name: turn, {entries}}}\n{more}\n"
    path = write_robot(tmp_path, text)
    quantities = (parse_quantity("parameter_jacobian"),)

    with pytest.raises(KinegenError, match=f"{where} is set at run time and is in a square root that is zero"):
        make(path, tmp_path, quantities=quantities, wrt=("p",), compile=False)

    path = write_robot(tmp_path, text.replace(f"p: {value}}}", f"p: {value}1}}" if "." in value else "p: 0.1}"))
    assert make(path, tmp_path, quantities=quantities, wrt=("p",), compile=False).proof.comparisons
