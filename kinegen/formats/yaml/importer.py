"""kinegen's own robot file, as one of the formats."""

from __future__ import annotations

from pathlib import Path

from kinegen.errors import printable
from kinegen.formats.format import Imported, ReadOptions
from kinegen.formats.yaml.read import read_robot
from kinegen.formats.yaml.resolve import resolve
from kinegen.formats.yaml.tree import decode, parse_tree


def read(data: bytes, path: Path, options: ReadOptions) -> Imported:  # noqa: ARG001 - the file says it all
    """Read a robot file; options for other formats mean nothing here."""
    return Imported(resolve(read_robot(parse_tree(decode(data))), printable(path.name)))
