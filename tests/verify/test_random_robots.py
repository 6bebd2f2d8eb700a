"""Robots at random build, and every kernel of theirs is proven: sixty that are always the same, and sixty by commit."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.backends.scalar_types import ScalarType
from kinegen.errors import KinegenError
from kinegen.io.load import loads
from kinegen.model.outputs import parse_quantity
from tests.builds.workshop import make, write_robot
from tests.verify.random_robots import commit, outputs_of, robot_text, wrt_of

SEED, COUNT = "robots", 60
SEEDS = {SEED: SEED, "commit": commit()}
ROBOTS = [pytest.param(seed, number, id=f"{name}-{number}") for name, seed in SEEDS.items() for number in range(COUNT)]
COMPILED = 6
"""Every so many robots are compiled as well, in both number types."""


def story(seed: str, number: int) -> str:
    """What makes a robot again."""
    return f"robot_text({seed!r}, {number}), outputs {', '.join(outputs_of(seed, number))}:\n{robot_text(seed, number)}"


@pytest.mark.parametrize(("seed", "number"), ROBOTS)
def test_every_robot_loads(seed: str, number: int) -> None:
    assert loads(robot_text(seed, number), "chance.yaml").rows, story(seed, number)


def test_a_seed_decides_its_robots() -> None:
    assert robot_text("a", 1) == robot_text("a", 1)
    assert robot_text("a", 1) != robot_text("b", 1)
    assert len({robot_text("a", number) for number in range(COUNT)}) == COUNT


def test_all_features_occur_among_a_few_hundred_robots() -> None:
    texts = [robot_text("features", number) for number in range(300)]
    words = (
        "d: 0.01*j",
        "hayati",
        "modified_prev_d",
        "ets:",
        "parent: j",
        "tool:",
        "coupling",
        "gear",
        "runtime: true",
        "mm",
        "limits",
    )
    for word in words:
        assert sum(word in text for text in texts) > 5, word
    assert max(text.count("- {name: j") for text in texts) == 20
    assert min(text.count("- {name: j") for text in texts) == 1


def test_an_angle_that_moves_a_length_may_make_it_infinite(tmp_path: Path) -> None:
    """The offset of row 2 follows the angle of row 1, and no sine comes between."""
    head = robot_text("head", 1).partition("convention:")[0]
    rows = (
        "convention: standard\nunits: {length: m, angle: deg}\njoints:\n"
        "  - {name: j1, theta: q, d: 0, a: 0, alpha: 0}\n  - {name: j2, theta: 0, d: 0.01*j1, a: 0.2, alpha: 0}\n"
    )

    assert make(write_robot(tmp_path, head + rows), tmp_path / "out", compile=False).proof.holds


@pytest.mark.long
@pytest.mark.usefixtures("machine")
@pytest.mark.parametrize(("seed", "number"), ROBOTS)
def test_every_robot_is_proven(seed: str, number: int, tmp_path: Path) -> None:
    is_compiled = number % COMPILED == 0
    reals = tuple(ScalarType) if is_compiled else (ScalarType.DOUBLE,)
    options = {"compile": is_compiled, "reals": reals, "wrt": wrt_of(seed, number)}
    quantities = tuple(map(parse_quantity, outputs_of(seed, number)))
    path = write_robot(tmp_path, robot_text(seed, number))
    try:
        result = make(path, tmp_path / "out", quantities=quantities, **options)
    except KinegenError as error:
        pytest.fail(f"{error}\n{story(seed, number)}")

    assert result.proof.holds
    assert result.backend == ("c" if is_compiled else "numpy")
