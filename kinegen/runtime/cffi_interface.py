"""The C between the kernels of a robot and Python: what cffi may call, and the reading of NumPy arrays.

In: the interface of a robot, a frozen record. Out: the declarations for cffi and the C text that goes into the
extension besides the emitted files. For an output `fk` of the robot `arm` the extension has

    arm_fk, arm_fk_batch     the kernels as emitted; `arm_f32_...` for float
    arm_fk_arrays            takes the addresses of array objects, and declines (0) what is not plain
    quick_class, quicken     the same for calls without Python code around them; see `calls.c`
    arm_fk_pointers          the scalar kernel with plain pointers, for bound arguments
    kinegen_stamp            the digest of the sources
    kinegen_select           picks the variant of the batch kernels, by name or (an empty one) the best that this
                             processor can run; 0 if there is none
    kinegen_variant          what was picked, and the flags, in words
    kinegen_signatures       the types of all these, for callers without cffi

`kinegen_select` and `kinegen_variant` are made by `dispatch.py`. The array handling (`runtime/`) knows these names. All
but the batch kernels and the scalar ones are visible from outside, so that ctypes finds them where cffi is missing.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib import resources

from kinegen.backends.c.arguments import batch_arguments as c_batch_arguments
from kinegen.backends.c.arguments import number_type
from kinegen.backends.c.syntax import TRUTH
from kinegen.model.outputs import Array
from kinegen.support import naming
from kinegen.support.dataclass import dataclass

HEADER = "kinegen_glue.h"
"""Declares everything that cffi calls."""

GLUE = "kinegen_glue.c"
"""What is made for one robot."""

CALLS = "kinegen_calls.c"
"""The same for all robots; the only file besides cffi's that reads the headers of Python and NumPy."""


@dataclass(frozen=True, slots=True)
class Function:
    """One kernel.

    Attributes:
        name: Its name after the robot's prefix, such as `fk`.
        inputs: What it is given, in order.
        results: What it gives, in order.
        returns_last: Whether the scalar kernel returns the last result, a truth value, instead of storing it.
    """

    name: str
    inputs: tuple[Array, ...]
    results: tuple[Array, ...]
    returns_last: bool = False

    @property
    def stored(self) -> tuple[Array, ...]:
        """The results that the scalar kernel stores."""
        return self.results[:-1] if self.returns_last else self.results


@dataclass(frozen=True, slots=True)
class Interface:
    """What an extension offers.

    Attributes:
        symbol: Prefix of the robot's C names.
        functions: The kernels.
        reals: `double`, `float` or both, in this order.
        parameters: Names of the runtime parameters, in the order of the C struct.
        numeric_inverse: Whether it offers the search for joint values.
        complete_inverse: Whether it offers all solutions of an arm.
        tips: Number of tips of a tree; 0 for an arm.
        redundancy_range: Whether it offers the ranges of a redundancy.
        inverse_tracker: Whether it offers the inverse along a path.
        redundancy: What its inverse is given besides the target; empty where nothing is.
    """

    symbol: str
    functions: tuple[Function, ...]
    reals: tuple[str, ...]
    parameters: tuple[str, ...] = ()
    numeric_inverse: bool = False
    complete_inverse: bool = False
    tips: int = 0
    redundancy_range: bool = False
    inverse_tracker: bool = False
    redundancy: str = ""

    def prefix(self, real: str) -> str:
        """Prefix of the names of one number type."""
        return naming.prefix(self.symbol, real)

    def params(self, real: str) -> str:
        """Type of the runtime parameters; empty where there are none."""
        return naming.params_type(self.symbol, real) if self.parameters else ""

    def headers(self) -> tuple[str, ...]:
        """The headers that declare the kernels."""
        return tuple(
            naming.c_file(self.symbol, "h", real, batch=batch) for real in self.reals for batch in (False, True)
        )


def declarations(interface: Interface) -> str:
    """What cffi is told: every function of the extension.

    Args:
        interface: The robot's interface.

    Returns:
        C declarations without macros.
    """
    lines = list(_FIXED)
    for real in interface.reals:
        prefix = interface.prefix(real)
        if interface.parameters:
            lines += [
                "typedef struct {",
                *(f"    {real} {name};" for name in interface.parameters),
                f"}} {interface.params(real)};",
            ]
        for function in interface.functions:
            lines.append(f"{_pointers(interface, function, real)};")
            kind = "int" if function.returns_last else "void"
            lines.append(f"{kind} {prefix}_{function.name}({_scalar_arguments(interface, function, real)});")
            batch = naming.function(interface.symbol, function.name, real, batch=True)
            lines.append(f"void {batch}({', '.join(batch_arguments(interface, function, real))});")
    lines += [f"{_arrays(interface, function)};" for function in interface.functions]
    return "\n".join(lines) + "\n"


