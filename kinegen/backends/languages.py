"""The languages by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

from kinegen.backends.c import C
from kinegen.backends.cpp import CPP
from kinegen.backends.cuda import CUDA
from kinegen.backends.fixed_point import INTEGERS
from kinegen.backends.javascript import JAVASCRIPT
from kinegen.backends.language import Language
from kinegen.backends.matlab import MATLAB
from kinegen.backends.python import PYTHON
from kinegen.backends.rust import RUST
from kinegen.errors import KinegenError
from kinegen.model.outputs import COMPLETE_INVERSE, INVERSE_TRACKER, NUMERIC_INVERSE, REDUNDANCY_RANGE, Quantity

if TYPE_CHECKING:
    from kinegen.backends.bundle import RobotPrograms
    from kinegen.backends.c.test_vectors import Vectors

LANGUAGES: Mapping[str, Language] = MappingProxyType(
    {
        language.name: language
        for language in (
            C,
            PYTHON,
            INTEGERS,
            JAVASCRIPT,
            CPP,
            RUST,
            MATLAB,
            CUDA,
        )
    }
)
"""What `--languages` can name is extra; see `Language.is_extra`. Help texts read this table, so a language imports what
prints its files only when it prints them."""


def emit_languages(kernels: RobotPrograms, names: Sequence[str], vectors: Vectors) -> dict[str, str]:
    """Print the files of some languages, by path; see `emit_language`."""
    return {path: text for name in names for path, text in emit_language(kernels, LANGUAGES[name], vectors).items()}


def emit_language(kernels: RobotPrograms, language: Language, vectors: Vectors | None = None) -> dict[str, str]:
    """Print the files of a language.

    Args:
        kernels: The robot and its programs; those of quantities that the language refuses are left out.
        vectors: What the kernels must return; without them there are no tests among the files.

    Returns:
        Text by path below the folder of the robot, with forward slashes.

    Raises:
        KinegenError: If a name of the robot is a word of the language.
    """
    robot = kernels.robot
    for kind, name in (("robot", robot.name), *(("parameter", each.name) for each in robot.runtime_parameters)):
        if name in language.reserved or (kind == "robot" and name in language.reserved_robots):
            reason = f"{kind} name '{name}' is a word of {language.title}; rename it or leave {language.title} out"
            raise KinegenError(reason, robot.source)
    folder = f"{language.name}/" if language.is_extra else ""
    printed = kept(kernels, language)
    files = [language.files(printed, real) for real in language.reals]
    files += [language.tests(printed, real, vectors) for real in language.reals] if vectors is not None else []
    return {f"{folder}{name}": text for each in files for name, text in each.items()}


def kept(kernels: RobotPrograms, language: Language) -> RobotPrograms:
    """Return the kernels that a language prints."""
    programs = tuple(each for each in kernels.programs if not language.refuses(each.quantity))
    solvers = [solver for solver in kernels.solvers if not _refusal(kernels, language, solver)]
    return replace(
        kernels,
        programs=programs,
        numeric_inverse=NUMERIC_INVERSE in solvers,
        complete_inverse=COMPLETE_INVERSE in solvers,
        redundancy_range=REDUNDANCY_RANGE in solvers,
        inverse_tracker=INVERSE_TRACKER in solvers,
    )


def refusals(kernels: RobotPrograms, language: Language) -> tuple[str, ...]:
    """Return sentences about what a language leaves out."""
    quantities = [*(program.quantity for program in kernels.programs), *kernels.solvers]
    reasons = ((quantity, _refusal(kernels, language, quantity)) for quantity in quantities)
    return tuple(f"{language.title} has no {quantity}: {reason}" for quantity, reason in reasons if reason)


def _refusal(kernels: RobotPrograms, language: Language, quantity: Quantity) -> str:
    """Return why a language has no function for a quantity of this robot, or an empty text."""
    several = quantity == NUMERIC_INVERSE and kernels.robot.is_tree and not language.searches_trees
    return language.refuses(quantity) or ("for several tips it is in C and Python alone" if several else "")
