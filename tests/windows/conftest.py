"""All tests of this folder run with `make test-windows`; by default they try a sample of the robots."""

from __future__ import annotations

import pytest

from tests.windows.tools import serve
from tests.windows.words import ROOT

SAMPLE = ("blocks", "calibrated_2r", "scara", "stanford")
"""No joint; runtime parameters; closed forms of three and of six joints, one of which slides."""

ZIG = ("scara", "hand", "calibrated_2r", "iiwa14_arm_angle", "jaco2")
"""Robots whose C is compiled by Zig, the first by default: closed form, tracker and search; a tree; parameters and
integers; ranges of a redundancy; all solutions."""

CPP = ("scara", "calibrated_2r", "hand", "puma560")
"""Robots whose C++ is compared; the first one by default."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """`--dist loadgroup` gives one process all tests of a robot in Wine, whose objects are made once then."""
    for item in items:
        call = getattr(item, "callspec", None)
        if call is not None and "any_robot" in call.params and config.pluginmanager.hasplugin("xdist"):
            item.add_marker(pytest.mark.xdist_group(call.params["any_robot"]))


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    every = metafunc.config.getoption("--every")
    if "any_robot" in metafunc.fixturenames:
        names = sorted(path.stem for path in (ROOT / "robots").glob("*.yaml")) if every else SAMPLE
        metafunc.parametrize("any_robot", names)
    if "cpp_robot" in metafunc.fixturenames:
        metafunc.parametrize("cpp_robot", CPP if every else CPP[:1])
    if "zig_robot" in metafunc.fixturenames:
        metafunc.parametrize("zig_robot", ZIG if every else ZIG[:1])


@pytest.fixture(scope="session")
def wine_runs() -> None:
    """Starts what all programs share, once."""
    serve()
