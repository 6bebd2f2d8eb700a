"""The folder of a firmware package, as text."""

from __future__ import annotations

from collections.abc import Mapping

from kinegen.emit.c.expected import Vectors
from kinegen.emit.environment import environment
from kinegen.emit.fixed.kernels import FixedKernels
from kinegen.emit.kernels import Kernels
from kinegen.emit.packages.context import project_context
from kinegen.emit.packages.ecosystem import Ecosystem
from kinegen.emit.packages.layout import LAYOUTS
from kinegen.emit.reals import Real
from kinegen.errors import KinegenError


def emit_project(
    kernels: Kernels,
    vectors: Vectors,
    files: Mapping[str, str],
    reals: tuple[Real, ...],
    ecosystem: Ecosystem,
    fixed: FixedKernels | None = None,
) -> dict[str, str]:
    """Print a package.

    Args:
        kernels: The robot and its programs.
        vectors: Their test vectors, which the example takes values from.
        files: The emitted C files by name, self-tests and vectors among them; they are taken as they are.
        reals: The number types of the package.
        ecosystem: Who takes it.
        fixed: The kernels in integers that it has too, or alone if `reals` is empty; None without them.

    Returns:
        Text by path below the package folder, with forward slashes. The folder has to bear the robot's name.

    Raises:
        KinegenError: If the ecosystem keeps the robot's name for itself.
    """
    robot = kernels.robot.name
    if ecosystem is Ecosystem.ARDUINO and robot.lower().startswith("arduino"):
        raise KinegenError(f"robot name {robot!r} begins as only Arduino's own libraries may; give it another `name:`")
    layout = LAYOUTS[ecosystem]
    context = project_context(kernels, vectors, reals, layout, fixed)
    project = {
        path: environment().get_template(f"packages/{template}").render(p=context)
        for path, template in layout.rendered.items()
    }
    places = (
        (layout.headers, context.headers),
        (layout.sources, context.sources),
        (layout.selftest, (name for test in context.selftests for name in (test.source, test.vectors))),
    )
    return project | {f"{folder}/{name}": files[name] for folder, names in places for name in names}
