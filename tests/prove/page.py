"""docs/proof.md: what is proved of which kernels, and Frama-C's own words."""

from __future__ import annotations

import hashlib
import math
import re
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.routines import SINCOS
from kinegen.backends.scalar_types import ScalarType
from kinegen.support.naming import c_file
from kinegen.verify.frama_c.driver import Driver, guard_driver, kernel_driver, pair_driver
from kinegen.verify.frama_c.eva import OPTIONS, PROGRAM, Outcome
from kinegen.verify.frama_c.ranges import TURNS
from tests.emit.emitted import kernels, robot

ROBOTS = ("puma560", "ur5", "scara", "panda", "thumb")
"""The robots whose kernels are proved."""

_DIGITS = 3


@dataclass(frozen=True, slots=True)
class Proof:
    """One program to be proved.

    Attributes:
        driver: The program.
        subject: What it calls, as the page names it.
    """

    driver: Driver
    subject: str


def proofs() -> tuple[Proof, ...]:
    """Everything that is proved, in the order of the page."""
    pairs = [Proof(pair_driver(real), f"{real} pair, within its range") for real in ScalarType]
    guards = [Proof(guard_driver(real), f"{real} pair, outside its range") for real in ScalarType]
    arms = [
        Proof(kernel_driver(kernels(name), real), c_file(name, "c", real)) for name in ROBOTS for real in ScalarType
    ]
    return (*arms, *pairs, *guards)


def digest(name: str, real: ScalarType) -> str:
    """A hash of a kernel file without its comments: what the proof is about."""
    text = emit_kernel(kernels(name), real)[c_file(name, "c", real)]
    bare = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
    return hashlib.sha256("\n".join(line.rstrip() for line in bare.splitlines() if line.strip()).encode()).hexdigest()[
        :16
    ]


def digests() -> dict[str, str]:
    """The hash of every kernel file that is proved, by its name."""
    return {c_file(name, "c", real): digest(name, real) for name in ROBOTS for real in ScalarType}


def digests_of(page: str) -> dict[str, str]:
    """The hashes that a page names."""
    return dict(re.findall(r"^\| `(\w+\.c)` \| `([0-9a-f]{16})` \|", page, re.M))


def page(done: Sequence[tuple[Proof, Outcome]], version: str) -> str:
    """The page.

    Args:
        done: What was proved, and what came out.
        version: Of Frama-C.

    Returns:
        Markdown.
    """
    outcomes = {proof.driver.name: outcome for proof, outcome in done}
    return "\n".join(
        [
            *_head(version),
            *_table(outcomes),
            *_pairs(),
            *_limits(),
            "## Output of Frama-C",
            "",
            "The options; pairs outside their range are analysed with `-warn-special-float none`: NaN is right there.",
            "",
            "```text",
            *_options(),
            "```",
            "",
            "Of the first kernel; every other program ends with the same lines and its own numbers, without an alarm.",
            "",
            *_words(*done[0]),
        ]
    )


def _head(version: str) -> list[str]:
    return f"""\
# Proof of no run-time errors

<!-- Written by scripts/prove_eva.py; run `make prove`. -->

Proved by Frama-C {version}, plug-in Eva, with no alarm: for every joint vector in the ranges
below, and whatever the output arrays held before, the emitted kernels

- read no uninitialised value, and read and write nothing outside an array;
- have no division, no conversion out of range and no overflow: no operation gives an infinity or a NaN;
- write finite numbers to every entry of every output.

The arithmetic is that of IEEE 754 in the type of the kernel, each operation rounded to nearest; words have 32 bits and
are little-endian. The kernel files are analysed as they are emitted. The sine-cosine pair is called through the macro
that boards use, once for each sixteenth of a quarter turn, where intervals are tight.

`make prove` repeats the proof and rewrites this page, and fails at the first alarm. Its tests analyse kernels with
deliberate errors, each of which must raise an alarm.

The ranges are the limits of the robot file. A joint without limits is assumed to turn
{_word(TURNS)} turns to either side, or to move as far as the robot is long.
""".splitlines()