def batch_arguments(interface: Interface, function: Function, real: str) -> tuple[str, ...]:
    """The arguments of a batch kernel, as declared in the emitted header.

    Args:
        interface: The robot's interface.
        function: The kernel.
        real: Number type.

    Returns:
        C declarations, each ending in the name.
    """
    return c_batch_arguments(function.inputs, function.results, real, interface.params(real))


def glue(interface: Interface, digest: str, more: tuple[str, ...] = ()) -> dict[str, str]:
    """The C that stands between the kernels and Python.

    Args:
        interface: The robot's interface.
        digest: What `stamp_of` says of the emitted sources.
        more: Declarations of what else the extension has.

    Returns:
        C text by file name, to be compiled beside the emitted files.
    """
    place = resources.files("kinegen.runtime")
    fixed = {f"kinegen_{name}": place.joinpath(name).read_text(encoding="utf-8") for name in _SAME}
    own = [f"{_pointers(interface, function, real)};" for function in interface.functions for real in interface.reals]
    own += [*_FIXED, *(f"{_arrays(interface, function)};" for function in interface.functions)]
    includes = ("#include <stdint.h>", *(f'#include "{header}"' for header in interface.headers()))
    header = [*includes, "", _VISIBLE, *own, *more, _HIDDEN]
    parts = [f'#include "{HEADER}"', '#include "kinegen_entries.h"', "#include <string.h>", ""]
    parts += [f'const char *kinegen_stamp(void) {{ return "{digest}"; }}', ""]
    listed = "".join(f'\n    "{line}\\n"' for line in _signatures(interface, (*own, *more)))
    parts += [f"const char *kinegen_signatures(void)\n{{\n    return{listed};\n}}", ""]
    for function in interface.functions:
        parts += [_pointers_definition(interface, function, real) for real in interface.reals]
        parts += [_arrays_definition(interface, function), ""]
    parts.append(_entries(interface))
    written = {HEADER: header, GLUE: parts}
    return fixed | {name: "\n".join(lines) + "\n" for name, lines in written.items()}


_SAME = ("entries.h", "arrays.h", "memory.h", "calls.c")
"""The C that is the same for all robots."""

_REALS = ("double", "float")
"""The order in which parameters of both number types are handed on."""

_FIXED = (
    "const char *kinegen_stamp(void);",
    "int kinegen_select(const char *wanted);",
    "const char *kinegen_variant(void);",
    "const char *kinegen_signatures(void);",
)

# Protected: seen from outside, but never replaced by a function of the same name in another library.
_VISIBLE = """#if defined(__ELF__) && defined(__GNUC__)
#pragma GCC visibility push(protected)
#elif defined(__GNUC__)
#pragma GCC visibility push(default)
#endif"""
_HIDDEN = """#ifdef __GNUC__
#pragma GCC visibility pop
#endif"""

_LETTERS = (("const char", "s"), ("*", "p"), ("uintptr_t", "p"), ("size_t", "z"), ("uint32_t", "u"), ("int32_t", "l"))


def _signatures(interface: Interface, declarations: tuple[str, ...]) -> Iterator[str]:
    """A line for each struct, `arm_params double`, and for each function: its name and the letters of its types.

    The letter of the result comes first, then one for each argument: v for void, i int, l int32_t, u uint32_t,
    z size_t, s a string, p any other address.
    """
    yield from (f"{interface.params(real)} {real}" for real in interface.reals if interface.parameters)
    for declaration in declarations:
        head, _, arguments = declaration.removesuffix(");").partition("(")
        result, name = head.replace("*", "* ").rsplit(maxsplit=1)
        letters = "".join(map(_letter, arguments.split(", "))).removeprefix("v")
        yield f"{name} {_letter(result)} {letters}".rstrip()


def _letter(declared: str) -> str:
    """The letter of a C type, with or without a name behind it."""
    return next((letter for text, letter in _LETTERS if text in declared), "v" if declared == "void" else "i")


def _scalar_arguments(interface: Interface, function: Function, real: str) -> str:
    parts = [f"const {real} {array.name}[{array.stored}]" for array in function.inputs if array.size]
    parts += [f"const {interface.params(real)} *params"] * bool(interface.parameters)
    for array in function.stored:
        outer = f"[{array.blocks}]" if array.in_blocks else ""
        parts += [f"{number_type(array, real)} {array.name}{outer}[{array.stored}]"] * bool(array.size)
    return ", ".join(parts) or "void"


def _pointers(interface: Interface, function: Function, real: str) -> str:
    params = [f"const {interface.params(real)} *params"] * bool(interface.parameters)
    inputs = [f"const {real} *{array.name}" for array in function.inputs]
    results = [f"{number_type(array, real)} *{array.name}" for array in function.results]
    name = naming.companion(naming.function(interface.symbol, function.name, real), "pointers")
    return f"void {name}({', '.join([*params, *inputs, *results])})"


