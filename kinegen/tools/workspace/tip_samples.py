"""Fills the box of the joint ranges with joint vectors, evaluates the tip there, and finds what it sweeps.

Random joint vectors leave gaps beside clusters: of n voxels that random samples hit m times each on average, n exp(-m)
stay empty, and the gaps are worst along the rim of a workspace, where only a thin part of the joint box leads. The
additive recurrence of Roberts ("The unreasonable effectiveness of quasirandom sequences", 2018) spreads its points so
that no cluster forms, costs one product and one remainder a number, gives any point without those before it, and stays
even wherever it ends. Joints that do not move the tip are left out: a spread is the easier the fewer dimensions there
are.

The rank of the tip's Jacobian at generic joint vectors is the dimension of what is swept: 1 for a curve, 2 for a
surface or a planar region, 3 for a solid. The singular values of sampled points say how many dimensions of space hold
it: a circle is a curve that takes 2, a sphere a surface that takes 3.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from kinegen.backends.bundle import RobotPrograms
from kinegen.driver.artifacts import make_package
from kinegen.errors import KinegenError
from kinegen.ir.program import Program, Temporary, Variable
from kinegen.model.joint_bounds import joint_box
from kinegen.model.outputs import Kind, Quantity
from kinegen.model.robot import TOOL, JointType, Robot
from kinegen.support.dataclass import dataclass
from kinegen.verify import reference


@dataclass(frozen=True, slots=True)
class Range:
    """The range of a joint variable, in radians or the file's length unit.

    Without limits of a file it is a full turn, or the sum of the lengths to either side.
    """

    name: str
    type: JointType
    low: float
    high: float
    limited: bool

    @property
    def bounds(self) -> tuple[float, float]:
        """Return the ends of a search: a joint that turns in place without limits has none; a screw climbs."""
        if self.limited or self.type is not JointType.REVOLUTE:
            return self.low, self.high
        return -math.inf, math.inf


def joint_ranges(robot: Robot, limits_from: Robot | None = None) -> tuple[Range, ...]:
    """Return the ranges of a robot's joint variables, with the limits of the joints of another robot if it is given.

    Raises:
        KinegenError: If the other robot lacks a joint, has one of another type, or measures lengths otherwise.
    """
    source = limits_from or robot
    known = dict(zip((variable.name for variable in source.variables), joint_box(source), strict=True))
    variables = {variable.name: variable for variable in source.variables}
    if source.units.length != robot.units.length:
        raise KinegenError(f"{source.source} measures in {source.units.length}, {robot.source} in {robot.units.length}")
    found = []
    # Limits of another robot count for joints of the same name and type.
    for variable in robot.variables:
        other = variables.get(variable.name)
        if other is None or other.type is not variable.type:
            what = "no joint variable" if other is None else f"a {other.type} joint"
            raise KinegenError(
                f"{source.source} has {what} {variable.name!r}, expected a {variable.type} one as in {robot.source}"
            )
        found.append(Range(variable.name, variable.type, *known[variable.name], limited=other.limits is not None))
    return tuple(found)


FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Samples:
    """A sequence of joint vectors, in which the `movers` vary; the others stay in the middle of their ranges.

    Attributes:
        box: Shape (dof, 2), the ends of each joint variable's range.
        bounds: Shape (dof, 2), how far a search that begins at a sample may go.
        start: Shape (movers,), the point of the unit cube where the sequence begins.
    """

    box: FloatArray
    bounds: FloatArray
    movers: tuple[int, ...]
    start: FloatArray

    def at(self, indices: IndexArray) -> FloatArray:
        """Return the joint vectors of some places in the sequence, shape (dof, N)."""
        q = np.empty((len(self.box), len(indices)))
        q[:] = self.box.mean(axis=1)[:, None]
        for mover, part in zip(self.movers, spread(indices, self.start), strict=True):
            low, high = self.box[mover]
            # Rounding may carry the largest values over the bound.
            np.minimum(low + part * (high - low), high, out=q[mover])
        return q


def spread(indices: IndexArray, start: FloatArray) -> Iterator[FloatArray]:
    """Some points of the sequence that begins at a point (d,) of the unit cube, one coordinate (N,) after the other."""
    count = indices.astype(float)
    for first, step in zip(start, _steps(len(start)), strict=True):
        part = count * step
        part += first
        part -= np.floor(part)
        yield part


def sequence(ranges: tuple[Range, ...], movers: tuple[int, ...], seed: int) -> Samples:
    """Return the sequence in which some joint variables vary; equal seeds give equal sequences."""
    box = np.array([(each.low, each.high) for each in ranges]).reshape(-1, 2)
    bounds = np.array([each.bounds for each in ranges]).reshape(-1, 2)
    return Samples(box, bounds, movers, np.random.default_rng(seed).random(len(movers)))


def _steps(dimensions: int) -> FloatArray:
    """Return powers of 1/g with g^(d+1) = g + 1: the golden ratio for one dimension, the plastic number for two."""
    root = 2.0
    for _ in range(64):  # a contraction by more than a half
        root = (1.0 + root) ** (1.0 / (dimensions + 1))
    return root ** -np.arange(1.0, dimensions + 1)


WRIST_CENTRE = "wrist_centre"
"""The point where the axes of the last three joints meet, as data sheets quote the reach of an arm."""

_PLACES, _NEAR = 16, 1e-9
"""Joint vectors at which a wrist is looked at, and how far its centre may move, of its distance from the base."""


@dataclass(frozen=True, slots=True)
class Tip:
    """One tip of a robot, or a link or named frame.

    Attributes:
        movers: Places in the joint vector of those variables on which the tip's position depends.
        position: Joint vectors (dof, N), in radians and lengths, to points (3, N) in the base frame.
        backend: What evaluates: `c`, or `numpy` without a compiler.
    """

    name: str
    dof: int
    movers: tuple[int, ...]
    position: Callable[[FloatArray], FloatArray]
    backend: str


def position_of(robot: Robot, name: str | None = None) -> Quantity:
    """Return the output that gives the position of a frame or the `WRIST_CENTRE`, by default of a chain's tip.

    Raises:
        KinegenError: If there is no such frame, there are several tips and none is named, or no frame is at the wrist
            centre.
    """
    frames = robot.frame_names
    if name is None and robot.is_tree:
        raise KinegenError(f"{robot.name} has {len(robot.tips)} tips; choose one with --tip ({', '.join(robot.tips)})")
    if name is None or name == TOOL:
        return Quantity.POSITION
    if name == WRIST_CENTRE and name not in frames:
        return Quantity(Kind.POSITION, frame=_wrist_centre(robot))
    if name not in frames:
        raise KinegenError(f"unknown tip {name!r} (expected {', '.join((*frames, WRIST_CENTRE))})")
    return Quantity(Kind.POSITION, frame=name)


def find_tip(kernels: RobotPrograms) -> Tip:
    """Compile the position kernel of a robot, its only program."""
    program = kernels.programs[0]
    kernel = getattr(make_package(kernels), program.quantity.function)

    def position(q: FloatArray) -> FloatArray:
        points: FloatArray = kernel(q, layout="joint_major", threads=1)
        return points

    (frame,) = program.signature.frames
    return Tip(frame, kernels.robot.dof, _movers(program), position, str(kernel.backend))


def _wrist_centre(robot: Robot) -> str:
    """The frame whose origin stays where it is, as a point of the tool, whichever of the last three joints turns."""
    last = robot.variables[-3:]
    if not robot.is_tree and len(last) == 3 and all(variable.type is JointType.REVOLUTE for variable in last):
        q = np.random.default_rng(1).uniform(-1, 1, (_PLACES, robot.dof))
        # A point about which all three joints turn stays where it is in the tool.
        before = reference.frames(robot, q)
        moves = []
        for variable in last:
            after = reference.frames(robot, q + np.eye(robot.dof)[variable.index])
            moves.append(after[TOOL] @ np.linalg.inv(before[TOOL]))
        for name in robot.frame_names:
            origin = before[name][:, :, 3:]
            near = _NEAR * float(np.abs(origin[:, :3]).max())
            if all(np.abs(move @ origin - origin).max() <= near for move in moves):
                return name
    raise KinegenError(f"{robot.name} has no frame where the axes of its last three joints meet")


def _movers(program: Program) -> tuple[int, ...]:
    """Return the inputs that the outputs depend on, in order."""
    wanted = set(program.outputs)
    for statement in reversed(program.statements):
        if not wanted.isdisjoint(map(Temporary, statement.results)):
            wanted.update(statement.operands)
    return tuple(sorted(operand.index for operand in wanted if isinstance(operand, Variable)))


FLAT = 1e-9
"""Thickness, relative to the size of the region, below which it has none; rounding leaves 1e-15."""

_RANK = 1e-7
_STEP = 1e-5
"""Of a joint's range; differences over it are true to some 1e-10, of the region's size."""

_SHAPE_PLACES = 64

_NAMES = {0: "point", 1: "curve", 2: "surface", 3: "solid"}


@dataclass(frozen=True, slots=True)
class Shape:
    """The kind of a region, a point `through` which its space goes, and the axes in which it is measured.

    Attributes:
        dimension: Of the region itself: 0 a point, 1 a curve, 2 a surface or planar region, 3 a solid.
        axes: Shape (D, 3), unit vectors in the base frame that span the space which holds it.
        names: A name for each axis: x, y, z where it is one of the base frame, else u, v.
    """

    dimension: int
    axes: FloatArray
    names: tuple[str, ...]
    through: FloatArray

    @property
    def fills(self) -> bool:
        """Tell whether the region has a length, area or volume in the space that holds it."""
        return self.dimension == len(self.axes)

    @property
    def kind(self) -> str:
        """Return what it is, in words."""
        if self.fills and 1 <= self.dimension <= 2:
            return ("straight line", "planar region")[self.dimension - 1]
        return _NAMES[self.dimension]


def find_shape(tip: Tip, samples: Samples, points: FloatArray) -> Shape:
    """Find the kind of the region from the points (3, N) to which some samples lead."""
    through = points.mean(axis=1)
    size = max(float(np.ptp(points, axis=1).max()), np.finfo(float).tiny)
    # A region that is too small for its distance from the base is rounding.
    if size <= FLAT * float(np.abs(points).max()):
        return Shape(0, np.zeros((0, 3)), (), through)
    directions = np.linalg.svd((points - through[:, None]).T, full_matrices=False)[2]
    thickness = np.ptp(directions @ points, axis=1)
    spanning = int((thickness > FLAT * size).sum())
    axes, names = _axes(directions, spanning)
    return Shape(min(_rank(tip, samples, size), spanning), axes, names, through)


def _axes(directions: FloatArray, spanning: int) -> tuple[FloatArray, tuple[str, ...]]:
    """Axes of the base frame where they serve; in a slanting plane a level one, and one that rises."""
    if spanning == 3:
        return np.eye(3), ("x", "y", "z")
    across = directions[spanning:]
    # Axes of the base frame where the region lies along them, since people know these.
    along = [axis for axis in range(3) if np.abs(across[:, axis]).max() <= FLAT]
    if len(along) == spanning:
        return np.eye(3)[along], tuple("xyz"[axis] for axis in along)
    if spanning == 1:
        line = directions[0]
        return (line * np.sign(line[np.abs(line).argmax()]))[None], ("u",)
    # Otherwise one axis is level, which a picture needs.
    normal = across[0] * np.sign(across[0][np.abs(across[0]).argmax()])
    level = np.cross([0.0, 0.0, 1.0], normal)
    level /= np.linalg.norm(level)
    return np.stack([level, np.cross(normal, level)]), ("u", "v")


def _rank(tip: Tip, samples: Samples, size: float) -> int:
    """Return the largest rank of the Jacobian, from differences over a small part of each joint's range."""
    q = samples.at(np.arange(_SHAPE_PLACES))
    columns = []
    for mover in tip.movers:
        step = np.zeros_like(q)
        step[mover] = _STEP * np.ptp(samples.box[mover])
        columns.append((tip.position(q + step) - tip.position(q - step)) / (2 * _STEP * size))
    if not columns:
        return 0
    jacobians = np.stack(columns, axis=1).transpose(2, 0, 1)
    return int((np.linalg.svd(jacobians, compute_uv=False) > _RANK).sum(axis=1).max())
