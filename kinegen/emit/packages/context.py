"""What the templates of packages are given: finished strings, the same for every ecosystem."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from fractions import Fraction

from kinegen.emit.c.complete_inverse import CompleteContext, complete_context
from kinegen.emit.c.expected import Vectors
from kinegen.emit.c.inverse_tracker import TrackerContext, tracker_context
from kinegen.emit.c.kernel import KernelContext, kernel_context
from kinegen.emit.c.numeric_inverse import SolverContext, solver_context
from kinegen.emit.c.redundancy_range import RangeContext, range_context
from kinegen.emit.complete.screws import require_double
from kinegen.emit.fixed.kernel import FixedContext, fixed_context
from kinegen.emit.fixed.kernels import FixedKernels
from kinegen.emit.functions import is_straight
from kinegen.emit.inverse import branches_of
from kinegen.emit.kernels import Kernels, joint_lines, operation_line, provenance
from kinegen.emit.packages.example import Example, example_of
from kinegen.emit.packages.integers import fixed_example
from kinegen.emit.packages.layout import Layout
from kinegen.emit.reals import Real
from kinegen.emit.words import brief, subject
from kinegen.naming import Q30, cmake_target, comment_text, macro, prefix, selftest_file, vectors_file
from kinegen.robot.model import Robot

_LONGEST_SENTENCE = 240  # PlatformIO's schema ends a description at 255 characters


@dataclass(frozen=True, slots=True)
class Selftest:
    """The self-test of one number type.

    Attributes:
        source: Its file, without folder.
        vectors: Its header, without folder.
        program: Name of the program that runs it.
        checks: C functions that return the largest difference, each with the macro of the largest accepted one.
        inverse: Whether an inverse is among what they check.
        real: Number type.
        zero: Zero in that type; empty for integers, which a self-test counts without a sign.
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
        """Whether differences are counted in units of the last place."""
        return not self.zero


@dataclass(frozen=True, slots=True)
class Manual:
    """What a README says of one header.

    Attributes:
        header: The header.
        accuracy: Of sines and cosines; empty where there are none.
        functions: Prototype of each function, what it computes, and what a call costs.
    """

    header: str
    accuracy: str
    functions: tuple[tuple[str, str, str], ...]


@dataclass(frozen=True, slots=True)
class ProjectContext:
    """What every template of a package is given, as `p`."""

    name: str
    upper: str
    version: str
    provenance: str
    description: str
    sentence: str
    markdown: str
    json_name: str
    json_sentence: str
    length: str
    units: str
    joints: tuple[str, ...]
    subject: str
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
    kernels: Kernels, vectors: Vectors, reals: tuple[Real, ...], layout: Layout, fixed: FixedKernels | None = None
) -> ProjectContext:
    """Everything the templates lay out.

    Args:
        kernels: The robot and its programs.
        vectors: Their test vectors.
        reals: Number types of the package.
        layout: Its folders.
        fixed: The kernels in integers; None without them.

    Returns:
        The context.
    """
    robot = kernels.robot
    about = subject(program.quantity for program in kernels.programs)
    sentence = _sentence(robot, about)
    floats = tuple(kernel_context(kernels, real) for real in reals)
    integers = (fixed_context(fixed),) if fixed else ()
    contexts: tuple[KernelContext | FixedContext, ...] = (*floats, *integers)
    solvers = _solvers(kernels, reals)
    printed = (*contexts, *solvers.all)
    return ProjectContext(
        name=robot.name,
        upper=robot.name.upper(),
        version=robot.release,
        provenance=provenance(robot),
        description=comment_text(robot.description),
        sentence=sentence,
        markdown=_markdown_text(sentence),
        json_name=json.dumps(robot.name),
        json_sentence=json.dumps(sentence, ensure_ascii=False),  # YAML knows no pairs of surrogates
        length=robot.units.length,
        units=_units(robot, reals, fixed),
        joints=joint_lines(robot) if reals else contexts[0].joints,
        subject=about,
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
        has_double=Real.DOUBLE in reals,
        target=cmake_target(robot.name),
        layout=layout,
    )


@dataclass(frozen=True, slots=True)
class _Solvers:
    """What there is of the outputs without a program."""

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


def _solvers(kernels: Kernels, reals: tuple[Real, ...]) -> _Solvers:
    if kernels.complete_inverse:
        require_double(kernels.robot, reals)
    return _Solvers(
        searches=tuple(solver_context(kernels, real) for real in reals * kernels.numeric_inverse),
        complete=(complete_context(kernels),) if kernels.complete_inverse else (),
        ranges=tuple(range_context(kernels, real) for real in reals * kernels.redundancy_range),
        trackers=tuple(tracker_context(kernels, real) for real in reals * kernels.inverse_tracker),
    )


def _steps(kernels: Kernels) -> str:
    """Which functions take the same time for all inputs."""
    if all(map(is_straight, kernels.programs)):
        loops = ["the search"] * kernels.numeric_inverse + ["the complete inverse"] * kernels.complete_inverse
        loops += ["the ranges of the redundancy"] * kernels.redundancy_range
        loops += ["the tracker"] * kernels.inverse_tracker
        functions = f"every function but {' and '.join(loops)} takes" if loops else "every function takes"
    else:
        functions = "a function without square roots, arc tangents and selections takes"
    return f"On a processor with an FPU for its numbers, {functions} the same instructions for every input."


def _units(robot: Robot, reals: tuple[Real, ...], fixed: FixedKernels | None) -> str:
    """The units of arguments and results."""
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


def _manual(kernels: Kernels, context: KernelContext | FixedContext) -> Manual:
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


def _sentence(robot: Robot, about: str) -> str:
    """What the package is, in one line that any manifest can hold."""
    described = comment_text(robot.description).rstrip(". ") or robot.name
    sentence = f"{about}: {described}."
    return sentence if len(sentence) <= _LONGEST_SENTENCE else f"{sentence[: _LONGEST_SENTENCE - 3]}..."


def _markdown_text(text: str) -> str:
    """Text that Markdown shows as it is."""
    return re.sub(r"([\\`*_{}\[\]<>#|])", r"\\\1", text)


def _selftest(kernels: Kernels, vectors: Vectors, real: Real) -> Selftest:
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
    """The self-test of the kernels in integers."""
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
