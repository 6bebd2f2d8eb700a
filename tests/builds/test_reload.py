"""A package that is built anew while it is imported: importing it again gives the new robot, and nothing of the old."""

from __future__ import annotations

import importlib
import pickle
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from kinegen.model.outputs import Quantity
from tests.builds.workshop import ARM, make, write_robot

QUANTITIES = (Quantity.POSE, Quantity.FRAMES)


def again_by_reload(module: ModuleType) -> ModuleType:
    return importlib.reload(module)


def again_by_hand(module: ModuleType) -> ModuleType:
    """What people do who do not trust reload."""
    del sys.modules[module.__name__]
    return importlib.import_module(module.__name__)


@pytest.mark.parametrize("again", [again_by_reload, again_by_hand])
@pytest.mark.parametrize("compiled", [True, False], ids=["compiled", "numpy"])
def test_a_rebuilt_package_that_is_imported_again_is_the_new_one(
    compiled: bool, again: Callable[[ModuleType], ModuleType], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Several times, in less than a second, with lengths of one number of digits."""
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    module = None
    kernels = []
    name = f"anew_{compiled}_{again.__name__}".lower()
    for length in ("0.25", "0.75", "0.25"):
        text = ARM.replace("name: arm", f"name: {name}").replace("d: 0.25", f"d: {length}")
        make(write_robot(tmp_path, text), tmp_path, compile=compiled, quantities=QUANTITIES)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.filterwarnings("ignore", "NumPy evaluates")
            module = again(module) if module else importlib.import_module(name)
        kernels.append((module.fk, float(length)))

        assert module.backend == ("c" if compiled else "numpy")
        assert module.fk(np.zeros(2))[2, 3] == module.frames(np.zeros(2))[0, 2, 3] == float(length)
        assert module.fk.backend == module.backend
        assert pickle.loads(pickle.dumps(module.fk)) is module.fk  # noqa: S301 - our own

    for kernel, length in kernels:
        assert kernel(np.zeros(2))[2, 3] == length  # who holds an old kernel keeps the old robot


def test_outputs_that_a_rebuilt_package_lacks_are_gone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    path = write_robot(tmp_path, ARM.replace("name: arm", "name: fewer"))
    make(path, tmp_path, compile=False, quantities=QUANTITIES)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "NumPy evaluates")
        module = importlib.import_module("fewer")
        make(path, tmp_path, compile=False, quantities=(Quantity.POSE,))
        importlib.reload(module)

    assert not {"frames", "FRAMES"} & set(dir(module))
    with pytest.raises(AttributeError, match="frames"):
        module.frames  # noqa: B018 - asked for, to be refused


def test_a_package_that_is_not_built_anew_can_be_imported_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    make(write_robot(tmp_path, ARM.replace("name: arm", "name: same_again")), tmp_path)
    module = importlib.import_module("same_again")
    before = module.fk(np.ones(2))

    assert np.array_equal(importlib.reload(module).fk(np.ones(2)), before)
    assert module.backend == "c"
