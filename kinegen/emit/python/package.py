"""The public module of a robot: `__init__.py`, with its array handling beside it."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable
from fractions import Fraction
from importlib import resources

from kinegen.emit.actuators import actuator_lines, actuator_names, actuator_units, has_actuators
from kinegen.emit.c.numeric_inverse import tolerances
from kinegen.emit.columns import varied_names
from kinegen.emit.environment import environment
from kinegen.emit.inverse import branches_of, notes_of
from kinegen.emit.kernels import Kernels, joint_lines, operation_line, provenance
from kinegen.emit.limits import joint_limits
from kinegen.emit.nearest import turnings
from kinegen.emit.python.complete import emit_tables
from kinegen.emit.python.context import Numeric, PackageContext, PublicKernel
from kinegen.emit.python.example import example
from kinegen.emit.python.ranges import RANGED, range_options
from kinegen.emit.python.stub import emit_stub
from kinegen.emit.python.tracker import tracking_of
from kinegen.emit.reals import Real
from kinegen.emit.tips import tips_of
from kinegen.emit.words import brief, summary
from kinegen.ir.program import Program
from kinegen.naming import docstring_text, python_identifier
from kinegen.outputs import NUMERIC_INVERSE, POSE_AND_JACOBIAN, Array, Branches, Kind
from kinegen.robot.actuators.extent import reading_ranges
from kinegen.robot.extent import joint_box, reach
from kinegen.robot.model import JointType, Robot

LINE = 120
"""Longest line of the module, as the project's formatter has it."""

RUNTIME = (
    "_kernel.py",
    "_derivatives.py",
    "_engines.py",
    "_gradients.py",
    "_limits.py",
    "_overlap.py",
    "_parameters.py",
    "_plain.py",
    "_quick.py",
    "_signature.py",
    "_threads.py",
    "_xla.py",
    "jax.py",
    "torch.py",
    "xp.py",
)
"""The array handling, copied as it is."""

MEASURES = "_measures.py"
"""What is copied besides where there are Jacobians."""

NAMES = "_names.py"
"""What is copied besides where results have an axis of tips or frames."""

NUMERIC = ("_numeric_inverse.py", "_search.py", "_targets.py")
"""What is copied besides for the search for joint values."""

TIPS = ("_tips_inverse.py", "_tips_search.py")
"""What is copied besides for a search with several tips."""

COMPLETE = ("_complete_inverse.py", "_elimination.py", "_targets.py")
"""What is copied besides for all solutions of an arm."""

TRACKER = ("_inverse_tracker.py", "_tracked.py", "_tracking.py")
"""What is copied besides for the inverse along a path."""

ACTUATORS = "_actuators.py"
"""What is copied besides where kernels take or give readings of actuators."""

INVERSE = ("_inverse.py", "_nearest.py", "_targets.py")
"""What is copied besides where there is a closed-form inverse."""

INVERSE_CLASSES = ("Inverse", "RangedInverse")
"""The class of an inverse: without and with ranges of its redundancy."""

_DTYPES = {Real.DOUBLE: "float64", Real.FLOAT: "float32"}


def emit_package(kernels: Kernels, reals: tuple[Real, ...], stamp: str) -> dict[str, str]:
    """Print the public module and the array handling it uses.

    Args:
        kernels: The robot and its programs.
        reals: The number types that were emitted.
        stamp: Digest of the C sources; an extension built from others is not used.

    Returns:
        Text by file name.
    """
    context = _context(kernels, reals, stamp)
    files = RUNTIME + (MEASURES,) * context.has_jacobians + (ACTUATORS,) * bool(context.actuators)
    files += (NAMES,) * context.named
    files += INVERSE * bool(context.branches)
    files += RANGED * kernels.redundancy_range
    files += NUMERIC * kernels.numeric_inverse + TIPS * (kernels.numeric_inverse and kernels.robot.is_tree)
    files += COMPLETE * kernels.complete_inverse + TRACKER * kernels.inverse_tracker
    banner = f"# {provenance(kernels.robot)}\n# SPDX-License-Identifier: 0BSD\n"
    runtime = resources.files("kinegen.native.runtime")
    return {
        "__init__.py": environment().get_template("python/__init__.py.jinja").render(k=context),
        **emit_stub(kernels, context),
        **(emit_tables(kernels) if kernels.complete_inverse else {}),
        **{name: banner + runtime.joinpath(name).read_text(encoding="utf-8") for name in files},
        "py.typed": "",
    }


