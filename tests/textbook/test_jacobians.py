"""Every Jacobian that a textbook prints is equal, exactly, to what `kinegen show --output jacobian` prints."""

from __future__ import annotations

from typing import Any

import mpmath
import pytest
import sympy as sp
import yaml

from kinegen.backends.textbook.jacobian import jacobian, jacobian_form
from kinegen.backends.textbook.notation import NOTATIONS, entry_names, entry_texts
from kinegen.derive.pose import transform
from kinegen.io.load import load
from kinegen.model.outputs import Reference
from kinegen.model.robot import BASE
from tests.textbook.catalog import HERE, ROBOTS, System, systems
from tests.textbook.prove import is_zero

PRINTED = [
    pytest.param(item, id=f"{item['system']}-{item['reference']}")
    for item in yaml.safe_load((HERE / "jacobians.yaml").read_text(encoding="utf-8"))
]


def system_of(item: dict[str, Any]) -> System:
    return next(system for system in systems() if system.key == item["system"])


@pytest.mark.parametrize("item", PRINTED)
def test_the_published_jacobian_is_ours(item: dict[str, Any]) -> None:
    system = system_of(item)
    robot = load(ROBOTS / f"{system.robots[0]}.yaml")
    ours = jacobian(robot, 0, item["to"], Reference(item["reference"]))
    published = sp.Matrix([[system.read(str(text), robot) for text in row] for row in item["matrix"]])

    assert ours.shape == published.shape
    assert [place for place in range(len(ours)) if not is_zero(ours[place] - published[place])] == []


@pytest.mark.parametrize("item", PRINTED)
def test_the_printed_text_says_the_same(item: dict[str, Any]) -> None:
    """What a reader copies from the terminal, read back."""
    system = system_of(item)
    robot = load(ROBOTS / f"{system.robots[0]}.yaml")
    form = jacobian_form(robot, 0, item["to"], Reference(item["reference"]))
    texts = entry_texts(form, NOTATIONS["text"])

    assert [len(row) for row in texts] == [robot.dof] * 6
    assert entry_names(form)[5][0] == "J61"
    for row, published in zip(texts, item["matrix"], strict=True):
        for text, other in zip(row, published, strict=True):
            assert is_zero(system.read(text, robot) - system.read(str(other), robot)), text


@pytest.mark.parametrize("name", ["puma560", "screw", "stanford", "planar_joint", "rpr_polar"])
@pytest.mark.parametrize("reference", Reference)
def test_every_reference_is_the_derivative_of_the_pose(name: str, reference: Reference) -> None:
    """By plain differentiation of the product of the link matrices: omega from dR/dq R^T, then the adjoint."""
    robot = load(ROBOTS / f"{name}.yaml")
    symbols = [sp.Symbol(variable.name, real=True) for variable in robot.variables]
    pose = transform(robot, BASE, robot.tips[0])
    rotation, position = pose[:3, :3], pose[:3, 3]
    found = jacobian(robot, BASE, robot.tips[0], reference)
    others = sorted(pose.free_symbols - set(symbols), key=str)
    values = [*(mpmath.mpf(place + 2) / 7 for place in range(len(symbols))), *[mpmath.mpf(5) / 3] * len(others)]

    def number(matrix: sp.Matrix) -> mpmath.matrix:
        return sp.lambdify([*symbols, *others], matrix, modules="mpmath", cse=True)(*values)

    with mpmath.workdps(30):
        turn = number(rotation)
        for column, symbol in enumerate(symbols):
            spin = number(rotation.diff(symbol)) * turn.T
            angular = mpmath.matrix([spin[2, 1], spin[0, 2], spin[1, 0]])
            linear = number(position.diff(symbol))
            if reference is Reference.WORLD:
                x, y, z = number(position)
                linear += mpmath.matrix(
                    [
                        y * angular[2] - z * angular[1],
                        z * angular[0] - x * angular[2],
                        x * angular[1] - y * angular[0],
                    ]
                )
            if reference is Reference.LOCAL:
                linear, angular = turn.T * linear, turn.T * angular
            ours = number(found[:, column])
            assert max(abs(ours[row] - value) for row, value in enumerate([*linear, *angular])) < 1e-25


def test_frames_that_a_joint_does_not_move_have_a_zero_column() -> None:
    robot = load(ROBOTS / "puma560.yaml")
    columns = jacobian(robot, BASE, "elbow", Reference.LOCAL_WORLD_ALIGNED)

    assert columns[:, 3:].is_zero_matrix
    assert not columns[:, :3].is_zero_matrix


@pytest.mark.parametrize("notation", list(NOTATIONS))
def test_every_notation_prints_all_entries(notation: str) -> None:
    form = jacobian_form(load(ROBOTS / "stanford.yaml"), BASE, "tool", Reference.WORLD)

    assert all(text for row in entry_texts(form, NOTATIONS[notation]) for text in row)
