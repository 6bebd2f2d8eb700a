"""Runners: each calls the kernels of one language, numbers in and numbers out, so that one judge proves all of them."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from kinegen.verify.runners.javascript import run_javascript
from kinegen.verify.runners.runner import Runner

RUNNERS: Mapping[str, Runner] = MappingProxyType({"javascript": run_javascript})
"""By name of the language, as in `kinegen.emit.languages.LANGUAGES`."""
