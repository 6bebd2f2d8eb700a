"""The C between the solvers of a robot and Python, one file each: loops over targets, and arguments without structs."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from kinegen.backends.redundancy_range import ANY
from kinegen.model.outputs import COMPLETE_INVERSE, NUMERIC_INVERSE, REDUNDANCY_RANGE
from kinegen.runtime.cffi_interface import HEADER, Interface
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import companion, complete_file, function, range_file, search_file, tracker_file


@dataclass(frozen=True, slots=True)
class _Solver:
    """The file of one solver.

    `file`: its name, beside the emitted files. `header`: the emitted header that it includes, for a number type.
    `heads`: its functions. `bodies`: what stands in their braces, in the same order. `reals`: its number types; empty
    for those of the package.
    """

    file: str
    header: Callable[[Interface, str], str]
    heads: Callable[[Interface, str], tuple[str, ...]]
    bodies: Callable[[Interface, str], tuple[str, ...]]
    reals: tuple[str, ...] = ()


def solver_declarations(interface: Interface) -> tuple[str, ...]:
    """Return what cffi is told of the solvers."""
    return tuple(
        f"{head};"
        for solver in _solvers(interface)
        for real in solver.reals or interface.reals
        for head in solver.heads(interface, real)
    )


def solver_glue(interface: Interface) -> dict[str, str]:
    """Return C text by file name; see `solver_declarations` for what it defines."""
    files = {}
    for solver in _solvers(interface):
        reals = solver.reals or interface.reals
        parts = [f'#include "{name}"\n' for name in (HEADER, *(solver.header(interface, real) for real in reals))]
        for real in reals:
            pairs = zip(solver.heads(interface, real), solver.bodies(interface, real), strict=True)
            parts += [f"\n{head}\n{{\n{body}\n}}\n" for head, body in pairs]
        files[solver.file] = "".join(parts)
    return files


def _solvers(interface: Interface) -> Iterator[_Solver]:
    if interface.numeric_inverse:
        yield _Solver("kinegen_search.c", _search_header, _search_heads, _search_bodies)
    if interface.complete_inverse:
        yield _Solver("kinegen_complete.c", _complete_header, _complete_heads, _complete_bodies, ("double",))
    if interface.redundancy_range:
        yield _Solver("kinegen_ranges.c", _range_header, _range_heads, _range_bodies)
    if interface.inverse_tracker:
        yield _Solver("kinegen_tracker.c", _tracker_header, _tracker_heads, _tracker_bodies)


def _head(interface: Interface, output: str, real: str, *arguments: str) -> str:
    return f"void {companion(function(interface.symbol, output, real), 'many')}({', '.join(arguments)})"


def _size(interface: Interface, word: str) -> str:
    return f"{interface.symbol.upper()}_{word}"


def _search_header(interface: Interface, real: str) -> str:
    return search_file(interface.symbol, "h", real, batch=True)


def _search_heads(interface: Interface, real: str) -> tuple[str, ...]:
    """Return the search: target i takes the runtime parameters `params[sets * i]`, of 0 sets all take the same."""
    params = ("const void *params", "size_t sets") if interface.parameters else ()
    weights = (f"const {real} *weights",) if interface.tips else ()
    targets = f"const {real} *targets", f"const {real} *starts", "size_t count", "size_t first", "int32_t single"
    limits = "int32_t restarts", "uint32_t seed", "int32_t budget", "int32_t steps"
    results = f"{real} *q", "void *found", "unsigned char *solved"
    tolerances = f"const {real} *tolerances"
    return (
        _head(interface, NUMERIC_INVERSE.function, real, *params, *targets, tolerances, *weights, *limits, *results),
    )


def _search_bodies(interface: Interface, real: str) -> tuple[str, ...]:
    """A single target is searched for by the kernel for one, all others in lock step."""
    stem, dof = interface.prefix(real), _size(interface, "DOF")
    one = function(interface.symbol, NUMERIC_INVERSE.function, real)
    many = function(interface.symbol, NUMERIC_INVERSE.function, real, batch=True)
    params = f"(const {interface.params(real)} *)params, " if interface.parameters else ""
    sets = "(ptrdiff_t)sets, " if interface.parameters else ""
    pairs = ", ".join(f"{{weights[{2 * tip}], weights[{2 * tip + 1}]}}" for tip in range(interface.tips))
    weights = f", {{{pairs}}}" if interface.tips else ""
    strides = f"{16 * interface.tips}, 16, 1" if interface.tips else "16, 1"
    return (
        f"""    const {stem}_search search = {{tolerances[0], tolerances[1], restarts, seed, budget, steps{weights}}};
    if (single) solved[0] = (unsigned char){one}(targets, starts, {params}&search, q, ({stem}_found *)found);
    else {many}(count, targets, {strides}, starts, {dof}, 1, {params}{sets}&search, first, q, {dof},
                ({stem}_found *)found, solved, 0);""",
    )


def _complete_header(interface: Interface, _real: str) -> str:
    return complete_file(interface.symbol, "h")


def _complete_heads(interface: Interface, real: str) -> tuple[str, ...]:
    arguments = "const double *targets", "size_t count", "double *solutions", "int32_t *counts"
    return (_head(interface, COMPLETE_INVERSE.function, real, *arguments),)


def _complete_bodies(interface: Interface, real: str) -> tuple[str, ...]:
    name, dof = function(interface.symbol, COMPLETE_INVERSE.function, real), _size(interface, "DOF")
    return (
        f"""    for (size_t i = 0; i < count; i++) {{
        counts[i] = {name}(targets + 16 * i, (double (*)[{dof}])(solutions + 16 * {dof} * i));
    }}""",
    )


def _range_header(interface: Interface, real: str) -> str:
    return range_file(interface.symbol, "h", real)


def _range_heads(interface: Interface, real: str) -> tuple[str, ...]:
    """Return the two functions: all ranges, and the nearest solution."""
    targets, count = f"const {real} *targets", "size_t count"
    ranges = targets, count, f"{real} *intervals", "unsigned char *counts"
    nearest = targets, f"const {real} *q0", count, f"{real} *q", "unsigned char *exists"
    return (
        _head(interface, REDUNDANCY_RANGE.function, real, *ranges),
        _head(interface, ANY, real, *nearest),
    )


def _range_bodies(interface: Interface, real: str) -> tuple[str, ...]:
    dof, rows, most = (_size(interface, word) for word in ("DOF", "BRANCHES", "RANGES"))
    ranges, nearest = (function(interface.symbol, name, real) for name in (REDUNDANCY_RANGE.function, ANY))
    return (
        f"""    for (size_t i = 0; i < count; i++) {{
        (void){ranges}(
            targets + 16 * i, ({real} (*)[{most}][2])(intervals + 2 * {most} * {rows} * i), counts + {rows} * i);
    }}""",
        f"""    for (size_t i = 0; i < count; i++) {{
        exists[i] = (unsigned char){nearest}(targets + 16 * i, q0 + {dof} * i, q + {dof} * i);
    }}""",
    )


def _tracker_header(interface: Interface, real: str) -> str:
    return tracker_file(interface.symbol, "h", real)


def _tracker_heads(interface: Interface, real: str) -> tuple[str, ...]:
    """Return the three functions: a start, many steps, and the speeds of a twist."""
    params = ("const void *params",) * bool(interface.parameters)
    start = (*params, "void *tracker", f"const {real} *q", f"const {real} *redundancy")
    targets = f"const {real} *targets", f"const {real} *redundancy", "size_t count", f"const {real} *max_step"
    follow = (*params, "void *tracker", *targets, f"{real} *q", "void *reports", "int32_t *status")
    given = f"const {real} *twist", f"const {real} *max_speed"
    speeds = (*params, "const void *tracker", *given, f"{real} *qd", f"{real} *residual", f"{real} *factor")
    return tuple(
        _head(interface, f"tracker_{part}", real, *arguments)
        for part, arguments in (("start", start), ("step", follow), ("speeds", speeds))
    )


def _tracker_bodies(interface: Interface, real: str) -> tuple[str, ...]:
    stem, dof = interface.prefix(real), _size(interface, "DOF")
    start, step, speeds = (function(interface.symbol, f"tracker_{part}", real) for part in ("start", "step", "speeds"))
    params = f", (const {interface.params(real)} *)params" if interface.parameters else ""
    given, each = (", redundancy", ", redundancy + i") if interface.redundancy else ("", "")
    return (
        f"""    (void)redundancy;
    {start}(({stem}_tracker *)tracker, q{given}{params});""",
        f"""    {stem}_tracked *results = ({stem}_tracked *)reports;
    (void)redundancy;
    for (size_t i = 0; i < count; i++) {{
        status[i] = {step}(({stem}_tracker *)tracker, targets + 16 * i{each}{params}, max_step, results + i);
        for (int j = 0; j < {dof}; j++) q[{dof} * i + (size_t)j] = (({stem}_tracker *)tracker)->q[j];
    }}""",
        f"""    factor[0] = {speeds}((const {stem}_tracker *)tracker, twist{params}, max_speed, qd, residual);""",
    )
