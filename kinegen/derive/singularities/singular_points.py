"""Joint vectors at which factors of a determinant vanish, and what happens there in words.

They are found by Newton's method, with the lengths of the file. The smallest set of joints is sought whose motions are
dependent at all of them and in general are not, and the axes of these joints are looked at. One joint vector is not
enough: of two links of one length, the end is on the axis of the first where they are folded and beside it where they
are stretched.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from kinegen.derive.singularities.loci import Loci, singular_loci
from kinegen.derive.singularities.screws import SEED, Numbers, Screws, View
from kinegen.errors import KinegenError
from kinegen.model.expression_parser import evaluate
from kinegen.model.expression_values import FLOAT64
from kinegen.model.robot import Robot

Floats = NDArray[np.float64]

STEPS = 60
CLOSE = 1e-9


def lengths_of(robot: Robot) -> dict[sp.Symbol, float]:
    """Return the values of the parameters in the file, by their symbols."""
    return {sp.Symbol(entry.name, real=True): evaluate(entry.value, {}, FLOAT64) for entry in robot.parameters}


def vanishing(
    expressions: Sequence[sp.Expr], joints: Sequence[sp.Symbol], lengths: dict[sp.Symbol, float], starts: Floats
) -> Floats:
    """Joint vectors at which some expressions vanish together.

    Returns shape (M, joints), at most one for each start: the nearest ones, as far as steps by the slopes lead there.
    `starts`: where to begin, shape (N, joints).
    """
    exact = sp.Matrix([expression.subs(lengths) for expression in expressions])
    value = sp.lambdify([list(joints)], exact, "numpy")
    slopes = sp.lambdify([list(joints)], exact.jacobian(list(joints)), "numpy")
    found = []
    for start in starts:
        q = start
        for _ in range(STEPS):
            step = np.linalg.pinv(slopes(q), rcond=CLOSE) @ value(q)[:, 0]
            q = q - step
            if not np.isfinite(q).all() or np.abs(step).max() < CLOSE**2:
                break
        size = np.abs(slopes(q)).max(initial=0)
        if np.isfinite(q).all() and np.abs(value(q)).max() < CLOSE * (size or 1):
            found.append(q)
    return np.array(found).reshape(-1, len(joints))


def singular_points(robot: Robot, box: Sequence[tuple[float, float]], count: int) -> Floats:
    """Joint vectors at which the Jacobian of the first tip loses rank, from the factors of its determinant.

    Returns shape (N, dof); none where the factors are not known. Arms with fewer than six joints have places at which
    several factors have to vanish together. `box`: lower and upper end of each joint variable; starts are inside, what
    is found may be outside. `count`: from how many joint vectors each place is looked for.
    """
    none = np.zeros((0, robot.dof))
    try:
        loci = singular_loci(robot, robot.root, robot.tips[0])
    except KinegenError:
        return none
    low, high = np.array(box).reshape(-1, 2).T
    starts = np.random.default_rng(SEED).uniform(low, high, (count, robot.dof))
    joints = [sp.Symbol(variable.name, real=True) for variable in robot.variables]
    lengths = lengths_of(robot)
    return np.concatenate([none, *(vanishing(each, joints, lengths, starts) for each in loci.sets or ())])


STARTS = 40

AT_ONCE = 12
"""So many of these are tried first; where some lead to joint vectors, the others are not."""

RANK = 1e-7

_UNREACHED = "not reached with the lengths of the file"

_LINEAR, _ANGULAR = slice(0, 3), slice(3, 6)


def meanings(robot: Robot, screws: Screws, loci: Loci, sets: Sequence[Sequence[sp.Expr]], end: str) -> tuple[str, ...]:
    """Return words for sets of expressions that vanish together.

    Returns for each set words such as `wrist aligned: axes 4 and 6 coincide`; empty where nothing is known. `sets`:
    some of `loci.sets`.
    """
    arm = _Arm(robot, screws, loci, end)
    # Where joints are left over, some motions are dependent in one place and the Jacobian is singular in none.
    if len(loci.joints) > loci.rank:
        return tuple(
            "; ".join(filter(None, (arm.words([each]) for each in some))) if arm.reaches(some) else _UNREACHED
            for some in sets
        )
    return tuple(arm.words(some) for some in sets)


class _Arm:
    """An arm with the lengths of its file."""

    def __init__(self, robot: Robot, screws: Screws, loci: Loci, end: str) -> None:
        self.screws, self.loci, self.end = screws, loci, end
        self.lengths = lengths_of(robot)
        numbers = {variable.name: variable.index + 1 for variable in robot.variables}
        self.names = [numbers[joint.name] for joint in screws.joints]
        kinds = {row[0] for row in loci.rows} if loci.partial else set()
        self.kept = {"v": _LINEAR, "w": _ANGULAR}.get("".join(kinds), slice(0, 6))
        self.random = np.random.default_rng(SEED)
        count = len(screws.joints)
        self.generic = self.at(self.random.uniform(0.3, 1.3, count))
        # A joint that others follow turns about no axis of its own.
        self.turning = [
            self.generic.twists[3:, joint].any() and len(screws.rates[joint]) == 1 for joint in range(count)
        ]
        self.centre = self._centre()

    def at(self, q: Floats) -> Numbers:
        return self.screws.numbers(self.lengths | dict(zip(self.screws.joints, q.tolist(), strict=True)))

    def words(self, expressions: Sequence[sp.Expr]) -> str:
        places = [self.at(q) for q in self.vanishing(expressions)]
        if not places:
            return _UNREACHED
        for size in range(1, len(self.names) + 1):
            for some in combinations(range(len(self.names)), size):
                rank = self._rank(self.generic, some)
                if all(self._rank(there, some) < rank for there in places):
                    first, *others = dict.fromkeys(self._described(there, some) for there in places)
                    return self._dependent(some) if others else first
        return ""

    def reaches(self, expressions: Sequence[sp.Expr]) -> bool:
        return len(expressions) == 1 or len(self.vanishing(expressions)) > 0

    def vanishing(self, expressions: Sequence[sp.Expr]) -> Floats:
        """Joint vectors at which some expressions vanish and others do not, one a row."""
        starts = self.random.uniform(-np.pi, np.pi, (STARTS, len(self.names)))
        first, others = np.split(starts, [AT_ONCE])
        found = vanishing(expressions, self.screws.joints, self.lengths, first)
        return found if len(found) else vanishing(expressions, self.screws.joints, self.lengths, others)

    def _rows(self, numbers: Numbers) -> Floats:
        return numbers.jacobian(View(0, len(self.screws.steps)))[self.kept]

    def _rank(self, numbers: Numbers, some: Sequence[int]) -> int:
        rows = self._rows(numbers)[:, some]
        size = np.abs(self._rows(self.generic)[:, some]).max()
        return int(np.linalg.matrix_rank(rows, tol=RANK * size)) if size else 0

    def _centre(self) -> tuple[int, ...]:
        """Return three neighbouring joints, the last such, whose axes meet in one point in every pose."""
        for first in reversed(range(len(self.names) - 2)):
            some = (first, first + 1, first + 2)
            if all(self.turning[joint] for joint in some) and self._point(self.generic, some) is not None:
                return some
        return ()

    def _point(self, numbers: Numbers, some: Sequence[int]) -> Floats | None:
        """Return where the axes of some joints meet, if not all of them are parallel."""
        twists = numbers.twists[:, some]
        unit = twists / np.linalg.norm(twists[3:], axis=0)
        # v = p x w for the moment v of an axis along w through p.
        rows = np.concatenate([-_crossing(w) for w in unit[3:].T])
        if np.linalg.matrix_rank(rows, tol=RANK) < 3:
            return None
        point, *_ = np.linalg.lstsq(rows, unit[:3].T.ravel(), rcond=None)
        return point if np.allclose(rows @ point, unit[:3].T.ravel(), atol=RANK * (1 + np.abs(point).max())) else None

    def _described(self, there: Numbers, some: tuple[int, ...]) -> str:
        if not all(self.turning[joint] for joint in some):
            return f"the motions of joints {self._listed(some)} are dependent"
        if self.kept == _ANGULAR and np.linalg.matrix_rank(there.twists[:, some], tol=RANK) == len(some):
            # The axes are dependent in their directions alone.
            return f"axes {self._listed(some)} are parallel" + (" to one plane" if len(some) > 2 else "")
        if self.kept == _LINEAR:
            return self._at_point(there, some, there.frames[-1][:3, 3], self.end)
        if self.centre and set(self.centre) < set(some):
            point = self._point(there, self.centre)
            rest = tuple(joint for joint in some if joint not in self.centre)
            name = f"the point where axes {self._listed(self.centre)} meet"
            return self._at_point(there, rest, point, name) if point is not None else self._dependent(some)
        return self._of_axes(there, some)

    def _of_axes(self, there: Numbers, some: tuple[int, ...]) -> str:
        parallel = self._parallel(there, some)
        if len(some) == 2:
            return f"{self._wrist(some)}axes {self._listed(some)} coincide"
        if parallel and len(some) == 3:
            return f"elbow stretched or folded: the parallel axes {self._listed(some)} are in one plane"
        if parallel:
            return f"{self._wrist(some)}axes {self._listed(some)} are parallel"
        if self._point(there, some) is not None:
            return f"axes {self._listed(some)} meet in one point" + (" and are in one plane" if len(some) == 3 else "")
        return self._across(there, some) or self._dependent(some)

    def _at_point(self, there: Numbers, rest: tuple[int, ...], point: Floats, name: str) -> str:
        """Return words for a point that the joints cannot move in every direction."""
        if len(rest) == 1:
            return f"{self._shoulder(rest)}{name} is on axis {self._listed(rest)}"
        if len(rest) == 2 and self._coincide(there, rest):
            return f"axes {self._listed(rest)} coincide"
        if len(rest) == 2 and self._parallel(there, rest):
            return f"elbow stretched or folded: {name} is in the plane of axes {self._listed(rest)}"
        if len(rest) == 2:
            return f"{self._shoulder(rest)}{name} is in the plane of axes {self._listed(rest)}"
        return self._over(there, rest, point, name) or f"joints {self._listed(rest)} move {name} in one plane only"

    def _over(self, there: Numbers, rest: tuple[int, ...], point: Floats, name: str) -> str:
        """Return words for a point in the plane through one axis that is parallel to others."""
        first, *others = rest
        if not self._parallel(there, others):
            return ""
        if self._parallel(there, rest):
            return f"axes {self._listed(rest)} are parallel"
        axis = there.twists[3:, others[0]]
        speed = there.twists[:3, first] + np.cross(there.twists[3:, first], point)
        if abs(speed @ axis) > RANK * (1 + np.abs(point).max()) * np.linalg.norm(axis):
            return ""
        plane = f"the plane through axis {self._listed([first])} parallel to axes {self._listed(others)}"
        return f"{self._shoulder(rest)}{name} is in {plane}"

    def _across(self, there: Numbers, some: tuple[int, ...]) -> str:
        """Return the same for the point where two axes meet, beside parallel axes."""
        for run in combinations(some, 3):
            rest = [joint for joint in some if joint not in run]
            if len(rest) != 3 or not self._parallel(self.generic, run):
                continue
            point = self._point(there, rest[1:])
            if point is not None and self._point(self.generic, rest[1:]) is not None:
                return self._over(there, (rest[0], *run), point, f"the point where axes {self._listed(rest[1:])} meet")
        return ""

    def _parallel(self, numbers: Numbers, some: Sequence[int]) -> bool:
        axes = numbers.twists[3:, some]
        return all(np.linalg.norm(np.cross(axes[:, 0], axis)) < RANK * np.linalg.norm(axis) for axis in axes.T)

    def _coincide(self, numbers: Numbers, some: Sequence[int]) -> bool:
        twists = numbers.twists[:, some]
        return int(np.linalg.matrix_rank(twists, tol=RANK * np.abs(twists).max())) == 1

    def _wrist(self, some: Sequence[int]) -> str:
        return "wrist aligned: " if some[-1] == len(self.names) - 1 > 3 else ""

    def _shoulder(self, some: Sequence[int]) -> str:
        return "shoulder: " if self.names[some[0]] == 1 else ""

    def _dependent(self, some: Sequence[int]) -> str:
        return f"the motions of joints {self._listed(some)} are dependent"

    def _listed(self, some: Sequence[int]) -> str:
        *most, last = (str(self.names[joint]) for joint in some)
        return f"{', '.join(most)} and {last}" if most else last


def _crossing(w: Floats) -> Floats:
    return np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
