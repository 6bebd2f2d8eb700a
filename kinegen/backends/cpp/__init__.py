"""C++17: one header of templates over the number type, with a CMake package around it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from kinegen.backends.language import Language
from kinegen.backends.scalar_types import ScalarType
from kinegen.model.outputs import Kind, Quantity

if TYPE_CHECKING:
    from kinegen.backends.bundle import RobotPrograms
    from kinegen.backends.c.test_vectors import Vectors
    from kinegen.backends.printing import Syntax
    from kinegen.ir.program import Operator

_MATH = """
    acos acosh asin asinh atan atan2 atanh cbrt ceil copysign cos cosh drem erf erfc exp exp10 exp2 expm1 fabs fadd
    fdim fdiv ffma finite floor fma fmax fmaximum fmin fminimum fmod fmul frexp fsqrt fsub gamma hypot ilogb
    isinf isnan j0 j1 jn ldexp lgamma llrint llround log log10 log1p log2 logb lrint lround modf nan nearbyint
    nextafter nexttoward pow remainder remquo rint round roundeven scalb scalbln scalbn significand sin sincos
    sinh sqrt tan tanh tgamma trunc y0 y1 yn
""".split()

_LIBRARY = """
    a64l abort abs access acct aligned_alloc alarm alloca asctime asprintf atexit atof atoi atol atoll basename bcmp
    bcopy brk bsearch bzero calloc chdir chown chroot clearenv clearerr clock clone close confstr ctermid ctime
    cuserid daemon daylight difftime div dprintf drand48 dup dup2 dup3 ecvt environ erand48 execl execv execve
    execvp exit fchdir fchown fclose fcvt fdopen feof ferror fflush ffs ffsl fgetc fgetpos fgets fileno fopen
    fork fpathconf fprintf fputc fputs fread free freopen fscanf fseek fsetpos fsync ftell ftruncate fwide
    fwrite gcvt getc getchar getcpu getcwd getdate getdelim getegid getenv geteuid getgid getgroups gethostid
    gethostname getline getlogin getopt getpagesize getpass getpgid getpgrp getpid getppid getpt getsid getuid
    getusershell getw getwd gmtime gnu index initstate isalnum isalpha isascii isatty isblank iscntrl isdigit
    isgraph islower isprint ispunct isspace isupper isxdigit jrand48 kill labs lchown lcong48 ldiv link llabs
    lldiv localeconv localtime lockf lrand48 lseek major makedev malloc mblen mbtowc memchr memcmp memcpy memmem
    memmove memset minor mkdtemp mkstemp mktemp mktime mrand48 nanosleep nice nrand48 obstack open optarg opterr
    optind optopt pathconf pause pclose perror pipe pipe2 popen pread printf profil pselect putc putchar putenv
    puts putw pwrite qsort raise rand random read readlink realloc realpath remove rename revoke rewind rindex
    rmdir rpmatch sbrk scanf seed48 select setbuf setegid setenv seteuid setgid setlocale setpgid setpgrp
    setregid setreuid setsid setstate setuid setvbuf sigevent signgam sigval sleep snprintf sprintf srand
    srandom sscanf stat stderr stdin stdout stpcpy strcat strchr strcmp strcoll strcpy strcspn strdup strerror
    strftime strlen strncat strncmp strncpy strndup strpbrk strrchr strsep strsignal strspn strstr strtod strtof
    strtok strtol strtold strtoll strtoul strtoull strxfrm swab symlink sync syscall sysconf system tempnam time
    timegm timelocal timespec timeval timezone tm tmpfile tmpnam toascii tolower toupper truncate ttyname
    ttyslot tzname tzset ualarm ungetc unlink unsetenv usleep valloc vfork vfprintf vhangup vprintf vscanf
    vsnprintf vsprintf vsscanf wcscat wcschr wcscmp wcscpy wcslen wctomb write
""".split()

RESERVED = frozenset(
    {"std", "Eigen", "main", "FILE", *_LIBRARY, *(f"{word}{end}" for word in _MATH for end in ("", "f", "l"))}
)
"""Of C++ itself, of the C library as usual systems declare it, and Eigen's."""


def _refuses(quantity: Quantity) -> str:
    if quantity.kind in (Kind.COMPLETE_INVERSE, Kind.REDUNDANCY_RANGE, Kind.INVERSE_TRACKER):
        return f"C++ calls that of C, in NAME_{quantity.kind}.h"
    return "it is a search; C++ calls that of C, see docs/cpp.md" if quantity.kind is Kind.NUMERIC_INVERSE else ""


def _syntax(_real: str) -> Syntax[Operator]:
    from kinegen.backends.cpp.syntax import SYNTAX

    return SYNTAX


def _files(kernels: RobotPrograms, _real: str) -> Mapping[str, str]:
    # Here, so that the list of languages is quick to read.
    from kinegen.backends.cpp.files import emit_cpp

    return emit_cpp(kernels)


def _tests(kernels: RobotPrograms, real: str, vectors: Vectors) -> Mapping[str, str]:
    from kinegen.backends.cpp.files import emit_cpp_tests

    return emit_cpp_tests(kernels, vectors, ScalarType(real))


CPP = Language(
    name="cpp",
    title="C++",
    reals=tuple(ScalarType),
    syntax=_syntax,
    files=_files,
    refuses=_refuses,
    tools=("g++", "clang++"),
    install="a C++ compiler (g++ 11, clang 9 or later)",
    tests=_tests,
    reserved=frozenset({"Real"}),
    reserved_robots=RESERVED,
)
