"""The singular places on the page: trees with the values of the factors, and the places that are near."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from kinegen.io.load import load
from kinegen.tools.viewer.panels import singular_model
from tests.viewer.node import evaluate, needs_node

ROBOTS = Path(__file__).resolve().parents[2] / "robots"

pytestmark = needs_node


@pytest.mark.parametrize(
    ("name", "q", "expected"),
    [
        ("ur5", [0.3, -1.2, 0.0, 0.4, 1.1, 0.2], ["elbow stretched or folded"]),
        ("ur5", [0.3, -1.2, 1.4, 0.4, 0.05, 0.2], ["wrist aligned"]),
        ("ur5", [0.3, -1.2, math.pi + 0.01, 0.4, math.pi, 0.2], ["elbow stretched or folded", "wrist aligned"]),
        ("ur5", [0.3, -1.2, 1.4, 0.4, 1.1, 0.2], []),
        ("iiwa14", [0.3, 0.0, 0.5, 1.4, 0.4, 0.0, 0.2], ["axes 1 and 3 coincide; wrist aligned"]),
        ("iiwa14", [0.3, 0.0, 0.5, 1.4, 0.4, 0.7, 0.2], []),
        ("stanford", [0.3, 1.0, 0.001, 0.4, 1.1, 0.2], ["the point where axes 4, 5 and 6 meet is on axis 2"]),
    ],
)
def test_places_that_are_near_are_named(name: str, q: list[float], expected: list[str]) -> None:
    (places,) = singular_model(load(ROBOTS / f"{name}.yaml"))
    found = evaluate(
        ("numbers.js", "algebra.js", "solve.js", "spectrum.js"),
        "spectrum.near(given.places, given.q, given.q.map(() => 1)).map((place) => place.words)",
        {"places": places, "q": q},
    )

    assert len(found) == len(expected)
    assert all(words.startswith(start) for words, start in zip(found, expected, strict=True))


def test_long_brackets_and_runtime_parameters_are_written_out() -> None:
    (places,) = singular_model(load(ROBOTS / "crx10ial.yaml"))
    assert '"F1"' not in str(places).replace("'", '"')
    assert "'cos'" in str(places)


def test_a_robot_of_many_joints_has_none() -> None:
    assert singular_model(load(ROBOTS / "human_body.yaml")) == [[]]
