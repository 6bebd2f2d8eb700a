"""The folder of a firmware package as text, and what its templates are given: finished strings."""

from __future__ import annotations

import json
from collections.abc import Mapping
from fractions import Fraction

from kinegen.backends.bundle import RobotPrograms, joint_lines, operation_line
from kinegen.backends.c.complete_inverse import CompleteContext, complete_context
from kinegen.backends.c.inverse_tracker import TrackerContext, tracker_context
from kinegen.backends.c.kernel import KernelContext, kernel_context
from kinegen.backends.c.numeric_inverse import SolverContext, solver_context
from kinegen.backends.c.redundancy_range import RangeContext, range_context
from kinegen.backends.c.test_vectors import Vectors
from kinegen.backends.complete_inverse.screws import require_double
from kinegen.backends.descriptions import brief
from kinegen.backends.firmware.ecosystem import LAYOUTS, Ecosystem, Layout
from kinegen.backends.firmware.example import Example, example_of, fixed_example
from kinegen.backends.fixed_point.files import FixedContext, fixed_context
from kinegen.backends.fixed_point.kernels import FixedKernels
from kinegen.backends.inverse import branches_of
from kinegen.backends.metadata import Metadata, metadata_of
from kinegen.backends.routines import is_straight
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.templates import environment, markdown
from kinegen.errors import KinegenError
from kinegen.model.robot import Robot
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import Q30, cmake_target, macro, prefix, selftest_file, vectors_file

_LONGEST_SENTENCE = 240  # PlatformIO's schema ends a description at 255 characters


@dataclass(frozen=True, slots=True)
class Selftest:
    """The self-test of one number type.

    `source`: its file, without folder. `vectors`: its header, without folder. `program`: name of the program that runs
    it. `checks`: C functions that return the largest difference, each with the macro of the largest accepted one.
    `inverse`: whether an inverse is among what they check. `zero`: zero in that type; empty for integers, which a
    self-test counts without a sign.
    """

    source: str
    vectors: str
    program: str
    checks: tuple[tuple[str, str], ...]
    inverse: bool
    real: str
    zero: str

    @property
    def counts(self) -> bool:
        """Return whether differences are counted in units of the last place."""
        return not self.zero


@dataclass(frozen=True, slots=True)
class Manual:
    """Holds what a README says of one header.

    `accuracy`: of sines and cosines; empty where there are none. `functions`: prototype of each function, what it
    computes, and what a call costs.
    """

    header: str
    accuracy: str
    functions: tuple[tuple[str, str, str], ...]


@dataclass(frozen=True, slots=True)
class ProjectContext:
    """Holds what every template of a package is given, as `p`."""

    sentence: str
    markdown: str
    json_name: str
    json_sentence: str
    units: str
    joints: tuple[str, ...]
    kernels: tuple[KernelContext | FixedContext, ...]
    choices: tuple[str, ...]
    searches: tuple[SolverContext, ...]
    complete: tuple[CompleteContext, ...]
    ranges: tuple[RangeContext, ...]
    trackers: tuple[TrackerContext, ...]
    headers: tuple[str, ...]
    sources: tuple[str, ...]
    manuals: tuple[Manual, ...]
    selftests: tuple[Selftest, ...]
    steps: str
    example: Example
    has_double: bool
    target: str
    layout: Layout


