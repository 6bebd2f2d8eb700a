"""What a build hands to the emitters, and what they make of it: programs and test vectors in, every text file out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from kinegen.emit.c.expected import Vectors
from kinegen.emit.controllers.controller import Controller
from kinegen.emit.controllers.project import emit_controller
from kinegen.emit.files import Emitted, emit_files, emit_integers
from kinegen.emit.fixed.kernels import fixed_kernels
from kinegen.emit.fixed.vectors import FixedVectors
from kinegen.emit.kernels import Kernels
from kinegen.emit.languages import LANGUAGES, emit_languages
from kinegen.emit.packages.project import emit_project
from kinegen.naming import EXTENSION
from kinegen.native.compile import Extension
from kinegen.results import BuildOptions
from kinegen.verify.integer_vectors import fixed_vectors
from kinegen.verify.vectors import compute_vectors


@dataclass(frozen=True, slots=True)
class Bundle:
    """What the emitters are given.

    Attributes:
        kernels: The robot and its programs.
        vectors: Their test vectors.
        integers: Test vectors of the kernels in integers; None if these were not asked for.
    """

    kernels: Kernels
    vectors: Vectors
    integers: FixedVectors | None


@dataclass(frozen=True, slots=True)
class Texts:
    """What the emitters made.

    Attributes:
        emitted: C and Python.
        integers: Files of the kernels in integers, by name; none if they were not asked for.
        others: Files of other languages, by path.
        project: Files of the firmware package, by path; none if a Python package was asked for.
    """

    emitted: Emitted
    integers: Mapping[str, str]
    others: Mapping[str, str]
    project: Mapping[str, str] = field(default_factory=dict)

    @property
    def count(self) -> int:
        """The number of files in text."""
        return len(self.project or self.emitted.files) + len(self.integers) + len(self.others)

    def package(self, extension: Extension | None) -> dict[str, str | bytes]:
        """The Python package, which is what is proven; files of other languages are proven apart."""
        compiled = {} if extension is None else {EXTENSION: extension.content}
        return {**self.emitted.files, **compiled, **self.integers}

    def written(self, extension: Extension | None) -> Mapping[str, str | bytes]:
        """What is written: the firmware package, or the Python package beside the files of other languages."""
        return {**self.project} if self.project else {**self.package(extension), **self.others}

    def vendored(self, options: BuildOptions) -> dict[str, str]:
        """The proven files that a firmware package takes from."""
        floats = {} if options.only_integers else self.emitted.files
        return {**floats, **self.integers}

    def is_stale(self, folder: Path, name: str) -> bool:
        """Whether a file of an earlier build goes that is not among the new ones.

        A firmware package clears the folders below its own, where all there is may be compiled; what lies in the folder
        itself may be another package of the same robot. A Python package clears kernels in any language, but not an
        extension of the same C files.
        """
        is_below = "/" in name
        if self.project:
            return is_below
        if name == EXTENSION:
            return self.emitted.stamp.encode() not in (folder / name).read_bytes()
        language = LANGUAGES.get(name.partition("/")[0])
        return not is_below or (language is not None and language.is_extra)


def bundle_of(kernels: Kernels, *, integers: bool) -> Bundle:
    """The kernels with what they must return.

    Args:
        kernels: The robot and its programs.
        integers: Whether there will be kernels in integers too.

    Raises:
        KinegenError: If integers cannot evaluate a program; the message says why.
    """
    fixed = fixed_vectors(fixed_kernels(kernels)) if integers else None
    return Bundle(kernels, compute_vectors(kernels), fixed)


def texts_of(bundle: Bundle, options: BuildOptions) -> Texts:
    """Print every file.

    Args:
        bundle: The kernels and their test vectors.
        options: What to make.

    Returns:
        All text; the files of a firmware package too if one is asked for.

    Raises:
        KinegenError: If a language or a package cannot have a name of the robot.
    """
    kernels, vectors = bundle.kernels, bundle.vectors
    texts = Texts(
        emitted=emit_files(kernels, options.reals, vectors),
        integers={} if bundle.integers is None else emit_integers(kernels, bundle.integers),
        others=emit_languages(kernels, options.languages, vectors),
    )
    if options.package is None:
        return texts
    if isinstance(options.package, Controller):
        return replace(texts, project=emit_controller(kernels, texts.vendored(options), options.package))
    files, reals = texts.vendored(options), () if options.only_integers else options.reals
    fixed = None if bundle.integers is None else fixed_kernels(kernels)
    return replace(texts, project=emit_project(kernels, vectors, files, reals, options.package, fixed))
