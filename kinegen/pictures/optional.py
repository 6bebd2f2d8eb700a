"""matplotlib, which not every installation has."""

from __future__ import annotations

import importlib

from kinegen.errors import KinegenError


def need_matplotlib() -> None:
    """Check that matplotlib is installed.

    Raises:
        KinegenError: If it is not.
    """
    try:
        importlib.import_module("matplotlib")
    except ImportError as error:
        raise KinegenError(
            "a picture takes matplotlib, which is not installed (pip install 'kinegen[plot]')"
        ) from error
