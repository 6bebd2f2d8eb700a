"""What joint values for poses cost, and whether any are missed: `python -m benchmarks.inverse`.

Every row is a figure that this project promises and what was found on this machine. Times are those of one thread on
the processor, so that other programs disturb them little; instructions are counted by callgrind, the same on every run.
Peers take part where they are installed (`pip install -e '.[bench]'`); see `benchmarks.solvers`.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Callable, Iterator
from functools import cache, partial
from itertools import chain, product
from pathlib import Path
from types import ModuleType

import numpy as np

from benchmarks.compiled import nanoseconds
from benchmarks.lock_step import lock_step
from benchmarks.machine_inverse import machines
from benchmarks.solvers import Solver, closed_forms, descents
from benchmarks.speed.arm import ROBOTS, Array
from benchmarks.speed.clock import Case, Effort, measure, seconds_of
from benchmarks.velocity import FLAGS, _instructions
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.scalar_types import ScalarType
from kinegen.derive.inverse.derive import family_of
from kinegen.derive.inverse.family import Aim
from kinegen.derive.inverse.singular_configurations import alignments, boundaries
from kinegen.driver.pipeline import build, lower_file
from kinegen.driver.results import BuildOptions
from kinegen.io.load import load
from kinegen.model.joint_bounds import joint_box
from kinegen.model.outputs import NUMERIC_INVERSE, Kind, Quantity
from kinegen.model.robot import JointType, Robot
from kinegen.runtime.extension import load_package
from kinegen.runtime.flags import Flags
from kinegen.verify import reference

RESULTS = Path(__file__).resolve().parent / "results" / "inverse.json"
INVERSE = Quantity(Kind.INVERSE)
FAMILIES = (
    "planar_3r",
    "scara",
    "cylindrical_arm",
    "cartesian",
    "spherical_arm",
    "anthropomorphic_arm",
    "puma560",
    "stanford",
    "ur5",
    "al5d",
)
"""A robot of each family."""

REDUNDANT = {"panda_joint_7": (600, 250), "iiwa14_arm_angle": (600, 250)}
"""Seven joints with one of them, or the arm angle, given: nanoseconds asked of one target, and of each in a batch."""

NEARLY = (Path(__file__).parents[1] / "tests" / "inverse" / "robots" / "ur5_calibrated.yaml", 1500)
"""An arm that is nearly of a family: nanoseconds asked of one target."""

POSES, SINGULAR, BLOCK = 1_000_000, 100_000, 100_000
SEARCHES, CALLS = 100_000, 20_000
EFFORT = Effort(turns=5, patience=5.0)
NEAR, NEARER = 1e-6, 1e-9
"""How near a solution must come to its joint vector, and its pose to the target."""

NEAR_START = 0.01
"""How far the joint vectors for `nearest=` are from one that leads to the target: radians."""

SINGULAR_VALUE = 1e-3
"""The least of a Jacobian in metres and radians, below which the rounding of a target moves joints."""

ROOTS = ("-fno-math-errno", "-fno-tree-slp-vectorize")
"""Square roots from the processor; and none of the moves between vectors that valgrind does not know."""

Row = tuple[str, str, str]


def main() -> int:
    """Print the table and write the file; a figure that is not met fails nothing, since machines differ."""
    rows: list[Row] = []
    ours = scalar(), batches(), nearest(), successes(), redundant(), nearly(), machines(), searches(), lock_step()
    for row in chain(*ours, against()):
        rows.append(row)
        print(f"{row[0]:<84}{row[1]:>36}   asked {row[2]}", flush=True)
    RESULTS.parent.mkdir(exist_ok=True)
    RESULTS.write_text(json.dumps([dict(zip(("what", "found", "asked"), row)) for row in rows], indent=1) + "\n")
    return 0


def scalar() -> Iterator[Row]:
    """All branches of one target, in C."""
    for name in ("puma560", "ur5"):
        kernels = lower_file(ROBOTS / f"{name}.yaml", (Quantity.POSE, INVERSE))
        files = emit_kernel(kernels, ScalarType.DOUBLE) | {"main.c": _MAIN.replace("NAME", name)}
        asked = "under 400 ns" if name == "puma560" else "-"
        yield f"{name}: eight branches, C, one target", f"{nanoseconds(files, Flags().arguments()):.0f} ns", asked
        for label, flags in FLAGS.items():
            found = _instructions(files, (*flags, *ROOTS))
            yield f"{name}: eight branches, C, instructions, {label}", f"{found:.0f}", "-"


def batches() -> Iterator[Row]:
    """All branches of many targets."""
    for name in ("puma560", "ur5"):
        package = _package(name, INVERSE)
        targets = package.fk(_random(name, BLOCK))
        results = package.inverse(targets)
        out = results[0], np.empty(results[1].shape)
        asked = "under 150 ns" if name == "puma560" else "-"
        plain = partial(package.inverse, targets, out=out, check=False)
        yield f"{name}: eight branches, batch", f"{_seconds(plain) / BLOCK * 1e9:.0f} ns", asked
        whole = _seconds(partial(package.inverse, targets)) / BLOCK * 1e9
        yield f"{name}: eight branches, batch, targets checked, new arrays", f"{whole:.0f} ns", "-"


def nearest() -> Iterator[Row]:
    """The solution nearest to a joint vector, targets checked, new arrays."""
    for name in ("puma560", "ur5"):
        package, q = _package(name, INVERSE), _random(name, BLOCK)
        targets, near = package.fk(q), q + NEAR_START
        many = _seconds(partial(package.inverse, targets, nearest=near)) / BLOCK * 1e6
        yield f"{name}: inverse(T, nearest=q0), batch", f"{many:.3f} us", "under 0.30 us"
        pairs = list(zip(targets[:CALLS], near[:CALLS], strict=True))
        one = _seconds(partial(_each, package, pairs)) / CALLS * 1e6
        yield f"{name}: inverse(T, nearest=q0), one a call", f"{one:.3f} us", "under 1.5 us"


def _each(package: ModuleType, pairs: list[tuple[Array, Array]]) -> None:
    for target, near in pairs:
        package.inverse(target, nearest=near)


def successes() -> Iterator[Row]:
    """Whether a closed form misses a pose that its arm can reach."""
    for name in FAMILIES:
        package = _package(name, INVERSE)
        counts = [_missed(name, package, _random(name, BLOCK, seed)) for seed in range(POSES // BLOCK)]
        missed, moved = (sum(each) for each in zip(*counts, strict=True))
        what = f"{name}: random joint vectors missed by the closed form"
        beside = f" ({moved} moved by rounding)" if moved else ""
        yield what, f"{missed} of {POSES:,}{beside}", "none"
        points = _singular(name)
        if len(points):
            lost = _unsolved(name, package, points)
            what = f"{name}: targets within 1e-9 rad of a singularity that are not solved"
            yield what, f"{lost} of {len(points):,}", "none"


def redundant() -> Iterator[Row]:
    """All branches for seven joints: one target in C, a batch, and whether any joint vector is missed."""
    for name, (one, each) in REDUNDANT.items():
        robot, package = load(ROBOTS / f"{name}.yaml"), _package(name, INVERSE)
        q = _random(name, BLOCK)
        targets, given = package.fk(q), reference.redundancy(robot, q)
        files = emit_kernel(lower_file(ROBOTS / f"{name}.yaml", (Quantity.POSE, INVERSE)), ScalarType.DOUBLE)
        files |= {"main.c": _REDUNDANT_MAIN.replace("NAME", name), "targets.h": _targets_text(targets, given)}
        found = f"{nanoseconds(files, Flags().arguments()):.0f} ns"
        yield f"{name}: eight branches, C, one target", found, f"under {one} ns"
        results = package.inverse(targets, given)
        out = results[0], np.empty(results[1].shape)
        plain = partial(package.inverse, targets, given, out=out, check=False)
        yield f"{name}: eight branches, batch", f"{_seconds(plain) / BLOCK * 1e9:.0f} ns", f"under {each} ns"
        missed = _far(name, *results, q)
        excused = results[1][missed].any(axis=1) & _are_singular(name, q[missed])
        what = f"{name}: random joint vectors missed by the closed form"
        yield what, f"{int((~excused).sum())} of {BLOCK:,} ({int(excused.sum())} moved by rounding)", "none"


def nearly() -> Iterator[Row]:
    """All branches of a calibrated arm: one target in C, a batch, and how far solutions lead from their targets."""
    path, asked = NEARLY
    robot, quantities = load(path), (Quantity.POSE, INVERSE)
    low, high = np.array(joint_box(robot)).T
    targets = reference.pose(robot, np.random.default_rng(0).uniform(low, high, (BLOCK, robot.dof)))[:, 0]
    files = emit_kernel(lower_file(path, quantities), ScalarType.DOUBLE)
    main = _REDUNDANT_MAIN.replace("NAME", robot.name).replace("targets[i] + 16, ", "").replace("[8][7]", "[8][6]")
    files |= {"main.c": main, "targets.h": _targets_text(targets, np.zeros(BLOCK))}
    found = f"{nanoseconds(files, Flags().arguments()):.0f} ns"
    yield f"{robot.name}: eight branches, C, one target", found, f"under {asked} ns"
    with tempfile.TemporaryDirectory() as folder:
        options = BuildOptions(output=Path(folder), reals=(ScalarType.DOUBLE,), quantities=quantities)
        package = load_package(build(path, options, lambda _: None).folder)
    solutions, valid = package.inverse(targets)
    out = solutions, np.empty(valid.shape)
    plain = partial(package.inverse, targets, out=out, check=False)
    yield f"{robot.name}: eight branches, batch", f"{_seconds(plain) / BLOCK * 1e9:.0f} ns", "-"
    where = np.repeat(np.arange(BLOCK), valid.sum(axis=1))
    worst = np.abs(reference.pose(robot, solutions[valid])[:, 0] - targets[where]).max()
    yield f"{robot.name}: largest error of a solution, m or rad", f"{worst:.1e}", "1e-12"


def _targets_text(targets: Array, given: Array) -> str:
    """A thousand targets, each with what is given besides, as C."""
    rows = np.concatenate([targets[:1000].reshape(1000, 16), given[:1000, None]], axis=1)
    lines = (f"    {{{', '.join(map(repr, map(float, row)))}}}," for row in rows)
    return "static const double targets[1000][17] = {\n" + "\n".join(lines) + "\n};\n"


def searches() -> Iterator[Row]:
    """Seven joints, random reachable targets, random starts."""
    for name in ("iiwa14", "panda"):
        package = _package(name, NUMERIC_INVERSE)
        targets, starts = package.fk(_random(name, SEARCHES)), _random(name, SEARCHES, 1)
        search = partial(package.numeric_inverse, targets, starts, tolerances=(NEAR, NEAR))
        spent, found = seconds_of(search), search()
        share = found.solved.mean()
        yield f"{name}: solved to 1e-6 of {SEARCHES:,}, 10 restarts", f"{share:.3%}", "at least 99.9%"
        yield f"{name}: solutions a second on one core", f"{found.solved.sum() / spent:,.0f}", "above 20,000"


def against() -> Iterator[Row]:
    """Peers and ours, the same targets in one run."""
    for name in ("puma560", "ur5"):
        package = _package(name, INVERSE)
        for peer in closed_forms(load(ROBOTS / f"{name}.yaml")):
            many = "one a call" not in peer.name
            yield _compared(name, peer, Solver(_label(many), peer.targets, partial(_solve, package, many), _valid))
        for (_, peer), many in product(descents(load(ROBOTS / f"{name}.yaml")), (True, False)):
            yield _compared(name, peer, Solver(_label(many), peer.targets, partial(_nearest, package, many), _existing))
    for name in ("iiwa14", "panda"):
        package = _package(name, NUMERIC_INVERSE)
        for (restarts, peer), many in product(descents(load(ROBOTS / f"{name}.yaml")), (True, False)):
            ours = Solver(_label(many), peer.targets, partial(_search, package, restarts, many), _existing)
            yield _compared(name, peer, ours)


def _label(many: bool) -> str:
    return "ours, batch" if many else "ours, one a call"


def _solve(package: ModuleType, many: bool, targets: Array, _: Array) -> list[tuple[Array, Array]]:
    return [package.inverse(targets)] if many else [package.inverse(target) for target in targets]


def _nearest(package: ModuleType, many: bool, targets: Array, starts: Array) -> list[tuple[Array, Array]]:
    if many:
        return list(zip(*package.inverse(targets, nearest=starts), strict=True))
    return [package.inverse(target, nearest=start) for target, start in zip(targets, starts, strict=True)]


def _search(package: ModuleType, restarts: int, many: bool, targets: Array, starts: Array) -> list[tuple[Array, Array]]:
    search = partial(package.numeric_inverse, tolerances=(NEAR, NEAR), restarts=restarts)
    if many:
        return list(zip(*search(targets, starts)[:2], strict=True))
    return [search(*pair)[:2] for pair in zip(targets, starts, strict=True)]


def _valid(found: list[tuple[Array, Array]]) -> list[Array]:
    pairs = zip(*found[0], strict=True) if found[0][0].ndim > 2 else found
    return [solutions[valid] for solutions, valid in pairs]


def _existing(found: list[tuple[Array, Array]]) -> list[Array]:
    return [q[None] if exists else q[None][:0] for q, exists in found]


def _compared(name: str, peer: Solver, ours: Solver) -> Row:
    """Times in alternating turns, and the solutions that hold."""
    robot = load(ROBOTS / f"{name}.yaml")
    targets = reference.pose(robot, _random(name, peer.targets))[:, 0]
    starts = _random(name, peer.targets, 1)
    both = (peer, ours)
    count = {each.name: _holding(robot, targets, each.solutions(each.run(targets, starts))) for each in both}
    timings = measure([Case(each.name, partial(each.run, targets, starts), len(targets)) for each in both], EFFORT)
    theirs, mine = (timings[each.name].median() * 1e6 for each in both)
    label = f"{name}: {peer.name}: {theirs:.1f} us a target, {count[peer.name]:,} solutions of {len(targets):,}"
    found = f"{theirs / mine:.1f} times ({ours.name.removeprefix('ours, ')}: {mine:.2f} us), {count[ours.name]:,}"
    return label, found, "faster, no fewer"


def _holding(robot: Robot, targets: Array, found: list[Array]) -> int:
    """How many different solutions lie within the limits and lead to their targets."""
    which = np.repeat(np.arange(len(found)), [len(each) for each in found])
    if not len(which):
        return 0
    low, high = np.array(joint_box(robot)).T
    middle = (low + high) / 2
    q = np.concatenate([each for each in found if len(each)])
    q = q - 2 * np.pi * np.round((q - middle) / (2 * np.pi))
    apart = np.abs(reference.pose(robot, q)[:, 0] - targets[which]).max(axis=(1, 2))
    holds = (apart < 2 * NEAR) & ((q >= low - NEAR) & (q <= high + NEAR)).all(axis=1)
    return len(np.unique(np.column_stack([which, np.round(q, 4)])[holds], axis=0))


def _missed(name: str, package: ModuleType, q: Array) -> tuple[int, int]:
    """Joint vectors that are not among the solutions for their poses, but for whole turns.

    Beside singular poses, which hardly tell joints apart, any solution will do; how often, comes second.
    """
    solutions, valid = package.inverse(package.fk(q))
    missed = _far(name, solutions, valid, q)
    excused = valid[missed].any(axis=1) & _are_singular(name, q[missed])
    return int((~excused).sum()), int(excused.sum())


def _far(name: str, solutions: Array, valid: Array, q: Array) -> Array:
    """Rows of joint vectors that are not among the solutions, but for whole turns."""
    apart = np.abs(solutions - q[:, None])
    angles = np.array([each.type is not JointType.PRISMATIC for each in load(ROBOTS / f"{name}.yaml").variables])
    turned = np.abs((apart + np.pi) % (2 * np.pi) - np.pi)
    apart = np.where(angles, turned, apart).max(axis=2)
    missed: Array = np.flatnonzero(np.where(valid, apart, np.inf).min(axis=1) > NEAR)
    return missed


def _are_singular(name: str, q: Array) -> Array:
    robot = load(ROBOTS / f"{name}.yaml")
    rows = 6 if family_of(robot).aim is Aim.POSE else 3
    jacobians = reference.Kinematics(robot, q).jacobian(robot.tips[0])[:, :rows]
    singular: Array = np.linalg.svd(jacobians, compute_uv=False).min(axis=1, initial=np.inf) < SINGULAR_VALUE
    return singular


def _unsolved(name: str, package: ModuleType, q: Array) -> int:
    """Joint vectors for whose poses no solution leads there, or one that is called valid does not."""
    whole = family_of(load(ROBOTS / f"{name}.yaml")).aim is Aim.POSE
    targets = package.fk(q)
    solutions, valid = package.inverse(targets)
    apart = np.abs(package.fk(solutions) - targets[:, None])
    apart = (apart if whole else apart[..., 3:]).max(axis=(2, 3))
    return int((~valid.any(axis=1) | (valid & ~(apart < NEARER)).any(axis=1)).sum())


def _singular(name: str) -> Array:
    """Random joint vectors with one joint within 1e-9 of where branches meet."""
    robot = load(ROBOTS / f"{name}.yaml")
    family, (low, high) = family_of(robot), np.array(joint_box(robot)).T
    places = [(joint, value) for joint, values in (*boundaries(family), *alignments(family)) for value in values]
    found = []
    for seed, (joint, value) in enumerate(places):
        q = _random(name, SINGULAR // len(places), seed)
        turned = value + 2 * np.pi * np.ceil((low[joint] - value) / (2 * np.pi) - NEARER)
        q[:, joint] = turned + np.random.default_rng(seed).uniform(-NEARER, NEARER, len(q))
        found.append(q[(q[:, joint] >= low[joint]) & (q[:, joint] <= high[joint])])
    return np.concatenate(found) if found else np.zeros((0, len(low)))


def _random(name: str, count: int, seed: int = 0) -> Array:
    """Joint vectors within the limits."""
    low, high = np.array(joint_box(load(ROBOTS / f"{name}.yaml"))).T
    return np.random.default_rng(seed).uniform(low, high, (count, len(low)))


def _seconds(call: Callable[[], object]) -> float:
    """The time of one call."""
    return measure([Case("", call, 1)], EFFORT)[""].median()


@cache
def _package(name: str, quantity: Quantity) -> ModuleType:
    with tempfile.TemporaryDirectory() as folder:
        options = BuildOptions(output=Path(folder), reals=(ScalarType.DOUBLE,), quantities=(Quantity.POSE, quantity))
        return load_package(build(ROBOTS / f"{name}.yaml", options, lambda _: None).folder)


_MAIN = r"""
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "NAME.h"

