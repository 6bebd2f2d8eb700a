"""The public modules of a robot: `__init__.py`, those for other libraries, and the vendored ones that they use."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable
from fractions import Fraction

from kinegen.backends.bundle import RobotPrograms, operation_line
from kinegen.backends.c.numeric_inverse import tolerances
from kinegen.backends.descriptions import brief, summary
from kinegen.backends.inverse import branches_of, end_of, notes_of, sharings, turnings
from kinegen.backends.limits import actuator_units, joint_limits
from kinegen.backends.metadata import metadata_of
from kinegen.backends.python.context import Numeric, PackageContext, PublicKernel, built_with, example
from kinegen.backends.python.solvers import emit_tables, range_options, tracking_of
from kinegen.backends.python.stub import emit_stub
from kinegen.backends.python.vendored import emit_vendored
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.solver_parameters import tips_of
from kinegen.backends.templates import environment
from kinegen.ir.program import Program
from kinegen.model.actuator_limits import reading_ranges
from kinegen.model.branches import Branches
from kinegen.model.joint_bounds import joint_box, reach
from kinegen.model.outputs import NUMERIC_INVERSE, POSE_AND_JACOBIAN, Array, Kind
from kinegen.model.robot import JointType, Robot
from kinegen.support.naming import docstring_text, python_identifier

LINE = 120
"""Longest line of the module, as the project's formatter has it."""

LIBRARIES = ("jax", "torch", "xp")
"""The modules with the outputs of a robot for other libraries."""

INVERSE_CLASSES = ("Inverse", "RangedInverse")
"""The class of an inverse: without and with ranges of its redundancy."""

_DTYPES = {ScalarType.DOUBLE: "float64", ScalarType.FLOAT: "float32"}


def emit_package(kernels: RobotPrograms, reals: tuple[ScalarType, ...], stamp: str) -> dict[str, str]:
    """Print the public modules, and the vendored ones that they use.

    `stamp`: digest of the C sources; an extension built from others is not used.
    """
    robot, context = metadata_of(kernels), _context(kernels, reals, stamp)
    library = environment().get_template("python/library.py.jinja")
    return {
        "__init__.py": environment().get_template("python/__init__.py.jinja").render(robot=robot, k=context),
        **emit_stub(kernels, context),
        **(emit_tables(kernels) if kernels.complete_inverse else {}),
        **{f"{name}.py": library.render(robot=robot, library=name) for name in LIBRARIES},
        **emit_vendored(_offered(kernels, context)),
        "py.typed": "",
    }


def _offered(kernels: RobotPrograms, context: PackageContext) -> tuple[str, ...]:
    """Return what a package offers that takes vendored modules of its own."""
    offers = {
        "jacobians": context.has_jacobians,
        "actuators": bool(context.actuators),
        "names": context.named,
        "inverse": bool(metadata_of(kernels).branches),
        "redundancy_range": kernels.redundancy_range,
        "numeric_inverse": kernels.numeric_inverse,
        "numeric_inverse of tips": kernels.numeric_inverse and kernels.robot.is_tree,
        "complete_inverse": kernels.complete_inverse,
        "inverse_tracker": kernels.inverse_tracker,
    }
    return tuple(name for name, is_offered in offers.items() if is_offered)


def _context(kernels: RobotPrograms, reals: tuple[ScalarType, ...], stamp: str) -> PackageContext:
    """Return what the template of the public module is given."""
    robot = kernels.robot
    branches = branches_of(kernels)
    functions = tuple(_public(kernels, program, branches) for program in kernels.programs)
    has_jacobians = any(array.name == "jacobian" for program in kernels.programs for array in program.signature.results)
    return PackageContext(
        description=_paragraph(docstring_text(robot.description)),
        limits=_limits(robot, ScalarType.DOUBLE),
        single_limits=_limits(robot, ScalarType.FLOAT),
        actuators=_actuators(kernels),
        varied=_quoted(map(python_identifier, metadata_of(kernels).varied)),
        parameters=tuple(
            (python_identifier(parameter.name), ScalarType.DOUBLE.literal(value))
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
        build=built_with(kernels),
        exported=_exported(kernels, functions, has_jacobians),
    )


def _paragraph(text: str) -> tuple[str, ...]:
    return tuple(textwrap.wrap(text, LINE, break_long_words=False, break_on_hyphens=False))


def _exported(kernels: RobotPrograms, functions: tuple[PublicKernel, ...], has_jacobians: bool) -> tuple[str, ...]:
    robot = metadata_of(kernels)
    names = ["DOF", "JOINTS", "LIMITS", "backend", "clamp", "within_limits", *(function.name for function in functions)]
    names += ["FRAMES"] * bool(robot.frames) + ["TIPS"] * bool(robot.tips) + ["Params"] * bool(kernels.defaults)
    names += ["PARAMETERS"] * bool(robot.varied)
    names += ["condition_number", "manipulability"] * has_jacobians
    names += ["BRANCHES"] * bool(robot.branches)
    names += ["ACTUATORS", "ACTUATOR_RANGES", "ACTUATOR_UNITS", "check_actuators"] * bool(robot.actuators)
    names += [solver.function for solver in kernels.solvers]
    return tuple(sorted(names, key=_export_key))


def _export_key(name: str) -> tuple[int, str]:
    """Return the order in which the project's linter wants `__all__`: constants, classes, functions."""
    return (0 if name.isupper() else 1 if name[0].isupper() else 2), name


def _public(kernels: RobotPrograms, program: Program, branches: Branches | None) -> PublicKernel:
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
        notes=notes_of(kernels, program, LINE - 4, tuple(ScalarType)),
        options=_inverse_options(kernels.robot, inverse) if inverse else _name_options(order) * has_names,
    )


