"""The closed form for readers; here the names of what can be printed, for the command line and for Python."""

from __future__ import annotations

from kinegen.model.outputs import Kind, Reference

OUTPUTS: dict[str, Reference | None] = {
    "pose": None,
    "jacobian": Reference.LOCAL_WORLD_ALIGNED,
    "jacobian_local": Reference.LOCAL,
    "jacobian_world": Reference.WORLD,
    "singularities": None,
    "rpy_zyx": None,
    "rpy_xyz": None,
    "euler_zyz": None,
}
"""What is printed, with the reference of a Jacobian."""

ORIENTATIONS = {"rpy_zyx": Kind.RPY_ZYX, "rpy_xyz": Kind.RPY_XYZ, "euler_zyz": Kind.EULER_ZYZ}
"""The outputs that are angles."""

SINGULARITIES = "singularities"

VARIABLES = ("q", "theta,d")
"""What joint variables are called: q1, q2 and so on, or by the kind of the joint."""
