"""Where a command writes the one file that a user names: never over what it was made from."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from kinegen.errors import WriteError, shown


def check_output(path: Path, inputs: Iterable[Path | None], *, force: bool) -> None:
    """Refuse an output before anything is computed: one of the inputs, a folder, or a file that exists.

    Its folder may be missing; `write_file` makes it.

    Args:
        path: The output.
        inputs: What the command reads; None for what was not given.
        force: Whether a file that exists may be replaced.

    Raises:
        WriteError: If it may not be written.
    """
    try:
        reason, place = _defect(path, [other for other in inputs if other is not None], force=force)
    except OSError as error:
        reason, place = f"cannot be written: {(error.strerror or 'error').lower()}", path
    if reason:
        raise WriteError(reason, shown(place))


def _defect(path: Path, inputs: list[Path], *, force: bool) -> tuple[str, Path]:
    """Why a file may not be written, or an empty text; and where."""
    if any(_same(path, other) for other in inputs):
        return "this is an input, which is never overwritten; choose another name", path
    if path.is_dir():
        return "this is a folder; expected the name of a file", path
    if path.exists() and not force:
        return "the file exists; choose another name, or overwrite it with --force", path
    above = next(folder for folder in path.absolute().parents if folder.exists())
    return ("", path) if above.is_dir() else ("this is a file, not a folder; choose another name", above)


def _same(first: Path, second: Path) -> bool:
    try:
        return first.resolve() == second.resolve() or first.samefile(second)
    except OSError:
        return False