def _name_options(order: str) -> tuple[str, ...]:
    """Return further arguments of a kernel whose results have an axis of tips or frames, as lines."""
    return (f"names={order},", f'word="{order.lower().removesuffix("s")}",')


def _inverse_options(robot: Robot, inverse: Branches) -> tuple[str, ...]:
    """Return further arguments of the inverse, as lines."""
    lines = []
    for real in ScalarType:
        joints = (
            f"        ({', '.join(map(_number, (each.turn, each.lowest, each.highest)))}),"
            for each in turnings(robot, inverse, real)
        )
        lines += ["    (", *joints, "    ),"]
    return ("turnings=(", *lines, "),", *_sharing_options(robot, inverse), *_end_options(robot, inverse))


def _sharing_options(robot: Robot, inverse: Branches) -> tuple[str, ...]:
    """Return the joints that can come in line, as lines; none where there are none."""
    if not inverse.in_line:
        return ()
    lines = []
    for real in ScalarType:
        rows = []
        for each in sharings(robot, inverse, real):
            sides = (f"({', '.join(map(_number, side))})" for side in (each.low, each.high))
            joints = map(str, (each.first, each.middle, each.last, -1 if each.are_opposed else 1))
            items = (*joints, _number(each.at), _number(each.near), *sides)
            rows += ["        (", *(f"            {item}," for item in items), "        ),"]
        lines += ["    (", *rows, "    ),"]
    return ("sharings=(", *lines, "),")


def _end_options(robot: Robot, inverse: Branches) -> tuple[str, ...]:
    """Return the joint at an end that a pose may leave free, as lines; none without one."""
    lines = []
    for real in ScalarType:
        end = end_of(robot, inverse, real)
        if end is None:
            return ()
        places = [f"    ({place[0]}, {', '.join(map(_number, place[1:]))})," for place in end.places]
        items = (str(end.joint), str(end.is_first), *(_vector(each) for each in (end.direction, end.point)))
        items = (*items, _number(end.rate), _number(end.rest), _vector(end.limits), _vector(end.met), _number(end.near))
        rows = [f"{item}," for item in items] + (["(", *places, "),"] if places else ["(),"])
        lines += ["    (", *(f"        {row}" for row in rows), "    ),"]
    return ("ends=(", *lines, "),")


def _vector(numbers: tuple[float, ...]) -> str:
    """Return numbers as Python text."""
    return f"({', '.join(map(_number, numbers))})"


def _arrays(arrays: tuple[Array, ...]) -> str:
    """Return arrays as Python text."""
    items = [f'Array("{array.name}", {_tuple(array.shape)}{_flags(array)})' for array in arrays]
    return f"({items[0]},)" if len(items) == 1 else f"({', '.join(items)})"


def _flags(array: Array) -> str:
    """Return what an array holds besides plain numbers, as arguments of Python."""
    return ", True" * array.is_pose + ", is_truth=True" * array.is_truth


def _tuple(shape: tuple[int, ...]) -> str:
    return f"({shape[0]},)" if len(shape) == 1 else f"({', '.join(map(str, shape))})"


def _batch_shape(array: Array) -> str:
    return f"({', '.join(['...', *map(str, array.shape)])})"


def _limits(robot: Robot, real: ScalarType) -> tuple[str, ...]:
    """Return both limits of each joint, as Python text."""
    found = (
        (ScalarType.DOUBLE.literal(Fraction(end)) for end in each) if each else None
        for each in joint_limits(robot, real)
    )
    return tuple("None" if each is None else f"({', '.join(each)})" for each in found)


def _actuators(kernels: RobotPrograms) -> tuple[tuple[str, str, str], ...]:
    """Return the name, range and unit of each actuator as Python text."""
    names = _quoted(metadata_of(kernels).actuators)
    ranges = [f"({_bound(low)}, {_bound(high)})" for low, high in reading_ranges(kernels.robot)]
    units = _quoted(actuator_units(kernels.robot))
    return tuple(zip(names, ranges, units, strict=True)) if names else ()


def _numeric(kernels: RobotPrograms) -> Numeric:
    robot = kernels.robot
    accepted = [tuple(map(float, tolerances(robot, real))) for real in (ScalarType.DOUBLE, ScalarType.FLOAT)]
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
    """Return a number as Python formatters write it, without a plus sign in the exponent."""
    return repr(value).replace("e+", "e")


def _bound(value: float) -> str:
    return repr(value) if math.isfinite(value) else f"float({str(value)!r})".replace("'", '"')


def _quoted(items: Iterable[str]) -> tuple[str, ...]:
    return tuple(f'"{item}"' for item in items)
