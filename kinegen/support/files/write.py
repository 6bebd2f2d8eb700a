"""Text to disk: a folder gets all of its files or keeps what it had.

In: a folder, and the content of each file, also in folders below it. Files that would not change are not touched. The
others are exchanged in one step (see `exchange`), so that a full disk, an unwritable folder, Ctrl-C or a kill leaves
the earlier output whole. Only files that kinegen wrote are replaced or removed (see `manifest`). A lock on the folder
keeps two builds apart. Nothing here looks into the text or alters it.
"""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Literal

from kinegen.errors import WriteError
from kinegen.support.dataclass import dataclass
from kinegen.support.files.exchange import STAGE, Change, exchange, recover
from kinegen.support.files.manifest import (
    MANIFEST,
    digest_of,
    is_ours,
    is_plain_path,
    manifest_text,
    other_kind,
    read_manifest,
)
from kinegen.support.files.replacing import replacing
from kinegen.support.naming import EXTENSION
from kinegen.support.system import held

_PATIENCE = 60.0  # seconds
_NAMED = 3
"""Files in the way that a message names."""


@dataclass(frozen=True, slots=True)
class Written:
    """What became of one file.

    Attributes:
        path: The file.
        status: Whether it is new, has changed, is as it was, or was removed.
    """

    path: Path
    status: Literal["new", "changed", "unchanged", "removed"]

    @property
    def changed(self) -> bool:
        """Whether the file was touched."""
        return self.status != "unchanged"

    @property
    def word(self) -> str:
        """What became of it, in a word for people."""
        return self.status if self.changed else "untouched"


def write_files(
    folder: Path,
    files: Mapping[str, str | bytes],
    stale: Callable[[str], bool] | None = None,
    *,
    force: bool = False,
    patience: float = _PATIENCE,
) -> tuple[Written, ...]:
    """Write the files of a folder, all or none, with a list of them (see `manifest`).

    Args:
        folder: The folder; made if missing.
        files: Content by path below the folder with forward slashes, such as `src/arm.c`; text becomes UTF-8.
        stale: Asked of each other file that an earlier build wrote and nobody changed, by its name, whether it is left
            over; those are removed. By default nothing is.
        force: Whether to replace files of these names that kinegen did not write, or that were changed since.
        patience: Seconds to wait for another build that writes to the folder.

    Returns:
        What became of each file, in the order of `files`, then of the list, then the removed ones by name.

    Raises:
        WriteError: If the folder cannot be written, or a file in it is in the way; it is then as it was.
    """
    contents = {name: text.encode() if isinstance(text, str) else text for name, text in files.items()}
    places = _places(contents)
    try:
        refuse_link(folder)
        with _made(folder), _locked(folder, patience) as alone, _made_below(folder, places):
            if alone:
                recover(folder)
            return _write(folder, contents, stale, force=force)
    except OSError as error:
        reason = error.strerror or str(error)
        raise WriteError(f"cannot write {folder}: {reason}; the earlier output is untouched") from error


def check_files(
    folder: Path, files: Mapping[str, str | bytes], stale: Callable[[str], bool] | None = None, *, force: bool = False
) -> None:
    """Refuse what `write_files` would refuse, before the work that comes between; arguments as there.

    Raises:
        WriteError: If a file in the folder is in the way, or belongs to a package of another kind.
    """
    contents = {name: text.encode() if isinstance(text, str) else text for name, text in files.items()}
    refuse_link(folder)
    if folder.is_dir():
        try:
            with _locked(folder, _PATIENCE):  # the list and the files of another build are not seen half written
                _planned(folder, contents, stale, force=force)
        except OSError as error:
            raise WriteError(f"cannot write {folder}: {error.strerror or error}; nothing was written") from error


def refuse_link(folder: Path) -> None:
    """Refuse a folder that is a symbolic link: what lies behind it may not be meant.

    Raises:
        WriteError: If it is a link.
    """
    if folder.is_symlink():
        raise WriteError(f"{folder} is a symbolic link; name the folder that it points to; nothing was written")


def write_file(path: Path, content: str | bytes) -> None:
    """Write the one file that a user named, whole or not at all; its folder is made, nothing else in it is touched.

    Raises:
        WriteError: If it cannot be written; an earlier file of that name is then as it was.
    """
    data = content.encode() if isinstance(content, str) else content
    try:
        # A link is followed here: the user named this very file.
        target = Path(os.path.realpath(path))
        target.parent.mkdir(parents=True, exist_ok=True)
        if target.is_dir():
            raise IsADirectoryError(f"{path} is a folder")
        mode = target.stat().st_mode & 0o777 if target.exists() else 0o666 & ~_umask()
        handle, name = tempfile.mkstemp(prefix=STAGE, dir=target.parent)
        # The permissions come last: a file that nobody may read can't be opened to see that it is on the disk.
        draft = Path(name)
        with replacing(target, draft, lambda: draft.chmod(mode)), os.fdopen(handle, "wb") as file:
            file.write(data)
            # By the handle that wrote: some systems say nothing of one that only reads.
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise WriteError(f"cannot write {path}: {error.strerror or error}; nothing was written") from error


def _umask() -> int:
    mask = os.umask(0o077)
    os.umask(mask)
    return mask


@dataclass(frozen=True, slots=True)
class _Plan:
    """What is going to happen to a folder: what becomes of each file, new contents, what goes and what stays listed."""

    written: tuple[Written, ...]
    changed: dict[str, bytes]
    gone: tuple[str, ...]
    kept: dict[str, str]


