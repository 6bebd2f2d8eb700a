"""The C that looks at the processor: may the kernels run, and which variant of the batch kernels serves it best.

In: the interface of a robot and the flags. Out: C text and the compilations that it needs. The emitted files stay as
they are: each variant of a batch file is the same file, compiled with other flags, its functions renamed on the
command line (`-Darm_fk_batch=arm_fk_batch_avx2`). The functions of the plain names then pass on to the variant that
was picked when the extension was loaded.
"""

from __future__ import annotations

from kinegen.backends.c.numeric_inverse_batch import search_batch_arguments
from kinegen.model.outputs import NUMERIC_INVERSE
from kinegen.runtime.cffi_interface import HEADER, Function, Interface, batch_arguments
from kinegen.runtime.flags import Flags
from kinegen.support import naming
from kinegen.support.dataclass import dataclass

NEEDS = "kinegen_needs.c"
"""Compiled like the kernels; holds data alone."""

PROCESSOR = "kinegen_processor.c"
"""Compiled for the plainest processor, so that it can ask which one it runs on."""

# The extensions of x86-64 that compilers use for arithmetic, as `__builtin_cpu_supports` names them.
_X86 = (
    "sse3", "ssse3", "sse4.1", "sse4.2", "avx", "avx2", "fma", "fma4", "xop", "bmi", "bmi2",
    "avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl", "avx512vbmi", "avx512ifma",
)  # fmt: skip

# Those of aarch64: the macro of the compiler, then where Linux tells of it, and the bit.
_ARM = (
    ("__ARM_FEATURE_SVE", "AT_HWCAP", 22),
    ("__ARM_FEATURE_SVE2", "AT_HWCAP2", 1),
    ("__ARM_FEATURE_COMPLEX", "AT_HWCAP", 14),
)


@dataclass(frozen=True, slots=True)
class Unit:
    """One call of the compiler.

    Attributes:
        source: The C file.
        name: Stem of the object file.
        arguments: Flags.
    """

    source: str
    name: str
    arguments: tuple[str, ...]


def units(interface: Interface, names: tuple[str, ...], flags: Flags) -> tuple[Unit, ...]:
    """The compilations of the kernels.

    Args:
        interface: The robot's interface.
        names: The emitted C files, and those of `dispatch`.
        flags: How to compile.

    Returns:
        One compilation for each file, or for each variant of a batch file.
    """
    batches = _batches(interface)
    found = [Unit(PROCESSOR, PROCESSOR.removesuffix(".c"), ("-std=gnu99", "-O2"))]
    for name in names:
        stem, plain = name.removesuffix(".c"), flags.arguments(batch=name in batches)
        if name in batches and flags.variants:
            functions = batches[name]
            for variant in flags.variants:
                renames = tuple(f"-D{function}={function}_{variant.name}" for function in functions)
                found.append(Unit(name, f"{stem}_{variant.name}", (*plain, *variant.arguments(), *renames)))
        elif name.endswith(".c") and name != PROCESSOR:
            found.append(Unit(name, stem, plain))
    return tuple(found)


def _batches(interface: Interface) -> dict[str, tuple[str, ...]]:
    """The C files with batch kernels, and the names of these."""
    found = {}
    for real in interface.reals:
        names = (naming.function(interface.symbol, each.name, real, batch=True) for each in interface.functions)
        found[naming.c_file(interface.symbol, "c", real, batch=True)] = tuple(names)
        if interface.numeric_inverse:
            name = naming.function(interface.symbol, NUMERIC_INVERSE.function, real, batch=True)
            found[naming.search_file(interface.symbol, "c", real, batch=True)] = (name,)
    return found


