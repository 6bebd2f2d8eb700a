"""The emitted sine-cosine pairs are as accurate as their headers say, and NaN where they say nothing."""

from __future__ import annotations

import math
from pathlib import Path

import mpmath
import numpy as np
import pytest
from numpy.typing import NDArray

from kinegen.backends.routines import SINCOS
from kinegen.backends.scalar_types import ScalarType
from tests.sincos.library import COMPILERS, DTYPES, Pairs, compile_pairs, run, source

HERE = Path(__file__).resolve().parent
CONTRACTION = ("off", "fast")
ULPS = 0.85
"""What the double template promises. The dearest angles stand near odd multiples of pi/4, where both results are
just above a half and a rounding counts fullest; 40 million random ones there stayed below 0.81."""
SEED = 3141592653
BITS = 160

pytestmark = pytest.mark.skipif(not COMPILERS, reason="needs gcc or clang")


@pytest.fixture(scope="module", params=[(c, f) for c in COMPILERS for f in CONTRACTION], ids="-".join)
def doubles(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Pairs:
    """The double pair, with and without contraction."""
    compiler, contraction = request.param
    flags = ("-O2", "-march=native", f"-ffp-contract={contraction}")
    return compile_pairs(tmp_path_factory.mktemp("doubles"), ScalarType.DOUBLE, compiler, *flags)


@pytest.fixture(scope="module", params=[(c, r) for c in COMPILERS for r in ScalarType], ids="-".join)
def pairs(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Pairs:
    """The pairs of both number types from every compiler."""
    compiler, real = request.param
    return compile_pairs(tmp_path_factory.mktemp("pairs"), ScalarType(real), compiler, "-O2", "-ffp-contract=off")


def worst_ulps(pairs: Pairs, angles: NDArray[np.float64]) -> float:
    """The largest error of either result in units in the last place of the true value."""
    worst = 0.0
    with mpmath.workprec(BITS):
        for x, *results in zip(angles.tolist(), *(results.tolist() for results in pairs(angles)), strict=True):
            true = mpmath.cos_sin(mpmath.mpf(x))[::-1]
            for result, value in zip(results, true, strict=True):
                worst = max(worst, float(abs(value - result)) / math.ulp(float(value)))
    return worst


def test_doubles_next_to_multiples_of_half_pi_are_within_the_bound(doubles: Pairs) -> None:
    """All multiples in range: there the small result consists of what the reduction leaves, and of nothing else."""
    with mpmath.workprec(BITS):
        nearest = np.array([float(k * mpmath.pi / 2) for k in range(1, 63663)])
    angles = nearest[nearest <= SINCOS[ScalarType.DOUBLE].limit]

    assert len(angles) == 63661
    assert worst_ulps(doubles, angles) < ULPS


@pytest.mark.parametrize("reach", [0.79, 2 * math.pi, 1e5])
def test_random_doubles_are_within_the_bound(doubles: Pairs, reach: float) -> None:
    angles = np.random.default_rng(SEED).uniform(-reach, reach, 10_000)

    assert worst_ulps(doubles, angles) < ULPS


def test_doubles_near_odd_multiples_of_a_quarter_pi_are_within_the_bound(doubles: Pairs) -> None:
    random = np.random.default_rng(SEED)
    odd = 2 * random.integers(0, 63660, 20_000) + 1

    assert worst_ulps(doubles, odd * (math.pi / 4) + random.uniform(-0.035, 0.02, odd.size)) < ULPS


@pytest.mark.parametrize("contraction", CONTRACTION)
@pytest.mark.parametrize("step", [61, pytest.param(1, marks=pytest.mark.long)])
def test_every_float_is_within_the_bound(tmp_path: Path, contraction: str, step: int) -> None:
    """All floats of both signs, but for tiny ones in steps: error, symmetry, and no result above one."""
    both = source(ScalarType.DOUBLE) + source(ScalarType.FLOAT, prefix="kg_f32")
    (tmp_path / "sincos.h").write_text(both, encoding="utf-8")
    flags = ("-std=c99", "-O3", "-march=native", f"-ffp-contract={contraction}", "-I", tmp_path)
    run([COMPILERS[0], *flags, HERE / "every_float.c", "-o", tmp_path / "every_float"])
    worst, wrong = run([tmp_path / "every_float", str(step)]).split()

    assert wrong == "0"
    assert 5e-8 < float(worst) < SINCOS[ScalarType.FLOAT].absolute_error


def test_the_promise_holds_up_to_the_limit_and_ends_there(pairs: Pairs) -> None:
    limit = DTYPES[pairs.real](SINCOS[pairs.real].limit)
    beyond = np.nextafter(limit, np.inf, dtype=limit.dtype)
    sines, cosines = pairs(np.array([limit, -limit]))

    assert sines == pytest.approx([math.sin(limit), -math.sin(limit)], abs=6e-8)
    assert cosines == pytest.approx([math.cos(limit)] * 2, abs=6e-8)
    assert np.isnan(pairs(np.array([beyond, -beyond]))).all()


def test_what_is_no_angle_in_range_gives_nan(pairs: Pairs) -> None:
    largest = float(np.finfo(DTYPES[pairs.real]).max)
    powers = [sign * 2.0**power for power in range(17, int(math.log2(largest))) for sign in (1, -1)]
    angles = np.array([math.nan, math.inf, -math.inf, largest, -largest, *powers])

    assert np.isnan(pairs(angles)).all()


def test_tiny_angles_are_their_own_sines(pairs: Pairs) -> None:
    kind = np.finfo(DTYPES[pairs.real])
    angles = np.array([0.0, kind.smallest_subnormal, kind.tiny, 1e-30, -1e-30], dtype=kind.dtype)
    sines, cosines = pairs(angles)

    assert sines.tolist() == angles.tolist()
    assert (cosines == 1.0).all()


def test_one_bad_angle_spoils_no_other(pairs: Pairs) -> None:
    """The loop is vector code; a NaN must stay in its own lane."""
    angles = np.linspace(-3, 3, 64)
    spoilt = angles.copy()
    spoilt[17] = math.inf

    np.testing.assert_array_equal(np.delete(pairs(angles), 17, axis=1), np.delete(pairs(spoilt), 17, axis=1))
