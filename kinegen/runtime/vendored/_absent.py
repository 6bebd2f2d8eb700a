"""What a package says of an output that it was built without. It needs the standard library alone."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping

OF_A_FRAME = (
    "pose",
    "position",
    "jacobian",
    "jacobian_local",
    "jacobian_world",
    "fk_jacobian",
    "fk_jacobian_local",
    "fk_jacobian_world",
    "twist",
    "twist_local",
    "twist_world",
    "bias_acceleration",
    "bias_acceleration_local",
    "bias_acceleration_world",
    "acceleration",
    "acceleration_local",
    "acceleration_world",
    "hessian",
    "quaternion_wxyz",
    "quaternion_xyzw",
    "rpy_zyx",
    "rpy_xyz",
    "euler_zyz",
    "axis_angle",
    "quaternion_wxyz_jacobian",
    "quaternion_xyzw_jacobian",
    "rpy_zyx_jacobian",
    "rpy_xyz_jacobian",
    "euler_zyz_jacobian",
    "axis_angle_jacobian",
    "parameter_jacobian",
    "inverse",
    "axis_inverse",
    "fk_actuators",
    "jacobian_actuators",
    "jacobian_actuators_local",
    "jacobian_actuators_world",
)
"""Outputs that are computed for the tips, or for one frame."""

OF_THE_ROBOT = (
    "frames",
    "inverse_pose",
    "transform_point",
    "adjoint",
    "actuators_to_joints",
    "joints_to_actuators",
    "numeric_inverse",
    "complete_inverse",
    "redundancy_range",
    "inverse_tracker",
)
"""Outputs that are not computed for one frame."""

COME_WITH = {
    "FRAMES": "frames",
    "BRANCHES": "inverse",
    "PARAMETERS": "parameter_jacobian",
    "condition_number": "jacobian",
    "manipulability": "jacobian",
}
"""Other names of a package, and the output that brings each."""

_MADE_BY_COMPILE = "kinegen.runtime.compiled."


def absent(
    name: str,
    module: str,
    *,
    robot: str,
    source: str,
    outputs: tuple[str, ...],
    frames: Iterable[str],
    options: Mapping[str, str],
) -> AttributeError:
    """The error for a name that a package does not have; for an output it says how to build it.

    Args:
        name: The name that was asked for.
        module: Name of the package, as it was imported.
        robot: Name of the robot.
        source: Its file, as a shell takes it; in angle brackets where there is none.
        outputs: What the package was built for.
        frames: Frames of the robot for which outputs may be computed.
        options: Further options of that build, without dashes; empty text for those that have no value.
    """
    output = output_named(name, frames)
    if not output or output in outputs:
        text = f"module {module!r} has no attribute {name!r}"
        return AttributeError(text, name=name, obj=sys.modules.get(module))
    wanted = ",".join((*outputs, output))
    varied = f', wrt="{options["wrt"]}"' if "wrt" in options else ""
    if module.startswith(_MADE_BY_COMPILE):
        return AttributeError(f'{robot} was compiled without {output}: kinegen.compile(robot, "{wanted}"{varied})')
    if source.startswith("<"):
        call = f'kinegen.build(robot, outputs="{wanted}"{varied})'
        return AttributeError(f"{robot} was built without {output}: {call}")
    more = "".join(f" --{option} {value}".rstrip() for option, value in options.items())
    return AttributeError(f"{robot} was built without {output}: kinegen build {source} --outputs {wanted}{more}")


def output_named(name: str, frames: Iterable[str]) -> str:
    """The output that a function computes, or that another name comes with; empty for any other name.

    Args:
        name: A name, such as `fk`, `jacobian_elbow` or `FRAMES`.
        frames: Frames of the robot for which outputs may be computed.
    """
    functions = {"fk" if output == "pose" else output: output for output in (*OF_A_FRAME, *OF_THE_ROBOT)}
    if name in functions or name in COME_WITH:
        return functions.get(name) or COME_WITH[name]
    ways = (
        f"{output}@{frame}"
        for function, output in functions.items()
        if output in OF_A_FRAME and name.startswith(f"{function}_")
        for frame in frames
        if name == f"{function}_{frame}"
    )
    return next(ways, "")
