"""Axes that are nearly parallel: a table has far lengths there, which is reported, and refused where it is useless."""

from __future__ import annotations

import pytest

from kinegen.errors import KinegenError
from kinegen.io.load import loads
from kinegen.model.dh_conversion import to_convention
from kinegen.model.robot import Convention, Robot

TABLES = (Convention.STANDARD, Convention.MODIFIED)


def bent(angle: str, length: str = "0.5", unit: str = "m") -> Robot:
    """Two joints whose axes are an angle apart, side by side."""
    return loads(
        f"""
kinegen: 1
name: bent
convention: standard
units: {{length: {unit}, angle: rad}}
joints:
  - {{name: first, type: revolute, ets: [Rz(q)]}}
  - {{name: second, type: revolute, ets: [Tx({length}), Ty({length}), Ry({angle}), Rz(q)]}}
tool: {{xyz: [{length}, 0, 0]}}
""",
        "bent.yaml",
    )


@pytest.mark.parametrize("convention", TABLES)
@pytest.mark.parametrize("unit", ["m", "mm"])
def test_useless_lengths_are_refused_with_a_way_out(convention: Convention, unit: str) -> None:
    with pytest.raises(
        KinegenError, match=r"1e-15 rad from being parallel.* length of 5e\+14 m?m, .*--snap.*ets"
    ) as caught:
        to_convention(bent("1e-15", unit=unit), convention)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("convention", TABLES)
def test_far_lengths_are_reported(convention: Convention) -> None:
    (first, *_) = to_convention(bent("1e-5"), convention).far

    assert "1e-05 rad from being parallel, so there is a length of 5e+04 m; kernels lose 5 digits" in first


@pytest.mark.parametrize("convention", TABLES)
@pytest.mark.parametrize("angle", ["0", "pi", "pi/2", "0.01"])
def test_ordinary_axes_are_not(convention: Convention, angle: str) -> None:
    assert to_convention(bent(angle), convention).far == ()


def test_elementary_rows_keep_any_angle() -> None:
    assert to_convention(bent("1e-15"), Convention.ETS).far == ()
