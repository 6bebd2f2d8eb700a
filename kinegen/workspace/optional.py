"""Libraries that only some of the outputs take; they come with an extra."""

from __future__ import annotations

import importlib
from types import ModuleType

from kinegen.errors import KinegenError


def library(module: str, purpose: str, extra: str = "workspace") -> ModuleType:
    """Import a library that may not be installed.

    Args:
        module: The module.
        purpose: What takes it, for the message.
        extra: The extra that installs it.

    Returns:
        The module.

    Raises:
        KinegenError: If it is not installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        name = module.partition(".")[0]
        raise KinegenError(
            f"{purpose} takes {name}, which is not installed (pip install 'kinegen[{extra}]')"
        ) from error