def project_context(
    kernels: RobotPrograms,
    vectors: Vectors,
    reals: tuple[ScalarType, ...],
    layout: Layout,
    fixed: FixedKernels | None = None,
) -> ProjectContext:
    """Return everything the templates lay out.

    `fixed`: the kernels in integers; None without them.
    """
    robot = kernels.robot
    sentence = _sentence(metadata_of(kernels))
    floats = tuple(kernel_context(kernels, real) for real in reals)
    integers = (fixed_context(fixed),) if fixed else ()
    contexts: tuple[KernelContext | FixedContext, ...] = (*floats, *integers)
    # Whatever has a header of its own, in the order in which READMEs list it.
    solvers = _solvers(kernels, reals)
    printed = (*contexts, *solvers.all)
    return ProjectContext(
        sentence=sentence,
        markdown=markdown(sentence),
        json_name=json.dumps(robot.name),
        json_sentence=json.dumps(sentence, ensure_ascii=False),  # YAML knows no pairs of surrogates
        units=_units(robot, reals, fixed),
        joints=joint_lines(robot) if reals else contexts[0].joints,
        kernels=contexts,
        choices=tuple(each.nearest.name for each in floats if each.nearest),
        searches=solvers.searches,
        complete=solvers.complete,
        ranges=solvers.ranges,
        trackers=solvers.trackers,
        headers=tuple(each.header for each in printed),
        sources=tuple(each.source for each in printed),
        manuals=(*(_manual(kernels, context) for context in contexts), *solvers.manuals),
        selftests=(*(_selftest(kernels, vectors, real) for real in reals), *([_integer_test(robot)] if fixed else [])),
        steps=_steps(kernels) if reals else "Integers alone: a processor needs no FPU.",
        example=fixed_example(fixed)
        if fixed and not reals
        else example_of(kernels, vectors, contexts[0].header, reals[0]),
        has_double=ScalarType.DOUBLE in reals,
        target=cmake_target(robot.name),
        layout=layout,
    )


@dataclass(frozen=True, slots=True)
class _Solvers:
    """Holds what there is of the outputs without a program."""

    searches: tuple[SolverContext, ...]
    complete: tuple[CompleteContext, ...]
    ranges: tuple[RangeContext, ...]
    trackers: tuple[TrackerContext, ...]

    @property
    def all(self) -> tuple[SolverContext | CompleteContext | RangeContext | TrackerContext, ...]:
        """Each of them has files of its own."""
        return (*self.searches, *self.complete, *self.ranges, *self.trackers)

    @property
    def manuals(self) -> tuple[Manual, ...]:
        """Their functions, for readers."""
        return (
            *map(_search_manual, self.searches),
            *map(_complete_manual, self.complete),
            *map(_range_manual, self.ranges),
            *map(_tracker_manual, self.trackers),
        )


def _solvers(kernels: RobotPrograms, reals: tuple[ScalarType, ...]) -> _Solvers:
    if kernels.complete_inverse:
        require_double(kernels.robot, reals)
    return _Solvers(
        searches=tuple(solver_context(kernels, real) for real in reals * kernels.numeric_inverse),
        complete=(complete_context(kernels),) if kernels.complete_inverse else (),
        ranges=tuple(range_context(kernels, real) for real in reals * kernels.redundancy_range),
        trackers=tuple(tracker_context(kernels, real) for real in reals * kernels.inverse_tracker),
    )


def _steps(kernels: RobotPrograms) -> str:
    """Return which functions take the same time for all inputs."""
    if all(map(is_straight, kernels.programs)):
        loops = ["the search"] * kernels.numeric_inverse + ["the complete inverse"] * kernels.complete_inverse
        loops += ["the ranges of the redundancy"] * kernels.redundancy_range
        loops += ["the tracker"] * kernels.inverse_tracker
        functions = f"every function but {' and '.join(loops)} takes" if loops else "every function takes"
    else:
        functions = "a function without square roots, arc tangents and selections takes"
    return f"On a processor with an FPU for its numbers, {functions} the same instructions for every input."


def _units(robot: Robot, reals: tuple[ScalarType, ...], fixed: FixedKernels | None) -> str:
    """Return the units of arguments and results."""
    floats = f"Angles are in rad, lengths in {robot.units.length}."
    if fixed is None:
        return floats
    integers = (
        "angles in 1/2^32 turn, rotation entries in 1/2^30, lengths in "
        f"1/2^{macro(prefix(robot.name, Q30), 'LENGTH_BITS')} {robot.units.length}"
    )
    return (
        f"{floats} Of the q30 functions every number is an int32_t: {integers}."
        if reals
        else f"Every number is an int32_t: {integers}."
    )


def _manual(kernels: RobotPrograms, context: KernelContext | FixedContext) -> Manual:
    prototypes = [function.prototype for function in context.functions]
    functions = tuple(
        (prototype, brief(program.signature), operation_line(program))
        for prototype, program in zip(prototypes, kernels.programs, strict=True)
    )
    if isinstance(context, KernelContext) and context.nearest:
        what = f"The solution of {context.nearest.inverse} nearest to a joint vector."
        functions = (*functions, (context.nearest.prototype, what, "one inverse, and a choice among its solutions"))
    accuracy = context.sincos.accuracy if isinstance(context, KernelContext) and context.sincos else ""
    return Manual(context.header, accuracy, functions)


