"""Each record has exactly what its templates ask for: nothing is missing, and nothing is made for no one."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator
from functools import cache
from typing import Any

import jinja2
import pytest
from jinja2 import meta, nodes

from kinegen.backends.c import (
    batch,
    complete_inverse,
    inverse_tracker,
    kernel,
    numeric_inverse,
    numeric_inverse_batch,
    redundancy_range,
    test_vectors,
    vectors,
)
from kinegen.backends.cpp import files as cpp
from kinegen.backends.javascript import files, functions, wasm
from kinegen.backends.metadata import Metadata
from kinegen.backends.python import formula, package, stub
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.templates import environment
from tests.emit import emitted

# The templates that are rendered, with the record that each variable is.
RENDERED: dict[str, dict[str, Any]] = {
    "c/kernel.h.jinja": {"k": kernel.KernelContext},
    "c/kernel.c.jinja": {"k": kernel.KernelContext},
    "c/batch.h.jinja": {"b": batch.BatchContext, "k": kernel.KernelContext},
    "c/batch.c.jinja": {"b": batch.BatchContext, "k": kernel.KernelContext},
    "c/vectors.h.jinja": {"k": vectors.VectorContext},
    "c/selftest.c.jinja": {"k": vectors.VectorContext},
    "c/numeric_inverse.h.jinja": {"k": numeric_inverse.SolverContext},
    "c/numeric_inverse.c.jinja": {"k": numeric_inverse.SolverContext},
    "c/numeric_inverse_batch.h.jinja": {"k": numeric_inverse.SolverContext, "b": numeric_inverse_batch.SearchBatch},
    "c/numeric_inverse_batch.c.jinja": {"k": numeric_inverse.SolverContext, "b": numeric_inverse_batch.SearchBatch},
    "c/numeric_inverse_tips.c.jinja": {"k": numeric_inverse.SolverContext},
    "c/numeric_inverse_tips_batch.c.jinja": {
        "k": numeric_inverse.SolverContext,
        "b": numeric_inverse_batch.SearchBatch,
    },
    "c/complete_inverse.h.jinja": {"k": complete_inverse.CompleteContext},
    "c/complete_inverse.c.jinja": {"k": complete_inverse.CompleteContext},
    "c/redundancy_range.h.jinja": {"k": redundancy_range.RangeContext},
    "c/redundancy_range.c.jinja": {"k": redundancy_range.RangeContext},
    "c/inverse_tracker.h.jinja": {"k": inverse_tracker.TrackerContext},
    "c/inverse_tracker.c.jinja": {"k": inverse_tracker.TrackerContext},
    "cpp/header.hpp.jinja": {"k": cpp.HeaderContext},
    "cpp/CMakeLists.txt.jinja": {"k": cpp.HeaderContext},
    "cpp/driver.cpp.jinja": {"k": cpp.HeaderContext},
    "cpp/vectors.cpp.jinja": {"k": cpp.TestContext, "v": test_vectors.VectorTests},
    "javascript/module.js.jinja": {"k": files.ModuleContext},
    "javascript/module.d.ts.jinja": {"k": files.ModuleContext},
    "javascript/driver.mjs.jinja": {},
    "javascript/test.mjs.jinja": {"v": test_vectors.VectorTests},
    "javascript/wasm.js.jinja": {"k": wasm.WasmContext},
    "javascript/wasm.c.jinja": {"k": wasm.WasmContext},
    "javascript/wasm.d.ts.jinja": {"k": wasm.WasmContext},
    "python/_eliminations.py.jinja": {},
    "python/__init__.pyi.jinja": {"s": stub.StubContext},
    "python/__init__.py.jinja": {"k": package.PackageContext},
    "python/_numpy.py.jinja": {"k": formula.FormulaContext},
    "python/library.py.jinja": {},
}
ITEMS: dict[Any, dict[str, tuple[str, ...]]] = {
    kernel.Function: {"f": ("c/kernel.h.jinja", "c/kernel.c.jinja")},
    batch.BatchFunction: {"f": ("c/batch.h.jinja", "c/batch.c.jinja")},
    batch.BatchInput: {"a": ("c/batch.c.jinja",)},
    batch.BatchResult: {"r": ("c/batch.c.jinja",)},
    vectors.VectorCheck: {"c": ("c/vectors.h.jinja", "c/selftest.c.jinja")},
    vectors.VectorResult: {"r": ("c/vectors.h.jinja", "c/selftest.c.jinja")},
    functions.Function: {"f": ("javascript/module.js.jinja", "javascript/module.d.ts.jinja")},
    wasm.WasmFunction: {"f": ("javascript/wasm.js.jinja", "javascript/wasm.c.jinja")},
    files.Table: {"table": ("javascript/module.js.jinja", "javascript/module.d.ts.jinja")},
    package.PublicKernel: {"f": ("python/__init__.py.jinja",)},
    formula.Formula: {"f": ("python/_numpy.py.jinja",)},
}
"""The records that templates loop over, and what they call them."""

HANDED_ON = {"kernel", "name", "stored", "function", "prototype", "prototypes", "nearest_prototype"}
"""Fields for emitters: the record of the scalar kernels, what functions are called, what inputs take in memory."""

STRINGS = {"prefix", "qualifier", "has_wasm", "imports", "robot", "name", "provenance", "tables", "bounds", "library"}
"""Variables besides the records: templates of functions, of tests, of types and of tables of constants take them, and
what is said of every robot."""

FUNCTIONS = [name for name in environment().list_templates() if re.fullmatch(r"c/_\w+_f(?:32|64)\.c\.jinja", name)]
"""The templates of functions, one for each number type, that are included by names made of the number type."""


@cache
def tree(template: str) -> nodes.Template:
    """The syntax tree of a template."""
    loader = environment().loader
    assert loader
    return environment().parse(loader.get_source(environment(), template)[0])


def with_includes(template: str) -> Iterator[nodes.Template]:
    """A template and all that it includes; an include whose name is a variable may be any of the functions."""
    yield tree(template)
    for name in meta.find_referenced_templates(tree(template)):
        for included in [name] if name else FUNCTIONS:
            yield from with_includes(included)


def macros(template: str) -> set[str]:
    """Names of imported macros, which are no variables."""
    return {
        name for part in with_includes(template) for found in part.find_all(nodes.FromImport) for name in found.names
    }


def variables(template: str) -> set[str]:
    """What a template and its includes take from outside."""
    found = set().union(*(meta.find_undeclared_variables(part) for part in with_includes(template)))
    arguments = {
        argument.name for part in with_includes(template) for m in part.find_all(nodes.Macro) for argument in m.args
    }
    own = {each.name for part in with_includes(template) for each in part.find_all(nodes.Name) if each.ctx == "store"}
    return found - macros(template) - arguments - own


def attributes(template: str, variable: str) -> set[str]:
    """The fields of a variable that a template and its includes read."""
    return {
        found.attr
        for part in with_includes(template)
        for found in part.find_all(nodes.Getattr)
        if isinstance(found.node, nodes.Name) and found.node.name == variable
    }


EMITTED = {"actuators", "varied"}
"""Fields of what is said of a robot that emitters turn into other text."""


def names_of(record: Any) -> set[str]:
    """The fields of a record."""
    return {entry.name for entry in dataclasses.fields(record)}


def test_every_template_is_rendered_or_included() -> None:
    rendered = {
        name for name in environment().list_templates() if name.startswith(("c/", "cpp/", "javascript/", "python/"))
    }
    used = {
        name
        for template in RENDERED
        for part in with_includes(template)
        for name in meta.find_referenced_templates(part)
    }

    assert rendered == set(RENDERED) | {name for name in used if name} | set(FUNCTIONS)


@pytest.mark.parametrize("template", RENDERED)
def test_a_template_takes_what_python_hands_over(template: str) -> None:
    assert variables(template) <= set(RENDERED[template]) | STRINGS


@pytest.mark.parametrize("template", RENDERED)
def test_every_field_that_a_template_reads_exists(template: str) -> None:
    for variable, record in RENDERED[template].items():
        assert attributes(template, variable) <= names_of(record)


@pytest.mark.parametrize("record", ITEMS, ids=lambda record: record.__name__)
def test_templates_read_every_field_of_what_they_loop_over_and_no_other(record: Any) -> None:
    read = {name for key, templates in ITEMS[record].items() for each in templates for name in attributes(each, key)}

    assert read - HANDED_ON == names_of(record) - HANDED_ON


@pytest.mark.parametrize(
    "record",
    dict.fromkeys(record for each in RENDERED.values() for record in each.values()),
    ids=lambda record: record.__name__,
)
def test_every_field_of_a_record_is_read_by_some_template_or_emitter(record: Any) -> None:
    read = {
        name
        for template, records in RENDERED.items()
        for variable, other in records.items()
        if other is record
        for name in attributes(template, variable)
    }

    assert names_of(record) - read - HANDED_ON == set()


def test_every_field_of_what_is_said_of_a_robot_is_read_by_some_template_and_exists() -> None:
    templates = [
        name for name in environment().list_templates() if name.startswith(("controllers/", "packages/", "python/"))
    ]
    read = {name for template in templates for name in attributes(template, "robot")}

    assert read - {"upper"} == names_of(Metadata) - EMITTED


LAYOUT = {
    *("upper", "lower", "capitalize", "sentence", "quoted", "docstring", "markdown", "xml", "one_based"),
    *("length", "indent", "join", "map", "list", "selectattr", "wordwrap"),
}
"""Filters that write a string otherwise, and those that go through a list."""


def test_templates_lay_out_and_do_not_decide() -> None:
    """No arithmetic, no sorting, no test of a type."""
    for name in environment().list_templates():
        forbidden = (nodes.Sub, nodes.Mul, nodes.Div, nodes.FloorDiv, nodes.Mod, nodes.Pow, nodes.Slice)
        found = [type(node).__name__ for kind in forbidden for node in tree(name).find_all(kind)]
        sums = [part for node in tree(name).find_all(nodes.Add) for part in (node.left, node.right)]
        found += [str(part.value) for part in sums if isinstance(part, nodes.Const) and not isinstance(part.value, str)]
        filters = {node.name for node in tree(name).find_all(nodes.Filter)}
        tests = {node.name for node in tree(name).find_all(nodes.Test)}

        assert found == [], name
        assert filters <= LAYOUT, name
        assert tests <= {"defined", "none"}, name


def test_every_template_says_what_it_needs() -> None:
    for name in environment().list_templates(["jinja"]):
        loader = environment().loader
        assert loader
        text = loader.get_source(environment(), name)[0]

        assert re.match(r"\{#.*?Needs\b.*?#\}", text, re.DOTALL), name


def test_a_missing_name_is_an_error() -> None:
    with pytest.raises(jinja2.UndefinedError):
        environment().from_string("{{ nothing }}").render()


@pytest.mark.parametrize("name", ["puma560", "calibrated_2r", "blocks", "hand"])
def test_no_template_leaves_a_trace_of_itself(name: str) -> None:
    trace = re.compile(r"\{%|%\}|\{#|#\}|\{\{ | \}\}|Undefined|<generator")
    for file, text in emitted.texts(name).items():
        assert trace.search(text) is None, file


def test_number_types_differ_only_in_their_type() -> None:
    """The float files are the double ones with another type, prefix and other digits: nothing else is decided twice."""

    def shape(text: str) -> str:
        text = text[text.index("\nvoid ") :]
        text = re.sub(r"(?i)puma560_f32|puma560", "ROBOT", text).replace("double", "REAL").replace("float", "REAL")
        return re.sub(r"\d+\.\d+(?:e[+-]\d+)?F?", "NUMBER", text)

    files = emitted.texts("puma560")

    assert shape(files[emitted.c_kernels("puma560", ScalarType.DOUBLE)[0]]) == shape(
        files[emitted.c_kernels("puma560", ScalarType.FLOAT)[0]]
    )
