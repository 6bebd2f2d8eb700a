"""CasADi finds no shorter program than the compiler: 142 tables against its common subexpressions."""

from __future__ import annotations

import numpy as np
import pytest

from kinegen.model.outputs import Kind, Quantity
from kinegen.verify.reference import Kinematics
from tests.operations.tables import TABLES, Table
from tests.operations.test_optimiser import ours

pytestmark = pytest.mark.imports

each_table = pytest.mark.parametrize("table", TABLES, ids=lambda table: table.name)


@each_table
@pytest.mark.parametrize("kind", [Kind.POSE, Kind.POSITION, Kind.JACOBIAN, Kind.TWIST], ids=lambda kind: kind.value)
def test_casadi_needs_no_fewer_operations(table: Table, kind: Kind) -> None:
    from tests.operations.casadi_forms import least_operations

    assert ours(table, Quantity(kind)) <= least_operations(table, kind)


@each_table
def test_casadi_describes_the_same_arm(table: Table) -> None:
    from tests.operations.casadi_forms import Peer

    peer, robot = Peer(table), table.robot()
    joints, rates = np.random.default_rng(0).uniform(-2, 2, (2, table.joints))
    kinematics = Kinematics(robot, [joints])
    pose, jacobian = kinematics.pose(robot.tips[0])[0], kinematics.jacobian(robot.tips[0])[0]

    np.testing.assert_allclose(peer.values(peer.pose, joints, rates), pose[:3], atol=1e-12, rtol=1e-12)
    np.testing.assert_allclose(peer.values(peer.jacobian(), joints, rates), jacobian, atol=1e-12, rtol=1e-12)
    for twist in peer.twists():
        np.testing.assert_allclose(peer.values(twist, joints, rates).ravel(), jacobian @ rates, atol=1e-11, rtol=1e-11)
