"""All files of a package, from all emitters."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass

from kinegen.emit.c.batch import emit_batch
from kinegen.emit.c.expected import Vectors
from kinegen.emit.c.kernel import emit_kernel
from kinegen.emit.c.numeric_inverse import emit_numeric_inverse
from kinegen.emit.c.vectors import emit_vectors
from kinegen.emit.kernels import Kernels
from kinegen.emit.python.formula import emit_formula
from kinegen.emit.python.package import emit_package
from kinegen.emit.reals import Real


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
    sources: dict[str, str] = {}
    for real in reals:
        sources |= emit_kernel(kernels, real) | emit_batch(kernels, real)
        if kernels.numeric_inverse:
            sources |= emit_numeric_inverse(kernels, real)
    files = dict(sources)
    for real in reals:
        files |= emit_vectors(kernels, vectors, real)
    stamp = stamp_of(sources)
    return Emitted(sources, files | emit_formula(kernels) | emit_package(kernels, reals, stamp), stamp)


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
