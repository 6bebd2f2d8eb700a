"""The types of the public module of a robot, `__init__.pyi`: each kernel with its own arguments."""

from __future__ import annotations

import re

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.metadata import metadata_of
from kinegen.backends.python.context import PackageContext
from kinegen.backends.templates import environment
from kinegen.model.outputs import Array
from kinegen.support.dataclass import dataclass

STUB = "__init__.pyi"
"""Name of the file, beside the module that it describes."""

_TYPE = "_Kernel_{}"


@dataclass(frozen=True, slots=True)
class StubKernel:
    """One kernel.

    `base`: the class that its own type derives from. `result`: type of what a call returns. `arguments`: arguments of a
    call, with types and defaults. `bound`: arguments of `bind`. `brief`: what it computes, in one line. `relation`:
    shapes and units in words.
    """

    name: str
    base: str
    result: str
    arguments: tuple[str, ...]
    bound: tuple[str, ...]
    brief: str
    relation: str

    @property
    def type(self) -> str:
        """Name of its type, which the module itself has not."""
        return _TYPE.format(self.name)

    @property
    def named(self) -> tuple[str, ...]:
        """Arguments of `by_name`, which takes inputs by their places."""
        place = self.arguments.index("*")
        return (*self.arguments[:place], "/", *self.arguments[place:])

    @property
    def is_named(self) -> bool:
        """Return whether its results have an axis of tips or frames."""
        return self.base.startswith("NamedKernel")


@dataclass(frozen=True, slots=True)
class StubContext:
    """Holds what the template `python/__init__.pyi.jinja` is given.

    `exported`: every public name. `names`: declarations of everything but kernels and parameters. `parameters`: names
    of the runtime parameters.
    """

    exported: tuple[str, ...]
    names: tuple[str, ...]
    parameters: tuple[str, ...]
    kernels: tuple[StubKernel, ...]


_PLACES = {
    "collections.abc": ("Callable",),
    "typing": ("Any", "Literal", "NamedTuple"),
    "numpy.typing": ("ArrayLike", "NDArray"),
    "._runtime._actuators": ("ReadingCheck",),
    "._runtime._complete_inverse": ("CompleteInverse",),
    "._runtime._engines": ("Floats",),
    "._runtime._inverse": ("Inverse", "Truths"),
    "._runtime._inverse_tracker": ("InverseTracker",),
    "._runtime._kernel": ("Kernel", "Layout"),
    "._runtime._limits": ("Clamp", "WithinLimits"),
    "._runtime._measures": (),
    "._runtime._names": ("ByName", "NamedKernel"),
    "._runtime._numeric_inverse": ("NumericInverse",),
    "._runtime._parameters": ("Values",),
    "._runtime._redundancy_range": ("RangedInverse", "RedundancyRange"),
    "._runtime._tips_inverse": ("TipsInverse",),
}
"""Where the names that a stub may use come from, in the order of a linter."""

_MEASURES = ("condition_number", "manipulability")

_BLOCKS = (("collections.abc", "typing"), ("numpy.typing",))
"""Modules of the standard library, and others; what is left is in the package."""


def emit_stub(kernels: RobotPrograms, package: PackageContext) -> dict[str, str]:
    """Print the types of a module."""
    robot, context = metadata_of(kernels), _context(kernels, package)
    template = environment().get_template("python/__init__.pyi.jinja")
    words = set(re.findall(r"\w+", template.render(robot=robot, s=context, imports=())))
    return {STUB: template.render(robot=robot, s=context, imports=_imports(words, package.has_jacobians))}