static double targets[1000][16], solutions[8][6];
static uint8_t valid[8];

int main(int argc, char **argv)
{
    const int calls = atoi(argv[argc - 1]);
    unsigned state = 1;
    for (int i = 0; i < 1000; i++) {
        double q[6];
        for (int j = 0; j < 6; j++) {
            state = state * 1664525u + 1013904223u;
            q[j] = (double)state / 4294967296.0 * 6.283185307179586 - 3.141592653589793;
        }
        NAME_fk(q, targets[i]);
    }
    struct timespec begin, end;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &begin);
    for (int i = 0; i < calls; i++) {
        NAME_inverse(targets[i], solutions, valid);
    }
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &end);
    printf("%.1f\n", ((double)(end.tv_sec - begin.tv_sec) * 1e9 + (double)(end.tv_nsec - begin.tv_nsec)) / calls);
    return 0;
}
"""

_REDUNDANT_MAIN = r"""
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "NAME.h"
#include "targets.h"

static double solutions[8][7];
static uint8_t valid[8];

int main(int argc, char **argv)
{
    const int calls = atoi(argv[argc - 1]);
    struct timespec begin, end;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &begin);
    for (int i = 0; i < calls; i++) {
        NAME_inverse(targets[i], targets[i] + 16, solutions, valid);
    }
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &end);
    printf("%.1f\n", ((double)(end.tv_sec - begin.tv_sec) * 1e9 + (double)(end.tv_nsec - begin.tv_nsec)) / calls);
    return 0;
}
"""


if __name__ == "__main__":
    sys.exit(main())
