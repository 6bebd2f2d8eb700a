"""The entries of books.yaml and articles.yaml, and the robots of their tables."""

from __future__ import annotations

from typing import Any

import sympy as sp
import yaml

from kinegen.io.load import loads
from kinegen.model.robot import Robot
from tests.textbook.catalog import HERE

BOOKS: list[dict[str, Any]] = [
    book for name in ("books", "articles") for book in yaml.safe_load((HERE / f"{name}.yaml").read_text("utf-8"))
]


def table(book: dict[str, Any]) -> Robot:
    """The robot of a book, with joints j1, j2 and so on."""
    lines = [f"kinegen: 1\nname: book\nconvention: {book.get('convention', 'standard')}"]
    lines += ["units: {length: m, angle: deg}", f"parameters: {book['parameters']}" if "parameters" in book else ""]
    rows = []
    for number, row in enumerate(book["rows"], 1):
        entries = zip(("theta", "d", "a", "alpha"), row.split(), strict=True) if isinstance(row, str) else ()
        columns = ", ".join(f"{name}: {value}" for name, value in entries) or f"ets: [{', '.join(row)}]"
        rows.append(f"- {{name: j{number}, {columns}}}")
    text = "\n".join([*lines, "joints:", *rows])
    return loads(text.replace("'", ""), "book.yaml")


def reading(arm: Robot) -> tuple[dict[str, sp.Expr], list[sp.Symbol]]:
    """What the names in the entries of a book stand for, and its joint variables for the shorthand."""
    symbols = [sp.Symbol(variable.name, real=True) for variable in arm.variables]
    names = {parameter.name: sp.Symbol(parameter.name, real=True) for parameter in arm.parameters}
    return names | {f"q{number}": symbol for number, symbol in enumerate(symbols, 1)}, symbols
