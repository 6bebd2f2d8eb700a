"""The C between the numeric inverse of a robot and Python."""

from __future__ import annotations

from kinegen.model.outputs import NUMERIC_INVERSE
from kinegen.runtime.cffi_interface import HEADER, Interface
from kinegen.support.naming import companion, function, search_file

SEARCH = "kinegen_search.c"
"""Compiled beside the emitted files."""


def search_declarations(interface: Interface) -> tuple[str, ...]:
    """What cffi is told of it."""
    return tuple(f"{_head(interface, real)};" for real in interface.reals)


def search_glue(interface: Interface) -> dict[str, str]:
    """C text by file name; see `search_declarations` for what it defines.

    Target i takes the runtime parameters `params[sets * i]`: of 0 sets all take the same. A single target is searched
    for by the kernel for one, all others in lock step.
    """
    parts = [f'#include "{search_file(interface.symbol, "h", real, batch=True)}"\n' for real in interface.reals]
    return {
        SEARCH: f'#include "{HEADER}"\n'
        + "".join(parts)
        + "".join(_definition(interface, real) for real in interface.reals)
    }


def _head(interface: Interface, real: str) -> str:
    params = ("const void *params", "size_t sets") if interface.parameters else ()
    arguments = (
        *params,
        f"const {real} *targets",
        f"const {real} *starts",
        "size_t count",
        "size_t first",
        "int32_t single",
        f"const {real} *tolerances",
        *([f"const {real} *weights"] if interface.tips else []),
        "int32_t restarts",
        "uint32_t seed",
        "int32_t budget",
        "int32_t steps",
        f"{real} *q",
        "void *found",
        "unsigned char *solved",
    )
    name = companion(function(interface.symbol, NUMERIC_INVERSE.function, real), "many")
    return f"void {name}({', '.join(arguments)})"


def _definition(interface: Interface, real: str) -> str:
    stem, dof = interface.prefix(real), f"{interface.symbol.upper()}_DOF"
    one = function(interface.symbol, NUMERIC_INVERSE.function, real)
    many = function(interface.symbol, NUMERIC_INVERSE.function, real, batch=True)
    params = f"(const {interface.params(real)} *)params, " if interface.parameters else ""
    sets = "(ptrdiff_t)sets, " if interface.parameters else ""
    weights = f", {{{', '.join(_weights(interface.tips))}}}" if interface.tips else ""
    strides = f"{16 * interface.tips}, 16, 1" if interface.tips else "16, 1"
    return f"""
{_head(interface, real)}
{{
    const {stem}_search search = {{tolerances[0], tolerances[1], restarts, seed, budget, steps{weights}}};
    if (single) solved[0] = (unsigned char){one}(targets, starts, {params}&search, q, ({stem}_found *)found);
    else {many}(count, targets, {strides}, starts, {dof}, 1, {params}{sets}&search, first, q, {dof},
                ({stem}_found *)found, solved, 0);
}}
"""


def _weights(tips: int) -> tuple[str, ...]:
    """The weights of position and rotation of each tip, as C text."""
    return tuple(f"{{weights[{2 * tip}], weights[{2 * tip + 1}]}}" for tip in range(tips))
