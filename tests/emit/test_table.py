"""The table in the comment of a header: every number of the file, in the units of the file; and the command."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.metadata import command_line, table_lines, table_title
from kinegen.backends.scalar_types import ScalarType
from kinegen.derive.dispatch import derive
from kinegen.io.load import load
from kinegen.ir.lower import lower, runtime_defaults
from kinegen.model.expression_parser import text_names
from kinegen.model.outputs import USUAL, parse_quantity
from kinegen.model.runtime_entries import with_runtime_entries
from kinegen.ui.cli.build import quantities_of
from tests.robot.files import robot

ROBOTS = Path(__file__).resolve().parents[2] / "robots"


def kernels(name: str, *outputs: str) -> RobotPrograms:
    """The programs of a robot."""
    arm = load(ROBOTS / f"{name}.yaml")
    quantities = tuple(map(parse_quantity, outputs)) or USUAL
    return RobotPrograms(arm, tuple(lower(derive(arm, quantity)) for quantity in quantities), runtime_defaults(arm))


def test_a_table_as_its_owner_wrote_it() -> None:
    arm = load(ROBOTS / "puma560.yaml")

    assert table_title(arm) == "Table of puma560.yaml, modified convention, lengths in m, angles in deg:"
    assert table_lines(arm) == (
        "row         alpha       a        d  theta",
        "waist           0       0        0   q[0]",
        "shoulder      -90       0        0   q[1]",
        "elbow           0  0.4318  0.15005   q[2]",
        "forearm       -90  0.0203   0.4318   q[3]",
        "wrist_bend     90       0        0   q[4]",
        "flange        -90       0        0   q[5]",
    )


@pytest.mark.parametrize(
    ("row", "shown"),
    [
        ("alpha: 90, a: 0, d: 0, theta: q, offset: -90", "90 0 0 q[0] - 90"),
        ("alpha: 0, a: 0, d: 0.1 - q/2, theta: 30", "0 0 -0.5*q[0] + 0.1 30"),
        ("alpha: atan(1), a: 2*b, d: 0, theta: 90 - q", "45 1 0 -q[0] + 90"),
        ("alpha: 0, a: r + 0.1, d: r*r, theta: q", "0 r + 0.1 f(r) q[0]"),
        ("alpha: t, a: r*b, d: 0, theta: q - 2*t", "t 0.5*r 0 q[0] - 2*t"),
    ],
)
def test_entries(row: str, shown: str) -> None:
    every = {"b": "b: 0.5", "r": "r: {value: 1, runtime: true}", "t": "t: {value: 3, runtime: true}"}
    named = [text for name, text in every.items() if name in text_names(row)]
    arm = robot(f"{{name: one, {row}}}", more=f"parameters: {{{', '.join(named)}}}" if named else "")

    assert " ".join(table_lines(arm)[1].split()) == f"one {shown}"


def test_trees_sequences_and_fixed_transforms() -> None:
    lines = table_lines(load(ROBOTS / "hand.yaml"))
    assert lines[7].endswith("Tx(90) Ty(25)  on base")

    arm = robot(
        "{name: base, a: 0, alpha: 0, d: 0, theta: q}",
        more="base: {xyz: [0, 0, 1]}\ntool: {rpy: [0, 0, 90]}\nframes: {eye: {parent: tool, xyz: [1, 0, 0]}}",
    )
    assert table_lines(arm)[2:] == ("base: Tz(1)", "tool: Rz(90)", "eye on tool: Tx(1)")
    assert table_lines(robot()) == ()


def test_every_robot_of_the_house_has_a_table_that_fits() -> None:
    for path in sorted(ROBOTS.glob("*.yaml")):
        lines = table_lines(load(path))
        assert all(line.isascii() and "*/" not in line and "/*" not in line for line in lines)
        assert max(map(len, lines)) < 116, path


def test_the_command_is_taken_by_the_command_line() -> None:
    outputs = ("pose", "frames", "position", "jacobian", "twist", "hessian", "pose@elbow", "jacobian_local@elbow")
    words = shlex.split(command_line(kernels("puma560", *outputs)))

    assert words[:3] == ["kinegen", "build", "puma560.yaml"]
    assert set(quantities_of(None, None, words[4])) == set(map(parse_quantity, outputs))  # type: ignore[arg-type]


def test_the_command_names_what_derivatives_are_taken_by() -> None:
    arm = with_runtime_entries(load(ROBOTS / "ur5.yaml"), ("dh",))
    given = RobotPrograms(arm, (lower(derive(arm, parse_quantity("parameter_jacobian"))),), runtime_defaults(arm))
    words = shlex.split(command_line(given))

    assert words[-2] == "--wrt"
    again = with_runtime_entries(load(ROBOTS / "ur5.yaml"), tuple(word.strip() for word in words[-1].split(",")))
    assert again.digest == arm.digest


def test_the_header_holds_both() -> None:
    header = emit_kernel(kernels("puma560"), ScalarType.FLOAT)["puma560_f32.h"]

    assert " *   elbow           0  0.4318  0.15005   q[2]\n" in header
    assert " *   kinegen build puma560.yaml --outputs pose,frames,position\n" in header
