"""What the NumPy form may hold besides sums and products: nothing that asks about data, wherever it stands."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.backends.c.batch import emit_batch
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.python.formula import emit_formula
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import lower_file
from kinegen.errors import ProofError
from kinegen.model.outputs import Quantity
from kinegen.verify.source_checks import require_straight

KERNELS = lower_file(Path(__file__).parents[2] / "robots" / "puma560.yaml", (Quantity.POSE,))
FILES = {
    **emit_kernel(KERNELS, ScalarType.DOUBLE),
    **emit_batch(KERNELS, ScalarType.DOUBLE),
    **emit_formula(KERNELS),
}
SUM = "    t0 = "


def require(form: str) -> None:
    require_straight(KERNELS.robot, {**FILES, "_numpy.py": form}, (Quantity.POSE,), ("double",))


def test_the_form_that_is_emitted_is_straight() -> None:
    assert FILES["_numpy.py"].count(SUM) == 1
    require(FILES["_numpy.py"])


@pytest.mark.parametrize(
    "crooked",
    [
        "if q[0] > 1.0:\n        t0 = 0.5\n",
        "for t0 in q:\n        t0 = t0 * 0.5\n",
        "t0 = q[0] if q[1] > 1.0 else q[2]\n",
        "t0 = q[0] ** 2\n",
        "t0 = q[0] // 0.5\n",
        "t0 = abs(q[0])\n",
        "t0 = q[int(q[1])] * 0.5\n",
        "t0 = q[0 if q[1] else 2] * 0.5\n",
        "t0 = q[q[1] % 2] * 0.5\n",
        "t0 = q[0] * 0.5; t0 = q[0] % 0.5\n",
        "t0 = [q[0] * 0.5 for _ in q]\n",
        "t0 = q[0] > 1.0 and q[1]\n",
    ],
)
@pytest.mark.parametrize("before", ["", "t9 = q[0] * 0.5\n    "])
def test_another_statement_is_named(before: str, crooked: str) -> None:
    form = FILES["_numpy.py"].replace(SUM, f"    {before}{crooked}{SUM}", 1)

    with pytest.raises(ProofError, match=r"_numpy\.py: fk is not straight: "):
        require(form)
