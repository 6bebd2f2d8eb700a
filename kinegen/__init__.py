"""kinegen: a compiler for robot kinematics.

It reads a YAML file with a Denavit-Hartenberg table. It writes the closed form as a textbook prints it, C files for
firmware, and a Python module that evaluates poses in bulk. Data goes one way, from the top of this list to its end:

    robot/      the model: a robot as its owner wrote it, with exact values
    tables/     Robot          -> Robot          another convention, every pose kept
    formats/    text           <-> Robot         validated, with line numbers; writers
    symbolic/   Robot          -> Expressions    elementary transforms, folded; poses; with sympy
    ir/         Expressions    -> Program        straight-line code, one operation per statement
    emit/       Program        -> {name: text}   one folder of templates per language
    native/     C text         -> callable       compiled extension, threads, arrays
    verify/     callable       -> Proof          the proof, against reference/
    textbook/   Robot          -> closed form    for readers: text, LaTeX, MathML, Python
    boards/     C text         -> Cost           emulated microcontrollers: the same bits, flash, stack, instructions
    compare/    two Robots     -> Comparison     the same robot, by proof, or the greatest difference
    prove/      C text         -> Evidence       run-time errors of the C, by Frama-C where it is installed
    workspace/  callable       -> Workspace      what the tip reaches: extents, volume, pictures, clouds of points
    pictures/   Robot          -> SVG, PNG, PDF  the arm with joint symbols, frames and dimensions, for papers
    doctor/     Robot, poses   -> Diagnosis      the small change of a file that makes it agree with measured poses
    texts.py    Programs       -> Texts          test vectors and every text file of a build
    pipeline.py the stages in order, timed; what they found as one record
    calibrate/  measurements   -> Study          the numbers of the table that fit them, and how well they are known
    viewer/     Robot          -> HTML           one page with the arm, which moves, and its kernels
    api/        what `import kinegen` offers: load, compile, build, and rich display in notebooks
    fleet/      files of joints -> files   kernels over data sets that are larger than memory
    wheels/     robots -> .whl           what pip installs, with a self-test
    cli/        one module per subcommand

A module imports only from rows above its own; `tests/test_layers.py` reads the imports. `docs/architecture.md` explains
the stages.

sympy is imported in symbolic/, textbook/ and ir/lower.py, nowhere else. This module itself imports nothing of kinegen,
so that `kinegen --help` answers at once; the names of `api/` are imported when they are used.
"""

from importlib import import_module

__version__ = "0.1.0"
"""The version; the banners of generated files name it, and the build of the wheel reads it here."""

_PLACES = {
    "ClosedForm": "api.closed_form",
    "KinegenError": "errors",
    "Robot": "api.robot",
    "Table": "api.table",
    "build": "api.building",
    "compile": "api.compiling",
    "load": "api.loading",
    "load_ipython_extension": "api.magic",
    "plot": "pictures",
    "view": "api.viewing",
}
"""The module of each public name. None of them is also the name of a module: importing a module would replace it."""

_PACKAGES = ("reference",)
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
        return import_module(f"kinegen.{name}")
    if name not in _PLACES:
        raise AttributeError(f"module 'kinegen' has no attribute {name!r}")
    found = getattr(import_module(f"kinegen.{_PLACES[name]}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
