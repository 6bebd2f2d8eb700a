"""The tag of a wheel: for which Pythons and systems its extensions are.

The C library that an extension needs follows from the names of symbol versions in it, as PEP 600 describes for the tags
`manylinux_X_Y`: such a wheel runs on every Linux whose C library is at least glibc X.Y.
"""

from __future__ import annotations

import re
import sys
import sysconfig
from collections.abc import Iterable

PURE = "py3-none-any"
"""The tag of a wheel that runs everywhere."""

_ABI = "cp310-abi3"
"""Extensions use the stable ABI of CPython 3.10."""

_LIBRARIES = re.compile(rb"\0(lib[\w+.-]+\.so(?:\.\d+)*)(?=\0)")
_VERSIONS = re.compile(rb"\0GLIBC_(\d+)\.(\d+)(?:\.\d+)?(?=\0)")
_PART_OF_GLIBC = (b"libc.so.6", b"libm.so.6", b"libpthread.so.0", b"libdl.so.2", b"librt.so.1", b"libgcc_s.so.1")
"""Libraries that PEP 600 lets a wheel expect on every Linux."""

_OLDEST = {"x86_64": (2, 5), "i686": (2, 5)}
_OLDEST_ELSEWHERE = (2, 17)
"""Before these there are no such tags."""


def platform_tag(extensions: Iterable[bytes]) -> str:
    """The tag of a wheel with compiled extensions, made on this machine.

    Args:
        extensions: The bytes of each shared library.

    Returns:
        Such as `cp310-abi3-manylinux_2_17_x86_64`; on Linux `linux_x86_64` in place of the latter where an extension
        needs a library that not every system has.
    """
    system = re.sub(r"[-. ]", "_", sysconfig.get_platform())
    if sys.platform != "linux":
        return f"{_ABI}-{system}"
    needed = [_glibc(content) for content in extensions]
    if any(version is None for version in needed):
        return f"{_ABI}-{system}"
    machine = system.removeprefix("linux_")
    oldest = _OLDEST.get(machine, _OLDEST_ELSEWHERE)
    major, minor = max([oldest, *(version for version in needed if version is not None)])
    return f"{_ABI}-manylinux_{major}_{minor}_{machine}"


def _glibc(content: bytes) -> tuple[int, int] | None:
    """The oldest glibc that an extension runs with; None if it needs other libraries than those of glibc."""
    if set(_LIBRARIES.findall(content)) - set(_PART_OF_GLIBC):
        return None
    found = [(int(major), int(minor)) for major, minor in _VERSIONS.findall(content)]
    return max(found) if found else None
