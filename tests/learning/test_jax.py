"""Packages in JAX: values, derivatives of first and second order, transforms, and what is refused."""

from __future__ import annotations

import os
import subprocess
import sys
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from tests.learning.conftest import angles, bridge

jax: Any = pytest.importorskip("jax")
pytestmark = [pytest.mark.learning, pytest.mark.filterwarnings("ignore::DeprecationWarning")]

OUTPUTS = ("fk", "position", "jacobian", "fk_jacobian", "quaternion_wxyz", "rpy_zyx", "axis_angle", "fk_forearm")


@pytest.fixture(autouse=True)
def _double() -> Iterator[None]:
    """JAX rounds to float32 by default."""
    jax.config.update("jax_enable_x64", True)
    yield
    jax.config.update("jax_enable_x64", False)


@pytest.mark.parametrize("real", ["float64", "float32"])
def test_values_are_those_of_the_kernels_bit_by_bit(arm: ModuleType, real: str) -> None:
    q = angles(7, real=real)
    for name in OUTPUTS:
        function = getattr(bridge(arm, "jax"), name)
        expected = jax.tree.leaves(getattr(arm, name)(q))
        for found in (function(q), jax.jit(function)(q), jax.vmap(function)(q)):
            for one, other in zip(expected, jax.tree.leaves(found), strict=True):
                np.testing.assert_array_equal(one, other, strict=True)


@pytest.mark.parametrize("name", OUTPUTS)
def test_derivatives_are_those_of_differences(arm: ModuleType, name: str) -> None:
    from jax.test_util import check_grads

    check_grads(getattr(bridge(arm, "jax"), name), (angles(3),), 2 if name in ("fk", "position") else 1)


@pytest.mark.parametrize("fixture", ["hand", "rail"])
def test_trees_and_sliding_joints_have_both_orders(fixture: str, request: pytest.FixtureRequest) -> None:
    from jax.test_util import check_grads

    module = request.getfixturevalue(fixture)
    for name in ("fk", "position"):
        check_grads(getattr(bridge(module, "jax"), name), (angles(2, module.DOF),), 2)


def test_the_rates_of_a_twist_have_derivatives_too(arm: ModuleType) -> None:
    from jax.test_util import check_grads

    check_grads(bridge(arm, "jax").twist, (angles(3), angles(1)[0]), 1)


def test_derivatives_are_the_kernels_own(arm: ModuleType) -> None:
    position, q = bridge(arm, "jax").position, angles(50)
    for each in (jax.jacfwd, jax.jacrev):
        found = jax.jit(jax.vmap(each(position)))(q)
        np.testing.assert_allclose(found, arm.jacobian(q)[:, :3], rtol=0, atol=1e-15)
    second = jax.vmap(jax.hessian(position))(q)
    np.testing.assert_allclose(second, np.moveaxis(arm.hessian(q), 1, -1)[:, :3], rtol=0, atol=1e-14)
    rates = angles(60)[10:]
    _, pushed = jax.jvp(position, (q,), (rates,))
    np.testing.assert_allclose(pushed, arm.twist(q, rates)[:, :3], rtol=0, atol=1e-14)


def test_gradients_agree_with_those_of_the_numpy_form(arm: ModuleType) -> None:
    q, weights = angles(1000), np.random.default_rng(1).normal(size=(1000, 4, 4))
    own, traced = (
        jax.jit(jax.grad(lambda q, each=each: (bridge(arm, each).fk(q) * weights).sum()))(jax.numpy.asarray(q))
        for each in ("jax", "xp")
    )

    assert abs(own - traced).max() < 1e-12 * abs(weights).sum((-1, -2)).max()


def test_batches_of_every_form(arm: ModuleType) -> None:
    function, q = bridge(arm, "jax").fk, angles(6)

    assert function(q[:0]).shape == (0, 4, 4)
    assert function(q.reshape(2, 3, 6)).shape == (2, 3, 4, 4)
    np.testing.assert_array_equal(jax.vmap(function, in_axes=1)(q.T), function(q))
    np.testing.assert_array_equal(jax.lax.map(function, q), function(q))
    large = np.broadcast_to(q[:1], (20_000, 6))
    np.testing.assert_array_equal(jax.jit(function)(large)[-1], function(q)[0])


@pytest.mark.parametrize("bad", [np.nan, np.inf, 2e5])
def test_what_is_no_angle_spoils_its_own_row_alone(arm: ModuleType, bad: float) -> None:
    q = angles(3)
    q[1, 2] = bad
    function = bridge(arm, "jax").position
    gradient = jax.grad(lambda q: function(q).sum())(q)

    for found in map(np.asarray, (function(q), gradient)):
        assert np.isfinite(found[[0, 2]]).all()
        assert np.isnan(found[1]).any()


