"""What a release consists of: versions that agree, a workflow, a recipe, and tutorials that say what they need."""

from __future__ import annotations

import re
import shlex
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml
from packaging.requirements import Requirement

import kinegen
from scripts import release

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib  # comes with hatchling

ROOT = Path(__file__).resolve().parent.parent
WORKFLOW = ROOT / ".github" / "workflows" / "tests.yml"


def project() -> dict[str, Any]:
    """The table `project` of pyproject.toml."""
    found = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert isinstance(found, dict)
    return found


def read(path: Path) -> dict[Any, Any]:
    """A file of YAML with a mapping."""
    found = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert isinstance(found, dict)
    return found


def test_the_version_is_the_same_in_every_file() -> None:
    assert set(release.versions().values()) == {kinegen.__version__}


def test_what_a_maintainer_types_names_the_version_and_the_hash(tmp_path: Path) -> None:
    source = tmp_path / "kinegen-9.8.7.tar.gz"
    source.write_bytes(b"abc")

    steps = release.next_steps("9.8.7", source)

    assert "git tag -a v9.8.7 " in steps
    assert "twine upload dist/kinegen-9.8.7*" in steps
    assert "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad" in steps


def test_a_version_that_differs_is_named_before_anything_is_built(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for path in release.VERSIONS:
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text((ROOT / path).read_text(encoding="utf-8"), encoding="utf-8")
    (tmp_path / "CITATION.cff").write_text("version: 9.8.7\n", encoding="utf-8")
    monkeypatch.setattr(release, "ROOT", tmp_path)

    assert release.main() == 1
    assert "CITATION.cff: 9.8.7" in capsys.readouterr().out


def test_the_licence_is_an_expression_and_no_classifier_repeats_it() -> None:
    found = project()

    assert (found["license"], found["license-files"]) == ("MIT", ["LICENSE"])
    assert not [line for line in found["classifiers"] if line.startswith("License")]
    assert found["classifiers"] == sorted(found["classifiers"])


def test_the_extra_all_is_what_users_can_ask_for() -> None:
    """Every extra is in it, but those for work on kinegen itself and those that are gigabytes."""
    found = project()["optional-dependencies"]
    (line,) = found["all"]
    apart = {"all", "bench", "browser", "dev", "docs", "examples", "judges", "learning", "release"}

    assert Requirement(line).extras == set(found) - apart


def test_the_recipe_requires_what_the_package_requires() -> None:
    recipe = read(ROOT / "scripts" / "conda" / "recipe.yaml")
    wanted = {Requirement(each).name: str(Requirement(each).specifier) for each in project()["dependencies"]}
    given = dict(each.split(" ", 1) for each in recipe["requirements"]["run"])

    assert given.pop("python") == project()["requires-python"]
    assert given == wanted
    assert recipe["build"]["python"]["entry_points"] == [f"kinegen = {project()['scripts']['kinegen']}"]
    assert recipe["build"]["noarch"] == "python"


def jobs() -> dict[str, Any]:
    """The jobs of the workflow."""
    found = read(WORKFLOW)["jobs"]
    assert isinstance(found, dict)
    return found


def test_the_workflow_calls_targets_of_the_makefile_or_modules_of_python() -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M))
    commands = [step["run"] for job in jobs().values() for step in job["steps"] if "run" in step]

    assert len(commands) >= 5
    for command in commands:
        words = shlex.split(command)
        assert words[:2] == ["python", "-m"] or (words[0] == "make" and set(words[1:]) <= targets), command


def test_the_workflow_tries_every_system_and_python() -> None:
    matrix = jobs()["test"]["strategy"]["matrix"]

    assert {name.partition("-")[0] for name in matrix["os"]} == {"ubuntu", "macos", "windows"}
    assert matrix["python"] == ["3.10", "3.11", "3.12", "3.13", "3.14"]
    assert f">={matrix['python'][0]}" == project()["requires-python"]


def test_the_workflow_is_one_that_the_forge_accepts() -> None:
    """The structure of its schema, as far as this file uses it; `check-jsonschema` checks the whole."""
    found = read(WORKFLOW)

    # YAML 1.1 reads the key `on` as true.
    assert set(found) == {"name", True, "permissions", "concurrency", "jobs"}
    assert found["permissions"] == {"contents": "read"}
    for job in jobs().values():
        assert {"runs-on", "timeout-minutes", "steps"} <= set(job)
        assert set(job) <= {"name", "runs-on", "timeout-minutes", "steps", "strategy", "env"}
        for step in job["steps"]:
            assert len({"run", "uses"} & set(step)) == 1
            assert set(step) <= {"name", "run", "uses", "with"}
            assert re.fullmatch(r"actions/[a-z-]+@v\d+", step.get("uses", "actions/x@v1"))


@pytest.mark.parametrize(
    "path", sorted((ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml")), ids=lambda path: path.stem
)
def test_a_form_for_issues_asks_for_something(path: Path) -> None:
    form = read(path)
    if path.stem == "config":
        assert form == {"blank_issues_enabled": True}
        return

    assert {"name", "description", "body"} <= set(form)
    assert all(part["attributes"]["label"] for part in form["body"])
    assert any(part.get("validations", {}).get("required") for part in form["body"])


def test_the_hooks_call_the_tools_of_the_environment() -> None:
    (repository,) = read(ROOT / ".pre-commit-config.yaml")["repos"]

    assert repository["repo"] == "local"
    entries = [hook["entry"].split()[:3] for hook in repository["hooks"]]
    assert entries == [[".venv/bin/python", "-m", tool] for tool in ("ruff", "ruff", "mypy")]


@pytest.mark.parametrize("page", release.TUTORIALS, ids=lambda page: page.stem)
def test_every_tutorial_begins_with_what_it_needs(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    extras = project()["optional-dependencies"]

    assert "\nNeeds: " in text[: text.index("\n## ")]
    assert release.needs(text) <= set(extras)
    # A figure needs Matplotlib, and a file of Parquet pyarrow.
    for words, extra in ((r"kinegen view .* -o \S+\.(svg|png|pdf)", "plot"), (r"\.parquet\b", "workspace")):
        assert not re.search(words, text) or extra in release.needs(text)


def test_what_a_tutorial_needs_is_read_from_its_line() -> None:
    assert release.needs("# T\n\nNeeds: `pip install .` in a checkout.\n") == set()
    assert release.needs("Needs: a robot, `pip install '.[plot,fleet]'` and `import`\n") == {"plot", "fleet"}
    with pytest.raises(SystemExit, match="does not say what it needs"):
        release.needs("# T\n\nRun `pip install '.[plot]'`.\n")
