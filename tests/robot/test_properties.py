"""Whatever stands in a robot file, the loader answers with a robot or with one clear line."""

from __future__ import annotations

import copy
import math
from pathlib import Path
from typing import Any

import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from kinegen.errors import RobotFileError
from kinegen.io.load import loads
from kinegen.io.robot_file import keys
from kinegen.model.actuators import Coupling
from kinegen.model.expression_parser import Arithmetic, Expression, evaluate
from kinegen.model.robot import Robot

FLOATS = Arithmetic(
    float,
    math.pi,
    {
        "sqrt": lambda value: math.sqrt(max(value, 0.0)),
        "asin": lambda value: math.asin(min(1.0, max(-1.0, value))),
        "acos": lambda value: math.acos(min(1.0, max(-1.0, value))),
        "atan": math.atan,
        "atan2": math.atan2,
    },
)
ROBOTS = {path.stem: path for path in sorted((Path(__file__).resolve().parents[2] / "robots").glob("*.yaml"))}
SEED_NAMES = ("puma560", "hand", "scara_hd", "screw", "motoman_l3", "palletiser", "differential_wrist")
SEEDS = [yaml.safe_load(ROBOTS[name].read_text(encoding="utf-8")) for name in SEED_NAMES]

WORDS = sorted(
    {*keys.TOP, *keys.ROW, *keys.FRAME, *keys.PARAMETER, *keys.UNITS, *keys.LENGTH_UNITS, *keys.ANGLE_UNITS}
    | {*keys.TABLE_CONVENTIONS, *keys.JOINT_TYPES, *keys.DIMENSIONS, "q", "wrist", "a2", "elbow", "lambda", "double"}
    | {
        *keys.ACTUATORS,
        *keys.READING,
        *keys.DRIVE,
        *keys.FORMS,
        "m1",
        "acos(2)",
        "atan2(q, 1)",
        "1/m1",
        "-1",
        "crossed",
    }
    | {"q - 90", "2*q", "0.5*elbow + 10", "pi/2", "1/0", "sqrt(-1)", "Rz(q)", "Tx(a2)", "Rz(", "9**9**9**9", "<<", "*x"}
)
SCALARS = st.one_of(
    st.sampled_from(WORDS),
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=20),
    st.dates(),
    st.binary(max_size=5),
)
KEYS = st.one_of(st.sampled_from(WORDS), st.text(max_size=8), st.integers(0, 3))
TREES = st.recursive(
    SCALARS,
    lambda inner: st.one_of(st.lists(inner, max_size=5), st.dictionaries(KEYS, inner, max_size=5)),
    max_leaves=25,
)
TOPS = st.fixed_dictionaries({}, optional=dict.fromkeys(keys.TOP, TREES))


def answer(text: str | bytes) -> None:
    """Load, and hold the answer to its promises."""
    try:
        check(loads(text, "arm.yaml"))
    except RobotFileError as caught:
        error = caught
    else:
        return
    assert str(error).isprintable()
    assert str(error).startswith("arm.yaml:")
    assert error.line is None or error.line > 0


def check(robot: Robot) -> None:
    """Every expression of a robot has a finite value, and every name in it is known."""
    values = {parameter.name: number(parameter.value, {}) for parameter in robot.parameters}
    values |= {variable.name: 0.25 for variable in robot.variables}
    for row in robot.rows:
        entries = [row.a, row.alpha, row.d, row.theta, row.beta, *(step.value for step in row.steps)]
        assert all(math.isfinite(number(entry, values)) for entry in entries if entry is not None)
        assert row.parent == "base" or row.parent in [other.name for other in robot.rows[: row.number - 1]]
    for variable in robot.variables:
        assert variable.limits is None or number(variable.limits[0], {}) <= number(variable.limits[1], {})
    values |= {reading.name: 0.25 for reading in robot.actuators.readings}
    for drive in robot.actuators.drives:
        assert set(drive.joints) <= {variable.name for variable in robot.variables}
        assert set(drive.actuators) <= {reading.name for reading in robot.actuators.readings}
        if isinstance(drive, Coupling):
            assert all(math.isfinite(number(entry, values)) for row in drive.matrix for entry in row)
    seen = {"base", "tool", "wrist", *(row.name for row in robot.rows)}
    for frame in robot.frames:
        assert frame.parent in seen
        assert all(math.isfinite(number(step.value, values)) for step in frame.steps)
        seen.add(frame.name)


