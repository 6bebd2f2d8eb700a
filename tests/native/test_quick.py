"""Plain calls are answered in C, with no Python code around them; all others find their way to it."""

from __future__ import annotations

import functools
import gc
import inspect
import subprocess
import sys
import weakref
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from tests.native.conftest import SAMPLES
from tests.native.sample import Sample

Loader = Callable[[str, str], ModuleType]

DTYPES = ["f8", "f4"]


def kernel_class(module: ModuleType) -> Any:
    """The class that the package's kernels are objects of, as its source has it."""
    return sys.modules[f"{module.__name__}._runtime._kernel"].Kernel


@pytest.fixture
def quick(load: Loader) -> ModuleType:
    """A compiled chain of three joints."""
    return load("several", "c")


@pytest.fixture
def entered(quick: ModuleType, monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """The names of kernels whose Python code was entered."""
    own, names = kernel_class(quick).__call__, []

    @functools.wraps(own)
    def noted(self: Any, *inputs: Any, **options: Any) -> Any:
        names.append(self.__name__)
        return own(self, *inputs, **options)

    monkeypatch.setattr(kernel_class(quick), "__call__", noted)
    return names


def inputs_of(sample: Sample, name: str, lead: tuple[int, ...], dtype: str) -> list[Any]:
    """Whole numbers for the inputs of a kernel."""
    generator = np.random.default_rng(5)
    return [generator.integers(0, 9, (*lead, *each.shape)).astype(dtype) for each in sample.function(name).inputs]


def room_for(results: Any) -> Any:
    """Arrays for results like these."""
    if isinstance(results, tuple):
        return tuple(np.full_like(each, np.nan) for each in results)
    return np.full_like(results, np.nan)


def are_same(first: Any, second: Any) -> bool:
    """Whether results are the same in number, type and bits."""
    one, other = (each if isinstance(each, tuple) else (each,) for each in (first, second))
    return len(one) == len(other) and all(
        a.dtype == b.dtype and np.array_equal(a, b) for a, b in zip(one, other, strict=True)
    )


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("lead", [(), (1,), (5,), (40,), (2, 3)])
@pytest.mark.parametrize("name", [function.name for function in SAMPLES["several"].functions])
def test_plain_calls_never_enter_python(
    quick: ModuleType, entered: list[str], name: str, lead: tuple[int, ...], dtype: str
) -> None:
    sample, kernel = SAMPLES["several"], getattr(quick, name)
    inputs = inputs_of(sample, name, lead, dtype)
    expected = sample.reference(sample.function(name), *inputs)
    out = room_for(expected)

    assert are_same(kernel(*inputs), expected)
    assert kernel(*inputs, out=out) is out
    assert are_same(out, expected)
    assert are_same(kernel(*inputs, out=None), expected)
    assert entered == []


@pytest.mark.parametrize(("name", "dtype"), [("runtime", "f8"), ("runtime", "f4"), ("single", "f4"), ("double", "f8")])
def test_parameters_of_the_file_are_used(load: Loader, name: str, dtype: str) -> None:
    sample, module = SAMPLES[name], load(name, "c")
    for lead in ((), (7,)):
        q = inputs_of(sample, "fk", lead, dtype)[0]
        gc.collect()

        assert np.array_equal(module.fk(q), sample.reference(sample.function("fk"), q))
        if sample.parameter:
            changed = module.fk(q, params=module.Params(7.0))
            assert np.array_equal(changed, sample.reference(sample.function("fk"), q, offset=7.0))


Q = np.arange(6.0).reshape(2, 3)
OTHERS: dict[str, tuple[tuple[Any, ...], dict[str, Any]]] = {
    "list": (([1.0, 2.0, 3.0],), {}),
    "integers": ((np.arange(3),), {}),
    "half": ((Q.astype("f2"),), {}),
    "steps": ((np.arange(6.0)[::2],), {}),
    "backwards": ((np.arange(3.0)[::-1],), {}),
    "foreign bytes": ((Q[0].astype(">f8"),), {}),
    "unaligned": ((np.frombuffer(bytes(25), "f8", 3, 1),), {}),
    "by name": ((), {"q": Q}),
    "threads": ((Q,), {"threads": 2}),
    "layout": ((Q,), {"layout": "3x4"}),
    "layout and out": ((Q,), {"layout": "3x4", "out": np.empty((2, 3, 4))}),
    "no configurations": ((np.empty((0, 3)),), {}),
    "many axes": ((np.ones((1,) * 12 + (3,)),), {}),
    "large": ((np.ones((20_000, 3)),), {}),
    "out in steps": ((Q,), {"out": np.empty((2, 4, 8))[..., ::2]}),
}


@pytest.mark.parametrize("case", OTHERS)
def test_other_calls_find_their_way(quick: ModuleType, entered: list[str], case: str) -> None:
    inputs, options = OTHERS[case]
    plain = np.array(inputs[0] if inputs else options["q"], float)

    result = quick.fk(*inputs, **options)

    expected = SAMPLES["several"].reference(SAMPLES["several"].function("fk"), plain)
    assert np.array_equal(result, expected[..., :3, :] if "layout" in options else expected)
    assert entered == ["fk"]


SHARED = np.zeros(60)
REFUSED: dict[str, tuple[tuple[Any, ...], dict[str, Any]]] = {
    "nothing": ((), {}),
    "too many": ((Q, Q), {}),
    "unknown": ((Q,), {"outt": Q}),
    "shape": ((np.zeros(4),), {}),
    "no axis": ((np.array(1.0),), {}),
    "masked": ((np.ma.zeros(3),), {}),
    "out a list": ((Q[0],), {"out": [1]}),
    "out of another shape": ((Q[0],), {"out": np.empty((3, 4))}),
    "out of another type": ((Q[0],), {"out": np.empty((4, 4), "f4")}),
    "out read-only": ((Q[0],), {"out": np.broadcast_to(0.0, (4, 4))}),
    "out for a batch": ((Q,), {"out": np.empty((3, 4, 4))}),
    "overlap": ((SHARED[2:5],), {"out": SHARED[4:20].reshape(4, 4)}),
    "overlap of a batch": ((SHARED[:6].reshape(2, 3),), {"out": SHARED[5:37].reshape(2, 4, 4)}),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_is_refused_as_python_does(quick: ModuleType, case: str) -> None:
    inputs, options = REFUSED[case]
    with pytest.raises((TypeError, ValueError)) as expected:
        kernel_class(quick).__call__(quick.fk, *inputs, **options)

    with pytest.raises(expected.type) as found:
        quick.fk(*inputs, **options)

    assert str(found.value) == str(expected.value)


def test_out_for_several_results_is_a_tuple(quick: ModuleType) -> None:
    inputs = inputs_of(SAMPLES["several"], "moving", (), "f8")
    pose, jacobian = np.empty((4, 4)), np.empty((6, 3))
    for out in ([pose, jacobian], (pose,), (pose, jacobian, pose), pose, (pose, [1.0]), (pose, jacobian.T)):
        with pytest.raises((TypeError, ValueError), match="moving: out"):
            quick.moving(*inputs, out=out)
    memory = np.empty(30)
    with pytest.raises(ValueError, match="out for jacobian shares memory with base_T_tool"):
        quick.moving(*inputs, out=(memory[:16].reshape(4, 4), memory[12:].reshape(6, 3)))


# Objects --------------------------------------------------------------------------------------------------------------


def test_a_quick_kernel_is_what_it_was(quick: ModuleType) -> None:
    plain = kernel_class(quick)

    assert isinstance(quick.fk, plain)
    assert type(quick.fk) is not plain
    assert (type(quick.fk).__name__, type(quick.fk).__module__) == (plain.__name__, plain.__module__)
    assert list(inspect.signature(quick.fk).parameters) == ["q", "out", "threads", "layout"]
    assert callable(quick.fk)
    assert quick.fk.__doc__.startswith('fk(q, *, out=None, threads=1, layout="4x4")\n\nThe fk.\n')


def test_every_way_to_call_gives_the_same(quick: ModuleType) -> None:
    q, out = Q[0], np.empty((4, 4))
    expected = quick.fk(q)
    ways = (
        lambda: quick.fk.__call__(q),
        lambda: quick.fk(*[q], out=out),
        functools.partial(quick.fk, q, out=out),
        lambda: next(map(quick.fk, [q])),
        lambda: kernel_class(quick).__call__(quick.fk, q),
    )

    assert all(np.array_equal(way(), expected) for way in ways)


def copy_of(module: ModuleType, made_by: Any) -> Any:
    """The pose kernel once more, as an object of another class."""
    return made_by(
        "fk",
        module=module.__name__,
        symbol="several",
        inputs=module.fk.inputs,
        results=module.fk.results,
        reals=("float64", "float32"),
        formula=module._numpy.fk,
        native=module._native,
    )


def test_a_class_of_ones_own_keeps_its_calls(quick: ModuleType) -> None:
    class Doubled(kernel_class(quick)):  # type: ignore[misc]
        def __call__(self, q: Any) -> Any:
            return 2 * super().__call__(q)

    doubled = copy_of(quick, Doubled)

    assert type(doubled) is Doubled
    assert np.array_equal(doubled(Q), 2 * quick.fk(Q))


def test_without_the_class_of_c_calls_are_the_same(quick: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    """As with a NumPy that the extension does not know."""
    monkeypatch.setattr(quick._native, "quick_class", lambda _: None)
    monkeypatch.setattr(sys.modules[f"{quick.__name__}._runtime._quick"], "_made", {})

    slow = copy_of(quick, kernel_class(quick))

    assert type(slow) is kernel_class(quick)
    assert np.array_equal(slow(Q), quick.fk(Q))


def test_kernels_go_when_nobody_holds_them(quick: ModuleType) -> None:
    kernel = copy_of(quick, kernel_class(quick))
    assert np.array_equal(kernel(Q), quick.fk(Q))
    kernel.me, alive = kernel, weakref.ref(kernel)
    del kernel
    gc.collect()

    assert alive() is None


LEAKS = """
import gc, sys; sys.path.insert(0, sys.argv[1]); import numpy as np, several as s
q, p, out = np.ones(3), np.ones((50, 3)), np.empty((4, 4))
moved = s.moving(q, q)
def work(count):
    for i in range(count):
        s.fk(q); s.fk(q, out=out); s.moving(q, q); s.moving(q, q, out=moved)
        s.fk(p); s.fk([1.0, 2.0, 3.0]); s.fk(out=None, q=q)
        for wrong in ((q[:2], {}), (q, {"out": 3}), (q, {"nothing": 1})):
            try:
                s.fk(wrong[0], **wrong[1])
            except (TypeError, ValueError):
                pass
def held():
    gc.collect()
    return [*map(sys.getrefcount, (q, p, out, moved, *moved, s.fk, type(s.fk), np.ndarray)), sys.getallocatedblocks()]
work(1000)
before = held()
work(3000)
after = held()
print(before[:-1] == after[:-1], after[-1] - before[-1] < 20)
"""


def test_calls_leave_nothing_behind(load: Loader) -> None:
    folder = Path(str(load("several", "c").__file__)).parent
    done = subprocess.run(
        [sys.executable, "-B", "-c", LEAKS, folder.parent], capture_output=True, text=True, timeout=120, check=True
    )

    assert done.stdout == "True True\n"
