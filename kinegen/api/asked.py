"""Calls of `kinegen.compile` that were made before in the same words, so that their robot need not be read again.

In: the file or text of a robot and the other arguments, as the caller wrote them. Out: the name of the call, and the
module that it led to. Reading a robot takes longer than importing its module, and the text decides what is read; so
the call is recognised by its text, and neither the model nor the readers are imported. Only kinegen's own format is
recognised in this way: xacro files read others, and what importing a URDF changes is told at each call.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from kinegen.api.kept import known_module
from kinegen.api.words import is_text
from kinegen.native.cache import Cache

_SHELF = "calls"
"""The folder of the cache that holds what calls led to."""

_OWN_SUFFIXES = (".yaml", ".yml")


@dataclass(frozen=True, slots=True)
class _Found:
    """What a call led to: the key of the module, and the name of the robot."""

    key: str
    name: str


def call_name(robot: object, decisive: tuple[object, ...]) -> str:
    """A name for a call.

    Args:
        robot: The robot as the caller named it.
        decisive: The other arguments, and everything else that decides the module.

    Returns:
        The name; empty for a robot that has to be read.
    """
    text = _text_of(robot)
    return Cache().key("call", text, decisive) if text else ""


def module_of(call: str) -> ModuleType | None:
    """The module that a call led to before; None where there was none, or its folder is not as it was left."""
    found = Cache(shelf=_SHELF).load_record(call, _Found) if call else None
    return None if found is None else known_module(found.key, found.name)


def remember(call: str, key: str, name: str) -> None:
    """Keep what a call led to.

    Args:
        call: Its name; nothing is kept if it is empty.
        key: The key of the module; nothing is kept if it is empty.
        name: Name of the robot.
    """
    if call and key:
        Cache(shelf=_SHELF).save_record(call, _Found(key, name))


def _text_of(robot: object) -> tuple[str, bytes] | None:
    """The path and the text of a robot in kinegen's own format, as far as they can be had without reading it."""
    if isinstance(robot, str) and is_text(robot):
        data = robot.encode("utf-8", "surrogatepass")
        return None if data.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<") else ("", data)
    if not isinstance(robot, str | os.PathLike):
        return None
    path = os.fspath(robot)
    if not isinstance(path, str) or not path.lower().endswith(_OWN_SUFFIXES):
        return None
    try:
        return path, Path(path).read_bytes()
    except (OSError, ValueError):
        return None
