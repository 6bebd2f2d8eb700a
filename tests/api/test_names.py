"""What `import kinegen` offers: each name is there, documented, typed, shown by an example, and imported late."""

from __future__ import annotations

import ast
import doctest
import importlib
import inspect
import pkgutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import kinegen

ROOT = Path(__file__).resolve().parents[2]
STUB = ROOT / "kinegen" / "__init__.pyi"
HEAVY = {"IPython", "anywidget", "cffi", "click", "jinja2", "matplotlib", "mpmath", "numpy", "scipy", "sympy", "yaml"}


def fresh(code: str) -> str:
    """What a new interpreter prints."""
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def own_members(thing: type[Any]) -> Iterator[tuple[str, Any]]:
    """What a class and those of `kinegen.ui.api` that it derives from define."""
    for each in reversed(thing.__mro__):
        yield from vars(each).items() if each.__module__.startswith("kinegen.ui.api") else ()


def public() -> Iterator[tuple[str, Any]]:
    """Every public function and class, and every public method."""
    for name in kinegen.__all__:
        thing = getattr(kinegen, name)
        if isinstance(thing, ModuleType):
            thing = thing.fk
        yield name, thing
        if inspect.isclass(thing) and not issubclass(thing, Exception):
            for part, member in own_members(thing):
                if not part.startswith("_") and (callable(member) or isinstance(member, property)):
                    yield f"{name}.{part}", member


NAMES = dict(public())


def test_importing_kinegen_imports_next_to_nothing() -> None:
    """30 ms are less than any of these takes; modules are counted, since a busy machine cannot be timed."""
    code = (
        "import sys; before = set(sys.modules); import kinegen; new = set(sys.modules) - before; "
        "print(len(new), sorted(name for name in new if name.startswith('kinegen')))"
    )
    count, names = fresh(code).split(" ", 1)

    assert names == "['kinegen']"
    assert int(count) <= 10


def test_finding_a_cached_module_needs_no_symbolic_library(tmp_path: Path) -> None:
    code = (
        "import sys, kinegen; m = kinegen.compile('robots/planar_3r.yaml', 'pose', real='double', compile=False); "
        "print(*sorted({'cffi', 'click', 'jinja2', 'mpmath', 'sympy'} & set(sys.modules)))"
    )
    first, second = fresh(code), fresh(code)

    assert "sympy" in first.split()
    assert second == ""


@pytest.mark.parametrize(
    "module",
    ["kinegen.verify.reference", "kinegen.driver.pipeline", "kinegen.runtime.compiled", "kinegen.ui.cli.build"],
)
def test_a_name_means_the_same_whatever_was_imported_before(module: str) -> None:
    show = "print(*(type(getattr(kinegen, n)).__name__ + ':' + getattr(kinegen, n).__name__ for n in kinegen.__all__))"

    assert fresh(f"import kinegen; {show}") == fresh(f"import {module}, kinegen; {show}")


def test_no_public_name_is_the_name_of_a_module() -> None:
    """Importing such a module would replace the name."""
    modules = {each.name for each in pkgutil.iter_modules(kinegen.__path__)}

    assert not set(kinegen.__all__) & modules


@pytest.mark.parametrize("module", ["kinegen", "kinegen.ui.cli.build"])
def test_the_names_that_python_lists_are_the_public_ones(module: str) -> None:
    """Also after other modules of the package were imported."""
    shown = fresh(f"import {module}, kinegen; print(*(name for name in dir(kinegen) if not name.startswith('_')))")

    assert shown.split() == sorted(kinegen.__all__)


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="module 'kinegen' has no attribute 'nothing'"):
        kinegen.nothing  # type: ignore[attr-defined] # noqa: B018


def test_the_stub_names_what_is_there_at_its_place() -> None:
    tree = ast.parse(STUB.read_text(encoding="utf-8"))
    places = {
        alias.name: node.module
        for node in tree.body
        if isinstance(node, ast.ImportFrom) and node.module != "kinegen"
        for alias in node.names
    }

    parents = {name: place.rpartition(".")[0] for name, place in kinegen._PACKAGES.items()}
    assert places == {name: f"kinegen.{place}" for name, place in (kinegen._PLACES | parents).items()}
    for name, place in places.items():
        assert getattr(importlib.import_module(str(place)), name) is getattr(kinegen, name)


@pytest.mark.parametrize("name", NAMES)
def test_every_public_name_is_documented(name: str) -> None:
    thing = NAMES[name]
    text = inspect.getdoc(thing) or ""
    function = thing.fget if isinstance(thing, property) else thing

    assert text
    if inspect.isfunction(function):
        signature = inspect.signature(function)
        given = [parameter for place, parameter in signature.parameters.items() if place != "self"]
        assert all(parameter.annotation is not inspect.Parameter.empty for parameter in given)
        assert signature.return_annotation is not inspect.Signature.empty
        assert all(f"{parameter.name}: " in text for parameter in given)


@pytest.mark.parametrize("name", [name for name in kinegen.__all__ if name != "reference"])
def test_every_public_name_has_an_example(name: str) -> None:
    assert ">>>" in (inspect.getdoc(getattr(kinegen, name)) or "")


@pytest.mark.parametrize("name", NAMES)
def test_examples_run(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    runner = doctest.DocTestRunner()
    for case in doctest.DocTestFinder(recurse=False).find(NAMES[name], name, globs={}):
        assert runner.run(case).failed == 0