def _context(kernels: Kernels, reals: tuple[Real, ...], stamp: str) -> PackageContext:
    """What the template of the public module is given."""
    robot = kernels.robot
    branches = branches_of(kernels)
    functions = tuple(_public(kernels, program, branches) for program in kernels.programs)
    has_jacobians = any(array.name == "jacobian" for program in kernels.programs for array in program.signature.results)
    has_frames = any(program.quantity.kind is Kind.FRAMES for program in kernels.programs)
    return PackageContext(
        name=robot.name,
        description=_paragraph(docstring_text(robot.description)),
        provenance=docstring_text(provenance(robot)),
        length=robot.units.length,
        dof=robot.dof,
        joints=joint_lines(robot),
        joint_names=_quoted(variable.name for variable in robot.variables),
        limits=_limits(robot, Real.DOUBLE),
        single_limits=_limits(robot, Real.FLOAT),
        actuators=_actuators(kernels),
        actuator_lines=actuator_lines(kernels),
        frames=_quoted(robot.frame_names) if has_frames else (),
        tips=_quoted(robot.tips) if robot.is_tree else (),
        branches=_quoted(branches.names) if branches else (),
        varied=_quoted(map(python_identifier, varied_names(kernels))),
        parameters=tuple(
            (python_identifier(parameter.name), Real.DOUBLE.literal(value))
            for parameter, value in zip(robot.runtime_parameters, kernels.defaults, strict=True)
        ),
        example=example(kernels),
        kernels=functions,
        reals=f"({', '.join(_quoted(_DTYPES[real] for real in reals))}{',' if len(reals) == 1 else ''})",
        plain=any(function.wrapper.startswith("Kernel") for function in functions),
        named=any(function.is_named for function in functions),
        has_jacobians=has_jacobians,
        numeric_inverse=_numeric(kernels) if kernels.numeric_inverse else None,
        complete_inverse=kernels.complete_inverse,
        redundancy_range=range_options(kernels, branches) if kernels.redundancy_range and branches else None,
        inverse_tracker=tracking_of(kernels) if kernels.inverse_tracker else None,
        stamp=stamp,
        exported=_exported(kernels, functions, has_frames, has_jacobians),
    )


def _paragraph(text: str) -> tuple[str, ...]:
    return tuple(textwrap.wrap(text, LINE, break_long_words=False, break_on_hyphens=False))


def _exported(
    kernels: Kernels, functions: tuple[PublicKernel, ...], has_frames: bool, has_jacobians: bool
) -> tuple[str, ...]:
    robot = kernels.robot
    names = ["DOF", "JOINTS", "LIMITS", "backend", "clamp", "within_limits", *(function.name for function in functions)]
    names += ["FRAMES"] * has_frames + ["TIPS"] * robot.is_tree + ["Params"] * bool(robot.runtime_parameters)
    names += ["PARAMETERS"] * bool(varied_names(kernels))
    names += ["condition_number", "manipulability"] * has_jacobians
    names += ["BRANCHES"] * any(function.wrapper in INVERSE_CLASSES for function in functions)
    names += ["ACTUATORS", "ACTUATOR_RANGES", "ACTUATOR_UNITS", "check_actuators"] * has_actuators(kernels)
    names += [solver.function for solver in kernels.solvers]
    return tuple(sorted(names, key=_export_key))


def _export_key(name: str) -> tuple[int, str]:
    """The order in which the project's linter wants `__all__`: constants, classes, functions."""
    return (0 if name.isupper() else 1 if name[0].isupper() else 2), name


