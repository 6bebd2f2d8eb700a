"""Quantities of several inputs and results, and of results of other shapes than poses and points."""

from __future__ import annotations

from kinegen.model.outputs import Quantity, parse_quantity

SEVERAL: tuple[Quantity, ...] = tuple(
    map(parse_quantity, ("fk_jacobian", "twist_local", "hessian", "inverse_pose", "transform_point"))
)
"""Two results; two inputs; three axes; a pose as input; a pose and a point."""
