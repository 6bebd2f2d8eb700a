"""What trackers give, and what follows their paths: the compiled functions, or NumPy. It needs NumPy alone."""

from __future__ import annotations

from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._tracking import HUGE, Arm, Follower

Floats = NDArray[np.floating[Any]]


class Status(IntEnum):
    """What a step came to; the tracker has moved if it is positive, and is unchanged otherwise.

    FOLLOWED: the tool is at the target. LAGGING: joints were held back by `max_step`. The branch ends: OUT_OF_REACH,
    where no branch has a solution; AT_LIMIT, where a joint would pass its limit; OTHER_BRANCH, where a joint would have
    to leap. NOT_A_POSE: the target is not a pose, or not finite.
    """

    FOLLOWED = 1
    LAGGING = 2
    OUT_OF_REACH = 0
    AT_LIMIT = -1
    OTHER_BRANCH = -2
    NOT_A_POSE = -3


class Step(NamedTuple):
    """What a step came to.

    Attributes:
        status: The outcome.
        q: The joint vector of the tracker (dof,); the one before, if it has not moved.
        position_error: Distance of that to the target, in the file's length unit; 1e30 for what is not a pose.
        rotation_error: Angle to the target in rad, likewise; 0 where the rotation is not read.
        branch: Row of `inverse` that it belongs to; -1 at a singularity where the path began, until it leaves it.
        joint: Index of the joint at its limit; None for other outcomes.
    """

    status: Status
    q: Floats
    position_error: float
    rotation_error: float
    branch: int
    joint: int | None


class Path(NamedTuple):
    """What the steps of a path came to, one row for each target.

    Attributes:
        q: Joint vectors (N, dof).
        status: Values of `Status` (N,).
        position_error: Distances to the targets (N,).
        rotation_error: Angles to the targets in rad (N,).
        branch: Rows of `inverse` (N,).
        joint: Indices of joints at their limits, or -1 (N,).
    """

    q: Floats
    status: NDArray[np.int32]
    position_error: Floats
    rotation_error: Floats
    branch: NDArray[np.int32]
    joint: NDArray[np.int32]


class Speeds(NamedTuple):
    """The joint speeds for a velocity of the tool.

    Attributes:
        qd: Speeds for the whole of it (dof,), in rad/s or the length unit per second.
        residual: What of it these speeds leave out (6,).
        factor: The largest part of it whose joint speeds are within `max_speed`, from 0 to 1.
    """

    qd: Floats
    residual: Floats
    factor: float


class Compiled:
    """The state of a tracker as the C struct, and the functions that move it.

    Args:
        native: What `load_native` gave.
        prefix: What the C names of the number type begin with.
        params: Values of the runtime parameters; None where there are none.
        q: The joint vector that the path begins at.
        given: The redundancy, if there is one.
    """

    def __init__(self, native: Any, prefix: str, params: Any, q: Floats, given: tuple[float, ...]) -> None:
        self._native, self._prefix, self._params, self._real = native, prefix, params, q.dtype
        whole = np.int32
        # The structs of the header.
        self._state = np.zeros(1, [("q", q.dtype, len(q)), ("branch", whole), ("changes", whole)])
        self._reported = [("errors", q.dtype, 2), ("joint", whole), ("branch", whole)]
        self._call("start", q, self._all_given(given, 1))

    @property
    def q(self) -> Floats:
        """The joint vector."""
        own: Floats = self._state["q"][0]
        return own.copy()

    @property
    def branch(self) -> int:
        """The row of `inverse`, or less."""
        return int(self._state["branch"][0])

    @property
    def changes(self) -> int:
        """How often the branch has changed."""
        return int(self._state["changes"][0])

    def follow(self, targets: Floats, given: Any, max_step: Floats, found: Path) -> None:
        """Go to all targets and write what comes of it."""
        count = len(targets)
        reports = np.empty(count, self._reported)
        values = self._all_given(() if given is None else given, count)
        self._call("step", targets, values, count, max_step, found.q, reports.view(np.uint8), found.status)
        found.position_error[:], found.rotation_error[:] = reports["errors"].T
        found.branch[:], found.joint[:] = reports["branch"], reports["joint"]

    def speeds(self, twist: Floats, largest: Floats) -> Speeds:
        """The joint speeds for a twist."""
        qd, residual, factor = (np.empty(size, self._real) for size in (largest.size, 6, 1))
        self._call("speeds", twist, largest, qd, residual, factor)
        return Speeds(qd, residual, float(factor[0]))

    def _all_given(self, values: Any, count: int) -> Floats:
        """The redundancy of each target; zeros that nothing reads, where there is none."""
        return np.full(count, values if len(values) else 0, self._real)

    def _call(self, part: str, *arguments: Any) -> None:
        ffi, call = self._native.ffi, getattr(self._native.lib, f"{self._prefix}_tracker_{part}_many")
        params = () if self._params is None else (ffi.new(f"{self._prefix}_params *", list(self._params)),)
        kinds = {"i": "int32_t[]", "u": "unsigned char[]", "f": "float[]" if self._real.itemsize == 4 else "double[]"}
        state = ffi.from_buffer("unsigned char[]", self._state.view(np.uint8), require_writable=True)
        call(
            *params,
            state,
            *(each if isinstance(each, int) else ffi.from_buffer(kinds[each.dtype.kind], each) for each in arguments),
        )


class Interpreted:
    """The same in NumPy.

    Args:
        arm: What a path is followed with.
        q: The joint vector that it begins at.
        given: The redundancy, if there is one.
    """

    def __init__(self, arm: Arm, q: Floats, given: tuple[float, ...]) -> None:
        self._follower = Follower(arm, q, given)

    @property
    def q(self) -> Floats:
        """The joint vector."""
        return self._follower.q.copy()

    @property
    def branch(self) -> int:
        """The row of `inverse`, or less."""
        return self._follower.branch

    @property
    def changes(self) -> int:
        """How often the branch has changed."""
        return self._follower.changes

    def follow(self, targets: Floats, given: Any, max_step: Floats, found: Path) -> None:
        """Go to all targets and write what comes of it."""
        for index, target in enumerate(targets):
            with np.errstate(all="ignore"):
                outcome = self._follower.step(target, () if given is None else (given[index],), max_step)
            found.q[index], found.branch[index] = self._follower.q, self._follower.branch
            found.status[index], found.joint[index] = outcome.status, outcome.joint
            found.position_error[index], found.rotation_error[index] = outcome.position_error, outcome.rotation_error

    def speeds(self, twist: Floats, largest: Floats) -> Speeds:
        """The joint speeds for a twist."""
        with np.errstate(all="ignore"):
            qd = self._follower.speeds(twist)
            _, jacobian = self._follower.arm.evaluate(self._follower.q)
            most, size = np.where(largest > 0, largest, 0), np.abs(qd)
            parts = np.where(size > most, most / np.where(size > most, size, 1), 1)
            factor = float(parts.min()) if (size < HUGE).all() else 0.0
            return Speeds(qd, twist - jacobian @ qd, factor)
