"""What a loaded robot computes: its kernels as methods, each compiled on first use and kept.

The methods are for programs and notebooks that need one robot soon. They call the kernels of `kinegen.compile`, built
for double alone; a module of one's own has more outputs, both number types, `bind` and no look-up in each call.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kinegen.model.robot import Robot as Model

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    Floats = NDArray[np.floating[Any]]

_OUTPUTS = {"fk": "pose,jacobian", "jacobian": "pose,jacobian", "inverse": "inverse"}
"""What is compiled for a method. The inverse takes longer, and not every robot has one."""

_lock = threading.RLock()


def model_of(robot: Model) -> Model:
    """The plain model again, whose text decides digests and names in the cache."""
    return Model(**{each.name: getattr(robot, each.name) for each in fields(Model)})


class Moving(Model):
    """A robot model whose poses, Jacobians and inverse kinematics can be computed."""

    __slots__ = ("_modules",)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joint variables, in the order of the joint vector; the same as `joints`."""
        return tuple(variable.name for variable in self.variables)

    @property
    def n(self) -> int:
        """Number of joint variables, as Robotics Toolbox calls it; the same as `dof`."""
        return self.dof

    @property
    def limits(self) -> tuple[tuple[float, float] | None, ...]:
        """Lower and upper limit of each joint in rad or the robot's length unit; None where the file has none.

        They are rounded outwards, as `LIMITS` of a compiled module.

        Example:
            >>> import kinegen
            >>> kinegen.load("robots/planar_3r.yaml").limits
            (None, None, None)
        """
        from kinegen.backends.limits import joint_limits
        from kinegen.backends.scalar_types import ScalarType

        found = joint_limits(self, ScalarType.DOUBLE)
        return tuple(None if each is None else (float(each[0]), float(each[1])) for each in found)

    @property
    def qlim(self) -> Floats:
        """The limits as Robotics Toolbox has them: an array (2, dof), -inf and inf where there are none."""
        import numpy as np

        pairs = [each or (-np.inf, np.inf) for each in self.limits]
        return np.array(pairs, dtype=np.float64).reshape(self.dof, 2).T

    @property
    def inverse_aim(self) -> str:
        """What of a target the closed-form inverse is solved for; nothing is compiled to find out.

        `pose`; or `position` for a three-joint arm whose inverse does not read the rotation of its target. Empty where
        the robot has no closed-form inverse of its tool, as a tree; `kinegen inspect` gives the reasons.

        Example:
            >>> import kinegen
            >>> kinegen.load("robots/puma560.yaml").inverse_aim
            'pose'
        """
        from kinegen.derive.inverse.derive import family_of
        from kinegen.errors import KinegenError

        try:
            return family_of(model_of(self)).aim.value
        except KinegenError:
            return ""

    def fk(self, q: ArrayLike, *, params: Any = None, out: Any = None, threads: int = 1, layout: Any = "4x4") -> Floats:
        """Pose of the tool in the base frame, for one joint vector or a batch.

        The first call for a robot compiles and verifies its kernels, which takes some seconds; they are kept in the
        user's cache. On a terminal and in a notebook a line on stderr says so.

        Args:
            q: Joint values (..., dof), in radians and the robot's length unit.
            params: Values of runtime parameters: a mapping by name, or `Params` of a compiled module.
            out: Array for the result, of its exact shape and type.
            threads: Number of threads that share a batch; 0 for all cores.
            layout: `4x4`, `3x4` or `joint_major`, as for a kernel.

        Returns:
            Poses (..., 4, 4); of a tree (..., tips, 4, 4), in the order of `tips`. Angles beyond 100,000 rad give NaN.

        Raises:
            KinegenError: If the compiler refuses or the verification fails.
            ValueError: If an array has another shape than expected.

        Example:
            >>> import kinegen
            >>> arm = kinegen.load("robots/planar_3r.yaml")
            >>> arm.fk([0.0, 0.0, 0.0])[:3, 3].round(6).tolist()
            [0.9, 0.0, 0.0]
        """
        kernel, params = self._kernel("fk", params)
        found: Floats = kernel(q, params=params, out=out, threads=threads, layout=layout)
        return found

    def jacobian(
        self, q: ArrayLike, *, params: Any = None, out: Any = None, threads: int = 1, layout: Any = "4x4"
    ) -> Floats:
        """Geometric Jacobian of the tool: linear velocity above angular velocity, both along the axes of the base.

        Args:
            q: Joint values (..., dof), in radians and the robot's length unit.
            params: As for `fk`.
            out: As for `fk`.
            threads: As for `fk`.
            layout: `4x4` or `joint_major`, as for a kernel.

        Returns:
            Jacobians (..., 6, dof), at the origin of the tool; of a tree (..., tips, 6, dof).

        Raises:
            KinegenError: If the compiler refuses or the verification fails.
            ValueError: If an array has another shape than expected.

        Example:
            >>> import kinegen
            >>> kinegen.load("robots/planar_3r.yaml").jacobian([[0.0, 0.5, 0.25]] * 100).shape
            (100, 6, 3)
        """
        kernel, params = self._kernel("jacobian", params)
        found: Floats = kernel(q, params=params, out=out, threads=threads, layout=layout)
        return found

    def inverse(
        self,
        base_T_tool: ArrayLike,
        redundancy: ArrayLike | None = None,
        *,
        nearest: ArrayLike | None = None,
        q0: ArrayLike | None = None,
        params: Any = None,
        out: Any = None,
        threads: int = 1,
        layout: Any = "4x4",
        check: bool = True,
    ) -> tuple[Floats, NDArray[np.bool_]]:
        """All joint vectors for a pose of the tool, in closed form.

        The inverse of a three-joint arm that is solved for the position of the tool does not read the rotation of the
        target: `inverse_aim` is then `position`.

        Args:
            base_T_tool: Targets (..., 4, 4).
            redundancy: What the inverse of some robots needs in addition, see `load`; (...) or (..., joints).
            nearest: A joint vector, or one for each target; the valid solution nearest to it is chosen.
            q0: Another name of `nearest`.
            params: As for `fk`.
            out: Arrays for both results; not with `nearest`.
            threads: Number of threads that share a batch; 0 for all cores.
            layout: `4x4`, or `joint_major` without `nearest`.
            check: Whether to see that targets are poses.

        Returns:
            Solutions (..., branches, dof), and which of them are valid (..., branches). With `nearest` one solution
            (..., dof), NaN where there is none, and whether there is one (...).

        Raises:
            KinegenError: If the robot has no closed-form inverse; the output `numeric_inverse` of `kinegen.compile`
                works for every arm.
            ValueError: If a target is not a pose.

        Example:
            >>> import kinegen
            >>> arm = kinegen.load("robots/planar_3r.yaml")
            >>> q, valid = arm.inverse(arm.fk([0.25, 0.5, 0.125]), nearest=[0, 0.5, 0])
            >>> q.round(12).tolist(), bool(valid)
            ([0.25, 0.5, 0.125], True)
        """
        kernel, params = self._kernel("inverse", params)
        inputs = (base_T_tool,) if redundancy is None else (base_T_tool, redundancy)
        options = {"params": params, "out": out, "threads": threads, "layout": layout, "check": check}
        found: tuple[Floats, NDArray[np.bool_]] = kernel(*inputs, nearest=nearest, q0=q0, **options)
        return found

    def fkine(self, q: ArrayLike) -> Floats:
        """The pose as Robotics Toolbox calls it; the same as `fk`, an array.

        Args:
            q: As for `fk`.
        """
        return self.fk(q)

    def jacob0(self, q: ArrayLike) -> Floats:
        """The Jacobian as Robotics Toolbox calls it; the same as `jacobian`.

        Args:
            q: As for `jacobian`.
        """
        return self.jacobian(q)

    def _kernel(self, function: str, params: Any) -> tuple[Any, Any]:
        """Return a kernel, and parameters of its own module."""
        outputs = _OUTPUTS[function]
        modules = getattr(self, "_modules", None) or {}
        module = modules.get(outputs) or self._compiled(outputs)
        return getattr(module, function), params if params is None else _settled(module, params)

    def _compiled(self, outputs: str) -> Any:
        """Return the module of some outputs, compiled if it has to be, and kept with this robot."""
        from kinegen.ui.api.module_cache import decisive_parts, made_module
        from kinegen.ui.api.options import build_options

        with _lock:
            modules: dict[str, Any] = getattr(self, "_modules", None) or {}
            if outputs not in modules:
                # A new mapping, since other threads read the old one without the lock.
                options = build_options(Path(), outputs=outputs, real="double")
                module, _ = made_module(model_of(self), options, decisive_parts(compile=True))
                modules = {**modules, outputs: module}
                object.__setattr__(self, "_modules", modules)
            return modules[outputs]

    if not TYPE_CHECKING:  # or every name would be one of a robot to type checkers

        def __getattr__(self, name: str) -> object:
            """Say of an output which module computes it."""
            from kinegen.runtime.vendored._absent import output_named

            output = output_named(name, ())
            text = f"'Robot' object has no attribute {name!r}"
            if output:
                raise AttributeError(f'{text}: kinegen.compile(robot, "{output}") has it')
            raise AttributeError(text, name=name, obj=self)


def _settled(module: Any, params: Any) -> Any:
    """Return runtime parameters as the module takes them, made of a mapping or of those of another module."""
    given = params._asdict() if hasattr(params, "_asdict") else params
    if not isinstance(given, Mapping) or not hasattr(module, "Params"):
        return params  # the kernel says what is wrong
    known = module.Params._fields
    for name in given:
        if name not in known:
            raise TypeError(f"params has {name!r}, which is not a runtime parameter (there are {', '.join(known)})")
    return module.Params(**given)
