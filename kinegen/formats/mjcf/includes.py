"""`<include file="..."/>` in MJCF: the contents of another file take its place.

Files come from the folder of the model, from below it, and from folders that the user names; nothing else is opened.
"""

from __future__ import annotations

from pathlib import Path

from kinegen.errors import RobotFileError, quote
from kinegen.formats import xml
from kinegen.formats.messages import fail

MAX_FILES = 64


def included(root: xml.Element, path: Path, folders: tuple[Path, ...]) -> xml.Element:
    """Put the contents of other files in place of the elements that name them.

    Args:
        root: The element at the top, which is changed.
        path: File of the model.
        folders: Further folders from which files may come.

    Raises:
        RobotFileError: If a file is outside, missing, or includes itself.
    """
    allowed = tuple(folder.resolve() for folder in (path.absolute().parent, *folders))
    seen = {path.resolve()}
    while True:
        found = next(root.iter("include"), None)
        if found is None:
            return root
        line = xml.line(found)
        name = xml.needed(found, "file")
        parent = found.getparent()
        if parent is None:
            fail("<include> cannot be the root element", line)
        file = _find(name, allowed, line)
        if file in seen or len(seen) > MAX_FILES:
            fail(f"{quote(name)} is included twice, or there are more than {MAX_FILES} files", line)
        seen.add(file)
        place = parent.index(found)
        parent[place : place + 1] = _contents(file, name, line)


def _find(name: str, allowed: tuple[Path, ...], line: int) -> Path:
    places = [(folder / name).resolve() for folder in allowed]
    inside = [file for file in places if any(file.is_relative_to(folder) for folder in allowed) and file.is_file()]
    if not inside:
        remedy = "name its folder with --package-path NAME=DIR"
        fail(f"the included file {quote(name)} is not in the folder of the model; {remedy}", line)
    return inside[0]


def _contents(file: Path, name: str, line: int) -> list[xml.Element]:
    if file.stat().st_size > xml.MAX_BYTES:
        fail(f"the included file {quote(name)} is too large for a robot file", line)
    try:
        top = xml.parse(file.read_bytes())
    except RobotFileError as error:
        fail(f"included file {quote(name)}: {error.message}", line)
    for element in top.iter():
        # Its lines are those of another file.
        element.sourceline = 0  # type: ignore[misc]
    return list(top)
