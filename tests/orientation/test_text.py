"""What headers and messages say of orientations."""

from __future__ import annotations

import pytest

from kinegen.backends.descriptions import brief, result_text
from kinegen.derive.orientation import FORMS, JACOBIANS, derive_orientation
from kinegen.errors import KinegenError
from kinegen.io.load import load
from kinegen.model.outputs import Kind, Quantity, Signature, parse_quantity


@pytest.mark.parametrize(
    ("word", "names"),
    [
        ("rpy", "rpy_zyx, rpy_xyz, rpy_zyx_jacobian, rpy_xyz_jacobian"),
        ("euler", "euler_zyz, euler_zyz_jacobian"),
        ("quaternion", "quaternion_wxyz, quaternion_xyzw, quaternion_wxyz_jacobian, quaternion_xyzw_jacobian"),
    ],
)
def test_an_orientation_without_its_order_is_refused_with_the_list(word: str, names: str) -> None:
    with pytest.raises(KinegenError) as caught:
        parse_quantity(word)

    assert caught.value.message == f"unknown output '{word}' (expected {names})"


@pytest.mark.parametrize("kind", [*FORMS, *JACOBIANS])
def test_the_text_of_an_output_says_its_order(kind: Kind) -> None:
    text = brief(Signature(Quantity(kind), ("tool",), 6, (), ()))

    if "quaternion" in kind:
        assert ("w, x, y, z" if "wxyz" in kind else "x, y, z, w") in text
    elif "rpy" in kind or "euler" in kind:
        assert any(product in text for product in ("Rz(", "Rx(", "Rz Ry Rx", "Rx Ry Rz", "zyz"))


@pytest.mark.parametrize("kind", FORMS)
def test_headers_name_the_numbers(kind: Kind) -> None:
    signature = derive_orientation(load("robots/scara.yaml"), Quantity(kind)).signature

    assert "numbers" not in result_text(signature.results[0])
