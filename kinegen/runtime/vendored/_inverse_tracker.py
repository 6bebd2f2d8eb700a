"""The inverse along a path: solutions that continue each other. It needs NumPy alone."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._engines import real_array
from ._inverse import Inverse
from ._kernel import Kernel
from ._parameters import checked_params, settled_params
from ._tracked import Compiled, Interpreted, Path, Speeds, Status, Step
from ._tracking import UNSET, Arm, Joints

Floats = NDArray[np.floating[Any]]


class InverseTracker:
    """Makes trackers of a robot; its `backend` is "c" or "numpy".

    Args:
        name: Name of this object in its module.
        module: Name of that module.
        symbol: Prefix of the C functions.
        inverse: The closed-form inverse.
        kernel: The pose with its Jacobian.
        strides: What of each joint counts as much as an angle of 1 rad.
        reach: Length that counts as much as an angle of 3 rad.
        rigid: How far the columns of a target may be from those of a rotation, for float64 and float32; None where the
            rotation is not read.
        given: Index of the joint that is given with the target; None where none is.
        reals: Number types that it was built for.
        native: What `load_native` gave.
        params: The robot file's values of the runtime parameters; None where there are none.
        doc: Text for `help()`.
    """

    def __init__(
        self,
        name: str,
        *,
        module: str,
        symbol: str,
        inverse: Inverse,
        kernel: Kernel[Any],
        strides: tuple[float, ...],
        reach: float,
        rigid: tuple[float, float] | None,
        given: int | None = None,
        reals: tuple[str, ...],
        native: Any = None,
        params: Any = None,
        doc: str = "",
    ) -> None:
        self.__name__, self.__module__ = name, module
        self.__doc__ = f"{name}(q0, *, ...); help({name}.__call__) lists the options\n\n{doc}"
        self.dof, self.backend = kernel.dof, "numpy" if native is None else "c"
        self.inverse, self.kernel, self.strides, self.reach = inverse, kernel, strides, reach
        self.rigid, self.given, self.reals = rigid, given, reals
        self.usual_params, self._native, self._symbol = params, native, symbol

    def __call__(
        self,
        q0: ArrayLike,
        *,
        max_step: ArrayLike | None = None,
        redundancy: float | None = None,
        params: Any = None,
    ) -> Tracker:
        """Begin a path at a joint vector.

        Args:
            q0: The present joint vector (dof,); its type is that of the tracker.
            max_step: The largest change of each joint in a step (dof,), or one number for all; none if left out.
            redundancy: The value of the joint that is given with the target; that of `q0` if left out.
            params: Values of the runtime parameters; by default those of the robot file.

        Returns:
            A tracker.

        Raises:
            ValueError: If a joint value is outside its limits or not finite, or a shape is wrong.
            TypeError: If an argument is not made of real numbers, or `params` is not the package's `Params`.
        """
        name = self.__name__
        given = real_array(name, "q0", q0)
        if given.shape != (self.dof,):
            raise ValueError(f"{name}: q0 has shape {given.shape}, expected ({self.dof},)")
        chosen, varied = settled_params(name, checked_params(name, params, self.usual_params))
        if varied:
            raise ValueError(f"{name}: {next(iter(varied))} is an array; a tracker has one set of parameters")
        single = given.dtype == np.float32 if len(self.reals) > 1 else self.reals[0] == "float32"
        real: Any = np.dtype(np.float32 if single else np.float64)
        steps = self.bounds("max_step", max_step, real)
        if redundancy is None and self.given is not None:
            redundancy = float(given[self.given])
        start, values = given.astype(real), self.redundancy(redundancy)
        engine: Compiled | Interpreted
        if self._native is None:
            engine = Interpreted(self.arm(real, chosen), start, values)
        else:
            engine = Compiled(self._native, f"{self._symbol}_f32" if single else self._symbol, chosen, start, values)
        tracker = Tracker(self, engine, steps, values)
        if tracker.branch == UNSET:
            raise ValueError(f"{name}: q0 is not a joint vector within the limits: {given.tolist()}")
        return tracker

    def __reduce__(self) -> str:
        return self.__name__  # pickled by reference, as functions are

    def __repr__(self) -> str:
        return f"<{self.__module__}.{self.__name__}: q0 ({self.dof},) to a tracker, backend {self.backend}>"

    def redundancy(self, value: float | None) -> tuple[float, ...]:
        """What is given with a target, checked."""
        if (value is None) != (self.given is None):
            reason = "takes no redundancy" if self.given is None else "needs the redundancy of each target"
            raise TypeError(f"{self.__name__}: this arm {reason}")
        return () if value is None else (float(value),)

    def arm(self, real: np.dtype[Any], params: Any) -> Arm:
        """What the NumPy form follows a path with."""
        options: dict[str, Any] = {} if params is None else {"params": params}
        turn, lowest, highest = np.array(self.inverse.turnings[real == np.float32], real).T  # type: ignore[index]
        held = np.arange(self.dof) == (-1 if self.given is None else self.given)
        joints = Joints(np.array(self.strides, real), turn, lowest, highest, held)
        return Arm(
            inverse=partial(self.inverse, check=False, **options),
            evaluate=partial(self.kernel, **options),
            joints=joints,
            weight=3 / self.reach,
            rows=3 if self.rigid is None else 6,
            rigid=self.rigid[real == np.float32] if self.rigid else 0.0,
        )

    def bounds(self, label: str, given: ArrayLike | None, real: Any) -> Floats:
        """Largest changes or speeds, one for each joint (dof,); infinite ones if left out."""
        array = real_array(self.__name__, label, np.inf if given is None else given)
        if array.shape not in ((), (self.dof,)):
            raise ValueError(f"{self.__name__}: {label} has shape {array.shape}, expected () or ({self.dof},)")
        if not (array >= 0).all():
            raise ValueError(f"{self.__name__}: {label} is {array.tolist()}, expected numbers that are not negative")
        with np.errstate(over="ignore"):
            return np.full(self.dof, array, real)


class Tracker:
    """A path of a robot: where it is, and how it goes on. `inverse_tracker` of a package makes it.

    Attributes:
        max_step: The largest change of each joint in a step (dof,); it may be written.
    """

    def __init__(
        self, maker: InverseTracker, engine: Compiled | Interpreted, max_step: Floats, redundancy: tuple[float, ...]
    ) -> None:
        self.max_step = max_step
        self._maker, self._engine, self._redundancy, self._name = maker, engine, redundancy, maker.__name__

    @property
    def q(self) -> Floats:
        """The joint vector (dof,), a copy."""
        return self._engine.q

    @property
    def branch(self) -> int:
        """The row of `inverse` that the path is on; -1 at a singularity where it began."""
        return self._engine.branch

    @property
    def changes(self) -> int:
        """How often a path through a singularity has changed the branch."""
        return self._engine.changes

    def step(self, base_T_tool: ArrayLike, redundancy: float | None = None) -> Step:
        """Go to the next target.

        Args:
            base_T_tool: The target (4, 4).
            redundancy: The value of the joint that is given with the target; that of the last one if left out.

        Returns:
            What it came to; a target that is not a pose is an outcome too.
        """
        target = self._targets(base_T_tool, 2)
        path = self.follow(target[None], None if redundancy is None else np.array([redundancy]))
        joint = int(path.joint[0])
        return Step(
            Status(int(path.status[0])),
            path.q[0],
            float(path.position_error[0]),
            float(path.rotation_error[0]),
            int(path.branch[0]),
            None if joint < 0 else joint,
        )

    def follow(self, base_T_tool: ArrayLike, redundancy: ArrayLike | None = None) -> Path:
        """Go to many targets, one after the other; one that is refused is left out.

        Args:
            base_T_tool: The targets (N, 4, 4).
            redundancy: Values of the joint that is given with them, (N,) or one for all; that of the last target
                before, if left out.

        Returns:
            What the steps came to.
        """
        targets = self._targets(base_T_tool, 3)
        count, real = len(targets), self.max_step.dtype
        given = self._all_given(redundancy, count)
        errors, indices = np.empty((2, count), real), np.empty((3, count), np.int32)
        found = Path(np.empty((count, self._maker.dof), real), indices[0], *errors, *indices[1:])
        self._engine.follow(targets, given, np.ascontiguousarray(self.max_step), found)
        return found

    def speeds(self, twist: ArrayLike, *, max_speed: ArrayLike | None = None) -> Speeds:
        """The joint speeds that a velocity of the tool costs, where the path is now.

        Args:
            twist: Velocity of the tool's origin, in length units per second, and angular velocity in rad/s (6,), in
                the base's axes.
            max_speed: The largest speed of each joint (dof,), or one number for all; none if left out.

        Returns:
            The speeds, damped near singularities, with what they leave out.
        """
        given = real_array(self._name, "twist", twist)
        if given.shape != (6,):
            raise ValueError(f"{self._name}: twist has shape {given.shape}, expected (6,)")
        largest = self._maker.bounds("max_speed", max_speed, self.max_step.dtype)
        return self._engine.speeds(given.astype(self.max_step.dtype), largest)

    def __repr__(self) -> str:
        return f"<tracker of {self._maker.__module__}: branch {self.branch}, q {self.q.tolist()}>"

    def _targets(self, base_T_tool: ArrayLike, axes: int) -> Floats:
        targets = real_array(self._name, "base_T_tool", base_T_tool)
        if targets.shape[-2:] != (4, 4) or targets.ndim != axes:
            expected = "(4, 4)" if axes == 2 else "(N, 4, 4)"
            raise ValueError(f"{self._name}: base_T_tool has shape {targets.shape}, expected {expected}")
        with np.errstate(over="ignore"):
            return np.ascontiguousarray(targets, self.max_step.dtype)

    def _all_given(self, redundancy: ArrayLike | None, count: int) -> Floats | None:
        """The redundancy of each target, of which the last one is remembered."""
        real = self.max_step.dtype
        if redundancy is None:
            return np.full(count, self._redundancy[0], real) if self._redundancy else None
        values = real_array(self._name, "redundancy", redundancy)
        if values.shape not in ((), (count,)):
            raise ValueError(f"{self._name}: redundancy has shape {values.shape}, expected () or ({count},)")
        found: Floats = np.full(count, values, real)
        if count:
            self._redundancy = self._maker.redundancy(float(found[-1]))
        return found
