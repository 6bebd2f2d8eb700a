"""The benchmarks: what they compare is right, and they run through with a handful of poses."""

from __future__ import annotations

import os
import shutil
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.speed import __main__ as command
from benchmarks.speed import machine, peers
from benchmarks.speed.arm import Arm, load_arm
from benchmarks.speed.c_text import closed_form_text, operations, plain_text, sincos_operations, tiled_text
from benchmarks.speed.clock import Case, Effort, Repeated, Timing, measure, ratio
from benchmarks.speed.kernels import Data, loops
from benchmarks.speed.library import libm_build, loop, tiled_build
from benchmarks.speed.peers import Absent, Peer, load_peers
from benchmarks.speed.placements import placements, urdf
from benchmarks.speed.rows import TIME, Row, load_results
from docs import make_performance
from kinegen.backends.scalar_types import ScalarType

pytestmark = pytest.mark.skipif(
    not any(map(shutil.which, ("cc", "gcc", "clang"))), reason="needs cc, gcc or clang (apt install gcc)"
)

POSES = 37
ROW = Row("arm", "kernel", "4x4", "double", 1, 100, "-O3", "gcc 12", 80.0, 90.0, 0.1)


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Arm:
    return load_arm("puma560", tmp_path_factory.mktemp("packages"))


@pytest.fixture
def free_cores() -> Iterator[None]:
    """Gives this process back the cores that a benchmark takes from it."""
    cores = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set()
    yield
    if cores:
        os.sched_setaffinity(0, cores)


# What is compared -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("real", list(ScalarType))
def test_every_loop_computes_the_poses(arm: Arm, real: ScalarType) -> None:
    data = Data(arm, real, POSES)
    entries = loops(data)
    expected = arm.poses(data.q)

    for name in ("4x4", "call", "libm", "tiled", "plain"):
        data.out[:] = 0
        entries[name].case.run()
        assert np.abs(data.out - expected).max() < (1e-14 if real is ScalarType.DOUBLE else 2e-6), name

    entries["joint-major"].case.run()
    assert np.abs(data.out_rows.T.reshape(POSES, 3, 4) - expected[:, :3]).max() < 2e-6


def test_what_is_called_from_c_is_repeated_there(arm: Arm) -> None:
    """A call from Python takes as long as some hundred poses, which a ratio of short batches would not survive."""
    entries = loops(Data(arm, ScalarType.DOUBLE, POSES))

    called = {name for name, one in entries.items() if not isinstance(one.case.run, Repeated)}
    assert called == {"call", "fresh"}


def test_a_sample_of_a_repeated_call_is_one_call() -> None:
    seen: list[tuple[int, str]] = []
    case = Case("c", Repeated(lambda times, word: seen.append((times, word)), ("q",)), 10)

    timing = measure([case], Effort(2, 0.0))["c"]

    assert len(timing.seconds) == 2
    assert {word for _, word in seen} == {"q"}
    assert [times for times, _ in seen if times > 1] == [max(times for times, _ in seen)] * 2


def test_the_hand_written_loops_suit_other_tables(tmp_path: Path) -> None:
    """The other convention, and an angle with a constant part."""
    arm = load_arm("thumb", tmp_path)
    q = arm.configurations(POSES, "double")

    for text, build in ((closed_form_text, libm_build()), (plain_text, libm_build()), (tiled_text, tiled_build())):
        out = np.zeros((POSES, 4, 4))
        loop(build, text(arm, ScalarType.DOUBLE), q, out, POSES)()
        assert np.abs(out - arm.poses(q)).max() < 1e-13


def test_placements_and_turns_make_the_pose(arm: Arm) -> None:
    q = arm.configurations(1, "double")
    before, tail = placements(arm)
    pose = np.eye(4)
    for matrix, angle in zip(before, q[0], strict=True):
        c, s = np.cos(angle), np.sin(angle)
        pose = pose @ matrix @ np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])

    assert np.abs(pose @ tail - arm.poses(q)[0]).max() < 1e-15


def test_the_urdf_has_a_joint_for_each_row_and_the_tool(arm: Arm) -> None:
    joints = ET.fromstring(urdf(arm)).findall("joint")  # noqa: S314 - our own text

    assert [joint.get("type") for joint in joints] == ["continuous"] * 6 + ["fixed"]


def test_operations_are_those_of_the_kernel(arm: Arm) -> None:
    """Forty-one products, twenty sums and the angle q2 + q3 at most, and six pairs."""
    plain = operations(arm.program, ScalarType.DOUBLE) - 6 * sincos_operations(ScalarType.DOUBLE)

    assert 55 <= plain <= 62


