"""Every identifier and file name that kinegen makes, the words they may not be, and text that comments can hold.

A name that cannot be used is an error that quotes it, never renamed in silence. The one exception is Python's own
keywords, which are good names in C and in a robot file: `python_identifier` gives them a trailing underscore.
"""

from __future__ import annotations

import keyword
import re
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from kinegen.errors import KinegenError

_ONLY_PRINTED: ContextVar[bool] = ContextVar("_ONLY_PRINTED", default=False)

Q30 = "q30"
"""The number type of integer kernels, on the command line and in the names of files and functions."""

EXTENSION = "_native.abi3.so"
"""File name of the compiled extension in a package; the one file there that carries no banner."""

RUNTIME = "_runtime"
"""Folder of a package with the vendored modules, which have the same bytes for every robot."""

MAX_NAME = 40
_SHAPE = re.compile(r"[A-Za-z][A-Za-z0-9_]*\Z")
_SHOWN = 60

PARTS = (
    *("batch", "tile", "params", "from_params", "expected", "accepted"),  # emitted C
    *("arrays", "pointers", "forms", "run", "many"),  # the extension
    "at",  # languages that evaluate in place
)
"""What follows the name of a function in the names that files and extensions need besides it."""

FORMAT_WORDS = frozenset({"base", "tool", "q", "pi", "sqrt"})
"""Words with a meaning in the robot file."""

C_WORDS = frozenset(
    """auto break case char const continue default do double else enum extern float for goto if inline int long
    register restrict return short signed sizeof static struct switch typedef union unsigned void volatile while
    asm fortran typeof typeof_unqual""".split()
)
"""Keywords of C99 and C11 in lower case, and those that compilers add; the others begin with an underscore."""

C_MACROS = frozenset(
    """EOF INFINITY NAN NULL assert errno linux offsetof stderr stdin stdout thread_local unix
    noreturn static_assert alignas alignof complex imaginary""".split()
)
"""Words that standard headers or gcc's GNU mode define as macros."""

_MACROS = re.compile(
    r"""(M_[A-Z0-9_]+ | HUGE_VAL[FL]? | MATH_\w+ | FP_[A-Z]+
    | (FLT|DBL|LDBL|DECIMAL|U?CHAR|SCHAR|U?SHRT|U?INT|U?LONG|U?LLONG|SSIZE|SIZE|PTRDIFF|WCHAR|WINT|SIG_ATOMIC
      |U?INT(_FAST|_LEAST)?(8|16|32|64)|U?INT(MAX|PTR))_[A-Z0-9_]+
    | U?INT(MAX|8|16|32|64)_C | KINEGEN_\w+ | [A-Z0-9_]+_(DOF|H_INCLUDED))\Z""",
    re.VERBOSE,
)
"""Macros of the headers that generated files may stand beside, and those that generated files define."""

_TYPES = re.compile(r"(size|ssize|ptrdiff|max_align|u?int(_fast|_least)?(8|16|32|64)|u?int(max|ptr)|float|double)_t\Z")
"""Types of the C library."""

C_HEADERS = frozenset(
    """assert complex ctype errno fenv float inttypes iso646 limits locale math setjmp signal stdarg stdbool stddef
    stdint stdio stdlib string tgmath time wchar wctype""".split()
)
"""Standard headers, which a header of the robot's name would hide."""

BOARD_MACROS = frozenset(
    """ADC ADCH ADCL ADCW APB_CLK_FREQ ARDUINO BUILTIN_SDCARD CAN CHANGE CRC CoreDebug DAC DEFAULT DEG_TO_RAD DISPLAY
    DWT EEAR EEDR EULER EXTERNAL EXTI FALLING FALSE FLASH FPU F_CPU HALF_PI HIGH INPUT INPUT_PULLDOWN
    INPUT_PULLUP INTERNAL INTERNAL1V1 INTERNAL2V56 ITM IWDG LED_BUILTIN LOW LSBFIRST MISO MOSI MPU MSBFIRST
    NOT_AN_INTERRUPT NOT_A_PIN NOT_A_PORT NVIC ONHIGH ONLOW OUTPUT OUTPUT_OPENDRAIN PI PWR RAD_TO_DEG RAMEND RCC
    RISING RNG RTC SCB SCK SCL SDA SERIAL SP SPDR SPH SPI SPL SREG SS SysTick TRUE TWO_PI TWCR TWDR WWDG""".split()
)
"""Macros of the cores of Arduino, of ESP-IDF, AVR and CMSIS, which firmware includes before the headers of kernels."""

_BOARD_MACRO = re.compile(
    r"B[01]{1,8}|BIT\d{1,2}|(PIN_)?A\d{1,2}|(PORT|DDR|PIN)[A-L]\d?|(P|DD)[A-L]\d|GPIO[A-K]|(DMA|I2C|SPI|TIM)\d{1,2}|"
    r"(ADC|CAN|DAC|UART|USART|LPUART)\d|(TCNT|TCCR|OCR|ICR|TIMSK|TIFR|UBRR|UCSR|UDR)\d[A-CHL]{0,2}"
)
"""More of them: binary numbers, bits, pins, ports and peripherals."""

