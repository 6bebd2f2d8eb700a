"""The languages beside C and Python, by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from kinegen.emit.javascript import JAVASCRIPT
from kinegen.emit.kernels import Kernels
from kinegen.emit.language import Language
from kinegen.outputs import NUMERIC_INVERSE

LANGUAGES: Mapping[str, Language] = MappingProxyType({language.name: language for language in (JAVASCRIPT,)})


def emit_languages(kernels: Kernels, names: Sequence[str]) -> dict[str, str]:
    """Print the files of some languages, by path; see `emit_language`."""
    return {path: text for name in names for path, text in emit_language(kernels, LANGUAGES[name]).items()}


def emit_language(kernels: Kernels, language: Language) -> dict[str, str]:
    """Print the files of a language.

    Args:
        kernels: The robot and its programs; those of quantities that the language refuses are left out.
        language: The language.

    Returns:
        Text by path below the folder of the robot, with forward slashes.
    """
    files = language.files(kept(kernels, language))
    return {f"{language.name}/{name}": text for name, text in files.items()}


def kept(kernels: Kernels, language: Language) -> Kernels:
    """The kernels that a language prints."""
    programs = tuple(each for each in kernels.programs if not language.refuses(each.quantity))
    return Kernels(kernels.robot, programs, kernels.defaults)


def refusals(kernels: Kernels, language: Language) -> tuple[str, ...]:
    """Sentences about what a language leaves out."""
    quantities = [program.quantity for program in kernels.programs]
    quantities += [NUMERIC_INVERSE] * kernels.numeric_inverse
    reasons = ((quantity, language.refuses(quantity)) for quantity in quantities)
    return tuple(f"{language.title} has no {quantity}: {reason}" for quantity, reason in reasons if reason)
