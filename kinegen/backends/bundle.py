"""What every emitter is given, and the sentences about a robot that several outputs print."""

from __future__ import annotations

import itertools
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from fractions import Fraction

from kinegen import __version__
from kinegen.backends.complete_inverse.screws import refusal, refused
from kinegen.backends.solver_parameters import require_trackable
from kinegen.errors import KinegenError
from kinegen.ir.program import Count, Program, count
from kinegen.model.expression_parser import Expression, evaluate
from kinegen.model.expression_values import FLOAT64, Dimension
from kinegen.model.outputs import SOLVERS, Kind, Quantity
from kinegen.model.robot import JointType, Robot
from kinegen.support.dataclass import dataclass
from kinegen.support.naming import PARTS, comment_text, companion, refuse_words


def redundancy_refusal(robot: Robot) -> str:
    """Return why a robot cannot have the ranges; empty if it can."""
    if not robot.redundancy:
        return "its inverse takes the pose alone; redundancy (in the file, or --redundancy) names what else it is given"
    if len(robot.given) > 1:
        return f"its inverse is given {len(robot.given)} values ({robot.redundancy}), and the ranges are those of one"
    if robot.is_tree:
        return "it has several tips"
    if robot.runtime_parameters:
        return f"{robot.runtime_parameters[0].name} is a runtime parameter, and the search takes lengths as they are"
    for variable in robot.variables:
        is_endless = variable.type is JointType.PRISMATIC and variable.limits is None
        if variable.name == robot.redundancy and is_endless:
            return f"joint {variable.name} has no limits, so that its range has no end"
    return ""


def redundancy_refused(robot: Robot, reason: str) -> KinegenError:
    """Return the error for a robot without the ranges."""
    return KinegenError(f"no redundancy range for {robot.name}: {reason}", robot.source)


@dataclass(frozen=True, slots=True)
class RobotPrograms:
    """A robot and its programs, one for each quantity asked for.

    Attributes:
        programs: In the order of `Quantity`.
        defaults: The file's values of the runtime parameters, in their order, in kernel units.
        numeric_inverse: Whether the search for joint values is wanted, which needs the pose with its Jacobian.
        complete_inverse: Whether all solutions of an arm with six turning joints are wanted, which need it too.
        redundancy_range: Whether the ranges of the redundancy are wanted, which need it and the inverse.
        inverse_tracker: Whether the inverse along a path is wanted, which needs it and the inverse.

    Raises:
        KinegenError: If two programs would give functions of the same name, or the search has nothing to search.
    """

    robot: Robot
    programs: tuple[Program, ...]
    defaults: tuple[Fraction, ...]
    numeric_inverse: bool = False
    complete_inverse: bool = False
    redundancy_range: bool = False
    inverse_tracker: bool = False

    def __post_init__(self) -> None:
        _check_words(self.robot)
        _check_names(self.robot, tuple(program.quantity for program in self.programs))
        if self.numeric_inverse and not self.robot.dof:
            raise KinegenError(f"no numeric inverse for {self.robot.name}: it has no joints", self.robot.source)
        if self.complete_inverse and (reason := refusal(self.robot)):
            raise refused(self.robot, reason)
        if self.redundancy_range and (reason := redundancy_refusal(self.robot)):
            raise redundancy_refused(self.robot, reason)
        if self.inverse_tracker:
            branches = (program.signature.branches for program in self.programs)
            require_trackable(self.robot, next(filter(None, branches), None))

    def alone(self, *programs: Program) -> RobotPrograms:
        """Return some of the programs by themselves, without the outputs that have none, which may need others."""
        return RobotPrograms(self.robot, programs, self.defaults)

    @property
    def solvers(self) -> tuple[Quantity, ...]:
        """The outputs without a program that are wanted."""
        wanted = self.numeric_inverse, self.complete_inverse, self.redundancy_range, self.inverse_tracker
        return tuple(itertools.compress(SOLVERS, wanted))


