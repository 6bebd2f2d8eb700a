"""A short hash of what a robot file says, blind to comments, formatting and the name of the file."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from enum import Enum
from fractions import Fraction

from kinegen.robot.actuators.model import NO_ACTUATORS
from kinegen.robot.model import Robot

_LEFT_OUT = frozenset({"line", "source", "digest", "made_of", "chosen", "version"})
_LENGTH = 16


def digest(robot: Robot) -> str:
    """The first hexadecimal digits of a SHA-256 over the robot's content."""
    text = json.dumps(_plain(robot), ensure_ascii=True, separators=(",", ":"))
    return hashlib.sha256(text.encode("ascii")).hexdigest()[:_LENGTH]


def _plain(value: object) -> object:
    """Records become lists that begin with their type, so that no two of them look alike."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        names = [field.name for field in dataclasses.fields(value) if field.name not in _LEFT_OUT]
        found = {name: getattr(value, name) for name in names}
        # A robot without actuators, named tips or a redundancy keeps the hash that it had before there were any.
        usual = (("tip", False), ("redundancy", ""))
        kept = [each for name, each in found.items() if each != NO_ACTUATORS and (name, each) not in usual]
        return [type(value).__name__, *map(_plain, kept)]
    if isinstance(value, tuple):
        return [_plain(part) for part in value]
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Fraction):
        return str(value)
    return value
