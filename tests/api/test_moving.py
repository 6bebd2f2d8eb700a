"""What a loaded robot computes by itself: compiled on first use, kept, and the same as a compiled module."""

from __future__ import annotations

import copy
import io
import pickle
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import kinegen
from kinegen.errors import ProofError
from kinegen.ui.api import module_cache
from tests.api.test_compile import again, arm, builds, folders, own_cache

ROOT = Path(__file__).resolve().parents[2]
ROBOTS = ROOT / "robots"

__all__ = ["builds", "own_cache"]  # fixtures

PLANAR = {
    "kinegen": 1,
    "name": "arm",
    "convention": "standard",
    "units": {"length": "m", "angle": "deg"},
    "joints": [
        {"name": "shoulder", "theta": "q", "d": 0, "a": 0.5, "alpha": 0, "limits": [-100, 90.1]},
        {"name": "elbow", "theta": "q", "d": 0, "a": 0.25, "alpha": 0},
    ],
}
RUNTIME = {**PLANAR, "parameters": {"reach": {"value": 0.5, "runtime": True}}}
RUNTIME["joints"] = [{**PLANAR["joints"][0], "a": "reach"}, PLANAR["joints"][1]]  # type: ignore[index]
TREE = {
    **{key: PLANAR[key] for key in ("kinegen", "name", "convention", "units")},
    "joints": [
        {"name": "body", "theta": "q", "d": 0.25, "a": 0, "alpha": 90},
        {"name": "left", "parent": "body", "theta": "q", "d": 0, "a": 0.5, "alpha": 0},
        {"name": "right", "parent": "body", "theta": "q", "d": 0, "a": 0.75, "alpha": 0},
    ],
}
MIMIC = """<robot name="gripper"><link name="a"/><link name="b"/><link name="c"/>
<joint name="turn" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0.5 0 0"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="follow" type="revolute"><parent link="b"/><child link="c"/><origin xyz="0.25 0 0"/><axis xyz="0 0 1"/>
<mimic joint="turn" multiplier="-0.5"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Any, ...]]:
    """The modules of robots compute with NumPy, which is made sooner; the calls that made them."""
    honest: Callable[..., Any] = module_cache.made_module
    calls = []

    def plain(model: Any, options: Any, decisive: Any) -> Any:
        calls.append((model.name, ",".join(map(str, options.quantities))))
        return honest(model, replace(options, compile=False), decisive)

    monkeypatch.setattr(module_cache, "made_module", plain)
    return calls


def test_a_robot_computes_what_its_modules_compute(own_cache: Path) -> None:
    robot = kinegen.load(PLANAR)
    q = np.random.default_rng(1).uniform(-1, 1, (50, 2))
    poses = robot.fk(q)
    module = kinegen.compile(robot, "pose,jacobian", real="double")

    assert module.backend == "c"
    assert np.abs(poses - kinegen.reference.fk(robot, q)).max() < 1e-15
    assert np.array_equal(robot.jacobian(q), module.jacobian(q))
    assert np.array_equal(robot.fk(q[0]), module.fk(q[0]))
    found, exists = robot.inverse(poses, q0=q)
    assert exists.all()
    assert np.abs(found - q).max() < 1e-7
    assert len(folders(own_cache)) == 2


def test_what_is_compiled_is_kept(
    own_cache: Path, quick: list[tuple[Any, ...]], builds: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = kinegen.load(PLANAR)
    for _ in range(3):
        robot.fk([0.0, 0.0])
        robot.jacobian([0.0, 0.0])
    assert quick == [("arm", "pose,jacobian")]
    kinegen.load(PLANAR).fk([0.0, 0.0])
    again(monkeypatch)
    kinegen.load(PLANAR).fk([0.0, 0.0])
    assert builds == ["arm"]
    robot.inverse(np.eye(4))
    assert builds == ["arm", "arm"]


def test_a_robot_that_computes_is_still_a_value(quick: list[tuple[Any, ...]]) -> None:
    robot, other = kinegen.load(PLANAR), kinegen.load(PLANAR)
    before = pickle.dumps(robot)
    robot.fk([0.0, 0.0])

    assert robot == other
    assert hash(robot) == hash(other)
    assert pickle.dumps(robot) == before
    for same in (copy.copy(robot), copy.deepcopy(robot), pickle.loads(before)):  # noqa: S301 - our own bytes
        assert same == robot
        assert np.array_equal(same.fk([0.1, 0.2]), robot.fk([0.1, 0.2]))
    with pytest.raises(AttributeError, match="a robot cannot be changed"):
        robot._modules = {}  # type: ignore[misc]


def test_arguments_are_those_of_a_kernel(quick: list[tuple[Any, ...]]) -> None:
    robot = kinegen.load(PLANAR)
    q = np.random.default_rng(2).uniform(-1, 1, (7, 3, 2))
    out = np.empty((7, 3, 4, 4))

    assert robot.fk(q, out=out, threads=2) is out
    assert np.array_equal(robot.fk(q, layout="3x4"), out[..., :3, :])
    assert robot.fk(q.astype(np.float32)).dtype == np.float32
    assert robot.jacobian(q.reshape(-1, 2).T, layout="joint_major").shape == (12, 21)
    assert np.isnan(robot.fk([np.nan, 0.0])[0, 3])
    for wrong in ([0.0], [[0.0] * 3], 0.0):
        with pytest.raises(ValueError, match=r"q has shape .*, expected \(..., 2\)"):
            robot.fk(wrong)
    with pytest.raises(TypeError, match="q has strings"):
        robot.jacobian("ab")
    with pytest.raises(ValueError, match="base_T_tool holds a reflection"):
        robot.inverse(np.diag([1.0, 1.0, -1.0, 1.0]))
    with pytest.raises(TypeError, match="nearest and q0 are the same argument"):
        robot.inverse(np.eye(4), nearest=[0, 0], q0=[0, 0])
    with pytest.raises(TypeError, match=r"takes 1 array \(base_T_tool\), 2 given"):
        robot.inverse(np.eye(4), 0.5)
    with pytest.raises(TypeError, match="params is given, but the robot has no runtime parameters"):
        robot.fk([0, 0], params={"reach": 1})
    assert np.array_equal(robot.fk([0, 0], params={}), robot.fk([0, 0]))


@pytest.mark.parametrize(
    ("name", "aim"),
    [("puma560", "pose"), ("scara", "position"), ("planar_3r", "pose"), ("hand", ""), ("general_6r", "")],
)
def test_a_robot_says_what_its_inverse_is_solved_for(name: str, aim: str) -> None:
    assert kinegen.load(ROBOTS / f"{name}.yaml").inverse_aim == aim


def test_runtime_parameters_are_given_by_name(quick: list[tuple[Any, ...]]) -> None:
    robot = kinegen.load(RUNTIME)
    module = kinegen.compile(robot, "pose", real="double", compile=False)

    assert robot.fk([0, 0])[0, 3] == 0.75
    assert robot.fk([0, 0], params={"reach": 1.5})[0, 3] == 1.75
    assert robot.fk([0, 0], params=module.Params(reach=2.0))[0, 3] == 2.25
    assert robot.fk([0, 0], params={"reach": np.array([1.0, 2.0])})[:, 0, 3].tolist() == [1.25, 2.25]
    assert robot.fk([0, 0], params={})[0, 3] == 0.75
    with pytest.raises(TypeError, match="params has 'short', which is not a runtime parameter"):
        robot.fk([0, 0], params={"short": 1})
    with pytest.raises(TypeError, match="params is of type float, expected Params"):
        robot.fk([0, 0], params=1.5)


def test_trees_and_followers_compute_too(quick: list[tuple[Any, ...]]) -> None:
    tree, gripper = kinegen.load(TREE), kinegen.load(MIMIC)

    assert tree.fk(np.zeros(3)).shape == (2, 4, 4)
    assert tree.jacobian(np.zeros((5, 3))).shape == (5, 2, 6, 3)
    with pytest.raises(kinegen.KinegenError, match="it has 2 tips"):
        tree.inverse(np.eye(4))
    q = np.array([0.5])
    assert np.abs(gripper.fk(q) - kinegen.reference.fk(gripper, q)).max() < 1e-15
    assert gripper.n == gripper.dof == 1
    assert gripper.limits == ((-1.0, 1.0),)


def test_a_redundancy_is_the_second_argument(quick: list[tuple[Any, ...]]) -> None:
    robot = kinegen.load(ROBOTS / "planar_3r.yaml")
    given = kinegen.load(robot, redundancy=robot.joints[0])
    solutions, valid = given.inverse(given.fk([0.1, 0.2, 0.3]), 0.1)

    assert valid.any()
    assert np.abs(solutions[valid][:, 0] - 0.1).max() < 1e-12


def test_robots_that_differ_in_limits_alone_keep_their_own(quick: list[tuple[Any, ...]]) -> None:
    narrow = {**PLANAR, "joints": [{**PLANAR["joints"][0], "limits": [-1, 1]}, PLANAR["joints"][1]]}  # type: ignore[index]
    wide, close = kinegen.load(PLANAR), kinegen.load(narrow)
    pose = wide.fk([0.8, 0.3])

    assert wide.inverse(pose)[1].sum() > close.inverse(pose)[1].sum()
    assert wide != close


def test_limits_are_those_of_a_module() -> None:
    for name in ("scara", "puma560", "ur5", "screw", "blocks"):
        robot = kinegen.load(ROBOTS / f"{name}.yaml")
        pairs = robot.limits

        assert robot.qlim.shape == (2, robot.dof)
        for pair, column in zip(pairs, robot.qlim.T, strict=True):
            assert tuple(column) == (pair or (-np.inf, np.inf))
    robot = kinegen.load(PLANAR)
    assert robot.limits == kinegen.compile(robot, "pose", real="double", compile=False).LIMITS
    assert robot.limits[1] is None
    assert robot.joint_names == robot.joints == ("shoulder", "elbow")
    assert robot.n == 2


def test_names_of_robotics_toolbox_are_there(quick: list[tuple[Any, ...]]) -> None:
    robot = kinegen.load(PLANAR)

    assert np.array_equal(robot.fkine([0.1, 0.2]), robot.fk([0.1, 0.2]))
    assert np.array_equal(robot.jacob0([0.1, 0.2]), robot.jacobian([0.1, 0.2]))


def test_looking_at_a_robot_compiles_nothing(quick: list[tuple[Any, ...]]) -> None:
    """`dir`, `hasattr` and what notebooks ask for."""
    robot = kinegen.load(PLANAR)
    for name in dir(robot):
        getattr(robot, name, None)
    assert not hasattr(robot, "twist")
    assert not hasattr(robot, "_repr_latex_")
    assert repr(robot)
    assert quick == []


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("twist", "'Robot' object has no attribute 'twist': kinegen.compile(robot, \"twist\") has it"),
        ("FRAMES", "'Robot' object has no attribute 'FRAMES': kinegen.compile(robot, \"frames\") has it"),
        ("forward", "'Robot' object has no attribute 'forward'"),
        ("_modules", "'Robot' object has no attribute '_modules'"),
    ],
)
def test_other_outputs_are_those_of_a_module(name: str, message: str) -> None:
    with pytest.raises(AttributeError) as caught:
        getattr(kinegen.load(PLANAR), name)
    assert str(caught.value) == message


def test_a_failure_is_not_kept(own_cache: Path, quick: list[tuple[Any, ...]], monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: Any) -> Any:
        raise ProofError("arm: nothing holds")

    robot = kinegen.load(PLANAR)
    with monkeypatch.context() as patch:
        patch.setattr("kinegen.driver.pipeline.build", fails)
        for _ in range(2):
            with pytest.raises(kinegen.KinegenError, match="nothing holds"):
                robot.fk([0.0, 0.0])
    assert robot.fk([0.0, 0.0])[0, 3] == 0.75


def test_without_a_compiler_numpy_computes(
    own_cache: Path, monkeypatch: pytest.MonkeyPatch, recwarn: pytest.WarningsRecorder
) -> None:
    monkeypatch.setenv("PATH", str(own_cache))
    robot = kinegen.load(PLANAR)
    with pytest.warns(RuntimeWarning, match="evaluates with NumPy"):
        assert robot.fk([0.0, 0.0])[0, 3] == 0.75
    recwarn.clear()
    assert robot.fk([0.0, 0.0])[0, 3] == 0.75
    assert not recwarn.list


def test_threads_compile_a_robot_once(own_cache: Path, quick: list[tuple[Any, ...]], builds: list[str]) -> None:
    robot = kinegen.load(PLANAR)
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda value: robot.fk([value, 0.0]), np.linspace(0, 1, 8)))

    assert quick == [("arm", "pose,jacobian")]
    assert builds == ["arm"]
    assert len({pose.tobytes() for pose in found}) == 8


class Terminal(io.StringIO):
    """A stream that a person reads."""

    def isatty(self) -> bool:
        return True


def test_a_terminal_is_told_once(
    own_cache: Path, quick: list[tuple[Any, ...]], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "stderr", Terminal())
    robot = kinegen.load(PLANAR)
    robot.fk([0.0, 0.0])
    kinegen.load(PLANAR).jacobian([0.0, 0.0])

    assert sys.stderr.getvalue() == "compiling arm (first time; kept)\n"  # type: ignore[attr-defined]
    assert capsys.readouterr().out == ""


def test_a_program_is_told_nothing(quick: list[tuple[Any, ...]], capsys: pytest.CaptureFixture[str]) -> None:
    kinegen.load(arm(0.5)).fk([0.0, 0.0])

    assert capsys.readouterr() == ("", "")


def test_a_notebook_is_told_and_a_closed_stream_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    closed, other = Terminal(), io.StringIO()
    closed.close()
    for stream in (closed, None, object()):
        monkeypatch.setattr(sys, "stderr", stream)
        module_cache.say_compiling("arm", is_kept=True)
    monkeypatch.setattr(sys, "stderr", other)
    for shell in (None, SimpleNamespace()):
        monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda shell=shell: shell))
        module_cache.say_compiling("arm", is_kept=True)
    assert other.getvalue() == ""
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: SimpleNamespace(kernel=1)))
    module_cache.say_compiling("arm", is_kept=False)
    assert other.getvalue() == "compiling arm (first time)\n"
