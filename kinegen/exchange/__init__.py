"""Old files for new ones: a folder as a whole, in one step of the file system.

`whole` makes the folder a second time beside the first one, with the new files, and with links to all files that stay.
Then the two change places, so that a reader finds the old files or the new ones, also if the power fails or the build
is killed. Where the system cannot do that, and where somebody works in the folder, `renames` exchanges one file after
the other: copies of the old ones are in the folder meanwhile, and what a killed build left half done is undone by the
next one.

Leftovers of a killed build are recognised by the record in them; no other folder is touched.
"""

from __future__ import annotations

import errno
import os
import shutil
import sys
from pathlib import Path

from kinegen.exchange.change import STAGE, Change, record_of
from kinegen.exchange.renames import READY, LostError, rename_each, roll_back
from kinegen.exchange.whole import dissolve, forget, swap

__all__ = ["STAGE", "Change", "LostError", "exchange", "recover"]

# No such system call or file system, no links there, a mount point, a parent folder that is not ours.
_OTHERWISE = frozenset(
    {errno.ENOSYS, errno.EINVAL, errno.EXDEV, errno.EBUSY, errno.EPERM, errno.EACCES, errno.EROFS, errno.ENOTSUP}
    | {errno.EMLINK, errno.ENOENT}
)


def exchange(folder: Path, change: Change) -> None:
    """Put a change into effect, wholly or not at all.

    Args:
        folder: The folder, which exists, and so do the folders in it that files are written to.
        change: What is written and removed.

    Raises:
        OSError: If it cannot be done; the folder is then as it was.
        LostError: If the old files could not be put back.
    """
    # A folder that may not be written to is left alone, though its parent would let it change places.
    if sys.platform == "linux" and os.access(folder, os.W_OK) and not _is_worked_in(folder):
        try:
            swap(folder, change)
        except OSError as error:
            if error.errno not in _OTHERWISE:
                raise
        else:
            return
    rename_each(folder, change)


def recover(folder: Path) -> None:
    """Undo what a killed build left half done in a folder, and remove its leftovers; the caller holds the lock."""
    for stage in sorted(folder.glob(f"{STAGE}*")):
        record = record_of(stage, folder)
        if record is not None:
            if (stage / READY).exists():
                roll_back(stage / "old", folder, frozenset(record["kept"]), record["names"])
            shutil.rmtree(stage, ignore_errors=True)
    for stage in sorted(folder.parent.glob(f"{STAGE}*")):
        record = record_of(stage, folder)
        if record is not None:
            dissolve(stage / folder.name, folder, frozenset(record["names"]), restore=False)
            forget(stage)


def _is_worked_in(folder: Path) -> bool:
    """Whether this process was started inside the folder, whose terminal would be left in the old one."""
    try:
        here = Path.cwd()
        return any(place.samefile(folder) for place in (here, *here.parents))
    except OSError:
        return False
