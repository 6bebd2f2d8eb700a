"""Every quantity that a robot has, in all languages: against the reference, and with the bits of C."""

from __future__ import annotations

import shutil

import pytest

from kinegen.backends.language import Language
from kinegen.backends.languages import LANGUAGES, emit_language, kept
from kinegen.verify.language_build import compare_bits
from kinegen.verify.languages import prove_languages
from kinegen.verify.runners import RUNNERS
from tests.emit.emitted import everything

WHOLE = ("blocks", "calibrated_2r", "differential_wrist", "hand", "palletiser", "puma560", "scara", "screw")
"""No joint, runtime parameters, actuators, a tree, a linkage, closed-form inverses, an angle that is a length too."""

COUNT = 200
"""Configurations at which every output of every robot has to give the bits of C."""


def require_tool(language: Language) -> None:
    """Skips a test where nothing runs the language."""
    if not any(map(shutil.which, language.tools)):
        pytest.skip(f"needs {language.install}")


@pytest.mark.languages
@pytest.mark.proves
@pytest.mark.parametrize("name", WHOLE)
def test_every_quantity_is_proven_in_all_languages(name: str) -> None:
    given, languages = everything(name), [LANGUAGES[each] for each in RUNNERS]
    for spoken in languages:
        require_tool(spoken)
    files = {path: text for each in languages for path, text in emit_language(given, each).items()}
    comparisons, _ = prove_languages(given, tuple(RUNNERS), files, compiled=True)

    for spoken in languages:
        own = [each for each in comparisons if each.invocation.language == spoken.title]
        programs = kept(given, spoken).programs
        assert {(each.quantity, each.real) for each in own} == {
            (program.quantity, str(real)) for program in programs for real in spoken.reals
        }


@pytest.mark.languages
@pytest.mark.proves("rust", "matlab", "javascript")
def test_every_robot_has_the_bits_of_c(language: str, name: str) -> None:
    """C++ and CUDA have tests of their own: with the driver of C++, and in the layouts that only CUDA has."""
    given, spoken = everything(name), LANGUAGES[language]
    require_tool(spoken)
    found = compare_bits(given, spoken, emit_language(given, spoken), COUNT)

    assert found.differing == 0, found.worst
    assert found.words > COUNT * len(kept(given, spoken).programs)
