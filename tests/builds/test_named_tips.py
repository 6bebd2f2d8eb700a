"""Packages of trees with named tips: results by name in Python, and macros of the names in C."""

from __future__ import annotations

import pickle
import subprocess
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from kinegen.io.load import load
from kinegen.model.outputs import parse_quantity
from kinegen.runtime.compiler import find_compiler
from kinegen.runtime.extension import load_package
from kinegen.verify import reference
from tests.builds.workshop import make, set_machine
from tests.robot.test_tips import FRAMES, TIPS, TREE

OUTPUTS = ("pose", "frames", "position", "jacobian", "fk_jacobian", "twist", "pose@index_nail", "jacobian@index_nail")
Q = np.random.default_rng(5).uniform(-2, 2, (7, 4))

CALLER = """#include <stdio.h>
#include "gripper.h"

int main(void)
{
    const double q[GRIPPER_DOF] = {0.5, -0.25, 0.75, 1.0};
    double tips[GRIPPER_TIPS][3];

    gripper_position(q, tips);
    printf("%.17g %.17g %.17g\\n", tips[GRIPPER_TIP_INDEX_NAIL][0], tips[GRIPPER_TIP_INDEX_NAIL][1],
           tips[GRIPPER_TIP_INDEX_NAIL][2]);
    return 0;
}
"""


