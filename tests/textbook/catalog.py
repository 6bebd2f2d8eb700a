"""The published entries as records: what stands in print, for which robot, and what is printed wrongly.

In: the YAML files beside this module. Out: frozen records of text; `notation.read` turns the text into sympy.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import sympy as sp
import yaml

from kinegen.io.load import load
from kinegen.model.robot import Robot
from tests.textbook.notation import read

HERE = Path(__file__).resolve().parent
ROBOTS = HERE.parent.parent / "robots"

Place = tuple[int, int]

NAMED_PLACES: Mapping[str, Place] = {f"r{i + 1}{j + 1}": (i, j) for i in range(3) for j in range(3)} | {
    f"p{axis}": (i, 3) for i, axis in enumerate("xyz")
}
"""The entries of a pose by the names that the books use."""


@dataclass(frozen=True, slots=True)
class Form:
    """One published or derived transform.

    Attributes:
        name: How the books call it, such as 0T6.
        start: Frame in which it is expressed.
        end: Frame that it reaches.
        status: printed, corrected (printed with an error) or derived (not printed).
        entries: Text of the entries by place; a full form has the twelve of the upper three rows.
        at_zero: Whether it holds for all joint variables at zero only.
    """

    name: str
    start: str | int
    end: str | int
    status: str
    entries: Mapping[Place, str]
    at_zero: bool


@dataclass(frozen=True, slots=True)
class Example:
    """One numeric pose; a value for each joint variable and parameter as text, and the upper three rows."""

    name: str
    start: str | int
    end: str | int
    values: Mapping[str, str]
    matrix: tuple[tuple[float, ...], ...]


@dataclass(frozen=True, slots=True)
class System:
    """All that stands in print about one robot.

    Attributes:
        key: Name of its data file.
        robots: Robot files for which the forms hold, the first of them the one that is shown.
        title: Heading.
        source: Where the forms stand in print.
        variables: What the print calls the joint variables, in the order of q.
        first: Number of the first joint variable in the shorthand c1, s23.
        forms: The transforms.
        examples: The numeric poses.
    """

    key: str
    robots: tuple[str, ...]
    title: str
    source: str
    variables: tuple[str, ...]
    first: int
    forms: tuple[Form, ...]
    examples: tuple[Example, ...]

    def read(self, text: str, robot: Robot) -> sp.Expr:
        """Read an entry in the symbols of a robot: one per joint variable and parameter, named as in its file."""
        angles = [sp.Symbol(variable.name, real=True) for variable in robot.variables]
        names = {parameter.name: sp.Symbol(parameter.name, real=True) for parameter in robot.parameters}
        names |= {symbol.name: symbol for symbol in angles}
        names |= dict(zip(self.variables, angles, strict=False))
        return read(text, names, angles, self.first)


@dataclass(frozen=True, slots=True)
class Product:
    """A product of elementary transforms, or one link matrix, that stands in print without a robot.

    Attributes:
        name: What it is.
        source: Where it stands in print.
        status: printed, corrected or derived.
        steps: Elementary transforms, left to right; empty for a link matrix.
        row: Convention of the link matrix, or None.
        inverse: Whether the inverse of the product is meant.
        angles: Symbols of the shorthand.
        first: Number of the first of them.
        entries: Text of the entries by place.
    """

    name: str
    source: str
    status: str
    steps: tuple[str, ...]
    row: str | None
    inverse: bool
    angles: tuple[str, ...]
    first: int
    entries: Mapping[Place, str]


@dataclass(frozen=True, slots=True)
class Misprint:
    """Something printed wrongly; provable if it names an entry of a system's form, of a product or of a book."""

    notes: str
    place: str
    printed: str
    correct: str
    kind: str
    system: str | None = None
    product: str | None = None
    book: str | None = None
    form: str | None = None
    entry: str | None = None


@cache
def systems() -> tuple[System, ...]:
    """Every system, in the order of the file names."""
    return tuple(_system(path) for path in sorted((HERE / "data").glob("*.yaml")))


@cache
def products() -> tuple[Product, ...]:
    """Every product that stands alone."""
    return tuple(_product(item) for item in _yaml(HERE / "products.yaml"))


@cache
def misprints() -> tuple[Misprint, ...]:
    """Every misprint."""
    return tuple(
        Misprint(**{key: str(value) for key, value in item.items()}) for item in _yaml(HERE / "misprints.yaml")
    )


@cache
def robot(name: str) -> Robot:
    """The robot of a file in `robots/`."""
    return load(ROBOTS / f"{name}.yaml")


def _yaml(path: Path) -> Any:
    return yaml.safe_load(path.read_text(encoding="utf-8"))


def _system(path: Path) -> System:
    item = _yaml(path)
    return System(
        key=path.stem,
        robots=(item["robot"], *item.get("also", ())),
        title=item["title"],
        source=item["print"],
        variables=tuple(item["variables"]),
        first=item.get("first", 1),
        forms=tuple(_form(form) for form in item["forms"]),
        examples=tuple(_example(example) for example in item.get("examples", ())),
    )


def _form(item: Mapping[str, Any]) -> Form:
    return Form(
        name=item["name"],
        start=item["from"],
        end=item["to"],
        status=item["status"],
        entries=_entries(item),
        at_zero=item.get("at") == "zero",
    )


def _example(item: Mapping[str, Any]) -> Example:
    return Example(
        name=item["name"],
        start=item["from"],
        end=item["to"],
        values={name: str(value) for name, value in item["values"].items()},
        matrix=tuple(tuple(float(entry) for entry in row) for row in item["matrix"]),
    )


def _product(item: Mapping[str, Any]) -> Product:
    return Product(
        name=item["name"],
        source=item["print"],
        status=item["status"],
        steps=tuple(item.get("steps", ())),
        row=item.get("row"),
        inverse=item.get("inverse", False),
        angles=tuple(item.get("angles", ())),
        first=item.get("first", 1),
        entries=_entries(item),
    )


def _entries(item: Mapping[str, Any]) -> dict[Place, str]:
    if "entries" in item:
        return {NAMED_PLACES[name]: str(text) for name, text in item["entries"].items()}
    return {(i, j): str(text) for i, row in enumerate(item["matrix"]) for j, text in enumerate(row)}