CPP_WORDS = frozenset(
    """alignas alignof and and_eq asm bitand bitor bool catch char16_t char32_t char8_t class co_await co_return
    co_yield compl concept consteval constexpr constinit const_cast decltype delete dynamic_cast explicit export false
    friend mutable namespace new noexcept not not_eq nullptr operator or or_eq private protected public
    reinterpret_cast requires static_assert static_cast template this thread_local throw true try typeid typename
    using virtual wchar_t xor xor_eq""".split()
)
"""Keywords of C++ that C99 does not have."""

DEVICE_NAMES = frozenset({"aux", "con", "nul", "prn", *(f"{port}{n}" for port in ("com", "lpt") for n in range(1, 10))})
"""File names that Windows keeps for itself."""

MODULE_NAMES = frozenset(
    """cffi click cupy dask distributed jax jaxlib jinja2 kinegen markupsafe matplotlib mpmath numba numpy packaging
    pandas pyarrow pycparser pytest scipy setuptools sympy tensorflow test torch xarray yaml zarr""".split()
)
"""Modules, besides the standard library, that a generated package of the same name would hide."""


@contextmanager
def only_printed() -> Iterator[None]:
    """Let files that are read inside have names which are words of C or Python; `RobotPrograms` refuses them later."""
    token = _ONLY_PRINTED.set(True)
    try:
        yield
    finally:
        _ONLY_PRINTED.reset(token)


def accept_printed(kind: str, name: str) -> None:
    """Check a name as `check_name`, but accept words of C and Python inside of `only_printed`."""
    reason = _shape_defect(name) or _format_defect(kind, name)
    if reason or not _ONLY_PRINTED.get():
        check_name(kind, name)


def refuse_words(names: Iterable[tuple[str, str]]) -> None:
    """Refuse words of C among the names of a robot, given with their kinds, which `only_printed` may have let pass.

    Raises:
        KinegenError: Without a place; the message quotes the name.
    """
    for kind, name in names:
        if reason := _word_defect(name) or (_robot_defect(name) if kind == "robot" else ""):
            raise KinegenError(f"{kind} name {name!r} {reason}")


def check_name(kind: str, name: str) -> None:
    """Refuse a name that cannot become an identifier in every output.

    Args:
        kind: `robot`, `parameter`, `joint`, `frame` or `runtime parameter`.
        name: As the user wrote it.

    Raises:
        KinegenError: Without a place; the message quotes the name and says what is wrong.
    """
    shown = name if len(name) <= _SHOWN else name[: _SHOWN - 3] + "..."
    reason = _shape_defect(name) or _format_defect(kind, name) or _word_defect(name)
    if kind == "robot":
        reason = reason or _robot_defect(name)
    elif kind == "runtime parameter":
        reason = reason or _member_defect(name)
    if reason:
        raise KinegenError(f"{kind} name {shown!r} {reason}")


def _shape_defect(name: str) -> str:
    if _SHAPE.match(name) is None:
        return "is not an identifier (a letter, then letters, digits and underscores)"
    if len(name) > MAX_NAME:
        return f"has {len(name)} characters (at most {MAX_NAME})"
    if "__" in name or name.endswith("_"):
        return "has an underscore at the end or two in a row, which C and C++ reserve"
    return ""


def _format_defect(kind: str, name: str) -> str:
    is_word = name in FORMAT_WORDS and (kind, name) != ("joint", "base")
    return "is a word of the robot file itself" if is_word else ""


def _word_defect(name: str) -> str:
    if name in C_WORDS:
        return "is a C keyword"
    if name in CPP_WORDS:
        return "is a C++ keyword"
    if name in C_MACROS:
        return "is a macro of the C library or compiler"
    if _MACROS.match(name):
        return "is a macro of a C header or of a generated one"
    if _TYPES.match(name):
        return "is a type of the C library"
    return ""


def _robot_defect(name: str) -> str:
    if keyword.iskeyword(name):
        return "is a Python keyword"
    if name in sys.stdlib_module_names or name in MODULE_NAMES:
        return "would hide the Python module of that name"
    if name in C_HEADERS:
        return "would hide the C header of that name"
    if name.startswith("kinegen_"):
        return "is the name of a file that kinegen compiles together with those of the robot"
    if name.lower() in DEVICE_NAMES:
        return "is a device name on Windows, so no folder can have it"
    return ""


def _member_defect(name: str) -> str:
    """Return why a macro would replace a member of a struct in the header; members have no prefix in C."""
    if name in BOARD_MACROS or _BOARD_MACRO.fullmatch(name):
        return "is a macro of Arduino, ESP-IDF, AVR or STM32; the macro would replace it in the header"
    return ""


