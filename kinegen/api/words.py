"""What callers write: lists of words, and texts where paths may be. Nothing large is imported for them."""

from __future__ import annotations

from collections.abc import Iterable

from kinegen.errors import KinegenError, quote

Words = str | Iterable[str]
"""A list of words, or a text with commas between them."""

USUAL_OUTPUTS = "pose,frames,position"
"""`outputs.USUAL` in words; a test compares them."""


def words_of(words: Words) -> tuple[str, ...]:
    """The words of a list, each once."""
    parts = words.split(",") if isinstance(words, str) else list(words)
    for part in parts:
        if not isinstance(part, str):
            raise KinegenError(f"expected words, not {quote(repr(part))}")
    return tuple(dict.fromkeys(part.strip() for part in parts)) if words else ()


def is_text(source: str) -> bool:
    """Whether a string is the text of a robot file, and not the path of one."""
    return not source.strip() or "\n" in source or source.lstrip()[:1] in ("<", "{")
