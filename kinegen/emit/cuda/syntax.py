"""How the body of a function is written in CUDA: as in C++, which it is."""

from __future__ import annotations

from dataclasses import replace

from kinegen.emit.cpp.syntax import SYNTAX as PLAIN
from kinegen.emit.cpp.syntax import TRUTHS

SYNTAX = replace(PLAIN, language="CUDA")

FORMS = tuple(TRUTHS.forms.values())
"""Forms of expressions beside those of the syntax: what makes a truth value."""
