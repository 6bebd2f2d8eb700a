"""In a batch kernel everything is part of the loop over configurations, however many kernels one file has.

gcc stops to inline where a file has grown by 40 percent. A loop with a call left in it does not become vector code: it
is five to nine times slower, and contracts other products than the loops that do.
"""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from kinegen.backends.c.batch import emit_batch
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.scalar_types import ScalarType
from kinegen.model.outputs import parse_quantity
from tests.emit.emitted import kernels

CC = shutil.which("gcc") or ""
OUTPUTS = (
    "fk_jacobian,fk_jacobian_local,fk_jacobian_world,jacobian,jacobian_world,hessian,acceleration,acceleration_world,"
    "bias_acceleration_world,quaternion_wxyz_jacobian,rpy_zyx_jacobian,rpy_xyz_jacobian,euler_zyz_jacobian,"
    "axis_angle_jacobian,frames,pose,inverse"
)


@pytest.mark.skipif(not CC or not shutil.which("nm"), reason="takes gcc and nm")
def test_large_files_keep_no_call_in_a_loop(tmp_path: Path) -> None:
    quantities = tuple(map(parse_quantity, OUTPUTS.split(",")))
    arm = kernels("puma560", quantities)
    for name, text in (emit_kernel(arm, ScalarType.DOUBLE) | emit_batch(arm, ScalarType.DOUBLE)).items():
        (tmp_path / name).write_text(text, encoding="utf-8")

    compile_ = [CC, "-std=c99", "-O3", "-ffp-contract=fast", "-c", "puma560_batch.c", "-o", "batch.o"]
    subprocess.run(compile_, cwd=tmp_path, check=True)
    listed = subprocess.run(["nm", "batch.o"], cwd=tmp_path, check=True, capture_output=True, text=True).stdout

    private = {line.split()[-1] for line in listed.splitlines() if line.split()[-2] == "t"}
    assert not {name for name in private if name.endswith(("_sincos", "_sqrt", "_atan2", "_select_lt"))}
