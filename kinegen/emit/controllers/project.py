"""The folder of a package for a controller, as text."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from kinegen.emit.controllers.context import controller_context
from kinegen.emit.controllers.controller import Controller
from kinegen.emit.environment import environment
from kinegen.emit.kernels import Kernels

_LINUXCNC = {
    "README.md": "linuxcnc/README.md.jinja",
    "Makefile": "linuxcnc/Makefile.jinja",
    "{name}_glue.c": "linuxcnc/glue.c.jinja",
    "sim/{name}.ini": "linuxcnc/machine.ini.jinja",
    "sim/{name}.hal": "linuxcnc/machine.hal.jinja",
    "sim/{name}.tbl": "linuxcnc/tools.tbl.jinja",
    "sim/moves.ngc": "linuxcnc/moves.ngc.jinja",
}

_ROS2_CONTROL = {
    "README.md": "ros2_control/README.md.jinja",
    "CMakeLists.txt": "ros2_control/CMakeLists.txt.jinja",
    "package.xml": "ros2_control/package.xml.jinja",
    "plugin.xml": "ros2_control/plugin.xml.jinja",
    "include/{name}_kinematics/plugin.hpp": "ros2_control/plugin.hpp.jinja",
    "src/plugin.cpp": "ros2_control/plugin.cpp.jinja",
    "config/controllers.yaml": "ros2_control/controllers.yaml.jinja",
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
        Controller.GRBLHAL: _GRBLHAL,
        Controller.KLIPPER: _KLIPPER,
    }
)
"""Templates below `controllers/`, by the path that they are written to; `{name}` stands for the robot."""

KERNELS: Mapping[Controller, str] = MappingProxyType(
    {
        Controller.LINUXCNC: "",
        Controller.ROS2_CONTROL: "src/",
        Controller.GRBLHAL: "",
        Controller.KLIPPER: "chelper/",
    }
)
"""Folder of the kernels, with a slash at its end."""


def emit_controller(kernels: Kernels, files: Mapping[str, str], controller: Controller) -> dict[str, str]:
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
    context, where = controller_context(kernels, controller), KERNELS[controller]
    rendered = {
        **RENDERED[controller],
        f"{where}{context.follow.header}": "_follow.h.jinja",
        f"{where}{context.follow.source}": "_follow.c.jinja",
    }
    project = {
        path.replace("{name}", kernels.robot.name): environment()
        .get_template(f"controllers/{template}")
        .render(m=context)
        for path, template in rendered.items()
    }
    project["LICENSE"] = environment().get_template("packages/LICENSE.jinja").render()
    for name in (context.header, context.sources[0]):
        project[where + name] = files[name]
    return project | {f"selftest/{name}": files[name] for name in context.selftests}
