"""Emitted files on disk, once for all tests of a process."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path

from kinegen.runtime.extension import lay_out


def folders(root: Path, texts: Callable[[str], Mapping[str, str]]) -> Callable[[str], Path]:
    """The folders of the files of robots, each written when it is first asked for.

    Args:
        root: The folder that they are in; tests write only beside them.
        texts: The files of a robot, by name.
    """

    @cache
    def folder(name: str) -> Path:
        lay_out(root / name, texts(name))
        return root / name

    return folder