def _search_manual(search: SolverContext) -> Manual:
    what = f"Joint values for {'poses of all tips' if search.tips else 'a pose of the tool'}, by a search."
    return Manual(search.header, "", ((search.prototype, what, "a bounded number of steps"),))


def _tracker_manual(tracker: TrackerContext) -> Manual:
    start, step, speeds = tracker.prototypes
    functions = (
        (start, "Begins a path at a joint vector.", "one inverse"),
        (step, "Goes to the next target of a path.", "one inverse, and a bounded number of steps"),
        (speeds, "The joint speeds that a velocity of the tool costs.", "one pose with its Jacobian, and a few steps"),
    )
    return Manual(tracker.header, "", functions)


def _complete_manual(complete: CompleteContext) -> Manual:
    what = "All joint vectors for a pose of the tool."
    return Manual(complete.header, "", ((complete.prototype, what, "a bounded number of steps"),))


def _range_manual(ranges: RangeContext) -> Manual:
    intervals = f"Intervals of {ranges.redundancy} for a pose of the tool."
    nearest = "The solution nearest to a joint vector, over all of these."
    cost = "a bounded number of solutions of the inverse"
    functions = (ranges.prototype, intervals, cost), (ranges.nearest_prototype, nearest, cost)
    return Manual(ranges.header, "", functions)


def _sentence(about: Metadata) -> str:
    """Return what the package is, in one line that any manifest can hold."""
    sentence = f"{about.subject}: {about.description.rstrip('. ') or about.name}."
    return sentence if len(sentence) <= _LONGEST_SENTENCE else f"{sentence[: _LONGEST_SENTENCE - 3]}..."


def _selftest(kernels: RobotPrograms, vectors: Vectors, real: ScalarType) -> Selftest:
    robot = kernels.robot
    stem = prefix(robot.name, real)
    checks = [(f"{stem}_selftest", macro(stem, "TOLERANCE"))]
    if branches_of(kernels):
        checks.append((f"{stem}_selftest_inverse", macro(stem, "INVERSE_TOLERANCE")))
    if vectors.pairs:
        checks.append((f"{stem}_selftest_sincos", macro(stem, "PAIR_TOLERANCE")))
    return Selftest(
        source=selftest_file(robot.name, real),
        vectors=vectors_file(robot.name, real),
        program=f"{stem}_selftest",
        checks=tuple(checks),
        inverse=branches_of(kernels) is not None,
        real=real.value,
        zero=real.literal(Fraction(0)),
    )


def _integer_test(robot: Robot) -> Selftest:
    """Return the self-test of the kernels in integers."""
    stem = prefix(robot.name, Q30)
    return Selftest(
        source=selftest_file(robot.name, Q30),
        vectors=vectors_file(robot.name, Q30),
        program=f"{stem}_selftest",
        checks=((f"{stem}_selftest", macro(stem, "TOLERANCE")),),
        inverse=False,
        real="uint32_t",
        zero="",
    )


def emit_project(
    kernels: RobotPrograms,
    vectors: Vectors,
    files: Mapping[str, str],
    reals: tuple[ScalarType, ...],
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
    robot = metadata_of(kernels)
    if ecosystem is Ecosystem.ARDUINO and robot.name.lower().startswith("arduino"):
        raise KinegenError(
            f"robot name {robot.name!r} begins as only Arduino's own libraries may; give it another `name:`"
        )
    layout = LAYOUTS[ecosystem]
    context = project_context(kernels, vectors, reals, layout, fixed)
    project = {
        path: environment().get_template(f"packages/{template}").render(robot=robot, p=context)
        for path, template in layout.rendered.items()
    }
    places = (
        (layout.headers, context.headers),
        (layout.sources, context.sources),
        (layout.selftest, (name for test in context.selftests for name in (test.source, test.vectors))),
    )
    return project | {f"{folder}/{name}": files[name] for folder, names in places for name in names}
