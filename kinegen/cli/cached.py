"""What a user is told of the cache."""

from __future__ import annotations

from functools import cache

from kinegen.cli.terminal import complain


@cache
def warn_of_cache() -> None:
    """Say once why the user's cache folder is not used, if it is not."""
    from kinegen.native.cache import Cache

    if refusal := Cache().refusal:
        complain(f"warning: {refusal}")
