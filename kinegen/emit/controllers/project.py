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

RENDERED: Mapping[Controller, Mapping[str, str]] = MappingProxyType({Controller.LINUXCNC: _LINUXCNC})
"""Templates below `controllers/`, by the path that they are written to; `{name}` stands for the robot."""

KERNELS: Mapping[Controller, str] = MappingProxyType({Controller.LINUXCNC: ""})
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
