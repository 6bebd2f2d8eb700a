"""The inverse of five-axis machines: proven for every type, and called as people call it."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.scalar_types import ScalarType
from kinegen.derive.dispatch import derive
from kinegen.driver.pipeline import lower_file
from kinegen.errors import KinegenError
from kinegen.io.load import load, loads
from kinegen.ir.lower import lower, runtime_defaults
from kinegen.model.outputs import Kind, parse_quantity
from kinegen.runtime.extension import load_package
from kinegen.ui.cli import main
from kinegen.verify import five_axis as proof
from kinegen.verify import reference
from kinegen.verify.singular_samples import Values
from tests.builds.workshop import ROBOTS, make, set_machine, write_robot
from tests.machine_tools.machines import MACHINES, Machine

WAY = "cutter/workpiece"
QUANTITIES = (parse_quantity(f"pose@{WAY}"), parse_quantity(f"axis_inverse@{WAY}"))
TURN = 2 * np.pi


def fewer(monkeypatch: pytest.MonkeyPatch, targets: int) -> None:
    """Targets in a proof."""
    monkeypatch.setattr(proof, "TARGETS", targets)
    monkeypatch.setattr(proof, "FEWER", targets // 4)
    monkeypatch.setattr(proof, "_SPECIAL", targets // 10)


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """The trunnion mill in double, in C."""
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("mill")
        set_machine(patch, folder / "cache")
        fewer(patch, 1000)
        result = make(ROBOTS / "trunnion_mill.yaml", folder, quantities=QUANTITIES, reals=(ScalarType.DOUBLE,))
        targets = {each.target for each in result.proof.comparisons if each.quantity.kind is Kind.AXIS_INVERSE}
        assert targets == {
            f"{way}, there and back{parameters}"
            for way in ("C double", "C double, batch", "C double, batch joint_major", "NumPy double")
            for parameters in ("", ", other parameters")
        }
        return load_package(folder / "trunnion_mill")


@pytest.fixture
def solve(package: ModuleType) -> Callable[..., tuple[np.ndarray, np.ndarray]]:
    return package.axis_inverse_cutter_in_workpiece


def aimed(package: ModuleType, q: np.ndarray, **options: object) -> tuple[np.ndarray, np.ndarray]:
    pose = package.fk_cutter_in_workpiece(q, **options)
    return pose[..., :3, 3], pose[..., :3, 2]


def test_the_joint_vector_comes_back(package: ModuleType, solve: Callable[..., tuple[np.ndarray, np.ndarray]]) -> None:
    q = np.array([0.7, -5.0, 120.0, -80.0, 500.0])
    solutions, valid = solve(*aimed(package, q), q)
    np.testing.assert_allclose(solutions[0], q, atol=1e-9)
    assert valid[0] == 1


def test_another_tool_length(package: ModuleType, solve: Callable[..., tuple[np.ndarray, np.ndarray]]) -> None:
    q = np.array([0.7, 1.0, 120.0, -80.0, 500.0])
    params = package.Params(tool_length=45.5)
    solutions, _ = solve(*aimed(package, q, params=params), q, params=params)
    shorter, _ = solve(*aimed(package, q, params=params), q)
    np.testing.assert_allclose(solutions[0], q, atol=1e-9)
    np.testing.assert_allclose(shorter[0] - q, [0, 0, 0, 0, 120 - 45.5], atol=1e-9)


def test_a_table_follows_its_last_turn(solve: Callable[..., tuple[np.ndarray, np.ndarray]]) -> None:
    axis = np.array([0.3, -0.2, 1.0])
    near = np.array([[0.3, c, 0, 0, 300] for c in np.linspace(-6.2, 6.2, 41)])
    solutions, valid = solve(np.zeros((41, 3)), np.tile(axis, (41, 1)), near)
    for branch in (0, 1):
        found = solutions[valid[:, branch] == 1, branch, 1]
        assert np.ptp(np.round((found - found[0]) / TURN)) == 1
        apart = np.abs(found - near[valid[:, branch] == 1, 1])
        inside = np.abs(near[valid[:, branch] == 1, 1]) < TURN - np.pi
        assert (apart[inside] <= np.pi + 1e-9).all()


def test_a_vertical_tool_leaves_the_table_where_it_is(solve: Callable[..., tuple[np.ndarray, np.ndarray]]) -> None:
    for angle in (-5.0, 0.0, 0.4, 6.0):
        solutions, valid = solve(np.zeros(3), np.array([0, 0, 2.0]), np.array([0, angle, 0, 0, 300.0]))
        assert valid.all()
        np.testing.assert_allclose(solutions[:, :2], [[0, angle]] * 2, atol=1e-12)


@pytest.mark.parametrize("axis", [[0, 0, 0], [np.nan, 0, 1], [np.inf, 0, 1], [0, 0, 1e-9], [0, 0, 1e9]])
def test_what_is_no_direction(solve: Callable[..., tuple[np.ndarray, np.ndarray]], axis: list[float]) -> None:
    assert not solve(np.zeros(3), np.array(axis), np.zeros(5))[1].any()


@pytest.mark.parametrize("near", [np.nan, np.inf])
def test_what_is_no_joint_vector(solve: Callable[..., tuple[np.ndarray, np.ndarray]], near: float) -> None:
    for place in range(5):
        q = np.zeros(5)
        q[place] = near
        assert not solve(np.zeros(3), np.array([0, 0.1, 1]), q)[1].any()


def test_an_empty_batch(solve: Callable[..., tuple[np.ndarray, np.ndarray]]) -> None:
    solutions, valid = solve(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 5)))
    assert solutions.shape == (0, 2, 5)
    assert valid.shape == (0, 2)


@pytest.mark.parametrize("name", ["head_cb", "nutating_table", "nutating_mixed"])
def test_other_types_in_numpy(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    set_machine(monkeypatch, tmp_path / "cache")
    fewer(monkeypatch, 1000)
    machine = next(each for each in MACHINES if each.name == name)
    assert build(machine, tmp_path, reals=(ScalarType.DOUBLE,), compile=False)


def numbers(text: str, way: str) -> Callable[..., tuple[np.ndarray, np.ndarray]]:
    """The inverse of a machine as its program says, in NumPy."""
    robot = loads(text, "mill.yaml")
    program = lower(derive(robot, parse_quantity(f"axis_inverse@{way}")))

    def solve(q: np.ndarray, near: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        poses = np.asarray(reference.Kinematics(robot, q).pose(way))
        entries = np.concatenate([poses[:, :3, 3], poses[:, :3, 2], near], axis=1)
        values = Values(program, entries.T, tuple(map(float, runtime_defaults(robot))))
        results = np.stack([values.of(operand) for operand in program.outputs], axis=1)
        return results[:, :10].reshape(len(q), 2, 5), results[:, 10:]

    return solve


@pytest.mark.parametrize(("low", "high"), [(-180, 180), (0, 360), (-90, 270)])
def test_a_table_with_limits_of_one_turn_stays_at_the_end_where_it_is(low: float, high: float) -> None:
    """Both ends are the same angle of the table, and a turn apart for its cables."""
    text = (ROBOTS / "trunnion_mill.yaml").read_text(encoding="utf-8").replace("[-360, 360]", f"[{low}, {high}]")
    for end in np.radians([low, high]):
        q = np.array([[0.7, end, 12.0, -80.0, 500.0]])
        solutions, valid = numbers(text, WAY)(q, q)
        assert valid[0, 0] == 1
        np.testing.assert_allclose(solutions[0, 0], q[0], atol=1e-9)


def test_a_table_with_limits_of_one_turn_is_proven(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    set_machine(monkeypatch, tmp_path / "cache")
    fewer(monkeypatch, 1000)
    text = (ROBOTS / "trunnion_mill.yaml").read_text(encoding="utf-8").replace("[-360, 360]", "[-180, 180]")
    path = write_robot(tmp_path, text, "trunnion_mill.yaml")
    assert make(path, tmp_path, quantities=QUANTITIES, reals=(ScalarType.DOUBLE,), compile=False).proof.holds


def test_a_vertical_tool_leaves_a_table_with_narrow_limits_within_them() -> None:
    text = (ROBOTS / "trunnion_mill.yaml").read_text(encoding="utf-8").replace("[-360, 360]", "[-100, 60]")
    q = np.array([[0.0, 0.3, 12.0, -80.0, 500.0]])
    solutions, valid = numbers(text, WAY)(q, np.array([[0, 2.0, 0, 0, 0]]))
    assert valid.all()
    np.testing.assert_allclose(solutions[0, :, 1], np.radians(60), atol=1e-12)


HEAD = """\
kinegen: 1
name: head
convention: standard
units: {length: mm, angle: deg}
joints:
  - {name: x_axis, parent: base, ets: [Tx(q)], limits: [0, 2000]}
  - {name: y_axis, parent: x_axis, ets: [Ty(q)], limits: [0, 1500]}
  - {name: z_axis, parent: y_axis, ets: [Tz(900 + q)], limits: [-400, 400]}
  - {name: c_axis, parent: z_axis, ets: [Rz(q)], limits: [-370, 370]}
  - {name: b_axis, parent: c_axis, ets: [Tx(1.5), Ry(q)], limits: [-110, 110]}
