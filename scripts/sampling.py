"""A gate with many results alike makes one in seven of them, drawn by the commit, so that each commit makes others."""

from __future__ import annotations

import hashlib
import shutil
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

SHARE = 7
"""One in so many."""


def commit(root: Path = ROOT) -> str:
    """The digest of the commit that is checked out.

    Args:
        root: The top of the repository.

    Returns:
        Hexadecimal digits; nothing in a copy without its history, where all runs make the same sample.
    """
    if not (root / ".git").exists() or shutil.which("git") is None:
        return ""
    found = subprocess.run(["git", "rev-parse", "HEAD"], cwd=root, capture_output=True, text=True, check=False)
    return found.stdout.strip()


def is_in_sample(name: str, drawn_by: str) -> bool:
    """Whether a result is made.

    Args:
        name: Its name.
        drawn_by: The digest of the commit.
    """
    return int(hashlib.sha256(f"{drawn_by} {name}".encode()).hexdigest(), 16) % SHARE == 0
