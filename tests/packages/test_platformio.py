"""The PlatformIO library, held against the rules for library.json, and its example."""

from __future__ import annotations

import copy
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

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

WORD = {"type": "string", "pattern": r"^([a-z\d\-_]+|\*)$", "minLength": 1, "maxLength": 50}
# https://docs.platformio.org/en/latest/manifests/library-json/: the fields in use, and nothing else.
SCHEMA = {
    "type": "object",
    "required": ["name", "version", "description", "keywords", "license"],
    "additionalProperties": False,
    "properties": {
        "$schema": {"type": "string", "format": "uri"},
        "name": {"type": "string", "pattern": "^[^:;/,@<>]+$", "minLength": 1, "maxLength": 50},
        "version": {"type": "string", "maxLength": 20},
        "description": {"type": "string", "minLength": 1, "maxLength": 255},
        "keywords": {"type": "array", "items": {"type": "string", "pattern": r"^[a-z\d\-+. ]+$", "maxLength": 50}},
        "license": {"const": "0BSD"},
        "frameworks": WORD,
        "platforms": WORD,
        "headers": {"type": "array", "items": {"type": "string"}, "minItems": 1},
        "examples": {
            "type": "array",
            "items": {
                "type": "object",
                "required": ["name", "base", "files"],
                "additionalProperties": False,
                "properties": {
                    "name": {"type": "string", "pattern": r"^[a-zA-Z\d\-_/]+$", "maxLength": 100},
                    "base": {"type": "string"},
                    "files": {"type": "array", "items": {"type": "string"}},
                },
            },
        },
        "build": {
            "type": "object",
            "additionalProperties": False,
            "properties": {"flags": {"type": "array", "items": {"type": "string", "pattern": "^-"}}},
        },
    },
}


def defects(manifest: Mapping[str, Any], files: Mapping[str, str]) -> list[str]:
    """What the rules would not accept."""
    found = [str(error.message) for error in jsonschema.Draft202012Validator(SCHEMA).iter_errors(manifest)]
    if not is_semantic_version(str(manifest.get("version"))):
        found.append("version")
    found += [f"no {name}" for name in manifest["headers"] if f"include/{name}" not in files]
    for example in manifest["examples"]:
        found += [f"no {name}" for name in example["files"] if f"{example['base']}/{name}" not in files]
    return found


@pytest.mark.parametrize("reals", [(ScalarType.FLOAT,), (ScalarType.DOUBLE, ScalarType.FLOAT), *INTEGERS], ids="-".join)
@pytest.mark.parametrize("robot", ROBOTS)
def test_the_manifest_keeps_the_rules(robot: str, reals: tuple[str, ...]) -> None:
    files = project(robot, Ecosystem.PLATFORMIO, reals)

    assert defects(json.loads(files["library.json"]), files) == []


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("name", "a/b"),
        ("version", "one"),
        ("description", ""),
        ("keywords", ["Robot Arm"]),
        ("headers", ["absent.h"]),
        ("examples", [{"name": "pose", "base": "examples", "files": ["pose.cpp"]}]),
        ("licence", "0BSD"),
    ],
)
def test_a_manifest_that_breaks_a_rule_is_noticed(key: str, value: object) -> None:
    files = project("puma560", Ecosystem.PLATFORMIO)
    manifest = copy.deepcopy(json.loads(files["library.json"]))
    manifest[key] = value

    assert len(defects(manifest, files)) == 1


@pytest.mark.parametrize("arduino", [True, False], ids=["arduino", "plain"])
@pytest.mark.parametrize("reals", [(ScalarType.FLOAT,), *INTEGERS], ids="-".join)
@pytest.mark.parametrize("robot", ROBOTS)
def test_the_example_runs(robot: str, reals: tuple[str, ...], arduino: bool, tmp_path: Path) -> None:
    """As PlatformIO builds: src and include on the path, src in an archive, the example as the project."""
    need("gcc", "g++")
    library = write_package(tmp_path, robot, Ecosystem.PLATFORMIO, reals)
    flags = json.loads((library / "library.json").read_text())["build"]["flags"]
    places = [f"-I{library / 'include'}", f"-I{library / 'src'}"]
    sources = sorted((library / "src").glob("*.c"))
    run(["gcc", "-std=gnu11", "-Os", "-Wall", "-Wextra", "-Werror", *flags, *places, "-c", *sources], tmp_path)
    run(["gcc-ar", "rcs", "library.a", *(f"{source.stem}.o" for source in sources)], tmp_path)
    example = library / "examples" / "pose" / "pose.cpp"
    framework = ["-DARDUINO=10819", f"-I{STUBS}"] if arduino else []
    run(
        ["g++", "-Os", "-Wall", "-Wextra", "-Werror", *framework, *places, example, "library.a", "-o", "example"],
        tmp_path,
    )

    told = run([tmp_path / "example"], tmp_path)

    np.testing.assert_allclose(last_rows(told), example_pose(robot, example.read_text()), atol=2e-4)


def test_the_library_is_found_by_its_header_alone() -> None:
    """PlatformIO takes a library whose include or src folder holds what a project includes; each name stands once."""
    headers = [path.rpartition("/")[2] for path in project("puma560", Ecosystem.PLATFORMIO) if path.endswith(".h")]

    assert sorted(headers) == ["puma560_f32.h", "puma560_f32_vectors.h"]