@pytest.fixture(scope="module", params=["c", "numpy"])
def gripper(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory, cache_home: Path) -> ModuleType:
    """The gripper, built and proved, with and without the extension."""
    folder = tmp_path_factory.mktemp(str(request.param))
    path = folder / "gripper.yaml"
    path.write_text(TREE + FRAMES, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        set_machine(patch, cache_home)
        quantities = tuple(map(parse_quantity, OUTPUTS))
        result = make(path, folder / "out", quantities=quantities, compile=request.param == "c")
        package = load_package(result.folder)

    assert package.backend == request.param
    return package


@pytest.mark.filterwarnings("ignore:NumPy evaluates")
def test_a_part_is_a_view_of_what_the_kernel_gives(gripper: Any) -> None:
    whole = gripper.fk(Q)
    parts = gripper.fk.by_name(Q)

    assert tuple(parts) == TIPS == gripper.TIPS == gripper.fk.names
    assert len(parts) == 4
    for place, tip in enumerate(TIPS):
        assert (parts[tip] == whole[:, place]).all()
        assert parts[tip].base is not None
        assert np.shares_memory(parts[tip], parts.result)


def test_a_part_is_what_a_kernel_of_its_frame_gives(gripper: Any) -> None:
    for found, alone in (
        (gripper.fk.by_name(Q), gripper.fk_index_nail(Q)),
        (gripper.jacobian.by_name(Q), gripper.jacobian_index_nail(Q)),
        (gripper.fk.by_name(Q[0]), gripper.fk_index_nail(Q[0])),
        (gripper.fk.by_name(Q[:0]), gripper.fk_index_nail(Q[:0])),
    ):
        np.testing.assert_allclose(found["index_nail"], alone, rtol=0, atol=1e-12)
    pose, jacobian = gripper.fk_jacobian.by_name(Q)["index_nail"]
    np.testing.assert_allclose(pose, gripper.fk_index_nail(Q), rtol=0, atol=1e-12)
    np.testing.assert_allclose(jacobian, gripper.jacobian_index_nail(Q), rtol=0, atol=1e-12)
    moved = np.einsum("...ij,...j->...i", jacobian, Q)
    np.testing.assert_allclose(gripper.twist.by_name(Q, Q)["index_nail"], moved, rtol=0, atol=1e-12)
    single = gripper.fk.by_name(Q.astype(np.float32))["index_nail"]
    assert single.dtype == np.float32
    assert np.array_equal(gripper.fk.by_name(Q, threads=2)["index_nail"], gripper.fk.by_name(Q)["index_nail"])


def test_parts_agree_with_the_reference(gripper: Any, tmp_path: Path) -> None:
    path = tmp_path / "gripper.yaml"
    path.write_text(TREE + FRAMES, encoding="utf-8")
    known = reference.frames(load(path), Q)

    assert gripper.frames.names == gripper.FRAMES
    for frame, pose in gripper.frames.by_name(Q).items():
        np.testing.assert_allclose(pose, known[frame], rtol=0, atol=1e-11)
    for tip, point in gripper.position.by_name(Q).items():
        np.testing.assert_allclose(point, known[tip][:, :3, 3], rtol=0, atol=1e-11)


@pytest.mark.parametrize("layout", ["3x4", "joint_major"])
def test_parts_in_other_layouts(gripper: Any, layout: str) -> None:
    q = Q.T.copy() if layout == "joint_major" else Q
    found = gripper.fk.by_name(q, layout=layout)["index_nail"]
    alone = gripper.fk_index_nail(q, layout=layout)

    assert found.shape == alone.shape
    np.testing.assert_allclose(found, alone, rtol=0, atol=1e-12)


def test_an_array_that_is_bound_has_parts_by_name(gripper: Any) -> None:
    """Views are made once; each call of the bound kernel fills them."""
    q, out = np.zeros(4), np.empty((4, 4, 4))
    step, parts = gripper.fk.bind(q, out), gripper.fk.named(out)
    nail = parts["index_nail"]
    q[:] = Q[3]
    step()

    assert parts.result is out
    assert np.array_equal(nail, gripper.fk.by_name(Q[3])["index_nail"])
    poses = np.empty((7, 4, 4, 4))
    assert gripper.fk.by_name(Q, out=poses).result is poses


def test_what_has_no_parts_is_refused(gripper: Any) -> None:
    assert not hasattr(gripper.fk_index_nail, "by_name")
    with pytest.raises(KeyError, match=r"there is no tip 'nail' \(there are knuckle, index_pad, index_nail, thumb\)"):
        gripper.fk.by_name(Q)["nail"]
    with pytest.raises(KeyError, match="there is no frame 'nail'"):
        gripper.frames.by_name(Q)["nail"]
    with pytest.raises(TypeError):
        gripper.fk.by_name(Q)["thumb"] = 0
    with pytest.raises(ValueError, match=r"base_T_tips has shape \(7, 4\), expected \(..., 4, 4, 4\)"):
        gripper.fk.named(Q)
    with pytest.raises(TypeError, match="base_T_tips is a list, expected a NumPy array"):
        gripper.fk.named([1.0])
    with pytest.raises(TypeError, match="the result is not a tuple of 2 arrays"):
        gripper.fk_jacobian.named(gripper.fk(Q))
    with pytest.raises(ValueError, match="no layout 'rows'"):
        gripper.fk.named(gripper.fk(Q), layout="rows")
    with pytest.raises(ValueError, match="q has shape"):
        gripper.fk.by_name(Q[:, :3])


def test_parts_can_be_pickled_and_told(gripper: Any) -> None:
    parts = gripper.fk.by_name(Q)
    again = pickle.loads(pickle.dumps(parts))  # noqa: S301 - our own

    assert repr(parts) == "<results of 4 tips: knuckle, index_pad, index_nail, thumb>"
    assert np.array_equal(again["thumb"], parts["thumb"])
    assert pickle.loads(pickle.dumps(gripper.fk)) is gripper.fk  # noqa: S301 - our own


def test_c_code_finds_a_tip_by_its_macro(gripper: Any, tmp_path: Path) -> None:
    folder = Path(gripper.__file__).parent
    for name in ("gripper.h", "gripper.c"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    (tmp_path / "caller.c").write_text(CALLER, encoding="utf-8")
    find_compiler().run(tmp_path, ("-std=c99", "caller.c", "gripper.c", "-o", "caller"), "caller.c")
    done = subprocess.run([tmp_path / "caller"], capture_output=True, text=True, check=True)

    expected = gripper.position.by_name(np.array([0.5, -0.25, 0.75, 1.0]))["index_nail"]
    np.testing.assert_allclose([float(word) for word in done.stdout.split()], expected, rtol=0, atol=1e-12)
    assert " *   GRIPPER_TIP_INDEX_NAIL  2  index_nail  on index_2\n" in (folder / "gripper.h").read_text("utf-8")
