"""What a caller asks for in words: lists, texts and paths, and `BuildOptions` that the command line shares."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from kinegen.errors import KinegenError, quote

if TYPE_CHECKING:
    from kinegen.backends.controllers.controller import Controller
    from kinegen.backends.firmware.ecosystem import Ecosystem
    from kinegen.driver.results import BuildOptions
    from kinegen.model.outputs import Quantity

Words = str | Iterable[str]
"""A list of words, or a text with commas between them."""


def words_of(words: Words) -> tuple[str, ...]:
    """Return the words of a list, each once."""
    parts = words.split(",") if isinstance(words, str) else list(words)
    for part in parts:
        if not isinstance(part, str):
            raise KinegenError(f"expected words, not {quote(repr(part))}")
    return tuple(dict.fromkeys(part.strip() for part in parts)) if words else ()


def is_text(source: str) -> bool:
    """Return whether a string is the text of a robot file, and not the path of one."""
    return not source.strip() or "\n" in source or source.lstrip()[:1] in ("<", "{")


REALS = {"double": ("double",), "float": ("float",), "both": ("double", "float")}
INTEGERS = {"q30": REALS["double"], "float,q30": REALS["float"], "all": REALS["both"]}
"""The choices with kernels in integers, and the number types beside them."""

ALWAYS = ("c", "python")
"""Languages that every build writes."""


def quantities_of(outputs: Words) -> tuple[Quantity, ...]:
    """Return the outputs in the order of `Kind`, whatever the order in which they were named.

    Raises:
        KinegenError: If there is no such output; the message lists what there is.
    """
    from kinegen.model.outputs import Kind, parse_quantity

    found = {parse_quantity(word) for word in words_of(outputs) or ("",)}
    places = {kind: place for place, kind in enumerate(Kind)}
    return tuple(sorted(found, key=lambda quantity: (places[quantity.kind], str(quantity))))


def languages_of(languages: Words) -> tuple[str, ...]:
    """Return the languages in the order of their table; C and Python may be named, and are always written.

    Raises:
        KinegenError: If there is no such language.
    """
    names = words_of(languages)
    if not names:
        return ()
    from kinegen.backends.languages import LANGUAGES

    extra = [language.name for language in LANGUAGES.values() if language.is_extra]
    unknown = [name for name in names if name not in (*ALWAYS, *extra)]
    if unknown:
        raise KinegenError(f"unknown language '{unknown[0]}' (expected {', '.join((*ALWAYS, *extra))})")
    return tuple(name for name in extra if name in names)


def build_options(
    output: str | os.PathLike[str] | None,
    *,
    outputs: Words | None,
    real: str | None,
    wrt: Words = (),
    package: str | None = None,
    languages: Words = (),
    compile: bool = True,  # noqa: A002 - as the option is called
    march: str | None = None,
    portable: bool = False,
    reproducible: bool = False,
    force: bool = False,
    measure: bool = False,
) -> BuildOptions:
    """Return the options of a build; arguments as for `kinegen.build`.

    The float kernels are measured on a microcontroller if `measure` is true or firmware is asked for: by `package`, or
    by a number type without double.

    Raises:
        KinegenError: If a word is unknown, or two options exclude each other.
    """
    from kinegen.backends.scalar_types import ScalarType
    from kinegen.driver.results import BuildOptions
    from kinegen.model.outputs import DEFAULT, USUAL
    from kinegen.runtime.flags import Flags

    # Words and pairs that nothing can be made of.
    known = REALS | INTEGERS
    if real is not None and real not in known:
        raise KinegenError(f"unknown number type {quote(str(real))} (expected {', '.join(known)})")
    chosen, real, outputs = _packaged(package, real, outputs)
    if march and portable:
        raise KinegenError("march and portable exclude each other")
    if package and words_of(languages):
        raise KinegenError("package writes C alone; build with languages into another folder")
    return BuildOptions(
        output=Path(output or (chosen.folder if chosen else "build")),
        reals=tuple(map(ScalarType, known[real])) if real else chosen.reals if chosen else tuple(ScalarType),
        quantities=quantities_of(outputs) if outputs is not None else USUAL if real in INTEGERS else DEFAULT,
        usual_inverse=outputs is None,
        wrt=words_of(wrt),
        integers=real in INTEGERS,
        only_integers=bool(package) and real == "q30",
        package=chosen,
        languages=languages_of(languages),
        force=force,
        measure=measure or chosen is not None or real in ("float", "float,q30"),
        compile=compile,
        flags=Flags(march or "native", portable=portable, contraction=not reproducible),
    )


def _packaged(
    package: str | None, real: str | None, outputs: Words | None
) -> tuple[Ecosystem | Controller | None, str | None, Words | None]:
    """Return what a package is for; the number type and the outputs are those of a controller where it is for one."""
    from kinegen.backends.controllers.controller import NEEDED, Controller
    from kinegen.backends.firmware.ecosystem import Ecosystem

    known: dict[str, Ecosystem | Controller] = {each.value: each for each in (*Ecosystem, *Controller)}
    if package is not None and package not in known:
        raise KinegenError(f"unknown package {quote(str(package))} (expected {', '.join(known)})")
    chosen = known[package] if package else None
    if not isinstance(chosen, Controller):
        return chosen, real, outputs
    (has,) = (each.value for each in chosen.reals)
    if real not in (None, has):
        raise KinegenError(f"a package for {chosen.makers_name} is in {has}; leave the number type out")
    return chosen, has, tuple(map(str, NEEDED))
