"""The C between the complete inverse of a robot and Python: one loop over targets."""

from __future__ import annotations

from kinegen.model.outputs import COMPLETE_INVERSE
from kinegen.runtime.cffi_interface import HEADER, Interface
from kinegen.support.naming import companion, complete_file, function

COMPLETE = "kinegen_complete.c"
"""Compiled beside the emitted files."""


def complete_declarations(interface: Interface) -> tuple[str, ...]:
    """What cffi is told of it."""
    return (f"{_head(interface)};",)


def complete_glue(interface: Interface) -> dict[str, str]:
    """C text by file name; see `complete_declarations` for what it defines."""
    name = function(interface.symbol, COMPLETE_INVERSE.function)
    dof = f"{interface.symbol.upper()}_DOF"
    text = f"""#include "{HEADER}"
#include "{complete_file(interface.symbol, "h")}"

{_head(interface)}
{{
    for (size_t i = 0; i < count; i++) {{
        counts[i] = {name}(targets + 16 * i, (double (*)[{dof}])(solutions + 16 * {dof} * i));
    }}
}}
"""
    return {COMPLETE: text}


def _head(interface: Interface) -> str:
    name = companion(function(interface.symbol, COMPLETE_INVERSE.function), "many")
    return f"void {name}(const double *targets, size_t count, double *solutions, int32_t *counts)"
