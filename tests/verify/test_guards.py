"""Guard words beside results: whatever a kernel writes there is seen, in every form in which results are made."""

from __future__ import annotations

import ctypes
import sys
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from kinegen.errors import ProofError
from kinegen.verify.isolation import GUARD, GuardedRows, Guards, calling, guarded, require_guards, watched

FORMS: tuple[tuple[Any, Any], ...] = (
    ((4, 4), np.float64),
    ((4, 4), np.float32),
    (3, np.float64),
    ((), np.bool_),
    ((1000, 4, 4), np.float32),
    (5, [("errors", np.float32, 2), ("iterations", np.int32)]),
)


def write(array: Any, place: int, value: int = 0) -> None:
    """Write a byte so many entries behind the first entry of an array, as C does."""
    ctypes.memset(array.ctypes.data + place * array.itemsize, value, 1)


@pytest.fixture
def guards() -> Guards:
    """Guards of an arm, whose kernel is called."""
    calling("C double pose")
    return Guards("arm")


@pytest.mark.parametrize(("shape", "dtype"), FORMS)
@pytest.mark.parametrize("place", [-1, -GUARD, "end", "far"])
def test_a_write_beside_a_result_is_refused(guards: Guards, shape: Any, dtype: Any, place: Any) -> None:
    found = guards.empty(shape, dtype)
    guards.require()
    found = guards.empty(shape, dtype)
    write(found, {"end": found.size, "far": found.size + GUARD - 1}.get(place, place))

    with pytest.raises(ProofError, match="arm: C double pose writes outside its results; nothing was written"):
        guards.require()


@pytest.mark.parametrize(("shape", "dtype"), FORMS)
def test_a_write_to_a_result_is_right(guards: Guards, shape: Any, dtype: Any) -> None:
    for _ in range(40):
        guards.empty(shape, dtype)[...] = np.zeros((), dtype)
        guards.zeros(shape, dtype)

    guards.require()


@pytest.mark.parametrize(("shape", "dtype"), [*FORMS, ((2, 0, 3), np.float64)])
def test_results_have_the_form_of_those_of_numpy(guards: Guards, shape: Any, dtype: Any) -> None:
    for found, wanted in (
        (guards.empty(shape, dtype), np.empty(shape, dtype)),
        (guards.zeros(shape, dtype), np.zeros(shape, dtype)),
        (guards.empty_like(np.zeros(shape, dtype)), np.zeros(shape, dtype)),
    ):
        assert (found.shape, found.dtype) == (wanted.shape, wanted.dtype)
        assert found.flags.c_contiguous
        assert found.flags.aligned
    assert not guards.zeros(shape, dtype).tobytes().strip(b"\0")


def test_results_never_share_memory(guards: Guards) -> None:
    found = [guards.empty((3,)) for _ in range(100)]
    for place, array in enumerate(found):
        array[...] = place

    assert [float(array.sum()) for array in found] == [3.0 * place for place in range(100)]


def test_a_number_that_is_left_out_is_no_number(guards: Guards) -> None:
    assert np.isnan(guards.empty((4, 4), np.float64)).all()
    assert np.isnan(guards.empty((4, 4), np.float32)).all()


def test_the_first_of_many_results_is_seen_as_well_as_the_last(guards: Guards) -> None:
    for place in (0, 500, 999):
        fresh = Guards("arm")
        found = [fresh.empty((4, 4)) for _ in range(1000)]
        write(found[place], 16)
        with pytest.raises(ProofError):
            fresh.require()


def test_large_results_are_looked_at_and_let_go(guards: Guards) -> None:
    bad = guards.empty((100_000,))
    write(bad, 100_000)

    with pytest.raises(ProofError):
        _ = [guards.empty((100_000,)) for _ in range(40)]


@pytest.mark.parametrize("place", [-1, 6])
def test_rows_of_other_callers_are_watched(place: int) -> None:
    rows = GuardedRows.of(5, (2, 3), np.int32, used=5)
    rows.cells[...] = 1
    write(rows.cells[2], place)

    with pytest.raises(ProofError, match="arm: "):
        rows.require("arm")


@pytest.fixture
def package(monkeypatch: pytest.MonkeyPatch) -> Any:
    """A package whose array handling makes memory in the ways that exist."""
    package, kernel = ModuleType("guarded_arm"), ModuleType("guarded_arm._runtime._kernel")
    vars(kernel).update(np=np, _empty=np.empty)
    monkeypatch.setitem(sys.modules, "guarded_arm._runtime._kernel", kernel)
    package.__dict__["_kernel"] = kernel
    return package


@pytest.mark.parametrize("name", ["_empty", "np.empty", "np.zeros"])
def test_the_memory_of_a_package_is_watched(package: Any, name: str) -> None:
    calling("C double pose of the package")
    module, _, word = name.rpartition(".")
    with guarded("arm", package):
        make = getattr(getattr(package._kernel, module) if module else package._kernel, word)
        found = make((4, 4))
        write(found, 16)
        with pytest.raises(ProofError, match="arm: C double pose of the package writes outside"):
            require_guards()


def test_other_functions_of_numpy_stay(package: Any) -> None:
    with guarded("arm", package):
        assert package._kernel.np is not np
        assert package._kernel.np.sin is np.sin
        assert package._kernel.np.ndarray is np.ndarray


def test_what_is_written_before_the_end_is_seen_at_the_end(package: Any) -> None:
    with pytest.raises(ProofError), guarded("arm", package):
        write(package._kernel.np.empty(3), -1)


@pytest.mark.parametrize("place", [0, 1])
def test_a_call_that_changes_its_inputs_is_refused(place: int) -> None:
    calling("C double pose")
    inputs = np.ones((3, 2)), np.ones((3, 1))

    def spoil(given: Any) -> int:
        given[place][2, 0] = 2.0
        return 5

    assert watched(len, inputs) == 2
    with pytest.raises(ProofError, match="C double pose changes its inputs; nothing was written"):
        watched(spoil, inputs)
