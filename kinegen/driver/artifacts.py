"""What is emitted of programs: every file of a build, or one package for this process alone."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Mapping
from dataclasses import field, replace
from pathlib import Path
from types import ModuleType

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.batch import emit_batch
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.c.test_vectors import Vectors
from kinegen.backends.controllers.controller import Controller
from kinegen.backends.controllers.project import emit_controller
from kinegen.backends.files import Emitted, emit_files, emit_integers, stamp_of
from kinegen.backends.firmware.project import emit_project
from kinegen.backends.fixed_point.kernels import fixed_kernels
from kinegen.backends.fixed_point.vectors import FixedVectors
from kinegen.backends.languages import LANGUAGES, emit_languages
from kinegen.backends.python.formula import emit_formula
from kinegen.backends.python.package import emit_package
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.results import BuildOptions
from kinegen.errors import MissingToolError
from kinegen.runtime.compile import Extension
from kinegen.runtime.extension import build_extension, interface_of, lay_out, load_package
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import EXTENSION, RUNTIME
from kinegen.verify.fixed_point_vectors import fixed_vectors
from kinegen.verify.vectors import compute_vectors


@dataclass(frozen=True, slots=True)
class ProgramBundle:
    """What the emitters are given.

    Attributes:
        kernels: The robot and its programs.
        vectors: Their test vectors.
        integers: Test vectors of the kernels in integers; None if these were not asked for.
    """

    kernels: RobotPrograms
    vectors: Vectors
    integers: FixedVectors | None


@dataclass(frozen=True, slots=True)
class Artifacts:
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
        """Return the Python package, which is what is proven; files of other languages are proven apart."""
        compiled = {} if extension is None else {EXTENSION: extension.content}
        return {**self.emitted.files, **compiled, **self.integers}

    def written(self, extension: Extension | None) -> Mapping[str, str | bytes]:
        """Return what is written: the firmware package, or the Python package beside the files of other languages."""
        return {**self.project} if self.project else {**self.package(extension), **self.others}

    def vendored(self, options: BuildOptions) -> dict[str, str]:
        """Return the proven files that a firmware package takes from."""
        floats = {} if options.only_integers else self.emitted.files
        return {**floats, **self.integers}

    def is_stale(self, folder: Path, name: str) -> bool:
        """Return whether a file of an earlier build goes that is not among the new ones.

        A firmware package clears the folders below its own; what is in the folder itself may be another package of the
        same robot. A Python package clears kernels in any language, but not an extension of the same C files.
        """
        # The vendored modules belong to a Python package, as the files beside them do.
        below = name.partition("/")[0] if "/" in name and not name.startswith(f"{RUNTIME}/") else ""
        if self.project:
            return bool(below)
        if name == EXTENSION:
            return self.emitted.stamp.encode() not in (folder / name).read_bytes()
        language = LANGUAGES.get(below)
        return not below or (language is not None and language.is_extra)


def bundle_of(kernels: RobotPrograms, *, integers: bool) -> ProgramBundle:
    """Return the kernels with what they must return.

    Raises:
        KinegenError: If integers cannot evaluate a program; the message says why.
    """
    fixed = fixed_vectors(fixed_kernels(kernels)) if integers else None
    return ProgramBundle(kernels, compute_vectors(kernels), fixed)


def texts_of(bundle: ProgramBundle, options: BuildOptions) -> Artifacts:
    """Print every file, and those of a firmware package if one is asked for.

    Raises:
        KinegenError: If a language or a package cannot have a name of the robot.
    """
    kernels, vectors = bundle.kernels, bundle.vectors
    texts = Artifacts(
        emitted=emit_files(kernels, options.reals, vectors),
        integers={} if bundle.integers is None else emit_integers(kernels, bundle.integers),
        others=emit_languages(kernels, options.languages, vectors),
    )
    if options.package is None:
        return texts
    # Packages take the verified files as they are, and add glue code and project files.
    if isinstance(options.package, Controller):
        return replace(texts, project=emit_controller(kernels, texts.vendored(options), options.package))
    files, reals = texts.vendored(options), () if options.only_integers else options.reals
    fixed = None if bundle.integers is None else fixed_kernels(kernels)
    return replace(texts, project=emit_project(kernels, vectors, files, reals, options.package, fixed))


_REALS = (ScalarType.DOUBLE,)


def make_package(kernels: RobotPrograms) -> ModuleType:
    """Return the package of a robot in double precision, compiled, and imported from a folder that nobody else sees.

    The kernels are the ones that a build emits, and verified there. NumPy evaluates where there is no compiler.

    Raises:
        CompileError: If there is a compiler, and it refuses the kernels.
    """
    sources: dict[str, str] = {}
    for real in _REALS:
        sources |= emit_kernel(kernels, real) | emit_batch(kernels, real)
    files = emit_formula(kernels) | emit_package(kernels, _REALS, stamp_of(sources))
    contents = {name: text.encode() for name, text in files.items()}
    # Without a compiler the package has no extension, and NumPy evaluates.
    extension = None
    with contextlib.suppress(MissingToolError):
        extension = build_extension(interface_of(kernels, _REALS), sources)
        contents[EXTENSION] = extension.content
    # Python keeps an extension open after its folder is gone.
    with tempfile.TemporaryDirectory(prefix="kinegen-") as staging:
        folder = Path(staging) / kernels.robot.name
        lay_out(folder, contents)
        package = load_package(folder)
    if extension is not None:
        # What does not load is compiled again the next time.
        (extension.keep if package.backend == "c" else extension.forget)()
    return package