@pytest.mark.parametrize(
    ("given", "kind", "message"),
    [
        (np.zeros(6, np.int32), TypeError, "fk: q is of int32, expected float64 or float32"),
        (np.zeros((3, 5)), ValueError, r"fk: q has shape \(3, 5\), expected \(..., 6\)"),
        (np.zeros(()), ValueError, r"fk: q has shape \(\), expected \(..., 6\)"),
        (np.zeros(6, complex), TypeError, "fk: q is of complex128"),
    ],
)
def test_other_arguments_are_refused_in_one_line(arm: ModuleType, given: Any, kind: type, message: str) -> None:
    with pytest.raises(kind, match=message) as caught:
        bridge(arm, "jax").fk(given)
    assert "\n" not in str(caught.value)


def test_a_missing_derivative_names_the_output_to_build(arm: ModuleType, poses_alone: ModuleType) -> None:
    q = angles(2)
    with pytest.raises(NotImplementedError, match="fk: its derivative takes the output jacobian"):
        jax.grad(lambda q: bridge(poses_alone, "jax").fk(q).sum())(q)
    with pytest.raises(NotImplementedError, match="frames: kinegen has no derivative of this output"):
        jax.jacfwd(bridge(arm, "jax").frames)(q)


def test_where_xla_refuses_the_handler_its_own_callback_serves(
    arm: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    module, q = bridge(arm, "jax"), angles(5)
    monkeypatch.setattr(bridge(arm, "_runtime.jax"), "_target", lambda _name: "")

    np.testing.assert_array_equal(jax.jit(jax.vmap(module.fk_jacobian))(q)[1], arm.fk_jacobian(q)[1])


def test_an_error_in_the_handler_reaches_the_caller(arm: ModuleType) -> None:
    """Shapes are checked before; this is the last resort."""
    xla = bridge(arm, "_runtime._xla")

    def fails(_arguments: object, _results: object) -> None:
        raise ZeroDivisionError("on purpose")

    handler = xla.handler(fails)
    jax.ffi.register_ffi_target("kinegen_test_failure", jax.ffi.pycapsule(handler), platform="cpu")
    call = jax.ffi.ffi_call("kinegen_test_failure", jax.ShapeDtypeStruct((3,), np.float64))
    with pytest.raises(Exception, match="ZeroDivisionError: on purpose"), warnings.catch_warnings():
        jax.block_until_ready(call(jax.numpy.zeros(3)))


SHARDED = """
import jax
import numpy as np

jax.config.update("jax_enable_x64", True)
import {name}
import {name}.jax as functions

P, kinds = jax.sharding.PartitionSpec, jax.sharding.AxisType
assert len(jax.devices()) == 4
q = np.random.default_rng(5).uniform(-1.2, 1.2, (8, 6))
for kind in (kinds.Auto, kinds.Explicit):
    mesh = jax.make_mesh((2, 2), ("rows", "others"), axis_types=(kind, kind))
    with jax.set_mesh(mesh):
        for spec in (P("rows"), P(("rows", "others")), P("rows", "others") if kind == kinds.Auto else P("others")):
            given = jax.device_put(q, jax.sharding.NamedSharding(mesh, spec))
            pose = jax.jit(functions.fk)(given)
            np.testing.assert_array_equal(pose, {name}.fk(q))
            assert pose.sharding.spec[0] == spec[0], (kind, spec, pose.sharding)
            text = jax.jit(functions.fk).lower(given).compile().as_text()
            assert spec == P("rows", "others") or "all-gather" not in text
            both = jax.jit(functions.fk_jacobian)(given)
            np.testing.assert_array_equal(both[1], {name}.fk_jacobian(q)[1])
            twist = jax.jit(functions.twist)(given, q[0])
            np.testing.assert_array_equal(twist, {name}.twist(q, q[0]))
            slope = jax.jit(jax.grad(lambda q: functions.position(q).sum()))(given)
            np.testing.assert_allclose(slope, {name}.jacobian(q)[:, :3].sum(-2), atol=1e-14)
        np.testing.assert_array_equal(jax.jit(jax.vmap(functions.fk, in_axes=1))(q.T), {name}.fk(q))
        np.testing.assert_array_equal(jax.jit(functions.fk)(q[0]), {name}.fk(q[0]))
        given = jax.device_put(q, jax.sharding.NamedSharding(mesh, P("rows")))
        inside = lambda function: jax.shard_map(function, in_specs=P("rows"), out_specs=P("rows"))
        for gradient in (
            inside(jax.grad(lambda q: functions.position(q).sum())),
            inside(jax.vmap(jax.grad(lambda q: functions.position(q).sum()))),
            jax.grad(lambda q: inside(functions.position)(q).sum()),
        ):
            np.testing.assert_allclose(jax.jit(gradient)(given), {name}.jacobian(q)[:, :3].sum(-2), atol=1e-14)
print("as one device")
"""


def test_arrays_that_are_sharded_over_devices_stay_so(arm: ModuleType) -> None:
    flags = {"XLA_FLAGS": "--xla_force_host_platform_device_count=4"}

    assert output_of(SHARDED, arm, flags) == "as one device\n"


def test_an_export_takes_the_operations_of_the_numpy_form(arm: ModuleType) -> None:
    """The handler has the address of one process, which JAX refuses to write down."""
    shape = jax.ShapeDtypeStruct((3, 6), np.float64)
    with pytest.raises(ValueError, match="no compatibility guarantees"):
        jax.export.export(jax.jit(bridge(arm, "jax").fk))(shape)
    exported = jax.export.export(jax.jit(bridge(arm, "xp").fk))(shape)

    np.testing.assert_allclose(exported.call(angles(3)), arm.fk(angles(3)), rtol=0, atol=1e-14)


def test_inputs_may_be_given_by_name(arm: ModuleType) -> None:
    module, q = bridge(arm, "jax"), angles(2)

    np.testing.assert_array_equal(module.twist(q, qd=q), module.twist(q, q))
    with pytest.raises(TypeError, match=r"fk: angles is not an input \(expected q\)"):
        module.fk(angles=q)


ENDS_EARLY = """
import jax
import jax.numpy as jnp
import {name}.jax

jax.config.update("jax_enable_x64", True)
slopes = jax.vmap(jax.value_and_grad(lambda q: {name}.jax.fk(q)[2, 3]))
print(jax.jit(lambda q: slopes(q)[1].sum())(jnp.zeros((1_000_000, 6))).shape)
"""


def output_of(program: str, arm: ModuleType, environment: Mapping[str, str]) -> str:
    """What a program prints that imports the package in an interpreter of its own."""
    folder = Path(str(arm.__file__)).parent
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", program.format(name=folder.name)],
        env={**os.environ, "PYTHONPATH": str(folder.parent), **environment},
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_program_may_end_before_a_result_that_nobody_reads(arm: ModuleType) -> None:
    assert output_of(ENDS_EARLY, arm, {}) == "()\n"


def test_runtime_parameters_have_derivatives(calibrated: ModuleType) -> None:
    from jax.test_util import check_grads

    generator, q = np.random.default_rng(11), angles(3, 2)
    params = calibrated.Params(*(value + generator.uniform(-0.2, 0.2, 3) for value in calibrated.Params()))
    for name in ("fk", "position"):
        function = getattr(bridge(calibrated, "jax"), name)
        along = lambda q, params, function=function: function(q, params=params)  # noqa: E731 - a name for a call
        check_grads(along, (q, params), 1)
        for found in (along(q, params), jax.jit(along)(q, params), jax.vmap(along)(q, params)):
            np.testing.assert_array_equal(found, getattr(calibrated, name)(q, params=params))
    one = jax.jit(jax.grad(lambda params: bridge(calibrated, "jax").fk(q, params=params)[:, 0, 3].sum()))
    expected = calibrated.parameter_jacobian(q)[:, 0].sum(0)
    np.testing.assert_allclose(list(one(calibrated.Params())), expected, rtol=0, atol=1e-14)


def test_derivatives_by_parameters_without_a_kernel_are_refused(arm: ModuleType, calibrated: ModuleType) -> None:
    module, q, params = bridge(calibrated, "jax"), angles(2, 2), calibrated.Params()
    with pytest.raises(NotImplementedError, match="jacobian: kinegen has no derivative of this output by runtime"):
        jax.grad(lambda params: module.jacobian(q, params=params).sum())(params)
    with pytest.raises(NotImplementedError, match="parameter_jacobian: kinegen has no derivative"):
        jax.hessian(lambda params: module.fk(q, params=params).sum())(params)
    # Derivatives by joints alone ask for nothing of the parameters, those by parameters for nothing of the joints.
    assert jax.grad(lambda q: module.jacobian(q, params=params).sum())(q).shape == q.shape
    with pytest.raises(TypeError, match=r"params.L1 is of float32, and q of float64"):
        module.fk(q, params=params._replace(L1=np.float32(0.4)))
    with pytest.raises(TypeError, match="the robot has no runtime parameters"):
        bridge(arm, "jax").fk(angles(2), params=params)
