"""The house has an order: a module imports only from rows above its own, and stays small."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from kinegen.emit.python.package import RUNTIME

ROOT = Path(__file__).resolve().parent.parent

# From top to bottom; the same order stands in kinegen/__init__.py. Modules of one row may import each other only
# where they stand in the same folder.
ROWS = (
    ("kinegen",),
    ("kinegen.angles", "kinegen.errors", "kinegen.lines", "kinegen.older", "kinegen.records"),
    ("kinegen.outputs",),
    ("kinegen.naming",),
    ("kinegen.manifest",),
    ("kinegen.exchange", "kinegen.output_file"),
    ("kinegen.write",),
    ("kinegen.robot",),
    ("kinegen.reference",),
    ("kinegen.tables",),
    ("kinegen.formats",),
    ("kinegen.symbolic",),
    ("kinegen.ir",),
    ("kinegen.emit",),
    ("kinegen.native",),
    ("kinegen.compiled",),
    ("kinegen.textbook",),
    (
        "kinegen.boards",
        "kinegen.compare",
        "kinegen.doctor",
        "kinegen.prove",
        "kinegen.verify",
        "kinegen.workspace",
    ),
    ("kinegen.pictures",),
    ("kinegen.results",),
    ("kinegen.clock", "kinegen.texts"),
    ("kinegen.pipeline", "kinegen.unchanged"),
    ("kinegen.calibrate",),
    ("kinegen.viewer",),
    ("kinegen.api",),
    ("kinegen.fleet", "kinegen.wheels"),
    ("kinegen.cli",),
    ("kinegen.__main__",),
)

# What the order alone would allow, and independence does not.
FORBIDDEN = {
    "kinegen.reference": ("kinegen.formats", "kinegen.symbolic", "kinegen.ir", "sympy"),
    "kinegen.symbolic": ("kinegen.formats",),
    "kinegen.ir": ("kinegen.formats",),
    "kinegen.emit": ("kinegen.formats", "kinegen.symbolic"),
    "kinegen.native": ("kinegen.formats", "kinegen.symbolic"),
    "kinegen.verify": ("kinegen.formats", "kinegen.textbook"),
}

OLDEST = (3, 10)
"""The oldest Python that kinegen and its packages run on."""

# The last importer of sympy is ir/lower.py; everything after it works on Programs.
SYMPY_MAY_ENTER = ("kinegen.symbolic", "kinegen.textbook", "kinegen.ir.lower")

LONGEST_FUNCTION = 60
LONGEST_MODULE = 350
USUAL_DOCSTRING = 25
"""Lines of a docstring that count as lines of its function."""


def modules() -> dict[str, Path]:
    """The modules of the package by name."""
    found = {}
    for path in sorted((ROOT / "kinegen").rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


MODULES = modules()
GENERATED = sorted((ROOT / "generated").rglob("*.py"))


@cache
def tree(path: Path) -> ast.Module:
    """The syntax tree of a file."""
    return ast.parse(path.read_text(encoding="utf-8"))


def imports(path: Path) -> Iterator[str]:
    """The full names that a file imports anywhere, also late and for annotations; relative ones start with a dot."""
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            module = "." * node.level + (node.module or "")
            for alias in node.names:
                # `from kinegen import errors` names a module, `from kinegen.errors import KinegenError` does not.
                name = f"{module}.{alias.name}"
                yield name if name in MODULES else module


def is_in(name: str, package: str) -> bool:
    """Whether a dotted name is a package or something below it."""
    return name == package or name.startswith(f"{package}.")


def row(module: str) -> tuple[int, str]:
    """The number of a module's row, and the entry of that row that it belongs to."""
    entries = [(number, entry) for number, entries in enumerate(ROWS) for entry in entries]
    # The package itself stands for its __init__ alone, not for everything below it.
    matching = [(number, entry) for number, entry in entries if module == entry or (number and is_in(module, entry))]
    assert matching, f"{module} stands in no row: give it a place in ROWS"
    return matching[-1]


def from_below(module: str) -> list[str]:
    """What a module imports from its own row, or from rows below."""
    number, entry = row(module)
    others = ((name, *row(name)) for name in imports(MODULES[module]) if is_in(name, "kinegen"))
    return [name for name, place, other in others if place > number or (place == number and other != entry)]


def test_imports_come_from_rows_above() -> None:
    assert {module: from_below(module) for module in MODULES if from_below(module)} == {}


