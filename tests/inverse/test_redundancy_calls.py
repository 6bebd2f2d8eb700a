"""Packages of seven joints with a redundancy: how the inverse is called, in Python, on the command line, elsewhere."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import kinegen
from kinegen.backends.languages import LANGUAGES, emit_language
from kinegen.errors import KinegenError
from kinegen.io.load import load
from kinegen.model.outputs import Kind, Quantity
from kinegen.runtime.extension import load_package
from kinegen.tools.viewer.document import page_kernels
from kinegen.ui.cli import main
from kinegen.verify import closed_form_inverse as proof
from kinegen.verify import languages, reference
from kinegen.verify.languages import prove_language
from tests.builds.workshop import ROBOTS, make, set_machine
from tests.emit.emitted import kernels, run, vectors

INVERSE = Quantity(Kind.INVERSE)
OUTPUTS = (Quantity.POSE, INVERSE)
PANDA = load(ROBOTS / "panda_joint_7.yaml")


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ModuleType]:
    folder = tmp_path_factory.mktemp("packages")
    with pytest.MonkeyPatch.context() as patch:
        set_machine(patch, folder / "cache")
        patch.setattr(proof, "TARGETS", 200)
        patch.setattr(proof, "FEWER", 200)
        yield load_package(make(ROBOTS / "panda_joint_7.yaml", folder, quantities=OUTPUTS).folder)


def joints(arm: ModuleType, count: int) -> np.ndarray:
    low, high = np.array(arm.LIMITS).T
    return np.random.default_rng(5).uniform(low, high, (count, 7))


@pytest.mark.parametrize("real", [np.float64, np.float32])
def test_one_target_is_solved_as_in_a_batch(arm: ModuleType, real: type) -> None:
    q = joints(arm, 20).astype(real)
    targets, given = arm.fk(q), q[:, 6]
    solutions, valid = arm.inverse(targets, given)

    assert arm.inverse.backend == "c"
    assert valid.any(axis=1).all()
    np.testing.assert_array_equal(solutions[valid][:, 6], np.repeat(given, valid.sum(axis=1)))
    for place in range(len(q)):
        one = given[place, ...]
        numbers = (one, np.array(one), *([float(one)] if real is np.float64 else []))
        for number in numbers:
            found, holds = arm.inverse(targets[place], number)

            assert found.dtype == real
            np.testing.assert_array_equal(found, solutions[place])
            np.testing.assert_array_equal(holds, valid[place])
        np.testing.assert_array_equal(arm.inverse(targets[place], redundancy=one)[0], solutions[place])


def test_it_broadcasts_with_the_targets(arm: ModuleType) -> None:
    q = joints(arm, 6)
    targets, given = arm.fk(q), q[:, 6]

    assert arm.inverse(targets[0], given)[0].shape == (6, 8, 7)
    assert arm.inverse(targets, given[0])[1].shape == (6, 8)
    np.testing.assert_array_equal(arm.inverse(targets[0], given)[0][3], arm.inverse(targets[0], given[3])[0])
    assert arm.inverse(targets.reshape(2, 3, 4, 4), given.reshape(2, 3), nearest=q[0])[0].shape == (2, 3, 7)


def test_the_nearest_solution_has_the_given_value(arm: ModuleType) -> None:
    q = joints(arm, 50)
    targets, given = arm.fk(q), q[:, 6]
    found, exists = arm.inverse(targets, given, nearest=q + 1e-3)

    assert exists.all()
    np.testing.assert_allclose(found, q, atol=1e-7)
    for target, number, near, wanted in zip(targets, given, q + 1e-3, found, strict=True):
        np.testing.assert_array_equal(arm.inverse(target, number, nearest=near)[0], wanted)


def test_what_is_no_redundancy_is_refused_or_not_solved(arm: ModuleType) -> None:
    target = arm.fk(joints(arm, 1)[0])
    with pytest.raises(TypeError, match=r"takes 2 arrays \(base_T_tool, redundancy\), 1 given"):
        arm.inverse(target)
    with pytest.raises(TypeError, match=r"takes 2 arrays \(base_T_tool, redundancy\), 1 given"):
        arm.inverse(target, nearest=np.zeros(7))
    with pytest.raises(TypeError, match="redundancy has strings"):
        arm.inverse(target, "0.5")
    with pytest.raises(ValueError, match=r"the shapes of base_T_tool \(3, 4, 4\), redundancy \(2,\)"):
        arm.inverse(np.stack([target] * 3), np.zeros(2))
    with pytest.raises(ValueError, match="orthonormal"):
        arm.inverse(target @ np.diag([2.0, 1.0, 1.0, 1.0]), 0.0)
    for value in (np.nan, np.inf, 3.0, -3.0):
        assert not arm.inverse(target, value)[1].any()
        assert np.isnan(arm.inverse(target, value, nearest=np.zeros(7))[0]).all()


def test_arguments_are_bound(arm: ModuleType) -> None:
    q = joints(arm, 1)[0]
    target, given = arm.fk(q), np.array(q[6])
    solutions, valid, numbers = np.zeros((8, 7)), np.zeros(8, bool), np.zeros(8)
    arm.inverse.bind(target, given, solutions, valid)()
    arm.inverse.bind(target, given, solutions, numbers)()
    wanted = arm.inverse(target, given)

    np.testing.assert_array_equal(solutions, wanted[0])
    np.testing.assert_array_equal(valid, wanted[1])
    np.testing.assert_array_equal(numbers, wanted[1])


def test_the_option_is_the_key(capsys: pytest.CaptureFixture[str]) -> None:
    for words in (["panda_joint_7.yaml"], ["panda.yaml", "--redundancy", "joint_7"]):
        assert main(["inspect", str(ROBOTS / words[0]), *words[1:]]) == 0
        assert "with spherical shoulder, joint_7 given\n" in capsys.readouterr().out
    assert main(["inspect", str(ROBOTS / "ur5.yaml"), "--redundancy", "wrist"]) == 1
    assert "redundancy: there is no joint 'wrist' (expected base_turn, " in capsys.readouterr().err
    assert main(["inspect", str(ROBOTS / "ur5.yaml"), "--redundancy", "arm_angle"]) == 1
    message = "redundancy: the robot has 6 joint variables, expected 7 for arm_angle\n"
    assert capsys.readouterr().err.endswith(message)
    assert main(["inspect", str(ROBOTS / "panda.yaml")]) == 0
    assert "  seven joints: --redundancy NAME" in capsys.readouterr().out


def test_an_option_makes_another_build(tmp_path: Path, machine: None) -> None:
    """A build that is repeated is recognised by its redundancy too."""
    words = ["build", str(ROBOTS / "iiwa14.yaml"), "--outputs", "pose", "--real", "double", "--no-compile"]
    headers = []
    for more in ([], ["--redundancy", "joint_1"], ["--redundancy", "arm_angle"]):
        assert main([*words, "-o", str(tmp_path), *more]) == 0
        headers.append((tmp_path / "iiwa14" / "iiwa14.h").read_text())
        assert all(f" {word}" in headers[-1] for word in more)

    assert len(set(headers)) == 3


def test_python_reads_and_writes_it() -> None:
    arm = kinegen.load(ROBOTS / "panda.yaml", redundancy="joint_7")

    assert arm.redundancy == "joint_7"
    assert kinegen.load(kinegen.load(ROBOTS / "panda.yaml"), redundancy="joint_7") == arm
    assert kinegen.load(arm.to_yaml()).digest == arm.digest
    with pytest.raises(KinegenError, match="there is no joint 'joint_8'"):
        kinegen.load(ROBOTS / "panda.yaml", redundancy="joint_8")


def test_a_page_searches_and_refuses_the_closed_form() -> None:
    assert INVERSE not in {program.quantity for program in page_kernels(PANDA).programs}
    with pytest.raises(KinegenError, match=r"a page has no input for the redundancy \(joint_7\)"):
        page_kernels(PANDA, (INVERSE,))


@pytest.mark.languages
@pytest.mark.parametrize("robot", ["iiwa14_arm_angle", "hanging_arm"])
@pytest.mark.parametrize("name", ["cpp", "rust", "javascript"])
def test_every_language_takes_it(name: str, robot: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    language = LANGUAGES[name]
    if not any(map(shutil.which, language.tools)):
        pytest.skip(f"needs {language.install}")
    monkeypatch.setattr(languages, "FEWER", 200)
    monkeypatch.setattr(languages, "SAME_BITS", 64)
    given = kernels(robot, OUTPUTS)
    files = emit_language(given, language, vectors(robot, OUTPUTS))
    compared = prove_language(given, language, files)

    assert {str(each.quantity) for each in compared} == {"pose", "inverse"}
    assert all(each.holds for each in compared)
    if name == "cpp":
        for path, text in files.items():
            (tmp_path / Path(path).name).write_text(text, encoding="utf-8")
        test = tmp_path / f"{robot}_test_double.cpp"
        run(["g++", "-std=c++17", "-Wall", "-Wextra", "-Werror", test, "-o", tmp_path / "test"])
        assert "0 failures" in run([tmp_path / "test"])


def test_the_reference_finds_what_was_given() -> None:
    q = np.zeros((3, 7))
    q[:, 6] = 0.1, 0.2, 0.3

    np.testing.assert_array_equal(reference.redundancy(PANDA, q), q[:, 6])
    with pytest.raises(ValueError, match="has no redundancy"):
        reference.redundancy(load(ROBOTS / "panda.yaml"), q)