def _public(kernels: Kernels, program: Program, branches: Branches | None) -> PublicKernel:
    results = program.signature.results
    order = "FRAMES" if program.quantity.kind is Kind.FRAMES else "TIPS"
    has_names = all(array.per_frame for array in results)
    several = f", in the order of `{order}`" if has_names else ""
    given = " and ".join(f"{array.name} of shape {_batch_shape(array)}" for array in program.signature.inputs)
    if len(results) == 1:
        gives = _batch_shape(results[0])
    else:
        gives = " and ".join(f"{array.name} {_batch_shape(array)}" for array in results)
    kind = "Floats" if len(results) == 1 else f"tuple[{', '.join(['Floats'] * len(results))}]"
    inverse = branches if program.quantity.kind is Kind.INVERSE else None
    return PublicKernel(
        name=program.quantity.function,
        brief=summary(brief(program.signature)),
        inputs=_arrays(program.signature.inputs),
        results=_arrays(results),
        relation=f"{given} {'gives' if len(program.signature.inputs) == 1 else 'give'} {gives}{several}",
        operations=operation_line(program),
        wrapper=INVERSE_CLASSES[kernels.redundancy_range] if inverse else f"{'Named' * has_names}Kernel[{kind}]",
        notes=notes_of(kernels, program, LINE - 4, tuple(Real)),
        options=_inverse_options(kernels.robot, inverse) if inverse else _name_options(order) * has_names,
    )


def _name_options(order: str) -> tuple[str, ...]:
    """Further arguments of a kernel whose results have an axis of tips or frames, as lines."""
    return (f"names={order},", f'word="{order.lower().removesuffix("s")}",')


def _inverse_options(robot: Robot, inverse: Branches) -> tuple[str, ...]:
    """Further arguments of the inverse, as lines."""
    lines = []
    for real in Real:
        joints = (
            f"        ({', '.join(map(_number, (each.turn, each.lowest, each.highest)))}),"
            for each in turnings(robot, inverse, real)
        )
        lines += ["    (", *joints, "    ),"]
    return ("turnings=(", *lines, "),")


def _arrays(arrays: tuple[Array, ...]) -> str:
    """Arrays as Python text."""
    items = [f'Array("{array.name}", {_tuple(array.shape)}{_flags(array)})' for array in arrays]
    return f"({items[0]},)" if len(items) == 1 else f"({', '.join(items)})"


def _flags(array: Array) -> str:
    """What an array holds besides plain numbers, as arguments of Python."""
    return ", True" * array.is_pose + ", is_truth=True" * array.is_truth


def _tuple(shape: tuple[int, ...]) -> str:
    return f"({shape[0]},)" if len(shape) == 1 else f"({', '.join(map(str, shape))})"


def _batch_shape(array: Array) -> str:
    return f"({', '.join(['...', *map(str, array.shape)])})"


def _limits(robot: Robot, real: Real) -> tuple[str, ...]:
    """Both limits of each joint, as Python text."""
    found = (
        (Real.DOUBLE.literal(Fraction(end)) for end in each) if each else None for each in joint_limits(robot, real)
    )
    return tuple("None" if each is None else f"({', '.join(each)})" for each in found)


def _actuators(kernels: Kernels) -> tuple[tuple[str, str, str], ...]:
    """Name, range and unit of each actuator as Python text."""
    names = _quoted(actuator_names(kernels))
    ranges = [f"({_bound(low)}, {_bound(high)})" for low, high in reading_ranges(kernels.robot)]
    units = _quoted(actuator_units(kernels.robot))
    return tuple(zip(names, ranges, units, strict=True)) if names else ()


def _numeric(kernels: Kernels) -> Numeric:
    robot = kernels.robot
    accepted = [tuple(map(float, tolerances(robot, real))) for real in (Real.DOUBLE, Real.FLOAT)]
    return Numeric(
        name=NUMERIC_INVERSE.function,
        kernel=POSE_AND_JACOBIAN.function,
        joints=tuple(
            f"Joint({float(low)!r}, {float(high)!r}, {variable.limits is not None}, "
            f"{variable.type is not JointType.PRISMATIC})"
            for variable, (low, high) in zip(robot.variables, joint_box(robot), strict=True)
        ),
        reach=repr(float(reach(robot, robot.tips))),
        tolerances=repr(tuple(accepted)),
        moving=tuple(map(_tuple, tips_of(robot).moving)) if robot.is_tree else (),
    )


def _number(value: float) -> str:
    """A number as Python formatters write it, without a plus sign in the exponent."""
    return repr(value).replace("e+", "e")


def _bound(value: float) -> str:
    return repr(value) if math.isfinite(value) else f"float({str(value)!r})".replace("'", '"')


def _quoted(items: Iterable[str]) -> tuple[str, ...]:
    return tuple(f'"{item}"' for item in items)