def python_identifier(name: str) -> str:
    """Return the name of a parameter or joint in Python, `lambda_` for `lambda`."""
    return f"{name}_" if keyword.iskeyword(name) else name


def prefix(robot: str, real: str) -> str:
    """Return what the C names and files of one number type begin with: `puma560`, `puma560_f32` or `puma560_q30`."""
    return robot + {"double": "", "float": "_f32", "q30": "_q30"}[real]


def function(robot: str, output: str, real: str = "double", *, batch: bool = False) -> str:
    """Return the C function of one output: `puma560_fk`, `puma560_f32_frames_batch`."""
    name = f"{prefix(robot, real)}_{output}"
    return companion(name, "batch") if batch else name


def companion(function: str, part: str) -> str:
    """Return the name of what is made for a function besides it, such as its form for batches: `puma560_fk_batch`.

    `part` is one of `PARTS`, which no other function of the robot may end in.
    """
    if part not in PARTS:
        raise ValueError(f"{part} is not among the parts of a function")
    return f"{function}_{part}"


def wasm_function(robot: str, output: str) -> str:
    """Return the function of one output in WebAssembly: `wasm_puma560_fk`."""
    return f"wasm_{function(robot, output)}"


def params_type(robot: str, real: str = "double") -> str:
    """Return the C type of the runtime parameters: `puma560_f32_params`."""
    return f"{prefix(robot, real)}_params"


def default_params(robot: str, real: str = "double") -> str:
    """Return the values of the robot file in C: `puma560_default_params`."""
    return f"{prefix(robot, real)}_default_params"


def module_file(robot: str, extension: str) -> str:
    """Return a file of a language that has one module for each robot, such as `puma560.js`."""
    return f"{robot}.{extension}"


def macro(robot: str, suffix: str) -> str:
    """Return a macro of the robot's header: `PUMA560_DOF`."""
    return f"{robot}_{suffix}".upper()


def c_file(robot: str, extension: str, real: str = "double", *, batch: bool = False) -> str:
    """Return the C file of one number type: `puma560.h`, `puma560_f32_batch.c`."""
    return f"{prefix(robot, real)}{'_batch' if batch else ''}.{extension}"


def search_file(robot: str, extension: str, real: str = "double", *, batch: bool = False) -> str:
    """Return a file of the numeric inverse of one number type: `puma560_numeric_inverse.c`, or that of many targets."""
    return f"{prefix(robot, real)}_numeric_inverse{'_batch' if batch else ''}.{extension}"


def complete_file(robot: str, extension: str) -> str:
    """Return the files of the complete inverse, in double alone: `jaco2_complete_inverse.c`."""
    return f"{robot}_complete_inverse.{extension}"


def range_file(robot: str, extension: str, real: str = "double") -> str:
    """Return the files of the ranges of a redundancy of one number type: `iiwa14_redundancy_range.c`."""
    return f"{prefix(robot, real)}_redundancy_range.{extension}"


def tracker_file(robot: str, extension: str, real: str = "double") -> str:
    """Return the files of the inverse along a path, of one number type: `puma560_f32_inverse_tracker.c`."""
    return f"{prefix(robot, real)}_inverse_tracker.{extension}"


def selftest_file(robot: str, real: str = "double") -> str:
    """Return the self-test of one number type: `puma560_selftest.c`."""
    return f"{prefix(robot, real)}_selftest.c"


def vectors_file(robot: str, real: str = "double") -> str:
    """Return the test vectors of one number type: `puma560_vectors.h`."""
    return f"{prefix(robot, real)}_vectors.h"


def cmake_target(robot: str) -> str:
    """Return the CMake target of a package, `kinegen_puma560`; other projects know it as `kinegen::puma560`."""
    return f"kinegen_{robot}"


def guard(file_name: str) -> str:
    """Return the include guard of a header: `KINEGEN_PUMA560_H_INCLUDED` for `puma560.h`."""
    return f"KINEGEN_{file_name.replace('.', '_').upper()}_INCLUDED"


def sincos_macro(robot: str, real: str = "double") -> str:
    """Return the macro by which a board's own sine-cosine replaces the emitted one: `KINEGEN_PUMA560_F32_SINCOS`."""
    return f"KINEGEN_{prefix(robot, real)}_SINCOS".upper()


def comment_text(text: str) -> str:
    """Return text that is harmless inside a C comment of either kind.

    It can neither close the comment, nor open another (gcc warns), nor continue a line, by a backslash or its trigraph.
    """
    spaced = text.replace("*/", "* /").replace("/*", "/ *").replace("??/", "?? /")
    return " ".join(spaced.split()).rstrip("\\ ")


def docstring_text(text: str) -> str:
    """Return text made harmless inside a Python docstring in triple double quotes."""
    escaped = text.replace("\\", "\\\\")
    return re.sub(r'"(?="|$)', r"\"", escaped)