def _context(kernels: RobotPrograms, context: PackageContext) -> StubContext:
    """Return what the template of the types is given."""
    both = zip(context.kernels, kernels.programs, strict=True)
    ranges = "ACTUATOR_RANGES: tuple[tuple[float, float], ...]"
    units = ("ACTUATOR_UNITS: tuple[str, ...]", "check_actuators: ReadingCheck")
    actuators = ("ACTUATORS: tuple[str, ...]", ranges, *units)
    numeric = context.numeric_inverse
    robot = metadata_of(kernels)
    lists = {"FRAMES": robot.frames, "TIPS": robot.tips, "BRANCHES": robot.branches, "PARAMETERS": robot.varied}
    return StubContext(
        exported=context.exported,
        names=(
            "DOF: int",
            "JOINTS: tuple[str, ...]",
            "LIMITS: tuple[tuple[float, float] | None, ...]",
            *(f"{name}: tuple[str, ...]" for name, entries in lists.items() if entries),
            *(actuators if context.actuators else ()),
            "within_limits: WithinLimits",
            "clamp: Clamp",
            *([f"{numeric.name}: {numeric.wrapper}"] if numeric else []),
            *(["complete_inverse: CompleteInverse"] if context.complete_inverse else []),
            *(["redundancy_range: RedundancyRange"] if context.redundancy_range else []),
            *(["inverse_tracker: InverseTracker"] if context.inverse_tracker else []),
            "backend: str",
        ),
        parameters=tuple(name for name, _ in context.parameters),
        kernels=tuple(
            _kernel(
                public.name,
                public.wrapper,
                program.signature.inputs,
                program.signature.results,
                public.brief[0],
                f"{public.relation}; angles in rad, lengths in {robot.length}.",
                has_params=bool(context.parameters),
            )
            for public, program in both
        ),
    )


def _imports(words: set[str], has_measures: bool) -> tuple[str, ...]:
    """Return the imports of what is used."""
    lines: list[str] = []
    for block in (*_BLOCKS, tuple(place for place in _PLACES if place.startswith("."))):
        for place in block:
            names = [name for name in _PLACES[place] if name in words]
            lines += [f"from {place} import {', '.join(names)}"] if names else []
            # Functions that are public as they are.
            is_public = place == "._runtime._measures" and has_measures
            lines += [f"from ._runtime._measures import {name} as {name}" for name in _MEASURES] if is_public else []
        lines.append("")
    return tuple(lines[:-1])


def _kernel(
    name: str,
    wrapper: str,
    inputs: tuple[Array, ...],
    results: tuple[Array, ...],
    brief: str,
    relation: str,
    *,
    has_params: bool,
) -> StubKernel:
    """Return a kernel as its stub has it.

    `name`: its name in the module. `wrapper`: the class that it is an object of, such as `Kernel[Floats]` or `Inverse`.
    `brief`: what it computes, in one line. `relation`: shapes and units in words. `has_params`: whether the robot has
    runtime parameters.
    """
    is_ranged = wrapper == "RangedInverse"
    is_inverse = wrapper == "Inverse" or is_ranged
    result = "tuple[Floats, Truths]" if is_inverse else wrapper.partition("[")[2].removesuffix("]")
    given = "tuple[Floats, NDArray[Any]]" if is_inverse else result
    params = ("params: Params | None = None",) * has_params
    layouts = 'Layout = "4x4"' if any(each.is_pose for each in results) else 'Literal["4x4", "joint_major"] = "4x4"'
    options = (*params, f"out: {given} | None = None", "threads: int = 1", f"layout: {layouts}")
    chosen = ("nearest: ArrayLike | None = None", "q0: ArrayLike | None = None", "check: bool = True")
    options += chosen if is_inverse else ()
    taken = (f"{each.name}: Floats" for each in inputs)
    # With `nearest` the redundancy, which comes last, may be chosen too.
    asked = [f"{each.name}: ArrayLike" for each in inputs]
    asked[-1] += " | None = None" * is_ranged
    written = (f"{_free(each, inputs)}: NDArray[Any]" for each in results)
    return StubKernel(
        name=name,
        base=wrapper,
        result=result,
        arguments=(*asked, "*", *options),
        bound=(*taken, *written, "/", "*", *params, f"layout: {layouts}"),
        brief=brief,
        relation=relation,
    )


def _free(result: Array, inputs: tuple[Array, ...]) -> str:
    """Return the name of a result among arguments, of which an input may have the same."""
    return f"{result.name}_out" if result.name in [each.name for each in inputs] else result.name