def number(expression: Expression, values: dict[str, float]) -> float:
    """A value in floats."""
    return float(evaluate(expression, values, FLOATS))


@given(TREES)
def test_random_trees(tree: Any) -> None:
    answer(yaml.safe_dump(tree, allow_unicode=True))


@given(TOPS)
def test_random_trees_under_the_right_keys(tree: dict[str, Any]) -> None:
    good = {"kinegen": 1, "name": "arm", "convention": "standard", "units": {"length": "m", "angle": "deg"}}
    answer(yaml.safe_dump(good | tree, allow_unicode=True, sort_keys=False))


@given(st.text(alphabet=st.characters(codec="utf-8"), max_size=200))
def test_random_text(text: str) -> None:
    answer(text)


@given(st.text(alphabet=list("{}[]:,-?&*!|>'\"%@#\n\t aq1~<\\U.x"), max_size=60))
def test_random_punctuation(text: str) -> None:
    """Characters that mean something in YAML come close to its parser's own corners."""
    answer(text)


@given(st.binary(max_size=200))
def test_random_bytes(data: bytes) -> None:
    answer(data)


@given(st.text(alphabet=list("0123456789.eE+-*/() aq_pisrt,"), max_size=40))
def test_random_expressions(text: str) -> None:
    row = {"name": "waist", "a": text, "alpha": 0, "d": 0, "theta": "q"}
    answer(yaml.safe_dump({**SEEDS[0], "parameters": {}, "joints": [row]}))


@settings(max_examples=300)
@given(st.data())
def test_mutations_of_good_files(data: st.DataObject) -> None:
    """A good file with a few entries deleted, replaced, copied or renamed."""
    tree = copy.deepcopy(data.draw(st.sampled_from(SEEDS)))
    for _ in range(data.draw(st.integers(1, 3))):
        mutate(tree, data)
    answer(yaml.safe_dump(tree, allow_unicode=True, sort_keys=False))


def mutate(tree: Any, data: st.DataObject) -> None:
    """Change one entry somewhere in a tree."""
    place = data.draw(st.sampled_from(list(places(tree))))
    key = data.draw(st.sampled_from(list(place) if isinstance(place, dict) else list(range(len(place)))))
    other = data.draw(st.sampled_from([value for branch in places(tree) for value in children(branch)]))
    match data.draw(st.sampled_from(["delete", "replace", "swap", "rename", "copy"])):
        case "delete":
            del place[key]
        case "replace":
            place[key] = data.draw(TREES)
        case "swap":
            place[key] = copy.deepcopy(other)
        case "rename" if isinstance(place, dict):
            place[data.draw(KEYS)] = place.pop(key)
        case _ if isinstance(place, list):
            place.append(copy.deepcopy(other))
        case _:
            place[data.draw(KEYS)] = copy.deepcopy(other)


def children(branch: Any) -> list[Any]:
    """The values of a dictionary or list."""
    return list(branch.values()) if isinstance(branch, dict) else list(branch)


def places(tree: Any) -> list[Any]:
    """Every dictionary and list of a tree that is not empty, the tree itself first."""
    inside = [found for child in children(tree) if isinstance(child, dict | list) for found in places(child)]
    return [tree, *inside] if tree else inside


@given(st.sampled_from(sorted(ROBOTS)), st.data())
def test_lines_deleted_doubled_or_swapped(name: str, data: st.DataObject) -> None:
    lines = ROBOTS[name].read_text(encoding="utf-8").splitlines()
    where, other = (data.draw(st.integers(0, len(lines) - 1)) for _ in range(2))
    match data.draw(st.sampled_from(["delete", "double", "swap"])):
        case "delete":
            del lines[where]
        case "double":
            lines.insert(where, lines[where])
        case _:
            lines[where], lines[other] = lines[other], lines[where]
    answer("\n".join(lines))


@given(st.sampled_from(sorted(ROBOTS)), st.data())
def test_one_character_changed(name: str, data: st.DataObject) -> None:
    text = ROBOTS[name].read_text(encoding="utf-8")
    where = data.draw(st.integers(0, len(text) - 1))
    answer(text[:where] + data.draw(st.characters(codec="utf-8")) + text[where + data.draw(st.integers(0, 1)) :])
