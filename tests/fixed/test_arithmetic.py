"""The products, roundings and sines that all integer kernels share."""

from __future__ import annotations

import os
import random
import re
from pathlib import Path
from types import SimpleNamespace

import pytest

from kinegen.backends.fixed_point.files import Scaling
from kinegen.backends.templates import environment
from kinegen.ir.fixed_point.program import LARGEST, LARGEST_FACTOR, PAIR_ERROR, SINE_ERROR
from tests.fixed.kernels import COMPILERS, UNDEFINED, run
from tests.fixed.machine import load

HERE = Path(__file__).resolve().parent
STEP = "1" if "KINEGEN_EVERY_ANGLE" in os.environ else "61"
"""Every angle takes a quarter of a minute, this many a moment."""


def arithmetic(**wanted: int) -> str:
    """The arithmetic by itself, as C text: products, or just what is wanted with some shift."""
    usual = {"shifts": (), "rounds": (), "parts": (), "multiplies": not wanted}
    scalings = {name: (Scaling(shift, shift - 1, 2**shift, 2**shift // 2),) for name, shift in wanted.items()}
    context = SimpleNamespace(**usual | scalings)
    template = environment().get_template("fixed_point/_arithmetic.c.jinja")
    return "#include <stdint.h>\n" + template.render(k=context, prefix="robot_q30")


def sincos() -> str:
    """The pair with the arithmetic that it needs."""
    context = SimpleNamespace(multiplies=True, sincos_macro="KINEGEN_ROBOT_Q30_SINCOS")
    return arithmetic() + environment().get_template("fixed_point/_sincos.c.jinja").render(
        k=context, prefix="robot_q30"
    )


@pytest.mark.skipif(not COMPILERS, reason="needs gcc or clang")
@pytest.mark.parametrize("compiler", COMPILERS)
def test_both_ways_to_multiply_give_the_defined_product(compiler: str, tmp_path: Path) -> None:
    """The names of both ways are told apart by macros; the sanitizer sees to overflow."""
    ways = re.findall(r"^#if defined\(KINEGEN.*?$(.*?)^#else$(.*?)^#endif$", sincos(), re.MULTILINE | re.DOTALL)
    for place, name in enumerate(("halves", "whole")):
        (tmp_path / f"{name}.c").write_text("".join(way[place] for way in ways), encoding="utf-8")
    limits = [f"-DLARGEST={LARGEST}", f"-DLARGEST_FACTOR={LARGEST_FACTOR}"]
    flags = ["-std=c99", "-O1", *UNDEFINED[compiler], *limits, "-I", tmp_path]
    run([compiler, *flags, HERE / "products.c", "-o", tmp_path / "products"])

    assert run([tmp_path / "products"]) == "0\n"


@pytest.mark.skipif(not COMPILERS, reason="needs gcc or clang")
def test_the_errors_of_sine_and_cosine_are_what_the_bounds_assume(tmp_path: Path) -> None:
    (tmp_path / "kernels.c").write_text(sincos(), encoding="utf-8")
    flags = ("-std=c99", "-O3", "-DSINCOS=robot_q30_sincos", "-I", tmp_path)
    run([COMPILERS[0], *flags, HERE / "every_angle.c", "-lm", "-o", tmp_path / "every_angle"])
    worst, both, wrong = run([tmp_path / "every_angle", STEP]).split()

    assert wrong == "0"
    assert 0.9 < float(worst) < SINE_ERROR
    assert 1.1 < float(both) < PAIR_ERROR


@pytest.mark.parametrize("split", [False, True])
def test_special_angles_are_exact(split: bool) -> None:
    machine = load(sincos(), split=split)
    found = []
    for eighth in range(8):
        results = machine.call("robot_q30_sincos", [(eighth << 29, "uint32_t")])
        found.append((results["s"][0], results["c"][0]))

    one, half = 2**30, 759250125
    assert found[::2] == [(0, one), (one, 0), (0, -one), (-one, 0)]
    assert all(abs(abs(entry) - half) <= 1 for pair in found[1::2] for entry in pair)


@pytest.mark.parametrize("shift", [1, 2, 7, 20, 30])
def test_roundings_halve_upwards(shift: int) -> None:
    machine = load(arithmetic(rounds=shift), split=False)
    source = random.Random(shift)
    for value in (-(2**31), 2**31 - 1, 0, -1, 1, *(source.randrange(-(2**31), 2**31) for _ in range(100))):
        found = machine.call(f"robot_q30_round{shift}", [(value, "int32_t")])["return"][0]
        assert found == (value + (1 << (shift - 1))) >> shift


@pytest.mark.parametrize("shift", [0, 1, 29])
def test_coarser_literals_have_products_of_their_own(shift: int) -> None:
    machine = load(arithmetic(shifts=shift), split=False)
    source = random.Random(shift)
    for _ in range(100):
        a, b = source.randrange(-(2**31), 2**31), source.randrange(-(2 ** (shift // 2)), 2 ** (shift // 2) + 1)
        found = machine.call(f"robot_q30_mul{shift}", [(a, "int32_t"), (b, "int32_t")])["return"][0]
        half = 1 << (shift - 1) if shift else 0
        assert found == (a * b + half) >> shift


@pytest.mark.parametrize("shift", [0, 30])
def test_parts_of_angles_wrap(shift: int) -> None:
    machine = load(arithmetic(parts=shift), split=False)
    source = random.Random(shift)
    for angle in (-(2**31), 2**31 - 1, -1, *(source.randrange(-(2**31), 2**31) for _ in range(50))):
        for factor in (715827883, -1789569707, 2**31 - 1, 1):
            found = machine.call(f"robot_q30_part{shift}", [(angle, "int32_t"), (factor, "int32_t")])["return"][0]
            half = 1 << (shift - 1) if shift else 0
            assert found == ((angle * factor + half) >> shift) % 2**32