def full_name(module: str, name: str) -> str:
    """The full name of what a module imports; a relative one is counted from its package."""
    dots = len(name) - len(name.lstrip("."))
    if not dots:
        return name
    package = module if MODULES[module].name == "__init__.py" else module.rpartition(".")[0]
    above = package.split(".")[: len(package.split(".")) - dots + 1]
    return ".".join([*above, *filter(None, [name.lstrip(".")])])


def circle(graph: dict[str, set[str]]) -> list[str]:
    """Names of which each imports the next, and the last the first; none if there is no such circle."""
    order = TopologicalSorter(graph)
    try:
        order.prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def test_no_modules_import_each_other_in_a_circle() -> None:
    """Late imports count, and so do those for annotations alone."""
    graph = {
        module: {full_name(module, name) for name in imports(path)} & MODULES.keys() - {module}
        for module, path in MODULES.items()
    }

    assert graph["kinegen.native.runtime._inverse"] >= {"kinegen.native.runtime._kernel"}
    assert circle({"a": {"b"}, "b": {"c"}, "c": {"a"}}) != []
    assert circle(graph) == []


def test_sympy_stays_in_the_symbolic_stage() -> None:
    users = [module for module, path in MODULES.items() if any(is_in(name, "sympy") for name in imports(path))]

    assert users
    assert [module for module in users if not any(is_in(module, place) for place in SYMPY_MAY_ENTER)] == []


@pytest.mark.parametrize("place", FORBIDDEN)
def test_independent_parts_stay_independent(place: str) -> None:
    for module, path in MODULES.items():
        if is_in(module, place):
            found = [name for name in imports(path) for other in FORBIDDEN[place] if is_in(name, other)]

            assert not found, f"{module} imports {', '.join(found)}"


def test_the_array_handling_of_generated_modules_needs_numpy_alone() -> None:
    """The modules of `native/runtime/` are copied into every generated package."""
    copied = {name: path for name, path in MODULES.items() if is_in(name, "kinegen.native.runtime")}
    assert {f"kinegen.native.runtime.{Path(name).stem}" for name in RUNTIME} < set(copied)

    assert {name: strangers(path) for name, path in copied.items() if strangers(path)} == {}


def test_generated_code_needs_numpy_alone() -> None:
    assert {str(path): strangers(path) for path in GENERATED if strangers(path)} == {}


def strangers(path: Path) -> list[str]:
    """The imports of a file that are neither NumPy's, nor the standard library's, nor its own folder's."""
    bridges = {path.stem} & {"jax", "torch"}  # modules that are imported only when asked for
    known = {"numpy", *bridges, *sys.stdlib_module_names}
    return [name for name in imports(path) if not name.startswith(".") and name.split(".")[0] not in known]


def test_modules_stay_short() -> None:
    lines = {module: len(path.read_text(encoding="utf-8").splitlines()) for module, path in MODULES.items()}

    assert {module: count for module, count in lines.items() if count > LONGEST_MODULE} == {}


def test_functions_stay_short() -> None:
    lines = {
        (module, node.name): (node.end_lineno or 0) - node.lineno + 1 - documentation(node)
        for module, path in MODULES.items()
        for node in ast.walk(tree(path))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    }

    assert {name: count for name, count in lines.items() if count > LONGEST_FUNCTION} == {}


def documentation(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of a docstring beyond a usual one: a public function documents each argument, with an example."""
    first = function.body[0]
    is_text = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    return max(0, (first.end_lineno or 0) - first.lineno + 1 - USUAL_DOCSTRING) if is_text else 0


def test_names_say_what_a_module_is_for() -> None:
    vague = {"common", "helper", "helpers", "manager", "misc", "tools", "util", "utils"}

    assert [module for module in MODULES if module.rpartition(".")[2] in vague] == []


def test_the_oldest_python_reads_every_module() -> None:
    """And names that the standard library got later come from `kinegen.older`."""
    paths = [path for path in (*MODULES.values(), *GENERATED) if path.name != "older.py"]

    assert {str(path): names_of_later_pythons(path) for path in paths if names_of_later_pythons(path)} == {}


def names_of_later_pythons(path: Path) -> set[str]:
    """What a file, which the oldest Python has to parse, takes from the standard library of later ones."""
    parsed = ast.parse(path.read_text(encoding="utf-8"), feature_version=OLDEST)
    late = {"StrEnum", "assert_never", "assert_type", "Self", "Never", "LiteralString", "Required", "Unpack", "chdir"}
    taken = {
        alias.name
        for node in ast.walk(parsed)
        if isinstance(node, ast.ImportFrom) and node.module in ("enum", "typing", "contextlib", "datetime")
        for alias in node.names
    }

    return taken & late
