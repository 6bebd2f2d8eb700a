"""Inverses give the same bits on every processor: the closed form on all of them, the search on one."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.c.numeric_inverse import emit_numeric_inverse
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.templates import environment
from kinegen.model.outputs import POSE_AND_JACOBIAN, Quantity, parse_quantity
from kinegen.support.naming import c_file, prefix, search_file
from kinegen.verify.boards.programs import Table, TableEntry, build_program
from kinegen.verify.boards.targets import SOURCES, TARGETS, Target, run_program
from tests.boards.conftest import kernels, require, run_files

pytestmark = pytest.mark.boards

ARM = "puma560"
DOF = 6
BRANCHES = 8
ON_BOARDS = [(target, real) for target in TARGETS.values() for real in target.reals]


def write(
    folder: Path, real: ScalarType, quantities: tuple[Quantity, ...], entry: TableEntry, header: str
) -> list[Path]:
    """Write the kernels of the arm and a table with one call; the C files."""
    folder.mkdir(exist_ok=True)
    arm = kernels(ARM, *quantities)
    table = Table(headers=(header,), kernels=(entry,), joints=entry.joints, numbers=entry.numbers)
    texts = {
        **emit_kernel(arm, real),
        **emit_numeric_inverse(arm, real),
        "kernels.c": environment().get_template("boards/kernels.c.jinja").render(t=table),
    }
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8", newline="\n")
    sources = [c_file(ARM, "c", real), "kernels.c"]
    return [folder / name for name in (*sources, *([search_file(ARM, "c", real)] if "search" in entry.name else []))]


def closed_form(folder: Path, real: ScalarType) -> list[Path]:
    """All solutions for the pose of a joint vector, and the one nearest to a vector half a turn from it."""
    stem, count = prefix(ARM, real), DOF * BRANCHES
    calls = (
        "real pose[16], near[6]",
        f"{stem}_fk(q, pose)",
        f"uint8_t valid[{BRANCHES}]",
        f"{stem}_inverse(pose, (void *)result, valid)",
        f"for (int i = 0; i < {BRANCHES}; i++) {{ result[{count} + i] = (real)valid[i]; }}",
        *(f"near[{joint}] = q[{joint}] + (real){3 * (-1) ** joint}" for joint in range(DOF)),
        f"result[{count + BRANCHES}] = (real){stem}_inverse_nearest(pose, near, result + {count + BRANCHES + 1})",
    )
    entry = TableEntry("inverse", "", "; ".join(calls), DOF, count + BRANCHES + 1 + DOF, "1")
    return write(folder, real, (Quantity.POSE, parse_quantity("inverse")), entry, c_file(ARM, "h", real))


def search(folder: Path, real: ScalarType) -> list[Path]:
    """What the search finds for the pose of a joint vector from zero, with few restarts, and how far it got."""
    stem = prefix(ARM, real)
    calls = (
        "real pose[16], jacobian[36]",
        f"static const real start[{DOF}] = {{0}}",
        f"const {stem}_search how = {{(real)1e-5, (real)1e-5, 1, 1u}}",
        f"{stem}_found found",
        f"{stem}_fk_jacobian(q, pose, jacobian)",
        f"result[{DOF}] = (real){stem}_numeric_inverse(pose, start, &how, result, &found)",
        f"result[{DOF + 1}] = found.position_error",
        f"result[{DOF + 2}] = (real)found.iterations",
    )
    entry = TableEntry("search", "", "; ".join(calls), DOF, DOF + 3, "1")
    return write(folder, real, (POSE_AND_JACOBIAN,), entry, search_file(ARM, "h", real))


@pytest.mark.parametrize(
    ("target", "real"), ON_BOARDS, ids=lambda value: value.name if isinstance(value, Target) else value.value
)
def test_every_board_solves_alike(target: Target, real: ScalarType, tmp_path: Path) -> None:
    require(target)
    program = build_program(target, tmp_path, closed_form(tmp_path, real), SOURCES / "bits.c", real, ("-Os",))
    host = tmp_path / "host"

    assert run_program(target, program) == run_files(host, closed_form(host, real), real, "gcc", "-O2")


@pytest.mark.parametrize("level", ["-Os", "-O2"])
def test_a_board_searches_as_the_host_does(level: str, tmp_path: Path) -> None:
    target, real = TARGETS["cortex-m4f"], ScalarType.FLOAT
    require(target)
    program = build_program(target, tmp_path, search(tmp_path, real), SOURCES / "bits.c", real, (level,))
    host = tmp_path / "host"

    assert run_program(target, program) == run_files(host, search(host, real), real, "gcc", "-O2")
