"""Packages in PyTorch: values, gradients of first and second order, compilation, batches, and what is refused."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from tests.learning.conftest import angles, bridge

torch: Any = pytest.importorskip("torch")
pytestmark = [pytest.mark.learning, pytest.mark.filterwarnings("ignore::DeprecationWarning")]

OUTPUTS = ("fk", "position", "jacobian", "fk_jacobian", "quaternion_wxyz", "rpy_zyx", "axis_angle", "fk_forearm")


def joints(count: int, dof: int = 6) -> Any:
    return torch.from_numpy(angles(count, dof)).requires_grad_()


def product(q: Any) -> Any:
    """The pose of the PUMA 560 as a product of matrices, which PyTorch differentiates by itself."""
    half = np.pi / 2
    rows = [(0, 0, 0), (-half, 0, 0), (0, 0.4318, 0.15005), (-half, 0.0203, 0.4318), (half, 0, 0), (-half, 0, 0)]
    pose = torch.eye(4, dtype=q.dtype)
    for joint, (alpha, a, d) in enumerate(rows):
        c, s = torch.cos(q[..., joint]), torch.sin(q[..., joint])
        ca, sa = (round(float(f(alpha)), 12) for f in (np.cos, np.sin))
        zero, one = torch.zeros_like(c), torch.ones_like(c)
        flat = [c, -s, zero, a * one, s * ca, c * ca, -sa * one, -sa * d * one]
        flat += [s * sa, c * sa, ca * one, ca * d * one, zero, zero, zero, one]
        pose = pose @ torch.stack(flat, -1).reshape(*q.shape[:-1], 4, 4)
    return pose


@pytest.mark.parametrize("real", ["float64", "float32"])
def test_values_are_those_of_the_kernels_bit_by_bit(arm: ModuleType, real: str) -> None:
    q = angles(7, real=real)
    for name in OUTPUTS:
        expected, found = getattr(arm, name)(q), getattr(bridge(arm, "torch"), name)(torch.from_numpy(q))
        pairs = zip(expected, found) if isinstance(expected, tuple) else [(expected, found)]
        for one, other in pairs:
            np.testing.assert_array_equal(one, other.numpy(), strict=True)


@pytest.mark.parametrize("name", OUTPUTS)
def test_gradients_are_those_of_differences(arm: ModuleType, name: str) -> None:
    function = getattr(bridge(arm, "torch"), name)

    assert torch.autograd.gradcheck(function, (joints(3),))
    if name in ("fk", "position"):
        assert torch.autograd.gradgradcheck(function, (joints(3),))


def test_the_rates_of_a_twist_have_gradients_too(arm: ModuleType) -> None:
    rates = joints(1)[0].detach().requires_grad_()

    assert torch.autograd.gradcheck(bridge(arm, "torch").twist, (joints(3), rates))


@pytest.mark.parametrize("fixture", ["hand", "rail"])
def test_trees_and_sliding_joints_have_gradients_of_both_orders(fixture: str, request: pytest.FixtureRequest) -> None:
    module = request.getfixturevalue(fixture)
    q = joints(2, module.DOF)
    for name in ("fk", "position"):
        function = getattr(bridge(module, "torch"), name)

        assert torch.autograd.gradcheck(function, (q,))
        assert torch.autograd.gradgradcheck(function, (q,))


def test_gradients_agree_with_those_of_a_differentiated_product(arm: ModuleType) -> None:
    q = joints(5000)
    weights = torch.from_numpy(np.random.default_rng(1).normal(size=(5000, 4, 4)))
    function = bridge(arm, "torch").fk
    found = function(q)
    expected = product(q)
    assert torch.allclose(found, expected, rtol=0, atol=1e-12)

    quick = torch.autograd.grad(found, q, weights, retain_graph=True)[0]
    twice = torch.autograd.grad(found, q, weights, create_graph=True)[0]
    plain = torch.autograd.grad(expected, q, weights)[0]

    assert (quick - plain).abs().max() < 1e-12 * weights.abs().sum((-1, -2)).max()
    assert (twice - plain).abs().max() < 1e-12 * weights.abs().sum((-1, -2)).max()


def test_compiled_functions_have_the_same_values_and_gradients(arm: ModuleType) -> None:
    function = bridge(arm, "torch").fk

    def cost(q: Any) -> Any:
        return (function(2.0 * q)[..., :3, 3] ** 2).sum()

    compiled = torch.compile(cost, fullgraph=True, backend="aot_eager")
    q = joints(4)

    torch.testing.assert_close(compiled(q), cost(q), rtol=1e-14, atol=0)
    torch.testing.assert_close(
        *(torch.autograd.grad(each(q), q)[0] for each in (compiled, cost)), rtol=1e-13, atol=1e-14
    )


def test_operators_keep_the_rules_of_pytorch(arm: ModuleType) -> None:
    module = bridge(arm, "torch")
    for name in ("fk", "fk_jacobian"):
        getattr(module, name)(joints(1))
        torch.library.opcheck(getattr(torch.ops, module._SPACE).__getattr__(name).default, (joints(3),))


def test_transforms_of_functions(arm: ModuleType) -> None:
    fk, position = bridge(arm, "torch").fk, bridge(arm, "torch").position
    q = joints(4).detach()
    jacobians = torch.from_numpy(arm.jacobian(q.numpy())[:, :3])

    assert torch.equal(torch.func.vmap(fk, in_dims=1)(q.T.contiguous()), fk(q))
    for each in (torch.func.jacrev, torch.func.jacfwd):
        torch.testing.assert_close(torch.func.vmap(each(position))(q), jacobians, rtol=0, atol=1e-14)
    second = torch.func.vmap(torch.func.hessian(lambda one: position(one)[2]))(q)
    expected = arm.hessian(q.numpy())[:, :, 2]
    np.testing.assert_allclose(second.numpy(), expected, atol=1e-13)
    many = torch.autograd.grad(fk(q.requires_grad_()), q, torch.ones(3, 4, 4, 4).double(), is_grads_batched=True)
    assert many[0].shape == (3, 4, 6)


def test_batches_of_every_form(arm: ModuleType) -> None:
    function = bridge(arm, "torch").fk
    q = torch.from_numpy(angles(6))

    assert function(q[:0]).shape == (0, 4, 4)
    assert torch.equal(function(q.T.contiguous().T), function(q))
    assert torch.equal(function(q[::2]), function(q)[::2])
    assert torch.equal(function(q.reshape(2, 3, 6)), function(q).reshape(2, 3, 4, 4))
    assert torch.equal(function(q[0]), function(q)[0])
    assert not function(q).requires_grad
    empty = q[:0].clone().requires_grad_()
    function(empty).sum().backward()
    assert empty.grad.shape == (0, 6)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 2e5])
def test_what_is_no_angle_spoils_its_own_row_alone(arm: ModuleType, bad: float) -> None:
    q = torch.from_numpy(angles(3))
    q[1, 2] = bad
    q.requires_grad_()
    pose = bridge(arm, "torch").fk(q)
    pose.sum().backward()

    assert torch.isfinite(pose[[0, 2]]).all()
    assert torch.isfinite(q.grad[[0, 2]]).all()
    assert torch.isnan(pose[1, :3]).any()
    assert torch.isnan(q.grad[1]).any()


@pytest.mark.parametrize(
    ("given", "kind", "message"),
    [
        ([0.0] * 6, TypeError, "fk: q is of type list, expected a torch.Tensor"),
        (
            torch.zeros(6, dtype=torch.int64),
            TypeError,
            "fk: q is of torch.int64, expected torch.float64 or torch.float32",
        ),
        (torch.zeros(6, dtype=torch.float16), TypeError, "fk: q is of torch.float16"),
        (torch.zeros(3, 5), ValueError, r"fk: q has shape \(3, 5\), expected \(..., 6\)"),
        (torch.tensor(0.0), ValueError, r"fk: q has shape \(\), expected \(..., 6\)"),
        (torch.zeros(2, 6).to_sparse(), TypeError, "fk: q has the layout torch.sparse_coo"),
    ],
)
def test_other_arguments_are_refused_in_one_line(arm: ModuleType, given: Any, kind: type, message: str) -> None:
    with pytest.raises(kind, match=message) as caught:
        bridge(arm, "torch").fk(given)
    assert "\n" not in str(caught.value)


def test_inputs_that_do_not_fit_together_are_refused(arm: ModuleType) -> None:
    twist = bridge(arm, "torch").twist
    with pytest.raises(TypeError, match=r"qd is of torch.float32 on cpu, and q of torch.float64"):
        twist(torch.zeros(6, dtype=torch.float64), torch.zeros(6))
    with pytest.raises(TypeError, match=r"takes 2 tensors \(q, qd\), 1 given"):
        twist(torch.zeros(6))


def test_a_missing_derivative_names_the_output_to_build(arm: ModuleType, poses_alone: ModuleType) -> None:
    module = bridge(poses_alone, "torch")
    pose = module.fk(joints(2))
    with pytest.raises(NotImplementedError, match="fk: its derivative takes the output jacobian"):
        pose.sum().backward()
    with pytest.raises(NotImplementedError, match=r"quaternion_wxyz: .* the output quaternion_wxyz_jacobian"):
        module.quaternion_wxyz(joints(2)).sum().backward()
    with pytest.raises(NotImplementedError, match="frames: kinegen has no derivative of this output"):
        bridge(arm, "torch").frames(joints(2)).sum().backward()
    first = torch.autograd.grad(bridge(arm, "torch").rpy_zyx(q := joints(2)).sum(), q, create_graph=True)[0]
    with pytest.raises(NotImplementedError, match="rpy_zyx_jacobian: kinegen has no derivative"):
        first.sum().backward()


def test_other_devices_take_the_numpy_form(arm: ModuleType) -> None:
    """The device without memory takes the path of all others, down to the shape of the result."""
    q = torch.zeros(5, 6, device="meta", dtype=torch.float32)

    assert bridge(arm, "torch").fk(q).shape == (5, 4, 4)
    assert bridge(arm, "xp").fk(q).device.type == "meta"


def test_a_package_that_is_imported_again_has_its_functions_again(
    arm: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = Path(str(arm.__file__)).parent
    monkeypatch.syspath_prepend(str(folder.parent))
    package = importlib.import_module(folder.name)
    before = bridge(package, "torch").fk(joints(2))
    importlib.reload(package)

    assert torch.equal(bridge(package, "torch").fk(joints(2)), before)


def test_what_is_no_output_is_no_attribute(arm: ModuleType) -> None:
    module = bridge(arm, "torch")
    with pytest.raises(AttributeError, match="has no attribute 'elbow'"):
        _ = module.elbow
    assert "fk" in dir(module)
    assert "within_limits" not in dir(module)
