"""The ESP-IDF component, held against the rules of the component manager, and its example project."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from kinegen.backends.firmware.ecosystem import Ecosystem
from kinegen.backends.scalar_types import ScalarType
from tests.packages.packages import (
    INTEGERS,
    ROBOTS,
    STUBS,
    example_pose,
    is_semantic_version,
    last_rows,
    need,
    project,
    run,
    write_package,
)

# https://docs.espressif.com/projects/idf-component-manager/en/latest/reference/manifest_file.html
FIELDS = (
    "targets",
    "dependencies",
    "version",
    "maintainers",
    "description",
    "license",
    "tags",
    "files",
    "examples",
    "url",
    "repository",
    "repository_info",
    "documentation",
    "issues",
    "discussion",
)
RANGE = re.compile(r"\*|((==|>=|<=|>|<|!=|~|~=|\^)?\d+(\.\d+){0,2})(,(==|>=|<=|>|<|!=|~|~=|\^)?\d+(\.\d+){0,2})*")


def defects(manifest: Mapping[str, Any]) -> list[str]:
    """What the component manager would not accept."""
    rules = {
        "fields": set(manifest) <= set(FIELDS),
        "version": isinstance(manifest.get("version"), str) and is_semantic_version(manifest["version"]),
        "description": isinstance(manifest.get("description"), str) and manifest["description"],
        "license": manifest.get("license") == "0BSD",
        "tags": all(re.fullmatch(r"[a-z0-9_-]+", tag) for tag in manifest["tags"]),
        "dependencies": all(
            name == "idf" and RANGE.fullmatch(version) for name, version in manifest["dependencies"].items()
        ),
    }
    return [rule for rule, kept in rules.items() if not kept]


@pytest.mark.parametrize("reals", [(ScalarType.FLOAT,), (ScalarType.DOUBLE, ScalarType.FLOAT), *INTEGERS], ids="-".join)
@pytest.mark.parametrize("robot", ROBOTS)
def test_the_manifest_keeps_the_rules(robot: str, reals: tuple[str, ...]) -> None:
    files = project(robot, Ecosystem.ESP_IDF, reals)

    assert defects(yaml.safe_load(files["idf_component.yml"])) == []
    assert "LICENSE" in files
    assert "README.md" in files


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("version", 1.0),
        ("version", "v1"),
        ("licence", "0BSD"),
        ("license", "none"),
        ("tags", ["two words"]),
        ("dependencies", {"idf": "new"}),
    ],
)
def test_a_manifest_that_breaks_a_rule_is_noticed(key: str, value: object) -> None:
    manifest = yaml.safe_load(project("puma560", Ecosystem.ESP_IDF)["idf_component.yml"]) | {key: value}

    assert len(defects(manifest)) == 1


@pytest.mark.parametrize("robot", ROBOTS)
def test_every_file_that_the_component_names_is_there(robot: str) -> None:
    files = project(robot, Ecosystem.ESP_IDF, (ScalarType.DOUBLE, ScalarType.FLOAT))
    quoted = re.findall(r'"([^"]+)"', files["CMakeLists.txt"])
    sources = {path for path in files if path.endswith(".c") and not path.startswith("examples/")}

    assert {name for name in quoted if name.endswith(".c")} == sources
    assert {name for name in quoted if "." not in name} == {
        path.rpartition("/")[0] for path in files if path.endswith(".h")
    }


@pytest.mark.parametrize("reals", INTEGERS, ids="-".join)
def test_the_example_project_runs_the_self_test_in_integers(reals: tuple[str, ...], tmp_path: Path) -> None:
    need("cmake", "gcc")
    component = write_package(tmp_path, "puma560", Ecosystem.ESP_IDF, reals)
    folder, products = component / "examples" / "pose", tmp_path / "products"
    flags = "-DCMAKE_C_FLAGS=-Wall -Wextra -Werror"
    run(["cmake", "-S", folder, "-B", products, flags], tmp_path, IDF_PATH=str(STUBS / "esp_idf"))
    run(["cmake", "--build", products], tmp_path)

    told = run([products / "puma560_pose"], tmp_path)

    assert "puma560_q30_selftest: passed\n" in told
    assert "FAILED" not in told
    np.testing.assert_allclose(
        last_rows(told), example_pose("puma560", (folder / "main" / "main.c").read_text()), atol=1e-5
    )


@pytest.mark.parametrize("robot", ["puma560", "blocks"])
def test_the_example_project_builds_and_runs(robot: str, tmp_path: Path) -> None:
    """With a build system that stands in for ESP-IDF's, for this machine."""
    need("cmake", "gcc")
    component = write_package(tmp_path, robot, Ecosystem.ESP_IDF, (ScalarType.DOUBLE, ScalarType.FLOAT))
    folder, products = component / "examples" / "pose", tmp_path / "products"
    run(["cmake", "-S", folder, "-B", products], tmp_path, IDF_PATH=str(STUBS / "esp_idf"))
    built = run(["cmake", "--build", products, "--verbose"], tmp_path)

    told = run([products / f"{robot}_pose"], tmp_path)

    compiled = [line for line in built.splitlines() if " -c " in line and f"/src/{robot}" in line]
    assert len(compiled) == 2
    assert all("-ffp-contract=off" in line for line in compiled)
    verdicts = [line for line in told.splitlines() if "selftest" in line]
    assert f"{robot}_selftest: passed" in verdicts
    assert f"{robot}_f32_selftest: passed" in verdicts
    assert all(re.fullmatch(r"\w+(_sincos)?: passed", line) for line in verdicts)
    assert (f"{robot}_f32_selftest_sincos: passed" in verdicts) == (
        "_sincos(" in (component / "src" / f"{robot}_f32.c").read_text()
    )
    shown = example_pose(robot, (folder / "main" / "main.c").read_text())
    np.testing.assert_allclose(last_rows(told), shown, atol=1e-5)
