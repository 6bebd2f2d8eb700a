"""What a build calls proven is proven as it is called; one alteration of each kind, of the many in tests/sabotage."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.errors import ProofError
from tests.sabotage.case import Sabotage
from tests.sabotage.workshop import attempt

BATCH = "planar_3r_batch.c"

CASES = (
    Sabotage("a layout", "planar_3r", "pose", BATCH, r"to\[entry\] = t", r"to[entry] = (last_rows != 0) ? 0 : t"),
    Sabotage("a tail", "planar_3r", "pose", BATCH, r"= from\[i \* pose\]", r"\g<0> + (count == 15)"),
    Sabotage("a stride", "planar_3r", "pose", BATCH, r"1 \* q_joint", "1 * 1", after="_fk_tile("),
    Sabotage("a guard", "planar_3r", "pose", "planar_3r.c", r"1\.7976931348623158e\+303", "1.7e+303"),
    Sabotage("a guard in NumPy", "planar_3r", "pose", "_numpy.py", "100000.0", "1000000.0"),
    Sabotage("a sine", "planar_3r", "pose", "planar_3r.c", r"0\.008333333333321919", "0.008333333333301919"),
    Sabotage("a strip", "planar_3r", "pose", "planar_3r.c", r"base_T_tool\[3\] = (\w+);",
             r"base_T_tool[3] = (q[0] > 1.0 && q[0] < 1.00001) ? 0.0 : \1;"),
    Sabotage("a limit", "puma560", "pose", "__init__.py", r"-2\.7925268", "-2.7925267"),
    Sabotage("a macro", "planar_3r", "pose", "planar_3r.h", "DOF 3", "DOF 4"),
    Sabotage("a vector", "planar_3r", "pose", "planar_3r_vectors.h", r"(\d\.\d{8})\d{4,}", r"\g<1>9",
             after="_fk_expected"),
    Sabotage("a self-test", "planar_3r", "pose", "planar_3r_selftest.c", r"return .{1,60} \? 0 : 1;", "return 0;"),
)  # fmt: skip


@pytest.mark.parametrize("case", CASES, ids=[case.name for case in CASES])
def test_an_altered_file_is_refused(case: Sabotage, tmp_path: Path) -> None:
    with pytest.raises(ProofError):
        attempt(case.setting, tmp_path, case)

    assert not any(tmp_path.iterdir())


def test_the_untouched_files_pass(tmp_path: Path) -> None:
    attempt(CASES[0].setting, tmp_path)

    assert (tmp_path / "planar_3r" / "planar_3r.c").exists()
