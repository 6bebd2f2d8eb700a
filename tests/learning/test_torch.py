"""Packages in PyTorch: values, gradients of first and second order, compilation, batches, and what is refused."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from tests.learning.conftest import angles, bridge, package

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


def slopes(function: Any, q: Any, step: float = 1e-6) -> Any:
    """Central differences by the numbers of a joint vector, along a last axis."""
    steps = step * torch.eye(q.shape[-1], dtype=q.dtype)
    return torch.stack([(function(q + each) - function(q - each)) / (2 * step) for each in steps], -1)


def compiled(function: Any) -> Any:
    """A function whose graph PyTorch has captured; the operators of the graph are called as they are."""
    torch._dynamo.reset()
    return torch.compile(function, fullgraph=True, backend="aot_eager")


@pytest.mark.parametrize("name", OUTPUTS)
def test_forward_mode_has_the_tangent_of_differences(arm: ModuleType, name: str) -> None:
    q, rates = (each.detach() for each in (joints(2)[0], joints(2)[1]))
    function = getattr(bridge(arm, "torch"), name)
    first = lambda q: found[0] if isinstance(found := function(q), tuple) else found  # noqa: E731 - a name for a part
    with torch.autograd.forward_ad.dual_level():
        found = torch.autograd.forward_ad.unpack_dual(first(torch.autograd.forward_ad.make_dual(q, rates))).tangent

    torch.testing.assert_close(found, slopes(first, q) @ rates, rtol=0, atol=1e-8)
    assert torch.autograd.gradcheck(function, (joints(2),), check_forward_ad=True, check_batched_forward_grad=True)


def test_modes_of_derivatives_can_be_nested(arm: ModuleType) -> None:
    fk, q = bridge(arm, "torch").fk, joints(2).detach()
    height = lambda q: (fk(q)[..., :3, :] ** 3).sum((-1, -2))  # noqa: E731 - with second derivatives by the pose too
    plain = lambda q: (product(q)[..., :3, :] ** 3).sum((-1, -2))  # noqa: E731 - the same, by PyTorch alone
    expected = torch.func.vmap(torch.func.hessian(plain))(q)
    forms = (torch.func.jacfwd, torch.func.jacrev)
    for outer in forms:
        for inner in forms:
            found = torch.func.vmap(outer(inner(height)))(q)
            torch.testing.assert_close(found, expected, rtol=0, atol=1e-13)
    with torch.autograd.forward_ad.dual_level():
        one = q[0].clone().requires_grad_()
        value = height(torch.autograd.forward_ad.make_dual(one, q[1]))
        gradient = torch.autograd.grad(value, one, create_graph=True)[0]
        rates = torch.autograd.forward_ad.unpack_dual(gradient).tangent
        through = torch.autograd.grad(torch.autograd.forward_ad.unpack_dual(value).tangent, one)[0]
    torch.testing.assert_close(rates, expected[0] @ q[1], rtol=0, atol=1e-13)
    torch.testing.assert_close(through, expected[0] @ q[1], rtol=0, atol=1e-13)


@pytest.mark.parametrize("name", ["position", "jacobian", "quaternion_wxyz", "rpy_zyx"])
def test_compiled_transforms_have_the_derivatives_of_plain_ones(arm: ModuleType, name: str) -> None:
    function, q = getattr(bridge(arm, "torch"), name), joints(1)[0].detach()
    for each in (torch.func.jacfwd, torch.func.jacrev):
        plain = each(function)(q)
        torch.testing.assert_close(compiled(each(function))(q), plain, rtol=0, atol=1e-14)
        torch.testing.assert_close(plain, slopes(function, q), rtol=0, atol=1e-8)


def test_compiled_transforms_of_batches_and_rates(arm: ModuleType) -> None:
    position, q = bridge(arm, "torch").position, joints(3).detach()
    height = lambda q: position(q)[2]  # noqa: E731 - a name for a part
    for form in (torch.func.grad(height), torch.func.jacfwd(position), torch.func.jacrev(torch.func.jacfwd(height))):
        batch = torch.func.vmap(form)
        torch.testing.assert_close(compiled(batch)(q), batch(q), rtol=0, atol=1e-14)
    rates = compiled(lambda q, v: torch.func.jvp(position, (q,), (v,))[1])(q[0], q[1])
    torch.testing.assert_close(rates, slopes(position, q[0]) @ q[1], rtol=0, atol=1e-8)


def test_a_derivative_without_a_kernel_is_refused_in_forward_mode_too(arm: ModuleType, poses_alone: ModuleType) -> None:
    q = joints(1)[0].detach()
    for function, output in ((bridge(poses_alone, "torch").fk, "jacobian"), (bridge(arm, "torch").frames, "frames")):
        with pytest.raises(NotImplementedError, match=output):
            torch.func.jacfwd(function)(q)
    with pytest.raises(NotImplementedError, match="quaternion_wxyz_jacobian: kinegen has no derivative"):
        torch.func.jacfwd(torch.func.jacfwd(bridge(arm, "torch").quaternion_wxyz))(q)


def test_inputs_may_be_given_by_name(arm: ModuleType) -> None:
    module, q = bridge(arm, "torch"), joints(2).detach()

    assert torch.equal(module.fk(q=q), module.fk(q))
    assert torch.equal(module.twist(q, qd=q), module.twist(q, q))
    with pytest.raises(TypeError, match=r"fk: angles is not an input \(expected q\)"):
        module.fk(angles=q)
    with pytest.raises(TypeError, match="fk: q is given twice"):
        module.fk(q, q=q)


def test_operators_keep_the_rules_of_pytorch(arm: ModuleType) -> None:
    space = bridge(arm, "_runtime.torch")._SPACE
    for name in ("fk", "fk_jacobian"):
        getattr(bridge(arm, "torch"), name)(joints(1))
        torch.library.opcheck(getattr(torch.ops, space).__getattr__(name).default, (joints(3),))


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


def test_half_precision_of_autocast_is_taken_as_float32(arm: ModuleType) -> None:
    fk, layer = bridge(arm, "torch").fk, torch.nn.Linear(6, 6)
    with torch.autocast("cpu", dtype=torch.bfloat16):
        q = layer(torch.ones(3, 6))
        assert q.dtype == torch.bfloat16
        pose = fk(q)
        assert torch.equal(compiled(fk)(q.detach()), pose)
    assert torch.equal(pose, fk(q.float()))
    pose.sum().backward()
    assert torch.isfinite(layer.weight.grad).all()
    with pytest.raises(TypeError, match=r"q is of torch.bfloat16"):
        fk(q)


def test_other_devices_take_the_numpy_form(arm: ModuleType) -> None:
    """The device without memory takes the path of all others, down to the shape of the result."""
    q = torch.zeros(5, 6, device="meta", dtype=torch.float32)

    assert bridge(arm, "torch").fk(q).shape == (5, 4, 4)
    assert bridge(arm, "xp").fk(q).device.type == "meta"


@pytest.mark.parametrize("name", ["fk", "rpy_zyx"])
def test_the_numpy_form_can_be_compiled_as_a_whole(arm: ModuleType, name: str) -> None:
    xp, q = bridge(arm, "xp"), joints(3).detach()
    function = getattr(xp, name)

    assert torch.equal(compiled(function)(q), function(q))
    assert torch.equal(compiled(lambda q: getattr(xp, name)(2.0 * q))(q), function(2.0 * q))
    torch.testing.assert_close(compiled(torch.func.jacrev(function))(q), torch.func.jacrev(function)(q))


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


def spread_parameters(module: ModuleType, count: int) -> Any:
    """Runtime parameters that differ for each of a number of configurations, away from those of the robot file."""
    generator = np.random.default_rng(11)
    values = [torch.from_numpy(value + generator.uniform(-0.2, 0.2, count)) for value in module.Params()]
    return module.Params(*(each.requires_grad_() for each in values))


@pytest.mark.parametrize("name", ["fk", "position"])
def test_runtime_parameters_have_gradients(calibrated: ModuleType, name: str) -> None:
    function, q = getattr(bridge(calibrated, "torch"), name), joints(3, 2)
    params = spread_parameters(calibrated, 3)

    def along(q: Any, *values: Any) -> Any:
        return function(q, params=calibrated.Params(*values))

    values = function(q, params=params).detach().numpy()
    plain = calibrated.Params(*(each.detach().numpy() for each in params))
    np.testing.assert_array_equal(values, getattr(calibrated, name)(q.detach().numpy(), params=plain))
    assert torch.autograd.gradcheck(along, (q, *params), check_forward_ad=True)
    assert torch.autograd.gradcheck(along, (q[0].detach(), *params), check_batched_grad=True)


def test_some_parameters_may_be_numbers_and_one_set_serves_a_batch(calibrated: ModuleType) -> None:
    fk, q = bridge(calibrated, "torch").fk, joints(4, 2).detach()
    length = torch.tensor(0.4, dtype=torch.float64, requires_grad=True)
    found = fk(q, params=calibrated.Params(L1=length))[:, 0, 3].sum()
    found.backward()

    expected = calibrated.parameter_jacobian(q.numpy(), params=calibrated.Params(L1=0.4))[:, 0, 0].sum()
    assert float(length.grad) == pytest.approx(expected, abs=1e-14)
    assert torch.equal(fk(q, params=calibrated.Params()), fk(q))


def test_parameters_under_transforms_and_compiled(calibrated: ModuleType) -> None:
    position, q = bridge(calibrated, "torch").position, joints(3, 2).detach()
    params = spread_parameters(calibrated, 3)

    def along(q: Any, values: Any) -> Any:
        return position(q, params=calibrated.Params(*values.unbind(-1)))

    table = torch.stack(params, -1).detach()
    each = torch.func.vmap(torch.func.jacrev(along, argnums=1))(q, table)
    forward = torch.func.vmap(torch.func.jacfwd(along, argnums=1))(q, table)
    plain = calibrated.Params(*table.numpy().T)
    np.testing.assert_allclose(each, calibrated.parameter_jacobian(q.numpy(), params=plain)[:, :3], atol=1e-14)
    torch.testing.assert_close(forward, each, rtol=0, atol=1e-14)
    whole = torch.func.grad(lambda table: (along(q, table) ** 2).sum())
    torch.testing.assert_close(compiled(whole)(table), whole(table), rtol=0, atol=1e-14)


def test_derivatives_by_parameters_without_a_kernel_are_refused(
    arm: ModuleType, calibrated: ModuleType, tmp_path: Path
) -> None:
    module, q, params = bridge(calibrated, "torch"), joints(2, 2).detach(), spread_parameters(calibrated, 2)
    for name in ("jacobian", "parameter_jacobian"):
        with pytest.raises(NotImplementedError, match=f"{name}: kinegen has no derivative of this output by runtime"):
            getattr(module, name)(q, params=params).sum().backward()
    with pytest.raises(NotImplementedError, match="twist: kinegen has no derivative of this output by runtime"):
        module.twist(q, q, params=params).sum().backward()
    # Second derivatives: the gradient by a parameter is made of parameter_jacobian, which has none.
    slope = torch.autograd.grad(module.fk(q, params=params).sum(), params.L1, create_graph=True)[0]
    with pytest.raises(NotImplementedError, match="parameter_jacobian: kinegen has no derivative"):
        slope.sum().backward()
    # The gradient by joints alone asks for nothing of the parameters.
    numbers = calibrated.Params(*(each.detach() for each in params))
    assert module.jacobian(joints(2, 2), params=numbers).sum().backward() is None
    bare = package(tmp_path, "calibrated_2r", "pose jacobian")
    with pytest.raises(NotImplementedError, match="by runtime parameters takes the output parameter_jacobian, which"):
        bridge(bare, "torch").fk(q, params=spread_parameters(bare, 2)).sum().backward()
    with pytest.raises(TypeError, match="the robot has no runtime parameters"):
        bridge(arm, "torch").fk(joints(2), params=params)
