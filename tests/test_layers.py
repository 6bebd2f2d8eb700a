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


@pytest.mark.parametrize("module", MODULES)
def test_imports_come_from_rows_above(module: str) -> None:
    number, entry = row(module)
    below = []
    for name in imports(MODULES[module]):
        if is_in(name, "kinegen"):
            other_number, other_entry = row(name)
            if other_number > number or (other_number == number and other_entry != entry):
                below.append(name)

    assert not below, f"{module} imports from its own row or from below"


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


@pytest.mark.parametrize("module", MODULES)
def test_sympy_stays_in_the_symbolic_stage(module: str) -> None:
    allowed = any(is_in(module, place) for place in SYMPY_MAY_ENTER)

    assert allowed or not any(is_in(name, "sympy") for name in imports(MODULES[module]))


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


@pytest.mark.parametrize("path", GENERATED, ids=lambda path: str(path.relative_to(ROOT)))
def test_generated_code_needs_numpy_alone(path: Path) -> None:
    assert strangers(path) == []


def strangers(path: Path) -> list[str]:
    """The imports of a file that are neither NumPy's, nor the standard library's, nor its own folder's."""
    known = {"numpy", *sys.stdlib_module_names}
    return [name for name in imports(path) if not name.startswith(".") and name.split(".")[0] not in known]


@pytest.mark.parametrize("module", MODULES)
def test_modules_stay_short(module: str) -> None:
    lines = len(MODULES[module].read_text(encoding="utf-8").splitlines())

    assert lines <= LONGEST_MODULE, f"{module} has {lines} lines: split it"


@pytest.mark.parametrize("module", MODULES)
def test_functions_stay_short(module: str) -> None:
    functions = [
        (node.name, (node.end_lineno or 0) - node.lineno + 1 - documentation(node))
        for node in ast.walk(tree(MODULES[module]))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    ]

    assert [(name, lines) for name, lines in functions if lines > LONGEST_FUNCTION] == []


def documentation(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of a docstring beyond a usual one: a public function documents each argument, with an example."""
    first = function.body[0]
    is_text = isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant)
    return max(0, (first.end_lineno or 0) - first.lineno + 1 - USUAL_DOCSTRING) if is_text else 0


@pytest.mark.parametrize("module", MODULES)
def test_names_say_what_a_module_is_for(module: str) -> None:
    vague = {"common", "helper", "helpers", "manager", "misc", "tools", "util", "utils"}

    assert module.rpartition(".")[2] not in vague


@pytest.mark.parametrize("path", [*MODULES.values(), *GENERATED], ids=lambda path: str(path.relative_to(ROOT)))
def test_the_oldest_python_reads_every_module(path: Path) -> None:
    """And names that the standard library got later come from `kinegen.older`."""
    parsed = ast.parse(path.read_text(encoding="utf-8"), feature_version=OLDEST)
    late = {"StrEnum", "assert_never", "assert_type", "Self", "Never", "LiteralString", "Required", "Unpack", "chdir"}
    taken = {
        alias.name
        for node in ast.walk(parsed)
        if isinstance(node, ast.ImportFrom) and node.module in ("enum", "typing", "contextlib", "datetime")
        for alias in node.names
    }

    assert path.name == "older.py" or not taken & late