def _planned(folder: Path, contents: dict[str, bytes], stale: Callable[[str], bool] | None, *, force: bool) -> _Plan:
    """Look at a folder; refuse what is in the way."""
    listed = read_manifest(folder)
    written = tuple(Written(folder / name, _status(folder / name, content)) for name, content in contents.items())
    changed = {name: contents[name] for name, entry in zip(contents, written, strict=True) if entry.changed}
    replaced = [name for name in changed if os.path.lexists(folder / name)]
    _check_ways(folder, replaced, listed, force=force)
    # What an earlier build wrote besides: some of it is left over, the rest stays in the list.
    others = sorted({*(listed or {}), EXTENSION} - contents.keys())
    others = [name for name in others if is_ours(folder / name, name, listed)]
    gone = tuple(name for name in others if stale is not None and stale(name))
    lost = (*replaced, *gone)
    kind = other_kind(listed or {}, contents, lost)
    if kind and not force:
        raise WriteError(
            f"{folder} holds {kind}, which would lose {len(lost)} file{'s' * (len(lost) != 1)} such as {lost[0]}: "
            "choose another folder, or replace it with --force; nothing was written"
        )
    if kind:
        gone = tuple(others)  # all that the package of another kind left: a mixture would be neither
    kept = {name: listed[name] for name in others if name not in gone and name in listed} if listed else {}
    return _Plan(written, changed, gone, kept)


def _write(
    folder: Path, contents: dict[str, bytes], stale: Callable[[str], bool] | None, *, force: bool
) -> tuple[Written, ...]:
    plan = _planned(folder, contents, stale, force=force)
    digests = plan.kept | {name: digest_of(content) for name, content in contents.items() if name != EXTENSION}
    manifest = manifest_text(digests)
    entry, changed = Written(folder / MANIFEST, _status(folder / MANIFEST, manifest)), dict(plan.changed)
    if entry.changed:
        changed[MANIFEST] = manifest
    if changed or plan.gone:
        exchange(folder, Change(changed, plan.gone))
    return (*plan.written, entry, *(Written(folder / name, "removed") for name in plan.gone))


def _check_ways(folder: Path, names: Sequence[str], listed: Mapping[str, str] | None, *, force: bool) -> None:
    """See that each file that would be replaced is kinegen's own, or may be replaced all the same."""
    folders = [name for name in names if (folder / name).is_dir() and not (folder / name).is_symlink()]
    if folders:
        raise WriteError(f"{folder / folders[0]} is a folder; move it away; nothing was written")
    foreign = [] if force else [name for name in names if not is_ours(folder / name, name, listed)]
    if foreign:
        named = ", ".join(str(folder / name) for name in foreign[:_NAMED])
        more = f" and {len(foreign) - _NAMED} more" if len(foreign) > _NAMED else ""
        verb, them = ("was", "it") if len(foreign) == 1 else ("were", "them")
        raise WriteError(
            f"{named}{more} {verb} not written by kinegen, or changed since: move {them} away, or replace {them} "
            "with --force; nothing was written"
        )


def _status(path: Path, content: bytes) -> Literal["new", "changed", "unchanged"]:
    try:
        return "unchanged" if not path.is_symlink() and path.read_bytes() == content else "changed"
    except FileNotFoundError:
        return "changed" if path.is_symlink() else "new"
    except IsADirectoryError:
        return "changed"


def _places(names: Collection[str]) -> tuple[str, ...]:
    """Return the folders below the main one that names are in, each after its parents; no name leads elsewhere."""
    places: set[str] = set()
    for name in names:
        if not is_plain_path(name) or name == MANIFEST:
            raise WriteError(f"{name!a} is not a plain file name; nothing was written")
        parts = name.split("/")
        places |= {"/".join(parts[:end]) for end in range(1, len(parts))}
    both = places.intersection(names)
    if both:
        raise WriteError(f"{min(both)!a} is the name of a folder too; nothing was written")
    return tuple(sorted(places))


@contextlib.contextmanager
def _made_below(folder: Path, places: Sequence[str]) -> Iterator[None]:
    """Make folders below the main one, and take away what was made if nothing came of it."""
    paths = [folder / name for name in places]
    for path in paths:
        # A link could lead out of the folder, and what lies there is not ours to replace.
        if path.is_symlink():
            raise WriteError(f"{path} is a link; the earlier output is untouched")
    made: list[Path] = []
    try:
        for path in paths:
            if not path.is_dir():
                path.mkdir()
                made.append(path)
        yield
    except BaseException:
        with contextlib.suppress(OSError):
            for place in reversed(made):
                place.rmdir()
        raise


@contextlib.contextmanager
def _made(folder: Path) -> Iterator[None]:
    """Make the folder, and take away what was made if nothing came of it."""
    missing = [place for place in (folder, *folder.parents) if not place.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    try:
        yield
    except BaseException:
        with contextlib.suppress(OSError):
            for place in missing:
                place.rmdir()
        raise


@contextlib.contextmanager
def _locked(folder: Path, patience: float) -> Iterator[bool]:
    """Hold the folder against other builds, and say whether that is possible here."""
    with contextlib.ExitStack() as stack:
        try:
            alone = stack.enter_context(held(folder, patience))
        except BlockingIOError:
            raise WriteError(f"another build is still writing to {folder}; the earlier output is untouched") from None
        yield alone
