"""Each kernel has its own arguments: for `inspect.signature`, for `help`, and in calls by name."""

from __future__ import annotations

import inspect
import pydoc
from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest

Loader = Callable[[str, str], ModuleType]


@pytest.fixture(params=["c", "numpy"])
def several(load: Loader, request: pytest.FixtureRequest) -> ModuleType:
    """A chain whose kernels have several inputs and results."""
    return load("several", request.param)


def test_signatures_have_the_names_of_the_inputs(several: ModuleType) -> None:
    kernels = [kernel for kernel in vars(several).values() if hasattr(kernel, "inputs")]

    assert len(kernels) > 2
    for kernel in kernels:
        parameters = inspect.signature(kernel).parameters
        names = [array.name for array in kernel.inputs]

        assert list(parameters) == [*names, "out", "threads", "layout"]
        assert all(parameters[each].default is inspect.Parameter.empty for each in names)
        assert parameters["threads"].default == 1
        assert parameters["out"].kind is inspect.Parameter.KEYWORD_ONLY


def test_help_shows_them(several: ModuleType) -> None:
    text = pydoc.plain(pydoc.render_doc(several.moving))

    assert str(inspect.signature(several.moving)).replace("'", '"') in text
    for name in inspect.signature(several.moving).parameters:
        assert f"\n    {name}: " in several.moving.__doc__


def test_the_class_has_a_signature_of_its_own(several: ModuleType) -> None:
    assert isinstance(inspect.signature(type(several.fk)), inspect.Signature)
    assert "q" not in inspect.signature(type(several.fk)).parameters


def test_inputs_can_be_given_by_name(several: ModuleType) -> None:
    kernel = several.moving
    inputs = [np.full((3, *array.shape), 0.5 + place / 8) for place, array in enumerate(kernel.inputs)]
    named = {array.name: values for array, values in zip(kernel.inputs, inputs, strict=True)}
    last = kernel.inputs[-1].name
    expected = kernel(*inputs)

    for found in (kernel(**named), kernel(*inputs[:-1], **{last: inputs[-1]}), kernel(**dict(reversed(named.items())))):
        assert all(np.array_equal(a, b) for a, b in zip(expected, found, strict=True))


def test_wrong_names_are_named(several: ModuleType) -> None:
    kernel, q = several.moving, np.zeros(several.fk.dof)
    first, second = (array.name for array in kernel.inputs[:2])
    for inputs, named, message in (
        ((q,), {"speed": q}, f"moving has no argument 'speed' \\(there are {first}, {second}, "),
        ((q,), {first: q, second: q}, "multiple values"),
        ((q, q), {second: q}, f"moving: {second} is given twice"),
        ((q,), {}, "takes 2 arrays"),
        ((), {second: q}, f"moving: {first} is missing"),
    ):
        with pytest.raises(TypeError, match=message):
            kernel(*inputs, **named)
    with pytest.raises(TypeError, match="fk has no argument 'foo'"):
        several.fk(q, foo=1)
