"""The folder of a package for a controller, as text."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.controllers.context import ControllerContext, MoveitContext, controller_context, moveit_context
from kinegen.backends.controllers.controller import Controller
from kinegen.backends.controllers.hal import HalContext, arm_hal
from kinegen.backends.controllers.kernel_calls import KernelNames
from kinegen.backends.controllers.machine_tool import mill_for
from kinegen.backends.controllers.machine_tool_context import MillContext, mill_context, mill_hal
from kinegen.backends.inverse import branches_of
from kinegen.backends.metadata import metadata_of
from kinegen.backends.templates import environment

_LINUXCNC = {
    "README.md": "linuxcnc/README.md.jinja",
    "Makefile": "linuxcnc/Makefile.jinja",
    "{name}_glue.c": "linuxcnc/glue.c.jinja",
    "sim/{name}.ini": "linuxcnc/machine.ini.jinja",
    "sim/{name}.hal": "linuxcnc/machine.hal.jinja",
    "sim/{name}.tbl": "linuxcnc/tools.tbl.jinja",
    "sim/moves.ngc": "linuxcnc/moves.ngc.jinja",
}

MILL: Mapping[str, str] = MappingProxyType(
    {
        **_LINUXCNC,
        "README.md": "linuxcnc/mill.md.jinja",
        "{name}_glue.c": "linuxcnc/mill.c.jinja",
        "sim/{name}.tbl": "linuxcnc/mill.tbl.jinja",
        "sim/moves.ngc": "linuxcnc/mill.ngc.jinja",
        "sim/428remap.ngc": "linuxcnc/mill_tcp.ngc.jinja",
        "sim/429remap.ngc": "linuxcnc/mill_identity.ngc.jinja",
    }
)
"""The same for a machine tool, which LinuxCNC alone moves."""

_ROS2_CONTROL = {
    "README.md": "ros2_control/README.md.jinja",
    "CMakeLists.txt": "ros2_control/CMakeLists.txt.jinja",
    "package.xml": "ros2_control/package.xml.jinja",
    "plugin.xml": "ros2_control/plugin.xml.jinja",
    "include/{name}_kinematics/plugin.hpp": "ros2_control/plugin.hpp.jinja",
    "src/plugin.cpp": "ros2_control/plugin.cpp.jinja",
    "config/controllers.yaml": "ros2_control/controllers.yaml.jinja",
}

_MOVEIT2 = {
    "README.md": "moveit2/README.md.jinja",
    "CMakeLists.txt": "moveit2/CMakeLists.txt.jinja",
    "package.xml": "moveit2/package.xml.jinja",
    "plugin.xml": "moveit2/plugin.xml.jinja",
    "include/{name}_moveit_kinematics/plugin.hpp": "moveit2/plugin.hpp.jinja",
    "src/plugin.cpp": "moveit2/plugin.cpp.jinja",
    "src/initialize.cpp": "moveit2/initialize.cpp.jinja",
    "src/arm.hpp": "moveit2/arm.hpp.jinja",
    "src/arm.cpp": "moveit2/arm.cpp.jinja",
    "src/placement.hpp": "moveit2/placement.hpp.jinja",
    "src/placement.cpp": "moveit2/placement.cpp.jinja",
    "config/kinematics.yaml": "moveit2/kinematics.yaml.jinja",
}

_GRBLHAL = {
    "README.md": "grblhal/README.md.jinja",
    "{name}_plugin.c": "grblhal/plugin.c.jinja",
    "example/my_plugin.c": "grblhal/my_plugin.c.jinja",
}

_KLIPPER = {
    "README.md": "klipper/README.md.jinja",
    "install.sh": "klipper/install.sh.jinja",
    "{name}.py": "klipper/kinematics.py.jinja",
    "chelper/kin_{name}.c": "klipper/helper.c.jinja",
    "printer.cfg": "klipper/printer.cfg.jinja",
}

RENDERED: Mapping[Controller, Mapping[str, str]] = MappingProxyType(
    {
        Controller.LINUXCNC: _LINUXCNC,
        Controller.ROS2_CONTROL: _ROS2_CONTROL,
        Controller.MOVEIT2: _MOVEIT2,
        Controller.GRBLHAL: _GRBLHAL,
        Controller.KLIPPER: _KLIPPER,
    }
)
"""Templates below `controllers/`, by the path that they are written to; `{name}` stands for the robot."""

KERNELS: Mapping[Controller, str] = MappingProxyType(
    {
        Controller.LINUXCNC: "",
        Controller.ROS2_CONTROL: "src/",
        Controller.MOVEIT2: "src/",
        Controller.GRBLHAL: "",
        Controller.KLIPPER: "chelper/",
    }
)
"""Folder of the kernels, with a slash at its end."""


def emit_controller(kernels: RobotPrograms, files: Mapping[str, str], controller: Controller) -> dict[str, str]:
    """Print a package for a controller.

    Args:
        kernels: The robot and its programs.
        files: The emitted C files by name, self-tests and vectors among them; they are taken as they are.
        controller: Who takes it.

    Returns:
        Text by path below the package folder, with forward slashes.

    Raises:
        KinegenError: If no such controller can move the robot.
    """
    where, robot = KERNELS[controller], metadata_of(kernels)
    names = KernelNames(robot.name, controller.reals[0], bool(kernels.robot.runtime_parameters))
    context, hal, rendered = _contexts(kernels, controller)
    # Every template of the controller, the shared inverse along a path among them, from the same four records.
    given = {"robot": robot, "kernels": names, "m": context, "h": hal}
    project = {
        path.replace("{name}", robot.name): environment().get_template(f"controllers/{template}").render(given)
        for path, template in rendered.items()
    }
    project["LICENSE"] = environment().get_template("packages/LICENSE.jinja").render()
    taken = context.headers + context.sources if isinstance(context, MoveitContext) else (names.header, names.source)
    # The C files are taken byte for byte, since these were proved.
    for name in taken:
        project[where + name] = files[name]
    return project | {f"selftest/{name}": files[name] for name in names.selftests}


def _contexts(
    kernels: RobotPrograms, controller: Controller
) -> tuple[ControllerContext | MillContext | MoveitContext, HalContext | None, dict[str, str]]:
    """Return what templates are given, and the templates themselves."""
    robot = kernels.robot
    if controller is Controller.MOVEIT2:
        return moveit_context(kernels), None, dict(RENDERED[controller])
    mill = mill_for(robot, solved=branches_of(kernels) is not None) if controller.has_mills else None
    if mill is not None:
        return mill_context(kernels, mill), mill_hal(robot, mill), dict(MILL)
    context, where = controller_context(kernels, controller), KERNELS[controller]
    follow = {context.follow.header: "_follow.h.jinja", context.follow.source: "_follow.c.jinja"}
    rendered = {**RENDERED[controller], **{where + path: template for path, template in follow.items()}}
    return context, arm_hal(robot, context.coordinates) if controller is Controller.LINUXCNC else None, rendered
