"""Rust: a crate without the standard library, without unsafe code and without dependencies."""

from __future__ import annotations

from typing import TYPE_CHECKING

from kinegen.backends.language import Language
from kinegen.backends.scalar_types import ScalarType
from kinegen.model.outputs import Kind, Quantity

if TYPE_CHECKING:
    from kinegen.backends.bundle import RobotPrograms
    from kinegen.backends.c.test_vectors import Vectors
    from kinegen.backends.printing import Syntax
    from kinegen.ir.program import Operator

_WORDS = frozenset(
    """abstract as async await become box break const continue crate do dyn else enum extern false final fn for gen if
    impl in let loop macro match mod move mut override priv pub ref return self static struct super trait true try type
    typeof union unsafe unsized use virtual where while yield Self""".split()
)
"""Keywords of all editions, and those that are kept for later ones."""

_CRATES = frozenset("alloc cc core glam nalgebra proc_macro std test f32 f64".split())
"""Crates and types that a crate of the same name would hide."""


def _refuses(quantity: Quantity) -> str:
    alone = (Kind.COMPLETE_INVERSE, Kind.REDUNDANCY_RANGE, Kind.INVERSE_TRACKER)
    return "it is in C and Python alone" if quantity.kind in alone else ""


def _syntax(real: str) -> Syntax[Operator]:
    from kinegen.backends.rust.syntax import rust_syntax

    return rust_syntax(ScalarType(real))


def _files(kernels: RobotPrograms, real: str) -> dict[str, str]:
    # Here, so that the list of languages is quick to read.
    from kinegen.backends.rust.files import emit_rust

    return emit_rust(kernels, ScalarType(real))


def _tests(kernels: RobotPrograms, real: str, vectors: Vectors) -> dict[str, str]:
    from kinegen.backends.rust.files import emit_rust_tests

    return emit_rust_tests(kernels, vectors, ScalarType(real))


RUST = Language(
    name="rust",
    title="Rust",
    reals=tuple(ScalarType),
    syntax=_syntax,
    files=_files,
    refuses=_refuses,
    searches_trees=False,
    tools=("rustc",),
    install="rustc",
    tests=_tests,
    reserved=_WORDS | _CRATES,
)
