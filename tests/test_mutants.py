"""`make mutants`: every mutant of the table fits the sources of today, and a survivor is reported as one."""

from __future__ import annotations

import ast
import re
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from scripts import mutants
from scripts.mutants import ROOT, Mutant, Outcome

TABLE = mutants.mutants()
STAGES = ["io", "model", "derive", "ir", "backends", "verify", "runtime"]


@pytest.mark.parametrize("mutant", [pytest.param(each, id=each.name) for each in TABLE])
def test_a_mutant_fits_the_sources(mutant: Mutant) -> None:
    """Where this fails, `old` has to be what the file has now: tests/mutants.yaml."""
    changed = mutant.applied()

    assert changed != (ROOT / mutant.file).read_text(encoding="utf-8")
    assert ast.dump(ast.parse(changed)) != ast.dump(ast.parse((ROOT / mutant.file).read_text(encoding="utf-8")))
    for name in mutant.tests:
        path, _, function = name.partition("::")
        assert (ROOT / path).exists()
        assert not function or re.search(rf"^def {function}\(", (ROOT / path).read_text(encoding="utf-8"), re.MULTILINE)


def test_there_are_sixty_in_all_stages_and_a_third_of_them_is_in_the_judge() -> None:
    stages = [each.stage for each in TABLE]

    assert len({each.name for each in TABLE}) == len(TABLE) >= 60
    assert list(dict.fromkeys(stages)) == STAGES
    assert stages.count("verify") >= 20


def test_a_piece_that_is_gone_or_there_twice_is_an_error(tmp_path: Path) -> None:
    mutant = Mutant("ir", "a sign", "one.py", "a + b", "a - b", ())
    for text, count in (("a - b", 0), ("a + b\na + b", 2)):
        (tmp_path / "one.py").write_text(text, encoding="utf-8")
        with pytest.raises(ValueError, match=f"a sign: one.py has {count} matches"):
            mutant.applied(tmp_path)


@pytest.mark.parametrize("name", ["t/test_a.py::test_b", "t/test_a.py::T::test_b[-x - y-p[0]]", "t/test_a.py"])
@pytest.mark.parametrize("reason", ["", " - assert [1] == [2]", " - x - y"])
def test_the_test_that_failed_is_found_in_what_pytest_prints(name: str, reason: str) -> None:
    found = mutants.FAILURE.search(f"=== short ===\nFAILED {name}{reason}\n1 failed")

    assert found is not None
    assert found[1] == name


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A project of one function, with a quick test, a slow one and one that fails by itself."""
    for name, text in {
        "pytest.ini": '[pytest]\naddopts = -m "not slow"\nmarkers = slow\n',
        "one.py": "def half(x):\n    return x / 2\n\n\ndef twice(x):\n    return x + x\n",
        "test_one.py": "import pytest\nfrom one import half, twice\n\ndef test_half():\n    assert half(3) == 1.5\n\n"
        "@pytest.mark.slow\ndef test_twice():\n    assert twice(3) == 6\n",
        "test_red.py": "def test_red():\n    assert False\n",
    }.items():
        (tmp_path / "work" / name).parent.mkdir(exist_ok=True)
        (tmp_path / "work" / name).write_text(text, encoding="utf-8")
    monkeypatch.setattr(mutants, "ROOT", tmp_path / "work")
    return tmp_path / "work"


HALF = Mutant("ir", "a whole", "one.py", "x / 2", "x // 1", ("test_one.py",))
TWICE = replace(HALF, name="a square", old="x + x", new="x * x")
SAME = replace(HALF, name="the same", old="x / 2", new="x * 0.5")


def test_quick_and_slow_tests_kill_and_a_survivor_is_reported(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = (project / "one.py").read_text(encoding="utf-8")
    found = mutants.run((HALF, TWICE, SAME), 1)

    assert [each.killer for each in found] == ["test_one.py::test_half", "test_one.py::test_twice", ""]
    assert "the same: SURVIVES" in capsys.readouterr().out
    assert (project / "one.py").read_text(encoding="utf-8") == before


@pytest.mark.usefixtures("project")
def test_a_test_that_fails_without_a_mutant_has_killed_none() -> None:
    with pytest.raises(RuntimeError, match="test_red fails without any mutant"):
        mutants.run((replace(HALF, tests=("test_red.py",)),), 1)


@pytest.mark.usefixtures("project")
def test_tests_that_cannot_be_run_are_an_error() -> None:
    with pytest.raises(RuntimeError, match="pytest ended with 4"):
        mutants.run((replace(HALF, tests=("test_nowhere.py",)),), 1)


@pytest.mark.parametrize("killer", ["", "tests/test_some.py::test_it"])
def test_a_survivor_fails_the_run(
    killer: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(mutants, "run", lambda chosen, _: [Outcome(each, killer, 1.0) for each in chosen])
    monkeypatch.setattr(sys, "argv", ["mutants.py", TABLE[0].name])

    assert mutants.main() == (not killer)
    assert f"{int(bool(killer))} of 1 mutants are killed, {int(not killer)} survive" in capsys.readouterr().out


def test_they_are_listed_and_sampled_by_the_commit(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(mutants.sampling, "commit", lambda: "now")
    for options, least, most in (([], len(TABLE), len(TABLE)), (["--sample"], 1, len(TABLE) // 3)):
        monkeypatch.setattr(sys, "argv", ["mutants.py", "--list", *options])
        assert mutants.main() == 0
        assert least <= len(capsys.readouterr().out.splitlines()) <= most
