"""Runners: each calls the kernels of one language, numbers in and numbers out, so that one judge proves all of them."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from kinegen.verify.runners.cpp import run_cpp
from kinegen.verify.runners.cuda import run_cuda
from kinegen.verify.runners.javascript import run_javascript
from kinegen.verify.runners.matlab import run_matlab
from kinegen.verify.runners.runner import Runner
from kinegen.verify.runners.rust import run_rust

RUNNERS: Mapping[str, Runner] = MappingProxyType(
    {"cpp": run_cpp, "cuda": run_cuda, "javascript": run_javascript, "matlab": run_matlab, "rust": run_rust}
)
"""By name of the language, as in `kinegen.backends.languages.LANGUAGES`."""
