"""kinegen: a compiler for robot kinematics.

It reads a YAML file with a Denavit-Hartenberg table. It writes the closed form as a textbook prints it, C files for
firmware, and a Python module that evaluates batches of poses. Data goes one way, from the top of this list to its end:

    support/    what knows nothing of robots: files that are written whole or not at all, the operating system
    model/      the robot as its owner wrote it, with exact values; outputs and names
    io/         text           <-> Robot         validated, with line numbers; writers; other conventions
    derive/     Robot          -> Expressions    elementary transforms, folded; poses, inverses; with sympy
    ir/         Expressions    -> Program        straight-line code, one operation per statement; error bounds
    backends/   Program        -> {name: text}   one folder of templates per language; the closed form for readers
    runtime/    C text         -> callable       compiled extension, threads, arrays
    verify/     callable       -> comparisons    with verify/reference/; boards; Frama-C
    driver/     the stages in order, timed; what they found as one record
    tools/      doctor, calibrate, compare, workspace, datasets, pictures, viewer, wheels
    ui/         what `import kinegen` offers, and the subcommands

A module imports only from rows above its own; `tests/test_layers.py` reads the imports. `docs/architecture.md` explains
the stages.

sympy is imported in derive/, backends/textbook/ and ir/lower.py, nowhere else. This module itself imports nothing of
kinegen, so that `kinegen --help` answers at once; the names of `ui/api/` are imported when they are used.
"""

from importlib import import_module

__version__ = "0.2.0"
"""The version; the banners of generated files name it, and the build of the wheel reads it here."""

_PLACES = {
    "ClosedForm": "ui.api.textbook_forms",
    "KinegenError": "errors",
    "Robot": "ui.api.robot",
    "Table": "ui.api.textbook_forms",
    "build": "ui.api.building",
    "compile": "ui.api.building",
    "load": "ui.api.loading",
    "load_ipython_extension": "ui.api.notebook",
    "plot": "tools.pictures",
    "view": "ui.api.notebook",
}
"""The module of each public name. None of them is also the name of a module: importing a module would replace it."""

_PACKAGES = {"reference": "verify.reference"}
"""Public packages, which are imported when they are named."""

__all__ = [
    "ClosedForm",
    "KinegenError",
    "Robot",
    "Table",
    "build",
    "compile",
    "load",
    "plot",
    "reference",
    "view",
]


def __getattr__(name: str) -> object:
    """Import a public name when it is used for the first time (PEP 562)."""
    if name in _PACKAGES:
        return import_module(f"kinegen.{_PACKAGES[name]}")
    if name not in _PLACES:
        raise AttributeError(f"module 'kinegen' has no attribute {name!r}")
    found = getattr(import_module(f"kinegen.{_PLACES[name]}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    """The public names; modules that were imported since are not among them."""
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})
