"""Replaces one file, or one folder, by another that was written under a name of its own.

Whoever reads the path finds the old content or the new one, whole, also if the power fails or the process is killed.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from kinegen.support.system import sync


@contextmanager
def replacing(path: Path, draft: Path, last: Callable[[], object] = lambda: None) -> Iterator[Path]:
    """Put a draft, a file or a folder beside the path, in its place when the block is done; an error leaves no draft.

    Args:
        path: The file or folder; it need not exist.
        draft: Another name in the same folder, which is free for this.
        last: Called when the draft is on the disk, right before it gets its name.

    Yields:
        The draft.

    Raises:
        OSError: If it cannot be written; the path is then as it was.
    """
    try:
        yield draft
        put_in_place(draft, path, last)
    finally:
        remove(draft)


def put_in_place(draft: Path, path: Path, last: Callable[[], object] = lambda: None) -> None:
    """Give a draft its name when it is on the disk; what `last` raises right before that leaves all as it is."""
    settle(draft)
    last()
    if path.is_dir():
        remove(path)
    draft.replace(path)
    sync(path.parent)


def settle(path: Path) -> None:
    """See that a file, or a folder with all that it holds, is on the disk before its name says that it is complete."""
    for place, _, names in os.walk(path):
        for name in names:
            sync(Path(place, name))
        sync(Path(place))
    if path.is_file():
        sync(path)


def remove(path: Path) -> None:
    """Remove a file or a folder, if it is there."""
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)
