"""The C between the inverse along a path and Python: one loop over targets."""

from __future__ import annotations

from kinegen.runtime.cffi_interface import HEADER, Interface
from kinegen.support.naming import companion, function, tracker_file

TRACKER = "kinegen_tracker.c"
"""Compiled beside the emitted files."""


def tracker_declarations(interface: Interface) -> tuple[str, ...]:
    """What cffi is told of it."""
    return tuple(f"{head};" for real in interface.reals for head in _heads(interface, real))


def tracker_glue(interface: Interface) -> dict[str, str]:
    """C text by file name; see `tracker_declarations` for what it defines."""
    includes = [f'#include "{tracker_file(interface.symbol, "h", real)}"\n' for real in interface.reals]
    definitions = [_definitions(interface, real) for real in interface.reals]
    return {TRACKER: "".join([f'#include "{HEADER}"\n', *includes, *definitions])}


def _heads(interface: Interface, real: str) -> tuple[str, ...]:
    """The three functions: a start, many steps, and the speeds of a twist."""
    params = ("const void *params",) * bool(interface.parameters)
    start = (*params, "void *tracker", f"const {real} *q", f"const {real} *redundancy")
    targets = f"const {real} *targets", f"const {real} *redundancy", "size_t count", f"const {real} *max_step"
    follow = (*params, "void *tracker", *targets, f"{real} *q", "void *reports", "int32_t *status")
    given = f"const {real} *twist", f"const {real} *max_speed"
    speeds = (*params, "const void *tracker", *given, f"{real} *qd", f"{real} *residual", f"{real} *factor")
    return tuple(
        f"void {_name(interface, real, part)}({', '.join(arguments)})"
        for part, arguments in (("start", start), ("step", follow), ("speeds", speeds))
    )


def _name(interface: Interface, real: str, part: str) -> str:
    return companion(function(interface.symbol, f"tracker_{part}", real), "many")


def _definitions(interface: Interface, real: str) -> str:
    stem, dof = interface.prefix(real), f"{interface.symbol.upper()}_DOF"
    start, step, speeds = (function(interface.symbol, f"tracker_{part}", real) for part in ("start", "step", "speeds"))
    params = f", (const {interface.params(real)} *)params" if interface.parameters else ""
    given, each = (", redundancy", ", redundancy + i") if interface.redundancy else ("", "")
    heads = _heads(interface, real)
    return f"""
{heads[0]}
{{
    (void)redundancy;
    {start}(({stem}_tracker *)tracker, q{given}{params});
}}

{heads[1]}
{{
    {stem}_tracked *results = ({stem}_tracked *)reports;
    (void)redundancy;
    for (size_t i = 0; i < count; i++) {{
        status[i] = {step}(({stem}_tracker *)tracker, targets + 16 * i{each}{params}, max_step, results + i);
        for (int j = 0; j < {dof}; j++) q[{dof} * i + (size_t)j] = (({stem}_tracker *)tracker)->q[j];
    }}
}}

{heads[2]}
{{
    factor[0] = {speeds}((const {stem}_tracker *)tracker, twist{params}, max_speed, qd, residual);
}}
"""