def _table(outcomes: dict[str, Outcome]) -> list[str]:
    lines = [
        "",
        "## Results",
        "",
        "The ranges of the outputs that Eva found. Intervals do not know that the sine and cosine of an angle belong",
        "together, so the bounds are wider than the real ranges, more so for longer chains; they are rounded",
        "outwards. The hash is of the kernel file without its comments.",
        "",
        "| file | hash | alarms | rotation, `fk` | rotation, `frames` | position, `fk` | position, `frames` |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name in ROBOTS:
        unit = robot(name).units.length
        for real in ScalarType:
            outcome = outcomes[c_file(name, "c", real).removesuffix(".c")]
            shown = [
                _interval(outcome.shown[f"{function}_{kind}"]) + (f" {unit}" if kind == "position" else "")
                for kind in ("rotation", "position")
                for function in ("fk", "frames")
            ]
            file = c_file(name, "c", real)
            lines.append(f"| `{file}` | `{digest(name, real)}` | {outcome.alarms} | {' | '.join(shown)} |")
    return lines


def _pairs() -> list[str]:
    double, single = (f"{SINCOS[real].limit:g}" for real in (ScalarType.DOUBLE, ScalarType.FLOAT))
    return f"""
## The sine-cosine pair

Also proved, for the sine-cosine pair alone:

- for every angle up to {double} rad (double) or {single} rad (float) no operation gives an infinity or a NaN, and both
  results are finite;
- for every other angle, also infinities and NaN, both results are NaN.
""".splitlines()


def _limits() -> list[str]:
    return """
## Your own robot

`kinegen prove FILE` does the same for any robot file, where Frama-C is installed (Debian: `apt-get install
--no-install-recommends frama-c-base`). It analyses each function of the scalar C files by itself:

```sh
kinegen prove arm.yaml --real float --outputs pose,jacobian,inverse -o evidence
```

It prints for each function the number of alarms, the interval of its results, the ranges of the inputs and whether they
are limits of the file or assumed, and the command that was run. There are two claims:

- `finite`, for functions without branches (poses, positions, Jacobians, velocities): for all inputs in the ranges there
  is no run-time error, no operation gives an infinity or a NaN, and all results are finite.
- `defined`, for functions with square roots, arc tangents or selections (`inverse`, `inverse_nearest`, orientations,
  some actuators, `within_limits`, `clamp`): for any inputs, NaN and infinities included, there is no run-time error,
  and all results are set. A result may be NaN. `clamp` also gives values within the limits, or NaN; `within_limits` and
  `inverse_nearest` return 0 or 1.

`-o evidence` keeps in `evidence/NAME` the report as text and JSON, and for each function its program, the C files, the
command and all that Frama-C said, so that the analysis can be repeated without kinegen. The exit status is 0 if all
claims were shown, 1 if an alarm is left, 2 if Frama-C is not installed.

An alarm means that Eva could not exclude an error, not that there is one. The kernels in integers (`--real q30`) leave
alarms; that they do not overflow is proven by kinegen's own analysis of each kernel. Runtime parameters have the values
of the file. `numeric_inverse` and the batch kernels are not analysed.

## What is not proved here

- The results and their accuracy: every build compares with a reference, and the header states the
  error.
- Kernels at angles between the ranges above and the range of the pair; there the results of the pair are finite or
  NaN, as above.
- Calls whose arrays overlap, which the headers forbid; rounding other than to nearest; products and sums fused by a
  compiler; the compiler itself.

""".splitlines()


def _words(proof: Proof, outcome: Outcome) -> list[str]:
    return [f"{proof.subject}:", "", "```text", *outcome.summary.splitlines(), "```", ""]


def _options() -> list[str]:
    """The options, in lines."""
    words = [option if " " not in option else f"'{option}'" for option in OPTIONS]
    return textwrap.wrap(
        f"{PROGRAM} {' '.join(words)} -warn-special-float non-finite main.c",
        110,
        break_on_hyphens=False,
        break_long_words=False,
    )


def _word(number: int) -> str:
    return ("no", "one", "two", "three", "four")[number]


def _interval(bounds: Iterable[float]) -> str:
    low, high = bounds
    return f"{_outwards(low, math.floor)} to {_outwards(high, math.ceil)}"


def _outwards(value: float, rounding: object) -> str:
    """A bound with three digits, rounded away from the interval."""
    if value == 0:
        return "0"
    step = 10.0 ** (math.floor(math.log10(abs(value))) - _DIGITS + 1)
    up = math.floor if rounding is math.floor else math.ceil
    return f"{up(value / step) * step:.{_DIGITS}g}"
