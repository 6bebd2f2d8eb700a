"""Packages that the tests of this folder evaluate, each made once."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from kinegen.model.outputs import parse_quantity
from tests.builds.workshop import assemble

OUTPUTS = (
    "pose position frames jacobian fk_jacobian hessian twist jacobian_local acceleration quaternion_wxyz "
    "quaternion_wxyz_jacobian rpy_zyx rpy_zyx_jacobian axis_angle axis_angle_jacobian pose@forearm jacobian@forearm"
)


def package(folder: Path, robot: str, outputs: str) -> ModuleType:
    """A package of a robot of `robots/`."""
    return assemble(robot, folder, compiled=True, quantities=tuple(map(parse_quantity, outputs.split())))


@pytest.fixture(scope="session")
def arm(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """A PUMA 560 with everything that has derivatives."""
    return package(tmp_path_factory.mktemp("arm"), "puma560", OUTPUTS)


@pytest.fixture(scope="session")
def poses_alone(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """The same without Jacobians."""
    return package(tmp_path_factory.mktemp("poses"), "puma560", "pose quaternion_wxyz")


@pytest.fixture(scope="session")
def hand(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """A tree of three fingers."""
    return package(tmp_path_factory.mktemp("hand"), "hand", "pose position jacobian hessian")


@pytest.fixture(scope="session")
def rail(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """A SCARA, whose third joint slides."""
    return package(tmp_path_factory.mktemp("rail"), "scara", "pose position fk_jacobian hessian")


@pytest.fixture(scope="session")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """Two joints with lengths and angles that are runtime parameters, and the derivative of the pose by them."""
    outputs = "pose position jacobian hessian twist parameter_jacobian"
    return package(tmp_path_factory.mktemp("calibrated"), "calibrated_2r", outputs)


def bridge(module: ModuleType, name: str) -> Any:
    """A public module of a package: `torch`, `jax` or `xp`."""
    return import_module(f"{module.__name__}.{name}")


def angles(count: int, dof: int = 6, real: str = "float64") -> np.ndarray[Any, Any]:
    """Joint vectors away from singular places, the same in every run."""
    return np.random.default_rng(5).uniform(-1.2, 1.2, (count, dof)).astype(real)