def _pointers_definition(interface: Interface, function: Function, real: str) -> str:
    arguments = [array.name for array in function.inputs if array.size]
    arguments += ["params"] * bool(interface.parameters)
    for array in function.stored:
        place = f"({real} (*)[{array.stored}]){array.name}" if array.in_blocks else array.name
        arguments += [place] * bool(array.size)
    arrays = (*function.inputs, *function.results)
    unused = "".join(f"    (void){array.name};\n" for array in arrays if not array.size)
    answer = f"{function.results[-1].name}[0] = ({TRUTH})" if function.returns_last else ""
    call = f"    {answer}{naming.function(interface.symbol, function.name, real)}({', '.join(arguments)});"
    return f"{_pointers(interface, function, real)}\n{{\n{unused}{call}\n}}\n"


def _arrays(interface: Interface, function: Function) -> str:
    params = [f"const {interface.params(real)} *params_{real}" for real in interface.reals if interface.parameters]
    params += ["uintptr_t sets"] * bool(interface.parameters)
    arrays = [f"uintptr_t {array.name}" for array in (*function.inputs, *function.results)]
    name = naming.companion(naming.function(interface.symbol, function.name), "arrays")
    return f"int {name}({', '.join([*params, *arrays, 'int layout'])})"


def _arrays_definition(interface: Interface, function: Function) -> str:
    """The forms of the arrays, the kernel for arrays that were found, and what cffi calls with their addresses."""
    arrays = (*function.inputs, *function.results)
    forms, run = _form_and_run(interface, function)
    counts = f"{len(function.inputs)}, {len(arrays)}"
    named = [f"params_{real}" if interface.parameters and real in interface.reals else "NULL" for real in _REALS]
    taken = f"kinegen_take_sets(sets, {len(interface.parameters)}, &call)"
    return "\n".join(
        [
            f"static const Form {forms}[] = {{{', '.join(_form(array) for array in arrays)}}};",
            "",
            _run_definition(interface, function),
            "",
            _arrays(interface, function),
            "{",
            f"    const uintptr_t addresses[] = {{{', '.join(array.name for array in arrays)}}};",
            f"    const void *params[] = {{{', '.join(named)}}};",
            f"    Place places[{len(arrays)}];",
            "    Call call;",
            f"    if (!kinegen_read_arrays(addresses, {forms}, {counts}, layout, places, &call)) return 0;",
            *[f"    if (sets != 0 && (params[0] = params[1] = {taken}) == NULL) return 0;"]
            * bool(interface.parameters),
            f"    return {run}(params, places, &call, layout);",
            "}",
        ]
    )


def _form_and_run(interface: Interface, function: Function) -> tuple[str, str]:
    """The names of the table of forms, and of the function that runs a kernel."""
    name = naming.function(interface.symbol, function.name)
    return naming.companion(name, "forms"), naming.companion(name, "run")


def _run_definition(interface: Interface, function: Function) -> str:
    """The kernel of either type, scalar or batch, for arrays that were found."""
    count, inputs = len(function.inputs) + len(function.results), range(len(function.inputs))
    lines = [
        f"static int {_form_and_run(interface, function)[1]}(",
        "    const void *const *params, const Place *p, const Call *call, int layout)",
        "{",
        "    (void)params;",
    ]
    for real in interface.reals:
        name = naming.function(interface.symbol, function.name, real)
        pointers, batched = (naming.companion(name, part) for part in ("pointers", "batch"))
        params = [f"(const {interface.params(real)} *)params[{_REALS.index(real)}]"] * bool(interface.parameters)
        single = [*params, *(f"p[{index}].data" for index in range(count))]
        batch = [f"p[{index}].{word}" for index in inputs for word in ("data", "pose", "joint")]
        batch += [*params, *["call->sets"] * bool(params)]
        batch += [f"p[{index}].{word}" for index in range(len(inputs), count) for word in ("data", "pose")]
        lines += [
            f"    if (call->type == TYPE_{real.upper()}) {{",
            f"        if (call->single) {pointers}({', '.join(single)});",
            f"        else {batched}(call->count, {', '.join(batch)}, layout);",
            "        return 1;",
            "    }",
        ]
    return "\n".join([*lines, "    return 0;", "}"])


def _entries(interface: Interface) -> str:
    """The kernels by name, for calls without Python code around them."""
    lines = ["const Entry *kinegen_find_entry(const char *name)", "{", "    static const Entry entries[] = {"]
    for function in interface.functions:
        (forms, run), inputs = _form_and_run(interface, function), len(function.inputs)
        numbers = f"{inputs}, {inputs + len(function.results)}"
        lines.append(f'        {{"{function.name}", {numbers}, {forms}, {run}}},')
    return "\n".join(
        [
            *lines,
            "    };",
            "    for (size_t i = 0; i < sizeof entries / sizeof entries[0]; ++i) {",
            "        if (strcmp(entries[i].name, name) == 0) return &entries[i];",
            "    }",
            "    return NULL;",
            "}",
        ]
    )


def _form(array: Array) -> str:
    shape = ", ".join(str(extent) for extent in array.shape or (0,))
    return f"{{{len(array.shape)}, {{{shape}}}, {int(array.is_pose)}, {int(not array.size)}, {int(array.is_truth)}}}"
