"""Poses of batches of joint vectors in float64: the chain product in arrays of NumPy."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from kinegen.errors import KinegenError, quote
from kinegen.model.robot import Robot
from kinegen.model.variants import frame_named
from kinegen.verify.reference.chain import chain, values_of
from kinegen.verify.reference.number_types import FLOATS, FloatArray


def frames(robot: Robot, q: ArrayLike, params: Mapping[str, float] | None = None) -> dict[str, FloatArray]:
    """Poses of all frames for a batch of joint vectors, in float64.

    Args:
        q: Joint vectors, shape (N, dof), or (dof,) for one; radians and the file's length unit.
        params: Values of parameters that differ from the file, in radians and the file's length unit.

    Returns:
        `base_T_frame` of shape (N, 4, 4) by frame name: the base, every row, the wrist and the tool of a chain, and
        every named frame.
    """
    batch = np.atleast_2d(np.asarray(q, dtype=np.float64))
    values = values_of(robot, list(batch.T), params, FLOATS)
    found = chain(robot, values, FLOATS)
    return {name: np.broadcast_to(matrix, (len(batch), 4, 4)) for name, matrix in found.items()}


def pose(robot: Robot, q: ArrayLike, params: Mapping[str, float] | None = None) -> FloatArray:
    """Poses of the tips for a batch of joint vectors, in float64.

    Args:
        q: Joint vectors, shape (N, dof), or (dof,) for one; radians and the file's length unit.
        params: Values of parameters that differ from the file.

    Returns:
        `base_T_tip` of shape (N, tips, 4, 4), tips in the order of `robot.tips`.
    """
    found = frames(robot, q, params)
    return np.stack([found[tip] for tip in robot.tips], axis=1)


def fk(robot: Robot, q: ArrayLike, frame: str = "", params: Mapping[str, float] | None = None) -> FloatArray:
    """Poses by plain matrix products in float64: the judge of every kernel, with the shapes of `fk` of a module.

    Args:
        robot: The robot.
        q: Joint vectors, shape (..., dof); radians and the robot's length unit.
        frame: Name of a frame; the tips if left out.
        params: Values of parameters that differ from the file, in radians and the robot's length unit.

    Returns:
        `base_T_tool` of shape (..., 4, 4); for the tips of a tree (..., tips, 4, 4), in the order of `robot.tips`. NaN
        and infinite angles make entries that depend on them NaN, infinite lengths make them infinite or NaN.

    Raises:
        KinegenError: If the joint vectors have another length, or there is no such frame or parameter.

    Example:
        >>> import kinegen
        >>> arm = kinegen.load("robots/planar_3r.yaml")
        >>> kinegen.reference.fk(arm, [0.0, 0.0, 0.0]).shape, kinegen.reference.fk(arm, [[0.0, 0.0, 0.0]]).shape
        ((4, 4), (1, 4, 4))
    """
    try:
        batch = np.asarray(q, dtype=np.float64)
    except (TypeError, ValueError):
        raise KinegenError(f"{robot.name}: joint vectors must be real numbers of shape (..., {robot.dof})") from None
    if batch.shape[-1:] != (robot.dof,):
        raise KinegenError(f"{robot.name}: joint vectors have shape {batch.shape}, expected (..., {robot.dof})")
    lead = batch.shape[:-1]
    flat = batch.reshape(math.prod(lead), robot.dof)
    try:
        with np.errstate(invalid="ignore"):
            found = frames(robot, flat, params)
    except ValueError as error:
        raise KinegenError(str(error)) from None
    frame = frame_named(robot, frame)
    if frame and frame not in found:
        known = ", ".join(robot.frame_names)
        raise KinegenError(f"{robot.name} has no frame {quote(str(frame))} (there are {known})")
    if frame or not robot.is_tree:
        return found[frame or robot.tips[0]].reshape(*lead, 4, 4)
    return np.stack([found[tip] for tip in robot.tips], axis=1).reshape(*lead, len(robot.tips), 4, 4)
