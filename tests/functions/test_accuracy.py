"""The emitted square roots are correctly rounded, arc tangents as accurate as headers say, or NaN as they say."""

from __future__ import annotations

import math
from collections.abc import Iterator

import mpmath
import numpy as np
import pytest
from numpy.typing import NDArray

from kinegen.backends.scalar_types import ScalarType
from tests.functions.library import COMPILERS, DTYPES, Functions, compile_functions

CONTRACTION = ("off", "fast")
SEED = 1414213562
BITS = 160
DIGITS = 53
"""Of the mantissa of a double."""

ANGLE_ULPS = 1.6
"""What the double template promises. The dearest angles stand just below 1/2, where half a unit of t counts double; 20
million random ones stayed below 1.49."""

ANGLE_ERROR = 1.7e-7
"""What the float template promises; the spacing of floats at pi is 2.4e-7."""

pytestmark = pytest.mark.skipif(not COMPILERS, reason="needs gcc or clang")

Doubles = NDArray[np.float64]


@pytest.fixture(scope="module", params=[(c, f) for c in COMPILERS for f in CONTRACTION], ids="-".join)
def doubles(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Functions:
    """The functions for doubles, with and without contraction."""
    return _compiled(ScalarType.DOUBLE, *request.param, tmp_path_factory)


@pytest.fixture(scope="module", params=[(c, f) for c in COMPILERS for f in CONTRACTION], ids="-".join)
def floats(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Functions:
    """The functions for floats, with and without contraction."""
    return _compiled(ScalarType.FLOAT, *request.param, tmp_path_factory)


@pytest.fixture(scope="module", params=[(c, r) for c in COMPILERS for r in ScalarType], ids="-".join)
def functions(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Functions:
    """The functions for both number types from every compiler."""
    compiler, real = request.param
    return _compiled(ScalarType(real), compiler, "off", tmp_path_factory)


def _compiled(real: ScalarType, compiler: str, contraction: str, folders: pytest.TempPathFactory) -> Functions:
    flags = ("-O2", "-march=native", f"-ffp-contract={contraction}")
    return compile_functions(folders.mktemp("functions"), real, compiler, *flags)


# Square roots ---------------------------------------------------------------------------------------------------------


def random_doubles(count: int) -> Doubles:
    """Positive doubles of all sizes, every eighth of them subnormal."""
    bits = np.random.default_rng(SEED).integers(1, 0x7FF0_0000_0000_0000, count)
    bits[::8] &= 0x000F_FFFF_FFFF_FFFF
    return bits.view(np.float64)


def roots_near_midpoints(largest: int) -> Iterator[float]:
    """All doubles, up to powers of four, whose roots lie next to the middle between two doubles.

    Let the root be next to S + 1/2, S having 53 bits. The number is then S^2 + S - c for a small whole number c, and
    has at least 52 zeros at its end, or it would be no double: S^2 + S = c modulo 2^52 or 2^53. For every even c that
    has two solutions, which Newton's method finds digit by digit. The distance of the root from the middle is about
    |c + 1/4| / 2^54 units in the last place.

    Args:
        largest: Of |c|.
    """
    for c in range(-largest, largest + 1, 2):
        for zeros in (DIGITS - 1, DIGITS):
            modulus = 1 << zeros
            for first in (0, 1):
                solution = first
                for _ in range(7):
                    slope = pow(2 * solution + 1, -1, modulus)
                    solution = (solution - (solution * solution + solution - c) * slope) % modulus
                for root in range(solution, 1 << DIGITS, modulus):
                    square = root * root + root - c
                    size = square.bit_length()
                    if root >> (DIGITS - 1) and size >= 2 * DIGITS - 1 and square % (1 << size - DIGITS) == 0:
                        yield float(square)


def test_random_roots_of_doubles_are_correctly_rounded(doubles: Functions) -> None:
    """NumPy asks the processor, which rounds correctly."""
    numbers = random_doubles(1_000_000)

    np.testing.assert_array_equal(doubles.sqrt(numbers), np.sqrt(numbers))


def test_roots_of_doubles_next_to_a_midpoint_are_correctly_rounded(doubles: Functions) -> None:
    """Everything nearer than 2^-44 units in the last place; the error before the last rounding is below 2^-48."""
    numbers = np.array(list(roots_near_midpoints(1024)))

    assert len(numbers) > 2000
    np.testing.assert_array_equal(doubles.sqrt(numbers), np.sqrt(numbers))


def test_every_root_of_a_float_is_correctly_rounded(floats: Functions) -> None:
    """All mantissas, with exponents of both kinds; then other exponents, and subnormal numbers."""
    numbers = np.arange(0x3F80_0000, 0x4080_0000, dtype=np.uint32).view(np.float32)
    some = np.random.default_rng(SEED).integers(1, 0x7F80_0000, 1_000_000, dtype=np.uint32)
    some[::8] &= 0x007F_FFFF
    for tried in (numbers, some.view(np.float32)):
        assert (floats.sqrt(tried) == np.sqrt(tried)).all()


def test_roots_of_what_is_no_positive_number(functions: Functions) -> None:
    kind = np.finfo(DTYPES[functions.real])
    zeros = functions.sqrt(np.array([0.0, -0.0]))
    tiny = float(kind.smallest_subnormal)

    assert zeros.tolist() == [0.0, 0.0]
    assert functions.sqrt(np.array([math.inf]))[0] == math.inf
    assert functions.sqrt(np.array([kind.max]))[0] == np.sqrt(kind.max)
    assert np.isnan(functions.sqrt(np.array([math.nan, -math.inf, -1.0, -tiny, kind.min]))).all()


# Angles of points -----------------------------------------------------------------------------------------------------


def worst_ulps(functions: Functions, y: Doubles, x: Doubles) -> float:
    """The largest error in units in the last place of the true angle."""
    worst = 0.0
    with mpmath.workprec(BITS):
        for a, b, found in zip(y.tolist(), x.tolist(), functions.atan2(y, x).tolist(), strict=True):
            true = mpmath.atan2(a, b)
            worst = max(worst, float(abs(true - found)) / math.ulp(float(true)))
    return worst


@pytest.mark.parametrize("reach", [math.pi, 0.51, 1e-3])
def test_random_angles_of_doubles_are_within_the_bound(doubles: Functions, reach: float) -> None:
    random = np.random.default_rng(SEED)
    angles, radii = random.uniform(-reach, reach, 5000), np.exp(random.uniform(-600, 600, 5000))

    assert worst_ulps(doubles, radii * np.sin(angles), radii * np.cos(angles)) < ANGLE_ULPS


def test_angles_of_doubles_where_the_formula_changes_are_within_the_bound(doubles: Functions) -> None:
    random = np.random.default_rng(SEED)
    slopes = np.repeat([0.5, 0.5463, 1.0, 1 / 0.5463], 2000) * (1 + random.uniform(-1e-2, 1e-2, 8000))
    x = random.uniform(1.0, 2.0, 8000)

    assert worst_ulps(doubles, x * slopes, x) < ANGLE_ULPS
    assert worst_ulps(doubles, -x * slopes, -x) < ANGLE_ULPS


def test_angles_of_floats_are_within_the_bound(floats: Functions) -> None:
    """A dense grid of directions, at random distances; NumPy's doubles are exact enough to compare with."""
    random = np.random.default_rng(SEED)
    angles = np.linspace(-math.pi, math.pi, 2_000_001)
    radii = np.exp(random.uniform(-60, 60, angles.size))
    y, x = (np.float32(radii * part) for part in (np.sin(angles), np.cos(angles)))
    true = np.arctan2(y.astype(float), x.astype(float))
    errors = np.abs(floats.atan2(y, x) - true)

    assert 1.5e-7 < errors.max() < ANGLE_ERROR
    assert errors[np.abs(true) < math.pi / 4].max() < 6e-8
    assert (errors / np.spacing(np.abs(true).astype(np.float32))).max() < 2.1


def test_angles_of_axes_and_diagonals(functions: Functions) -> None:
    y = np.array([0, 1, 0, -1, 1, 1, -1, -1, 5, -0.0, -0.0])
    x = np.array([1, 0, -1, 0, 1, -1, -1, 1, -0.0, -1, 3])
    quarters = np.array([0, 2, 4, -2, 1, 3, -3, -1, 2, 4, 0])

    np.testing.assert_array_equal(functions.atan2(y, x), (quarters * (math.pi / 4)).astype(DTYPES[functions.real]))


def test_the_angle_of_the_origin_is_zero_whatever_the_signs_of_its_zeros(functions: Functions) -> None:
    zeros = np.array([0.0, -0.0])

    assert functions.atan2(zeros[:, None], zeros).tolist() == [[0.0, 0.0], [0.0, 0.0]]


def test_mirrored_points_have_mirrored_angles(functions: Functions) -> None:
    random = np.random.default_rng(SEED)
    y, x = random.normal(size=(2, 100_000))

    np.testing.assert_array_equal(functions.atan2(-y, x), -functions.atan2(y, x))
    assert np.abs(functions.atan2(y, x)).max() <= DTYPES[functions.real](math.pi)


def test_points_that_are_none_have_no_angle(functions: Functions) -> None:
    bad, good = np.array([math.nan, math.inf, -math.inf]), np.array([0.0, -1.0, 2.0, 1e30, math.inf, math.nan])

    assert np.isnan(functions.atan2(bad[:, None], good)).all()
    assert np.isnan(functions.atan2(good, bad[:, None])).all()


def test_small_and_large_points_have_their_angles(functions: Functions) -> None:
    """As far as the template says, and no nonsense beyond."""
    low, high = (1e-290, 8e307) if functions.real is ScalarType.DOUBLE else (1e-30, 1e38)
    for size in (low, high):
        found = functions.atan2(np.array([size, size / 4]), np.array([size, size]))
        np.testing.assert_allclose(found, [math.pi / 4, math.atan(0.25)], rtol=4 * np.finfo(found.dtype).eps)
    tiny = np.finfo(DTYPES[functions.real]).smallest_subnormal

    assert 0.0 <= functions.atan2(np.array([tiny]), np.array([tiny]))[0] < 0.8


def test_one_bad_number_spoils_no_other(functions: Functions) -> None:
    """The loops are vector code; a NaN must stay in its own lane."""
    numbers = np.linspace(0.1, 3, 64)
    spoilt = numbers.copy()
    spoilt[17] = math.nan
    for function in (functions.sqrt, lambda x: functions.atan2(x, np.cos(numbers))):
        np.testing.assert_array_equal(np.delete(function(numbers), 17), np.delete(function(spoilt), 17))


def test_selections_compare_as_c_does(functions: Functions) -> None:
    a = np.array([1.0, 2.0, 3.0, -0.0, math.inf, -math.inf, 1.0])
    b = np.array([2.0, 1.0, 3.0, 0.0, 1.0, 1.0, math.nan])

    assert functions.larger(a, b).tolist() == [2.0, 2.0, 3.0, 0.0, math.inf, 1.0, 1.0]