def test_a_peer_that_is_installed_takes_part(arm: Arm) -> None:
    found = list(load_peers(arm, ("numpy_matmul", "sympy_lambdify")))

    assert [(peer.name, peer.real) for peer in found if isinstance(peer, Peer)] == [
        ("NumPy matmul chain", "double"),
        ("NumPy matmul chain", "float"),
        ("SymPy lambdify(cse=True)", "double"),
        ("SymPy lambdify(cse=True)", "float"),
    ]


def test_a_peer_with_other_poses_takes_no_part(arm: Arm, monkeypatch: pytest.MonkeyPatch) -> None:
    from benchmarks.speed.peers import numpy_matmul

    (honest, _) = numpy_matmul.peers(arm)
    wrong = replace(honest, result=lambda poses: poses + 1e-3)
    monkeypatch.setattr(numpy_matmul, "peers", lambda _: iter([wrong]))

    assert list(load_peers(arm, ("numpy_matmul",))) == [Absent("NumPy matmul chain", "its poses are off by 1.0e-03")]


def test_a_peer_that_is_not_installed_is_named(arm: Arm, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(_: str) -> None:
        raise ModuleNotFoundError("No module named 'numba'")

    monkeypatch.setattr(peers.importlib, "import_module", missing)

    assert list(load_peers(arm, ("numba_closed_form",))) == [
        Absent("numba_closed_form", "not installed: No module named 'numba'")
    ]


# How it is measured ---------------------------------------------------------------------------------------------------


def test_cases_take_turns() -> None:
    order: list[str] = []
    cases = [Case(key, lambda key=key: order.append(key), 1) for key in "ab"]  # type: ignore[misc]

    timings = measure(cases, Effort(turns=2, patience=0.0))

    assert set(timings) == {"a", "b"}
    assert "".join(dict.fromkeys(order)) == "ab"
    assert "".join(order).count("ab") > 2


def test_a_ratio_compares_what_ran_together() -> None:
    """The third turn was disturbed, so it does not count; in each other the one took half the time."""
    timings = {
        "one": Timing((1.0, 2.0, 50.0, 3.0), frozenset({0, 1, 3})),
        "other": Timing((2.0, 4.0, 6.0, 6.0), frozenset({0, 1, 2, 3})),
    }

    assert ratio(timings, "one", "other") == 2.0
    assert timings["one"].median() == 2.0


def test_all_turns_count_where_too_few_are_calm() -> None:
    timing = Timing((1.0, 2.0, 3.0), frozenset({2}))

    assert timing.median() == 2.0
    assert timing.best == 1e-6


def test_a_figure_is_met_by_the_ratio_or_by_a_shorter_time() -> None:
    assert ROW.met is None
    assert replace(ROW, ratio=0.6, asked=0.5).met is True
    assert replace(ROW, ratio=0.4, asked=0.5).met is False
    assert replace(ROW, unit=TIME, value=0.3, asked=0.65).met is True
    assert replace(ROW, unit=TIME, value=0.7, asked=0.65).met is False


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="needs os.sched_setaffinity, which Linux has")
@pytest.mark.usefixtures("free_cores")
def test_the_process_keeps_to_one_core() -> None:
    cores = machine.pin()

    assert os.sched_getaffinity(0) == {cores[0]}


# The command and the page ---------------------------------------------------------------------------------------------


@pytest.mark.usefixtures("free_cores")
def test_the_command_prints_and_writes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "environ", dict(os.environ))
    output = tmp_path / "results" / "speed.json"
    few = ["--poses", "100", "--turns", "1", "--patience", "0"]

    status = command.main(
        [*few, "--robots", "puma560", "--parts", "shares,sizes,threads,single", "--output", str(output)]
    )

    assert status == 0
    printed = capsys.readouterr().out
    assert "batch kernel, from C" in printed
    results = load_results(output)
    asked = {(row.what, row.layout, row.asked) for row in results.rows if row.asked is not None}
    assert ("batch kernel, from C", "4x4", 0.5) in asked
    assert ("batch kernel, from C", "joint-major", 0.65) in asked
    assert ("one call: fk(q)", "4x4", 0.4) in asked
    assert all(row.processor and row.value > 0 for row in results.rows)
    page = "".join(f"<!-- measured: {name} -->\n<!-- end -->\n" for name in ("machine", "kernels", "threads", "single"))
    assert "| batch kernel, from C, joint-major | double |" in make_performance.page(page, results)
    ET.fromstring(make_performance.draw(results))  # noqa: S314 - our own text


def test_the_page_says_what_its_measurement_says() -> None:
    assert make_performance.main(["--check"]) == 0
