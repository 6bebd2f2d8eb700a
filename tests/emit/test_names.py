"""Names that several outputs, inputs or arrays of one robot could share."""

from __future__ import annotations

import re

import pytest

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.batch import emit_batch
from kinegen.backends.scalar_types import ScalarType
from kinegen.derive.dispatch import derive
from kinegen.errors import KinegenError
from kinegen.io.load import loads
from kinegen.ir.lower import lower
from kinegen.model.outputs import Quantity, parse_quantity

ARM = loads(
    """
kinegen: 1
name: arm
convention: standard
units: {length: m, angle: deg}
joints:
  - {name: one, theta: q, d: 0, a: 1, alpha: 0}
  - {name: two, theta: q, d: 0, a: 1, alpha: 0}
frames:
  jacobian: {parent: one}
  batch: {parent: one}
  run: {parent: one}
  forms: {parent: one}
  local_elbow: {parent: one}
  elbow: {parent: two}
""",
    "arm.yaml",
)


def kernels(*outputs: str) -> RobotPrograms:
    quantities = [parse_quantity(text) for text in outputs]
    return RobotPrograms(ARM, tuple(lower(derive(ARM, quantity)) for quantity in quantities), ())


@pytest.mark.parametrize(
    ("outputs", "name"),
    [
        (("fk_jacobian", "pose@jacobian"), "fk_jacobian"),
        (("jacobian_local@elbow", "jacobian@local_elbow"), "jacobian_local_elbow"),
        (("pose", "pose@batch"), "fk_batch"),
        (("pose", "pose@run"), "fk_run"),
        (("pose", "pose@forms"), "fk_forms"),
    ],
)
def test_outputs_whose_functions_would_share_a_name_are_refused(outputs: tuple[str, ...], name: str) -> None:
    words = f"arm.yaml: outputs '{outputs[0]}' and '{outputs[1]}' would both be called {name}; build them separately"

    with pytest.raises(KinegenError, match=re.escape(words)) as caught:
        kernels(*outputs)

    assert "\n" not in str(caught.value)
    for output in outputs:
        kernels(output)


def test_a_pose_and_a_vector_of_as_many_numbers_are_read_by_functions_of_their_own() -> None:
    """A pose has 12 numbers that are read, in places for 16; joint vectors of 12 and 16 are read otherwise."""
    for dof in (12, 16):
        rows = "".join(f"  - {{name: j{place}, theta: 0, d: q, a: 0, alpha: 0}}\n" for place in range(dof))
        text = f"kinegen: 1\nname: worm\nconvention: standard\nunits: {{length: m, angle: deg}}\njoints:\n{rows}"
        robot = loads(text, "worm.yaml")
        quantities = (Quantity.POSITION, parse_quantity("inverse_pose"))
        found = RobotPrograms(robot, tuple(lower(derive(robot, quantity)) for quantity in quantities), ())
        batch = emit_batch(found, ScalarType.DOUBLE)["worm_batch.c"]

        finders = re.findall(r"^static inline tile_input (\w+)\(", batch, re.MULTILINE)

        assert set(finders) == {f"find_tile_{dof}", "find_tile_12_of_16"}
        assert len(finders) == 2
