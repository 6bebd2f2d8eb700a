"""What the templates of the public module of a robot and of its types are given."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterable

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.limits import ARRAY
from kinegen.backends.metadata import further_options
from kinegen.model.actuator_limits import reading_box
from kinegen.model.outputs import Array, Kind
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import comment_text
from kinegen.verify import reference


@dataclass(frozen=True, slots=True)
class PublicKernel:
    """One kernel of the module.

    `brief`: what it computes, in paragraphs. `inputs`: what it is given, as Python text. `results`: what it gives, as
    Python text. `relation`: the shapes of inputs and results in words. `operations`: what a configuration costs.
    `wrapper`: the class that it is an object of, with its type. `notes`: more lines of its docstring. `options`: lines
    of more arguments of its constructor, as Python text.
    """

    name: str
    brief: tuple[str, ...]
    inputs: str
    results: str
    relation: str
    operations: str
    wrapper: str
    notes: tuple[str, ...]
    options: tuple[str, ...]

    @property
    def is_named(self) -> bool:
        """Return whether its results have an axis of tips or frames."""
        return self.wrapper.startswith("NamedKernel")


@dataclass(frozen=True, slots=True)
class Numeric:
    """The search for joint values.

    `kernel`: name of the kernel it searches on. `joints`: where each joint may stand, as Python text. `reach`: what a
    position error is compared with. `tolerances`: accepted errors for float64 and for float32, as Python text.
    `moving`: the joints that move each tip of a tree, as Python text; empty for an arm.
    """

    name: str
    kernel: str
    joints: tuple[str, ...]
    reach: str
    tolerances: str
    moving: tuple[str, ...]

    @property
    def wrapper(self) -> str:
        """The class that it is an object of."""
        return "TipsInverse" if self.moving else "NumericInverse"


@dataclass(frozen=True, slots=True)
class RangeOptions:
    """The ranges of a redundancy.

    `redundancy`: what it is, in words. `most`: intervals of a branch at most. `lines`: arguments of the constructor, as
    Python text.
    """

    redundancy: str
    most: int
    lines: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Tracking:
    """The inverse along a path, as Python text.

    `kernel`: name of the kernel of pose and Jacobian. `strides`: what of each joint counts as much as an angle of 1
    rad. `reach`: what a position error is compared with. `rigid`: how far targets may be from rotations, for float64
    and for float32; None where rotations are not read. `given`: index of the joint that is given with the target; None
    where none is.
    """

    kernel: str
    strides: str
    reach: str
    rigid: str
    given: str


@dataclass(frozen=True, slots=True)
class BuiltWith:
    """Holds how a package was built, as Python text.

    `source`: the robot file, as a shell takes it. `outputs`: its outputs. `options`: further options of the build, as
    entries of a dictionary.
    """

    source: str
    outputs: tuple[str, ...]
    options: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class PackageContext:
    """Holds what the template `python/__init__.py.jinja` is given."""

    description: tuple[str, ...]
    limits: tuple[str, ...]
    single_limits: tuple[str, ...]
    actuators: tuple[tuple[str, str, str], ...]
    varied: tuple[str, ...]
    parameters: tuple[tuple[str, str], ...]
    example: str
    kernels: tuple[PublicKernel, ...]
    reals: str
    plain: bool
    named: bool
    has_jacobians: bool
    numeric_inverse: Numeric | None
    complete_inverse: bool
    redundancy_range: RangeOptions | None
    inverse_tracker: Tracking | None
    stamp: str
    build: BuiltWith
    exported: tuple[str, ...]


def built_with(kernels: RobotPrograms) -> BuiltWith:
    """Return what the template of the public module prints of its build."""
    source = comment_text(kernels.robot.source)
    is_file = not source.startswith("<")
    outputs = [*(program.quantity for program in kernels.programs), *kernels.solvers]
    options = further_options(kernels.robot).items()
    return BuiltWith(
        source=_text(shlex.quote(source) if is_file else source),
        outputs=tuple(_text(str(output)) for output in outputs),
        options=tuple(f"{_text(name)}: {_text(value)}" for name, value in options),
    )


def _text(text: str) -> str:
    """Return a text as a literal of Python, in double quotes."""
    return json.dumps(text)


def example(kernels: RobotPrograms) -> str:
    """Return a call of the first kernel of a module."""
    robot, program = kernels.robot, kernels.programs[0]
    if program.quantity.kind is Kind.JOINTS_TO_ACTUATORS:
        given = [_array(reference.Actuation(robot, _readings(robot)).joints[0])]
    else:
        given = [_argument(robot, array) for array in program.signature.inputs]
    results = ", ".join(array.name for array in program.signature.results)
    return f"{results} = {robot.name}.{program.quantity.function}({', '.join(given)})"


def _argument(robot: Robot, array: Array) -> str:
    if array.name == ARRAY:
        return _array(_readings(robot))
    if array.shape == (robot.dof,):
        return f"np.zeros({robot.name}.DOF)"
    return "np.eye(4)" if array.is_pose else f"np.zeros({array.shape})"


def _readings(robot: Robot) -> list[float]:
    """Return readings in the middle of what they can be: a linkage need not close at zero."""
    return [(low + high) / 2 for low, high in reading_box(robot)]


def _array(numbers: Iterable[float]) -> str:
    return f"[{', '.join(f'{float(number) + 0.0:.4g}' for number in numbers)}]"
