"""The C between the numeric inverse of a robot and Python: one loop over targets."""

from __future__ import annotations

from kinegen.naming import companion, function
from kinegen.native.glue import HEADER, Interface
from kinegen.outputs import NUMERIC_INVERSE

SEARCH = "kinegen_search.c"
"""Compiled beside the emitted files."""


def search_declarations(interface: Interface) -> tuple[str, ...]:
    """What cffi is told of it."""
    return tuple(f"{_head(interface, real)};" for real in interface.reals)


def search_glue(interface: Interface) -> dict[str, str]:
    """C text by file name; see `search_declarations` for what it defines.

    Target i takes the runtime parameters `params[sets * i]`: of 0 sets all take the same.

    The seed of a target depends on its place in the whole batch, so the result does not depend on blocks or threads.
    """
    name = NUMERIC_INVERSE.function
    parts = [f'#include "{interface.prefix(real)}_{name}.h"\n' for real in interface.reals]
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
        f"const {real} *tolerances",
        "int32_t restarts",
        "uint32_t seed",
        "int32_t budget",
        "int32_t steps",
        f"{real} *q",
        f"{real} *errors",
        "int32_t *iterations",
        "unsigned char *solved",
    )
    name = companion(function(interface.symbol, NUMERIC_INVERSE.function, real), "many")
    return f"void {name}({', '.join(arguments)})"


def _definition(interface: Interface, real: str) -> str:
    stem, name = interface.prefix(real), NUMERIC_INVERSE.function
    params = f"(const {interface.params(real)} *)params + sets * i, " if interface.parameters else ""
    dof = f"{interface.symbol.upper()}_DOF"
    return f"""
{_head(interface, real)}
{{
    for (size_t i = 0; i < count; i++) {{
        const uint32_t own = seed + (uint32_t)(first + i) * 2654435761U;
        const {stem}_search search = {{tolerances[0], tolerances[1], restarts, own, budget, steps}};
        {stem}_found found;
        solved[i] = (unsigned char){stem}_{name}(
            targets + 16 * i, starts + {dof} * i, {params}&search, q + {dof} * i, &found);
        errors[2 * i] = found.position_error;
        errors[2 * i + 1] = found.rotation_error;
        iterations[i] = found.iterations;
    }}
}}
"""