tool: {ets: [Tz(-210)]}
frames:
  workpiece: {parent: base, xyz: [300, 200, 40]}
"""


def test_a_machine_with_all_joints_in_the_head_has_its_workpiece_on_the_base() -> None:
    q = np.array([[400.0, 300.0, 100.0, 2.0, 0.7]])
    solutions, valid = numbers(HEAD, "tool/workpiece")(q, q)
    assert valid[0, 0] == 1
    np.testing.assert_allclose(solutions[0, 0], q[0], atol=1e-9)


def test_a_tip_on_the_base_of_such_a_machine_is_refused_with_the_way_out() -> None:
    with pytest.raises(KinegenError) as caught:
        loads(HEAD.replace("parent: base, xyz", "parent: base, tip: true, xyz"), "mill.yaml")
    assert "leave tip out here, and build outputs such as pose@tool/workpiece" in str(caught.value)


@pytest.mark.long
@pytest.mark.parametrize("machine", MACHINES, ids=lambda machine: machine.name)
def test_every_type_in_both_number_types(machine: Machine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    set_machine(monkeypatch, tmp_path / "cache")
    assert build(machine, tmp_path)


def build(machine: Machine, folder: Path, **options: object) -> bool:
    path = write_robot(folder, machine.text, f"{machine.name}.yaml")
    return make(path, folder, quantities=QUANTITIES, **options).proof.holds


def refused(text: str) -> str:
    with pytest.raises(KinegenError) as caught:
        derive(loads(text, "mill.yaml"), QUANTITIES[1])
    return str(caught.value)


def test_what_is_no_machine() -> None:
    text = MACHINES[0].text
    assert "3 prismatic and 2 revolute joints, this has 2 and 3" in refused(text.replace("Ty(q)", "Rz(q)"))
    assert "axes first and second are parallel" in refused(text.replace("Rx(-q)", "Rz(-q)"))
    assert "are in one plane" in refused(text.replace("Ty(q)", "Tx(q)"))
    text = MACHINES[4].text
    swapped = text.replace("name: z, parent: y, ets: [Tz(q)]", "name: second, parent: y, ets: [Ry(q)]")
    swapped = swapped.replace("name: second, parent: z, ets: [Ry(q)]", "name: z, parent: second, ets: [Tz(q)]")
    assert "must follow each other" in refused(swapped.replace("cutter: {parent: second", "cutter: {parent: z"))


def test_inspect_says_how(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["inspect", str(ROBOTS / "nutating_mill.yaml")]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert (
        "cutter as a tool in the frame of workpiece: a machine tool with five axes, both rotary axes in the head"
        in told
    )
    assert "directions from 0 to 90 deg off axis c_axis are reached in two ways" in told
    assert "workpiece as a tool" not in told


def test_the_example_of_the_page(tmp_path: Path) -> None:
    page = (ROBOTS.parent / "docs" / "machine_tools.md").read_text(encoding="utf-8")
    file, source = (page.split(f"```{kind}\n")[1].split("```")[0] for kind in ("yaml", "c"))
    robot, shown = loads(file, "trunnion_mill.yaml"), load(ROBOTS / "trunnion_mill.yaml")
    assert robot.digest == shown.digest
    kernels = lower_file(ROBOTS / "trunnion_mill.yaml", QUANTITIES)
    for name, text in ({"example.c": source} | emit_kernel(kernels, ScalarType.DOUBLE)).items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    subprocess.run(["cc", "-O0", "-o", "example", "example.c", "trunnion_mill.c"], cwd=tmp_path, check=True)
    found = subprocess.run([str(tmp_path / "example")], capture_output=True, text=True, check=True).stdout
    assert f"./a.out\n{found}```" in page
