"""What a caller asks of a build, in words, as `BuildOptions`; the command line and Python share it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from kinegen.api.words import Words, words_of
from kinegen.emit.controllers.controller import NEEDED, Controller
from kinegen.emit.packages.ecosystem import Ecosystem
from kinegen.errors import KinegenError, quote
from kinegen.outputs import Kind, Quantity, parse_quantity

if TYPE_CHECKING:
    from kinegen.results import BuildOptions

REALS = {"double": ("double",), "float": ("float",), "both": ("double", "float")}
INTEGERS = {"q30": REALS["double"], "float,q30": REALS["float"], "all": REALS["both"]}
"""The choices with kernels in integers, and the number types beside them."""

ALWAYS = ("c", "python")
"""Languages that every build writes."""


def quantities_of(outputs: Words) -> tuple[Quantity, ...]:
    """The outputs in the order of `Kind`, whatever the order in which they were named.

    Raises:
        KinegenError: If there is no such output; the message lists what there is.
    """
    found = {parse_quantity(word) for word in words_of(outputs) or ("",)}
    places = {kind: place for place, kind in enumerate(Kind)}
    return tuple(sorted(found, key=lambda quantity: (places[quantity.kind], str(quantity))))


def languages_of(languages: Words) -> tuple[str, ...]:
    """The languages in the order of their table; C and Python may be named, and are always written.

    Raises:
        KinegenError: If there is no such language.
    """
    names = words_of(languages)
    if not names:
        return ()
    from kinegen.emit.languages import LANGUAGES

    extra = [language.name for language in LANGUAGES.values() if language.is_extra]
    unknown = [name for name in names if name not in (*ALWAYS, *extra)]
    if unknown:
        raise KinegenError(f"unknown language '{unknown[0]}' (expected {', '.join((*ALWAYS, *extra))})")
    return tuple(name for name in extra if name in names)


def build_options(
    output: str | os.PathLike[str] | None,
    *,
    outputs: Words,
    real: str | None,
    wrt: Words = (),
    package: str | None = None,
    languages: Words = (),
    compile: bool = True,  # noqa: A002 - as the option is called
    march: str | None = None,
    portable: bool = False,
    reproducible: bool = False,
    force: bool = False,
) -> BuildOptions:
    """Options of a build; arguments as for `kinegen.build`.

    Raises:
        KinegenError: If a word is unknown, or two options exclude each other.
    """
    from kinegen.emit.reals import Real
    from kinegen.native.flags import Flags
    from kinegen.results import BuildOptions

    known = REALS | INTEGERS
    if real is not None and real not in known:
        raise KinegenError(f"unknown number type {quote(str(real))} (expected {', '.join(known)})")
    chosen = _package_of(package)
    if march and portable:
        raise KinegenError("march and portable exclude each other")
    if package and words_of(languages):
        raise KinegenError("package writes C alone; build with languages into another folder")
    if isinstance(chosen, Controller):
        real = _controller_real(chosen, real)
    return BuildOptions(
        output=Path(output or (chosen.folder if chosen else "generated")),
        reals=tuple(map(Real, known[real])) if real else chosen.reals if chosen else tuple(Real),
        quantities=quantities_of(map(str, NEEDED) if isinstance(chosen, Controller) else outputs),
        wrt=words_of(wrt),
        integers=real in INTEGERS,
        only_integers=bool(package) and real == "q30",
        package=chosen,
        languages=languages_of(languages),
        force=force,
        compile=compile,
        flags=Flags(march or "native", portable=portable, contraction=not reproducible),
    )


def _package_of(package: str | None) -> Ecosystem | Controller | None:
    """What a package is for.

    Raises:
        KinegenError: If nothing is called so.
    """
    known: dict[str, Ecosystem | Controller] = {each.value: each for each in (*Ecosystem, *Controller)}
    if package is not None and package not in known:
        raise KinegenError(f"unknown package {quote(str(package))} (expected {', '.join(known)})")
    return known[package] if package else None


def _controller_real(controller: Controller, real: str | None) -> str:
    """The number type that a controller has.

    Raises:
        KinegenError: If another one is asked for.
    """
    (has,) = (each.value for each in controller.reals)
    if real not in (None, has):
        raise KinegenError(f"a package for {controller.makers_name} is in {has}; leave the number type out")
    return has
