"""All files of a package, from all emitters."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass

from kinegen.emit.c import C
from kinegen.emit.c.expected import Vectors
from kinegen.emit.c.vectors import emit_vectors
from kinegen.emit.complete.screws import require_double
from kinegen.emit.fixed import INTEGERS
from kinegen.emit.fixed.kernels import fixed_kernels
from kinegen.emit.fixed.vectors import FixedVectors, emit_fixed_vectors
from kinegen.emit.kernels import Kernels
from kinegen.emit.python import PYTHON
from kinegen.emit.python.package import emit_package
from kinegen.emit.reals import Real
from kinegen.naming import Q30


@dataclass(frozen=True, slots=True)
class Emitted:
    """What the emitters made.

    Attributes:
        sources: The C files that the extension is compiled from, by name.
        files: All files of the package, these among them.
        stamp: Digest of the sources.
    """

    sources: Mapping[str, str]
    files: Mapping[str, str]
    stamp: str


def emit_files(kernels: Kernels, reals: tuple[Real, ...], vectors: Vectors) -> Emitted:
    """Print every text file of a package.

    Args:
        kernels: The robot and its programs.
        reals: Number types.
        vectors: What the kernels must return.

    Returns:
        C kernels, their test vectors, and the Python module with its NumPy form.
    """
    if kernels.complete_inverse:
        require_double(kernels.robot, reals)
    sources: dict[str, str] = {}
    for real in reals:
        sources |= C.files(kernels, real)
    files = dict(sources)
    for real in reals:
        files |= emit_vectors(kernels, vectors, real)
    stamp = stamp_of(sources)
    for real in reals:
        files |= PYTHON.files(kernels, real)
    return Emitted(sources, files | emit_package(kernels, reals, stamp), stamp)


def emit_integers(kernels: Kernels, vectors: FixedVectors) -> dict[str, str]:
    """Print all there is of the kernels in integers.

    Args:
        kernels: The robot and its programs.
        vectors: What the kernels must return.

    Returns:
        Kernels, test vectors and self-test, by name.

    Raises:
        KinegenError: If integers cannot evaluate a program; the message says why.
    """
    return {**INTEGERS.files(kernels, Q30), **emit_fixed_vectors(fixed_kernels(kernels), vectors)}


def stamp_of(sources: Mapping[str, str]) -> str:
    """The digest by which a package recognises the extension that belongs to it.

    Args:
        sources: Emitted C files by name: those of the kernels, headers included, in any order.

    Returns:
        Sixteen hexadecimal digits.
    """
    digest = hashlib.sha256()
    for name, text in sorted(sources.items()):
        digest.update(f"{name}\0{text}\0".encode())
    return digest.hexdigest()[:16]