def _check_words(robot: Robot) -> None:
    """Refuse names that `show` prints but no C can have."""
    names = [("robot", robot.name), *(("parameter", parameter.name) for parameter in robot.parameters)]
    names += [*(("joint", row.name) for row in robot.rows), *(("frame", frame.name) for frame in robot.frames)]
    try:
        refuse_words(names)
    except KinegenError as error:
        raise KinegenError(error.message, robot.source) from None


def _check_names(robot: Robot, quantities: tuple[Quantity, ...]) -> None:
    """Refuse quantities whose functions would have one name, such as the pose of a frame called jacobian."""
    inverses = [quantity for quantity in quantities if quantity.kind is Kind.INVERSE]
    if len(inverses) > 1:
        names = " and ".join(map(str, inverses[:2]))
        raise KinegenError(f"outputs {names}: a build has one inverse; build them separately", robot.source)
    taken: dict[str, Quantity] = {}
    for quantity in quantities:
        for name in (quantity.function, *(companion(quantity.function, part) for part in PARTS)):
            other = taken.setdefault(name, quantity)
            if other != quantity:
                reason = f"outputs '{other}' and '{quantity}' would both be called {name}"
                raise KinegenError(f"{reason}; build them separately or rename the frame", robot.source)


def provenance(robot: Robot) -> str:
    """Return the line that says what reproduces a file; nothing in it varies between machines or days."""
    return f"Generated by kinegen {__version__} from {comment_text(robot.source)}, model {robot.digest}."


def joint_lines(robot: Robot) -> tuple[str, ...]:
    """Return one line for each entry of the joint vector: place, name, type, unit, limits."""
    width = max((len(variable.name) for variable in robot.variables), default=0)
    place = len(f"q[{robot.dof - 1}]")
    lines = []
    for variable in robot.variables:
        unit = robot.units.length if variable.type is JointType.PRISMATIC else "rad"
        limits = "no limits"
        if variable.limits is not None:
            low, high = map(_outwards, variable.limits, (ROUND_FLOOR, ROUND_CEILING))
            limits = f"{low} to {high}"
        index = f"q[{variable.index}]"
        lines.append(f"{index:<{place}}  {variable.name:<{width}}  {variable.type.value:<9}  {unit:<3}  {limits}")
    return tuple(lines)


def parameter_lines(robot: Robot) -> tuple[str, ...]:
    """Return one line for each runtime parameter: name, unit, value in the file."""
    units = {Dimension.LENGTH: robot.units.length, Dimension.ANGLE: "rad", Dimension.NUMBER: "1"}
    width = max((len(parameter.name) for parameter in robot.runtime_parameters), default=0)
    return tuple(
        f"{parameter.name:<{width}}  {units[parameter.dimension]:<3}  {_decimal(parameter.value)}"
        for parameter in robot.runtime_parameters
    )


def _outwards(limit: Expression, rounding: str) -> str:
    """Return a limit with six digits that leave no joint value between the limits outside."""
    exact = Decimal(repr(float(evaluate(limit, {}, FLOAT64))))
    return f"{float(Context(prec=6, rounding=rounding).plus(exact)):.6g}"


def _decimal(expression: Expression) -> str:
    return f"{evaluate(expression, {}, FLOAT64):.6g}"


def operation_line(program: Program) -> str:
    """Return the operations of one call, in words."""
    counted: Count = count(program)
    parts = (
        (counted.multiplications, "multiplication", "multiplications"),
        (counted.additions, "addition", "additions"),
        (counted.negations, "change of sign", "changes of sign"),
        (counted.divisions, "division", "divisions"),
        (counted.sine_cosines, "sine-cosine pair", "sine-cosine pairs"),
        (counted.roots, "square root", "square roots"),
        (counted.arc_tangents, "arc tangent", "arc tangents"),
        (counted.selections, "selection", "selections"),
    )
    words = (f"{number} {one if number == 1 else several}" for number, one, several in parts if number)
    return ", ".join(words) or "none"
