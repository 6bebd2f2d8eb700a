"""A wheel as bytes: files in, a zip archive with its RECORD out, the same bytes for the same files (PEP 427)."""

from __future__ import annotations

import base64
import hashlib
import io
import zipfile
from collections.abc import Mapping

_EPOCH = (1980, 1, 1, 0, 0, 0)
"""The time of every file: the first that a zip archive can hold."""

_MODE = 0o100644 << 16


def archive(files: Mapping[str, bytes], folder: str) -> bytes:
    """Put files into a wheel.

    Args:
        files: Contents by path.
        folder: The `.dist-info` folder of the wheel; its RECORD comes last.

    Returns:
        The bytes of the archive.
    """
    record = f"{folder}/RECORD"
    lines = [f"{name},sha256={_digest(content)},{len(content)}\n" for name, content in files.items()]
    listed = "".join([*lines, f"{record},,\n"]).encode()
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as opened:
        for name, content in (*files.items(), (record, listed)):
            info = zipfile.ZipInfo(name, _EPOCH)
            info.external_attr, info.compress_type = _MODE, zipfile.ZIP_DEFLATED
            info.create_system = 3  # Unix, wherever it is written
            opened.writestr(info, content)
    return buffer.getvalue()


def _digest(content: bytes) -> str:
    return base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
