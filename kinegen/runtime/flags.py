"""How the kernels are compiled, and for which processors."""

from __future__ import annotations

import re

from kinegen.errors import CompileError
from kinegen.runtime.compiler import processor
from kinegen.support.dataclass import dataclass

_X86 = ("x86_64", "amd64", "x64")
_ARM = ("aarch64", "arm64")

# For most processors with AVX-512 the compilers prefer 256 bits, lest a few wide instructions slow down the code around
# them. A batch is nothing but wide arithmetic: it gains a fifth on a Zen 4 (91 against 75 million poses a second).
_WIDE = ("-mprefer-vector-width=512",)

# gcc 12 fuses a product into a sum and a difference side by side even without contraction, when it makes vectors out of
# straight code (`vfmaddsub`). Batch kernels compute in loops, which it leaves as they are.
_STRAIGHT = ("-fno-tree-slp-vectorize",)

# Kernels then take square roots from the processor, with the bits of their own in a fifth of the time.
_ROOTS = "-fno-math-errno"


@dataclass(frozen=True, slots=True)
class Variant:
    """One form of the batch kernels in a portable extension.

    Attributes:
        name: How people name it, also in the environment as KINEGEN_VARIANT.
        features: The instructions beyond the plainest processor of the family, as gcc and clang call them after `-m`
            and in `__builtin_cpu_supports`.
    """

    name: str
    features: tuple[str, ...] = ()

    def arguments(self) -> tuple[str, ...]:
        """What the compiler is told besides the flags of the plainest processor."""
        wide = _WIDE if "avx512f" in self.features else ()
        return (*(f"-m{feature}" for feature in self.features), *wide)


_AVX2 = ("avx", "avx2", "fma", "bmi", "bmi2")
_AVX512 = (*_AVX2, "avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl")
_VARIANTS = (Variant("baseline"), Variant("avx2", _AVX2), Variant("avx512", _AVX512))


@dataclass(frozen=True, slots=True)
class Flags:
    """How the kernels are compiled.

    Attributes:
        march: Processor to compile for: "native", a name that the compiler knows, or None for what the compiler takes
            by itself.
        portable: Compile for every processor of the family instead, with variants of the batch kernels for those that
            have more instructions; `march` is then not asked.
        contraction: Whether a product and a sum may become one operation with one rounding. Without it the results
            are the same bits everywhere.
        optimisation: Digit after -O.
        extra: Further flags, for the kernels alone.
    """

    march: str | None = "native"
    portable: bool = False
    contraction: bool = True
    optimisation: str = "3"
    extra: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.march is not None and not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9+._-]*", self.march):
            raise CompileError(f"{self.march!a} is not a processor (expected native or a name that the compiler knows)")

    @property
    def variants(self) -> tuple[Variant, ...]:
        """The forms of the batch kernels, plainest first; none where there is only one form."""
        if not self.portable:
            return ()
        return _VARIANTS if _machine() in _X86 else _VARIANTS[:1]

    @property
    def label(self) -> str:
        """The flags in a word or two, for people."""
        words = [] if self.portable else [self.march or "plain"]
        return ", ".join([*words, *["reproducible"] * (not self.contraction)])

    @property
    def place(self) -> str:
        """A text that differs between machines on which the same flags give different code."""
        return processor().describe() if self.march == "native" and not self.portable else processor().machine

    def arguments(self, *, batch: bool = False) -> tuple[str, ...]:
        """The flags as the compiler takes them.

        Args:
            batch: Whether they are for batch kernels; a variant adds its own.
        """
        straight = _STRAIGHT if not self.contraction and not batch else ()
        wide = _WIDE if batch and self.march is not None and not self.portable and _machine() in _X86 else ()
        contraction = f"-ffp-contract={'fast' if self.contraction else 'off'}"
        plain = ("-std=c99", f"-O{self.optimisation}", contraction, _ROOTS)
        return (*plain, *straight, *self._target(), *wide, *self.extra)

    def _target(self) -> tuple[str, ...]:
        if self.portable:
            # Some distributions raise what their compilers take by themselves.
            return ("-march=x86-64",) if _machine() in _X86 else ()
        if self.march is None:
            return ()
        # On this family, -march=native says nothing about the order of instructions.
        return (f"-mcpu={self.march}" if self.march == "native" and _machine() in _ARM else f"-march={self.march}",)


def _machine() -> str:
    return processor().machine.lower()