def dispatch(interface: Interface, flags: Flags) -> dict[str, str]:
    """The C that looks at the processor.

    Args:
        interface: The robot's interface.
        flags: How the kernels are compiled.

    Returns:
        C text by file name, to be compiled beside the emitted files.
    """
    macros = [*(f"__{name.upper().replace('.', '_')}__" for name in _X86), *(macro for macro, _, _ in _ARM)]
    needs = [line for macro in macros for line in (f"#ifdef {macro}", "    1,", "#else", "    0,", "#endif")]
    data = ["extern const unsigned char kinegen_needs[];", "const unsigned char kinegen_needs[] = {", *needs, "};"]
    names = [variant.name for variant in flags.variants] or [""]
    labels = [", ".join(word for word in (name, flags.label) if word) for name in names]
    code = _CODE.replace("NEEDS_X86", _x86_needs()).replace("NEEDS_ARM", _arm_needs())
    code = code.replace("FEATURES", _features(flags)).replace("LAST", str(len(names) - 1))
    code = code.replace("NAMES", _strings(names)).replace("LABELS", _strings(labels))
    if flags.variants:
        code += "".join(_kernels_passed_on(interface, function, flags) for function in interface.functions)
        code += _search_passed_on(interface, flags) if interface.numeric_inverse else ""
    return {NEEDS: "\n".join([*data, ""]), PROCESSOR: f'#include "{HEADER}"\n{_searches(interface)}{code}'}


_CODE = """
#include <string.h>
#if defined(__aarch64__) && defined(__linux__)
#include <sys/auxv.h>
#endif

extern const unsigned char kinegen_needs[];

static const char *const names[] = {NAMES};
static const char *const labels[] = {LABELS};
static int picked;

/* Whether this processor has the instructions that all kernels were compiled for, and also those of a variant. */
static int can_run(int variant)
{
    (void)variant;
#if defined(__x86_64__) && defined(__GNUC__)
    __builtin_cpu_init();
NEEDS_X86
FEATURES
#elif defined(__aarch64__) && defined(__linux__)
NEEDS_ARM
#endif
    return 1;
}

int kinegen_select(const char *wanted)
{
    for (int variant = LAST; variant >= 0; --variant) {
        const int asked = LAST == 0 || wanted[0] == 0 || strcmp(wanted, names[variant]) == 0;
        if (asked && can_run(variant)) {
            picked = variant;
            return 1;
        }
    }
    return 0;
}

const char *kinegen_variant(void)
{
    return labels[picked];
}
"""


def _strings(texts: list[str]) -> str:
    return ", ".join(f'"{text}"' for text in texts)


def _x86_needs() -> str:
    return "\n".join(
        f'    if (kinegen_needs[{index}] && !__builtin_cpu_supports("{name}")) return 0;'
        for index, name in enumerate(_X86)
    )


def _arm_needs() -> str:
    return "\n".join(
        f"    if (kinegen_needs[{index}] && !(getauxval({place}) >> {bit} & 1)) return 0;"
        for index, (_, place, bit) in enumerate(_ARM, len(_X86))
    )


def _features(flags: Flags) -> str:
    return "\n".join(
        f'    if (variant == {index} && !__builtin_cpu_supports("{feature}")) return 0;'
        for index, variant in enumerate(flags.variants)
        for feature in variant.features
    )


def _searches(interface: Interface) -> str:
    """The headers of the searches for many targets."""
    names = (naming.search_file(interface.symbol, "h", real, batch=True) for real in interface.reals)
    return "".join(f'#include "{name}"\n' for name in names) if interface.numeric_inverse else ""


def _kernels_passed_on(interface: Interface, function: Function, flags: Flags) -> str:
    """The batch kernels of the plain names."""
    text = ""
    for real in interface.reals:
        name = naming.function(interface.symbol, function.name, real, batch=True)
        text += _passed_on(name, batch_arguments(interface, function, real), flags)
    return text


def _search_passed_on(interface: Interface, flags: Flags) -> str:
    """The searches for many targets of the plain names."""
    text = ""
    for real in interface.reals:
        name = naming.function(interface.symbol, NUMERIC_INVERSE.function, real, batch=True)
        arguments = search_batch_arguments(
            interface.symbol, real, parameters=bool(interface.parameters), tips=bool(interface.tips)
        )
        text += _passed_on(name, arguments, flags)
    return text


def _passed_on(name: str, arguments: tuple[str, ...], flags: Flags) -> str:
    """A function that calls the variant that was picked."""
    values = ", ".join(argument.split()[-1].lstrip("*") for argument in arguments)
    forms = ", ".join(f"{name}_{variant.name}" for variant in flags.variants)
    signature = f"({', '.join(arguments)})"
    text = f"\ntypedef void {name}_form{signature};\n{name}_form {forms};\n\nvoid {name}{signature}\n{{\n"
    return text + f"    static {name}_form *const forms[] = {{{forms}}};\n    forms[picked]({values});\n}}\n"
