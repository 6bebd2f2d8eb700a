"""The house has an order: a module imports only from rows above its own, and stays small."""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from kinegen.backends.python.vendored import FURTHER, SHARED

ROOT = Path(__file__).resolve().parent.parent

# From top to bottom; the same order stands in kinegen/__init__.py. Modules of one row may import each other only
# where they stand in the same folder.
ROWS = (
    ("kinegen",),
    ("kinegen.errors",),
    ("kinegen.support",),
    ("kinegen.model",),
    ("kinegen.verify.reference",),
    ("kinegen.model.dh_conversion",),
    ("kinegen.io",),
    ("kinegen.derive",),
    ("kinegen.ir",),
    ("kinegen.backends",),
    ("kinegen.runtime",),
    ("kinegen.backends.textbook",),
    ("kinegen.verify",),
    ("kinegen.driver",),
    ("kinegen.tools.compare", "kinegen.tools.doctor", "kinegen.tools.pictures", "kinegen.tools.workspace"),
    ("kinegen.tools.calibrate", "kinegen.tools.viewer"),
    ("kinegen.ui.api",),
    ("kinegen.tools.datasets", "kinegen.tools.wheels"),
    ("kinegen.tools",),
    ("kinegen.ui.cli",),
    ("kinegen.ui",),
    ("kinegen.__main__",),
)

# What the order alone would allow, and independence does not.
FORBIDDEN = {
    "kinegen.verify.reference": ("kinegen.io", "kinegen.derive", "kinegen.ir", "sympy"),
    "kinegen.derive": ("kinegen.io",),
    "kinegen.ir": ("kinegen.io",),
    "kinegen.backends": ("kinegen.io", "kinegen.derive"),
    "kinegen.backends.textbook": ("kinegen.io",),
    "kinegen.runtime": ("kinegen.io", "kinegen.derive"),
    "kinegen.verify": ("kinegen.io", "kinegen.backends.textbook"),
}

OLDEST = (3, 10)
"""The oldest Python that kinegen and its packages run on."""

# The last importer of sympy is ir/from_expressions.py; everything after it works on Programs.
SYMPY_MAY_ENTER = ("kinegen.derive", "kinegen.backends.textbook", "kinegen.ir.from_expressions")

EXTRAS = ("anywidget", "cupy", "dask", "distributed", "IPython", "jax", "matplotlib", "pyarrow", "scipy", "torch")
EXTRAS += ("traitlets", "zarr")
"""What modules import late, and only where it was asked for."""

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
    return max(matching, key=lambda each: len(each[1]))


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

    assert graph["kinegen.runtime.vendored._inverse"] >= {"kinegen.runtime.vendored._kernel"}
    assert circle({"a": {"b"}, "b": {"c"}, "c": {"a"}}) != []
    assert circle(graph) == []


def test_sympy_stays_in_the_symbolic_stage() -> None:
    users = [module for module, path in MODULES.items() if any(is_in(name, "sympy") for name in imports(path))]

    assert users
    assert [module for module in users if not any(is_in(module, place) for place in SYMPY_MAY_ENTER)] == []


def test_records_come_from_the_dataclass_that_is_quick_to_make() -> None:
    """A hundred classes of the standard library's take a third of the start of a command."""
    makers = {
        module
        for module, path in MODULES.items()
        for node in ast.walk(tree(path))
        if isinstance(node, ast.ImportFrom) and node.module == "dataclasses"
        if any(alias.name == "dataclass" for alias in node.names)
    }

    assert makers == {"kinegen.support.dataclass"}


@pytest.mark.parametrize("place", FORBIDDEN)
def test_independent_parts_stay_independent(place: str) -> None:
    for module, path in MODULES.items():
        if place == max((each for each in FORBIDDEN if is_in(module, each)), key=len, default=None):
            found = [name for name in imports(path) for other in FORBIDDEN[place] if is_in(name, other)]

            assert not found, f"{module} imports {', '.join(found)}"


def test_what_every_module_imports_is_required_or_in_an_extra() -> None:
    """Readers and writers of robot files need what `pip install kinegen` brings, xacro files apart."""
    needed, optional = installed_by_default(), {"xacro", *EXTRAS}
    foreign = {module: packages(path) - {"kinegen"} for module, path in MODULES.items()}

    assert {module: names - needed - optional for module, names in foreign.items() if names - needed - optional} == {}
    for module, names in foreign.items():
        if is_in(module, "kinegen.io"):
            assert names - needed <= ({"xacro"} if is_in(module, "kinegen.io.xacro") else set())


def installed_by_default() -> set[str]:
    """The packages that kinegen requires, as they are imported."""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    (block,) = re.findall(r"^dependencies = \[\n(.*?)^\]", text, re.M | re.S)
    return {"yaml" if name == "pyyaml" else name for name in re.findall(r'"([\w-]+)', block)}


def packages(path: Path) -> set[str]:
    """The packages outside of the standard library that a file imports, by their first names."""
    first = {name.partition(".")[0] for name in imports(path) if not name.startswith(".")}
    return first - sys.stdlib_module_names - {each.stem for each in path.parent.glob("*.py")}


def test_the_array_handling_of_generated_modules_needs_numpy_alone() -> None:
    """The modules of `runtime/vendored/` are copied into every generated package."""
    copied = {name: path for name, path in MODULES.items() if is_in(name, "kinegen.runtime.vendored")}
    listed = {*SHARED, *(name for names in FURTHER.values() for name in names)}
    assert listed == {path.name for path in copied.values()}

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
    vague = {"common", "helper", "helpers", "manager", "misc", "util", "utils"}

    assert [module for module in MODULES if module.rpartition(".")[2] in vague] == []


def test_the_oldest_python_reads_every_module() -> None:
    """And names that the standard library got later come from `kinegen.support.compat`."""
    paths = [path for path in (*MODULES.values(), *GENERATED) if path.name != "compat.py"]

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
