"""The C between the ranges of a redundancy and Python: loops over targets."""

from __future__ import annotations

from kinegen.backends.redundancy_range import ANY
from kinegen.model.outputs import REDUNDANCY_RANGE
from kinegen.runtime.cffi_interface import HEADER, Interface
from kinegen.support.naming import companion, function, range_file

RANGES = "kinegen_ranges.c"
"""Compiled beside the emitted files."""


def range_declarations(interface: Interface) -> tuple[str, ...]:
    """What cffi is told of it."""
    return tuple(f"{head(interface, real)};" for real in interface.reals for head in (_ranges_head, _nearest_head))


def range_glue(interface: Interface) -> dict[str, str]:
    """C text by file name; see `range_declarations` for what it defines."""
    parts = [f'#include "{range_file(interface.symbol, "h", real)}"\n' for real in interface.reals]
    parts += [_definitions(interface, real) for real in interface.reals]
    return {RANGES: f'#include "{HEADER}"\n{"".join(parts)}'}


def _ranges_head(interface: Interface, real: str) -> str:
    name = companion(function(interface.symbol, REDUNDANCY_RANGE.function, real), "many")
    return f"void {name}(const {real} *targets, size_t count, {real} *intervals, unsigned char *counts)"


def _nearest_head(interface: Interface, real: str) -> str:
    name = companion(function(interface.symbol, ANY, real), "many")
    return f"void {name}(const {real} *targets, const {real} *q0, size_t count, {real} *q, unsigned char *exists)"


def _definitions(interface: Interface, real: str) -> str:
    dof, rows, most = (f"{interface.symbol.upper()}_{word}" for word in ("DOF", "BRANCHES", "RANGES"))
    ranges, nearest = (function(interface.symbol, name, real) for name in (REDUNDANCY_RANGE.function, ANY))
    return f"""
{_ranges_head(interface, real)}
{{
    for (size_t i = 0; i < count; i++) {{
        (void){ranges}(
            targets + 16 * i, ({real} (*)[{most}][2])(intervals + 2 * {most} * {rows} * i), counts + {rows} * i);
    }}
}}

{_nearest_head(interface, real)}
{{
    for (size_t i = 0; i < count; i++) {{
        exists[i] = (unsigned char){nearest}(targets + 16 * i, q0 + {dof} * i, q + {dof} * i);
    }}
}}
"""
