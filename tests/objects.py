"""What a compiler made of the same text with the same words, once in a run; most builds differ in few files."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from threading import Event

from kinegen.runtime.compiler import Compiler

INCLUDED = re.compile(r'^[ \t]*#[ \t]*include[ \t]*[<"]([^">]+)[">]', re.MULTILINE)

SYSTEM = tuple({Path("/usr"), *map(Path, (sys.prefix, sys.base_prefix))})
"""Headers below these do not change during a run."""

Run = Callable[[Compiler, Path, tuple[str, ...], str, "Event | None"], None]


def remembering(run: Run, store: Path) -> Run:
    """A compiler that copies what it made before in this run, in whichever process.

    What counts is the command with its words, and the bytes of all that it reads but the headers of the system. A
    compiler that the user named is asked each time.

    Args:
        run: `Compiler.run`.
        store: A folder that all processes of the run share.
    """

    def remembered(
        self: Compiler, folder: Path, arguments: tuple[str, ...], subject: str, stop: Event | None = None
    ) -> None:
        if "CC" in os.environ or arguments.count("-o") != 1:
            run(self, folder, arguments, subject, stop)
            return
        made, kept = Path(folder) / arguments[arguments.index("-o") + 1], store / _key(self, Path(folder), arguments)
        if kept.exists():
            shutil.copy(kept, made)
            return
        run(self, folder, arguments, subject, stop)
        handle, name = tempfile.mkstemp(dir=store)
        os.close(handle)
        shutil.copy(made, name)
        Path(name).replace(kept)

    return remembered


def _key(compiler: Compiler, folder: Path, arguments: tuple[str, ...]) -> str:
    """A digest of all that decides what a compiler makes."""
    digest = hashlib.sha256(repr((compiler, arguments)).encode())
    for path, content in _read(folder, arguments):
        digest.update(f"\0{path.name}\0{len(content)}\0".encode() + content)
    return digest.hexdigest()


def _read(folder: Path, arguments: tuple[str, ...]) -> Iterator[tuple[Path, bytes]]:
    """The files that a compiler reads, with their bytes; those beside a file come before those of the folders given."""
    output = arguments.index("-o") + 1
    named = [folder / word for place, word in enumerate(arguments) if place != output]
    given = [folder / word[2:] for word in arguments if word.startswith("-I")]
    places = [folder, *(place for place in given if not any(map(place.is_relative_to, SYSTEM)))]
    waiting, seen = [path for path in named if path.is_file()], set[Path]()
    while waiting:
        path = waiting.pop()
        if path in seen:
            continue
        seen.add(path)
        content = path.read_bytes()
        yield path, content
        if path.suffix != ".o":
            names = INCLUDED.findall(content.decode(errors="replace"))
            found = (
                next(filter(Path.is_file, (place / name for place in (path.parent, *places))), None) for name in names
            )
            waiting += filter(None, found)
