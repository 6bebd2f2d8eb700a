"""Files of every format as the text of a robot file."""

from __future__ import annotations

from pathlib import Path

from kinegen.formats.format import FORMATS, format_of
from kinegen.formats.load import load, read_bytes
from kinegen.formats.yaml.tree import decode
from kinegen.formats.yaml.write import write


def as_robot_file(path: str | Path) -> tuple[str, str]:
    """A file of any format as the text of a robot file, for commands that edit such text.

    Args:
        path: A file that `load` reads.

    Returns:
        The text as it is, or as `kinegen convert` writes it; and a name under which `loads` reads it.

    Raises:
        KinegenError: If it cannot be read, or a robot file cannot hold it.
    """
    data = read_bytes(path)
    if format_of(path, data).name == FORMATS[0].name:
        return decode(data), str(path)
    return write(load(path)), f"{path}.yaml"
