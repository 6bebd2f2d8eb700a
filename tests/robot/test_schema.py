"""The published JSON Schema agrees with the loader about the shape of a robot file."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from kinegen.errors import KinegenError
from kinegen.io.load import load
from kinegen.io.robot_file import keys
from kinegen.io.robot_file.keys import schema
from kinegen.support.naming import FORMAT_WORDS

ROOT = Path(__file__).resolve().parents[2]
ROBOTS = sorted((ROOT / "robots").glob("*.yaml"))
VALIDATOR = jsonschema.Draft202012Validator(schema())

# Bad files whose defect is one of shape, by the words that their names hold.
SHAPES = (
    "unknown_key",
    "unknown_top_key",
    "missing",
    "is_a_list",
    "is_a_mapping",
    "is_a_word",
    "is_text",
    "row_beta_in",
    "row_hayati",
    "row_type_unknown",
    "row_without_name",
    "convention_unknown",
    "convention_far_off",
    "units_length_unknown",
    "units_angle_unknown",
    "joints_200",
    "limits_one",
    "limits_three",
    "limits_a_number",
    "tool_two_values",
    "tool_xyz_and_ets",
    "ets_with",
    "ets_unknown",
    "ets_no_brackets",
    "ets_too_long",
    "frame_without_parent",
    "frame_name_with_space",
    "parameter_without_value",
    "parameter_bad_dimension",
    "name_with",
    "name_ends",
    "name_is_a_path",
    "name_too_long",
    "name_not_ascii",
    "version_2",
    "description_too_long",
    "unknown_dimension",
    "drive_form_and_value",
    "drive_key_of_another_form",
    "drive_sign_2",
    "drive_unknown_form",
    "linear_actuator_three_sides",
)
MISSHAPEN = [path for path in sorted((ROOT / "tests/bad").glob("*.yaml")) if any(word in path.name for word in SHAPES)]


def test_it_is_a_schema() -> None:
    jsonschema.Draft202012Validator.check_schema(schema())

    assert schema() is not schema()


@pytest.mark.parametrize("path", ROBOTS, ids=lambda path: str(path.stem))
def test_every_robot_of_the_house_is_valid(path: Path) -> None:
    assert [error.message for error in VALIDATOR.iter_errors(plain(path))] == []


@pytest.mark.parametrize("path", MISSHAPEN, ids=lambda path: str(path.stem))
def test_a_misshapen_file_is_not(path: Path) -> None:
    assert not VALIDATOR.is_valid(plain(path))


def test_enough_misshapen_files_are_tried() -> None:
    assert len(MISSHAPEN) > len(SHAPES)


def test_every_key_has_a_meaning() -> None:
    """An editor shows it while one types."""
    found = schema()
    tables = [
        (found, keys.TOP),
        (found["properties"]["units"], keys.UNITS),
        (found["$defs"]["row"], keys.ROW),
        (found["$defs"]["transform"], keys.TRANSFORM),
        (found["$defs"]["frame"], keys.FRAME),
        (found["$defs"]["parameter"]["anyOf"][1], keys.PARAMETER),
        (found["properties"]["actuators"], keys.ACTUATORS),
        (found["$defs"]["reading"]["anyOf"][1], keys.READING),
        (found["$defs"]["drive"], keys.DRIVE),
    ]
    for part, table in tables:
        assert {key: value["description"] for key, value in part["properties"].items()} == table
        assert part["additionalProperties"] is False


@pytest.mark.parametrize("key", keys.TOP_REQUIRED)
def test_loader_and_schema_require_the_same_keys(key: str, tmp_path: Path) -> None:
    whole = plain(ROOT / "robots" / "puma560.yaml")
    without = copy.deepcopy(whole)
    del without[key]
    (tmp_path / "arm.yaml").write_text(yaml.safe_dump(without), encoding="utf-8")

    assert VALIDATOR.is_valid(whole)
    assert not VALIDATOR.is_valid(without)
    with pytest.raises(Exception, match=f"key '{key}' is missing"):
        load(tmp_path / "arm.yaml")


ARM = """kinegen: 1
name: arm
convention: standard
units: {length: m, angle: deg}
joints:
  - {name: j1, theta: q, d: 0, a: 1, alpha: 0}
"""


@pytest.mark.parametrize("text", ["3", "1.5", "true", "A planar arm", "''", "[3]", "{a: 3}"])
def test_a_description_is_text_for_both_if_it_is_for_one(text: str, tmp_path: Path) -> None:
    assert_both_agree(f"{ARM}description: {text}\n", tmp_path)


@pytest.mark.parametrize("word", sorted(FORMAT_WORDS))
@pytest.mark.parametrize(
    "change",
    [
        ("name: arm", "name: {}"),
        ("name: j1", "name: {}"),
        ("joints:", "parameters: {{{}: 1}}\njoints:"),
        ("joints:", "frames: {{{}: {{parent: j1}}}}\njoints:"),
    ],
    ids=["robot", "joint", "parameter", "frame"],
)
def test_words_of_the_file_name_what_the_loader_lets_them_name(
    change: tuple[str, str], word: str, tmp_path: Path
) -> None:
    old, new = change

    assert_both_agree(ARM.replace(old, new.format(word)), tmp_path)


def assert_both_agree(text: str, folder: Path) -> None:
    """The loader takes a file if, and only if, the schema does."""
    (folder / "arm.yaml").write_text(text, encoding="utf-8")
    try:
        load(folder / "arm.yaml")
    except KinegenError:
        taken = False
    else:
        taken = True

    assert VALIDATOR.is_valid(yaml.safe_load(text)) == taken


def plain(path: Path) -> Any:
    """A file as an editor reads it."""
    return yaml.safe_load(path.read_text(encoding="utf-8"))
