"""The proof of kernels in languages beside C and Python: what was emitted, run by the tool of the language.

In: emitted text. Out: comparisons with the reference, at the same inputs and on the same terms as those of C; and the
same bits as the scalar C kernels that are compiled without contraction.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack

from kinegen.emit.kernels import Kernels
from kinegen.emit.language import Language
from kinegen.emit.languages import LANGUAGES, refusals
from kinegen.emit.reals import Real
from kinegen.errors import MissingToolError
from kinegen.verify.comparison import Comparison, Proof
from kinegen.verify.judged import Judged
from kinegen.verify.prepared import Ready, prepared


def prove_languages(
    kernels: Kernels, names: Sequence[str], files: Mapping[str, str], *, compiled: bool
) -> tuple[tuple[Comparison, ...], tuple[str, ...]]:
    """Prove the files of some languages, all of them beside one computation of the reference.

    Args:
        kernels: The robot and its programs.
        names: The languages, as in `LANGUAGES`.
        files: Their files by path.
        compiled: Whether the build compiles C, whose bits are asked for.

    Returns:
        The comparisons, and sentences about what a language leaves out, or why it was not proven.

    Raises:
        CompileError: As `prove_language`.
        ProofError: As `prove_language`.
    """
    ready: list[Ready] = []
    reasons: list[str] = []
    with ExitStack() as stack:
        for language in (LANGUAGES[name] for name in names):
            reasons += refusals(kernels, language)
            own = {path: text for path, text in files.items() if path.startswith(f"{language.name}/")}
            missing = "" if compiled else "it takes a C compiler"
            try:
                ready += [stack.enter_context(prepared(kernels, language, own))] if compiled else ()
            except MissingToolError as error:
                missing = error.message
            reasons += [f"the {language.title} files are written without a proof: {missing}"] * bool(missing)
        return _prove(ready), tuple(reasons)


def prove_language(kernels: Kernels, language: Language, files: Mapping[str, str]) -> tuple[Comparison, ...]:
    """Run the files of a language and hold every kernel against the reference.

    Args:
        kernels: The robot and its programs.
        language: The language.
        files: Its files by path.

    Returns:
        The comparisons, all of which hold.

    Raises:
        MissingToolError: If nothing that runs the language is installed, or no C compiler, whose bits are asked for.
        CompileError: If the tool refuses the files.
        ProofError: If a kernel is off by more than is accepted, loses a NaN or gives other bits than C.
    """
    with prepared(kernels, language, files) as ready:
        return _prove([ready])


def _prove(ready: Sequence[Ready]) -> tuple[Comparison, ...]:
    """The comparisons of languages that can be called, one language after the other."""
    found: dict[str, list[Comparison]] = {each.language.title: [] for each in ready}
    for real in Real:
        able = [each for each in ready if real in map(Real, each.language.reals)]
        if able:
            judged = Judged(able, real)
            compared = judged.comparisons()
            for title, own in compared.items():
                Proof(1.0, tuple(own)).require(able[0].kernels.robot)
                found[title] += own
            judged.require_bits()
    return tuple(comparison for own in found.values() for comparison in own)
