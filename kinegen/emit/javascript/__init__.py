"""JavaScript: an ECMAScript module with its type declarations, for browsers, Node.js and other engines."""

from __future__ import annotations

from kinegen.emit.kernels import Kernels
from kinegen.emit.language import Language
from kinegen.outputs import Kind, Quantity


def _refuses(quantity: Quantity) -> str:
    return "it is a search, and functions here have no loop" if quantity.kind is Kind.NUMERIC_INVERSE else ""


def _files(kernels: Kernels) -> dict[str, str]:
    # Here, so that the list of languages is quick to read.
    from kinegen.emit.javascript.module import emit_javascript

    return emit_javascript(kernels)


JAVASCRIPT = Language(
    name="javascript",
    title="JavaScript",
    refuses=_refuses,
    files=_files,
    tools=("node",),
    install="Node.js",
)
