"""What poses with Jacobians cost, against poses alone and against other tools: `python -m benchmarks.velocity`.

Every row is a figure that this project promises and what was found on this machine. Instructions are counted by
callgrind, the same on every run; rates are medians of alternating turns in one process, of which only ratios count.
CasADi and Pinocchio take part where they are installed (`pip install -e '.[bench]'`).
"""

from __future__ import annotations

import importlib.util
import json
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import chain, repeat
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from benchmarks.speed.arm import ROBOTS, Arm, load_arm
from benchmarks.speed.clock import Case, Effort, measure, seconds_of
from benchmarks.speed.peers.pinocchio import _model
from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import build
from kinegen.driver.results import BuildOptions
from kinegen.io.load import load
from kinegen.ir.lower import program_of
from kinegen.ir.program import count
from kinegen.model.outputs import Quantity, parse_quantity
from kinegen.model.robot import Robot
from kinegen.runtime.extension import load_package

RESULTS = Path(__file__).resolve().parent / "results" / "velocity.json"
POSES = 100_000
EFFORT = Effort(turns=15, patience=10.0)
ONE_BY_ONE = 2000
FEW, MANY = 200, 1000
FLAGS = {"AVX2": ("-std=gnu99", "-O2", "-mavx2", "-mfma"), "SSE2": ("-std=gnu99", "-O2")}
"""For the widest vectors that valgrind knows, and for every processor of the family (libm picks its own form for the
processor at hand all the same)."""
BOTH = parse_quantity("fk_jacobian")
Row = tuple[str, str, str]


def main() -> int:
    """Print the table and write the file; a figure that is not met fails nothing, since machines differ."""
    rows: list[Row] = []
    for row in chain(operations(), times(), instructions(), rates(), calls()):
        rows.append(row)
        print(f"{row[0]:<64}{row[1]:>24}   asked {row[2]}", flush=True)
    RESULTS.parent.mkdir(exist_ok=True)
    RESULTS.write_text(json.dumps([dict(zip(("what", "found", "asked"), row)) for row in rows], indent=1) + "\n")
    return 0


def operations() -> Iterator[Row]:
    """What the Jacobian costs beyond the pose."""
    for name in ("puma560", "ur5", "panda", "iiwa14"):
        robot = load(ROBOTS / f"{name}.yaml")
        pose, both = (count(program_of(robot, each)) for each in (Quantity.POSE, BOTH))
        extra = [each.multiplications + each.additions for each in (pose, both)]
        asked = "at most 60" if name == "puma560" else "-"
        yield f"{name}: operations of the Jacobian beyond the pose", f"{extra[1] - extra[0]}", asked


def times() -> Iterator[Row]:
    """The symbolic stage with Jacobian and Hessian."""
    for name in ("panda", "iiwa14"):
        robot = load(ROBOTS / f"{name}.yaml")
        seconds = seconds_of(partial(_derive, robot))
        yield f"{name}: deriving pose, Jacobian and Hessian", f"{seconds:.2f} s", "under 3 s"


def _derive(robot: Robot) -> None:
    for text in ("fk_jacobian", "hessian"):
        program_of(robot, parse_quantity(text))


def instructions() -> Iterator[Row]:
    """Instructions of one call beside CasADi's generated C."""
    if importlib.util.find_spec("casadi") is None:
        yield "CasADi is not installed", "-", "-"
        return
    for name in ("ur5", "panda", "iiwa14"):
        with tempfile.TemporaryDirectory() as folder:
            arm = load_arm(name, Path(folder))
        for label, flags in FLAGS.items():
            ours, theirs = (_instructions(text, flags) for text in (_our_text(arm), _casadi_text(arm)))
            what = f"{name}: instructions, {label}, beside CasADi's {theirs:.0f}"
            yield what, f"{ours:.0f} = {ours / theirs:.2f}", "at most 0.6"


def rates() -> Iterator[Row]:
    """Batches of poses with Jacobians, against poses alone and against peers."""
    for name in ("puma560", "ur5", "panda"):
        with tempfile.TemporaryDirectory() as folder:
            arm = load_arm(name, Path(folder) / "pose")
            options = BuildOptions(output=Path(folder), reals=(ScalarType.DOUBLE,), quantities=(Quantity.POSE, BOTH))
            package = load_package(build(ROBOTS / f"{name}.yaml", options, lambda _: None).folder)
        rate = _rates([*_ours(arm, package), *_peers(arm)])
        yield f"{name}: pose and Jacobian, million a second", f"{rate['both'] / 1e6:.1f}", "-"
        yield f"{name}: share of the rate of poses alone", f"{rate['both'] / rate['pose']:.2f}", "at least 0.35"
        for peer in rate.keys() - {"pose", "both"}:
            label = f"{name}: against {peer} ({rate[peer] / 1e6:.2f} million a second)"
            yield label, f"{rate['both'] / rate[peer]:.1f} times", "at least 20"


def calls() -> Iterator[Row]:
    """One configuration from Python, as in a control loop."""
    for name in ("puma560", "ur5", "panda"):
        with tempfile.TemporaryDirectory() as folder:
            arm = load_arm(name, Path(folder) / "pose")
            quantities = (Quantity.POSE, parse_quantity("jacobian"), BOTH)
            options = BuildOptions(output=Path(folder), reals=(ScalarType.DOUBLE,), quantities=quantities)
            package = load_package(build(ROBOTS / f"{name}.yaml", options, lambda _: None).folder)
        q = arm.configurations(1, "double")[0]
        work = [
            Case("jacobian(q)", partial(_calls, package.jacobian, q), ONE_BY_ONE),
            Case("fk_jacobian(q)", partial(_calls, package.fk_jacobian, q), ONE_BY_ONE),
        ]
        if importlib.util.find_spec("pinocchio") is not None:
            work.append(Case("Pinocchio", partial(_calls, _pinocchio(arm), q), ONE_BY_ONE))
        for what, rate in _rates(work).items():
            asked = "under 0.40 us" if what == "jacobian(q)" else "-"
            yield f"{name}: one call, {what}", f"{1e6 / rate:.2f} us", asked


def _calls(function: Callable[[Any], object], q: Any) -> None:
    for _ in repeat(None, ONE_BY_ONE):
        function(q)


def _ours(arm: Arm, package: ModuleType) -> Iterator[Case]:
    q = arm.configurations(POSES, "double")
    pose, jacobian = np.empty((POSES, 4, 4)), np.empty((POSES, 6, arm.dof))
    yield Case("pose", lambda: package.fk(q, out=pose), POSES)
    yield Case("both", lambda: package.fk_jacobian(q, out=(pose, jacobian)), POSES)


def _rates(cases: Sequence[Case]) -> dict[str, float]:
    """Configurations a second, in turns that alternate."""
    return {name: 1e6 * timing.rate for name, timing in measure(cases, EFFORT).items()}


def _peers(arm: Arm) -> Iterator[Case]:
    few = 5000
    q = arm.configurations(few, "double")
    if importlib.util.find_spec("casadi") is not None:
        mapped, columns = _casadi(arm).map(few), np.asfortranarray(q.T)
        yield Case("CasADi map", lambda: mapped(columns), few)
    if importlib.util.find_spec("pinocchio") is not None:
        one = _pinocchio(arm)

        def loop() -> None:
            for row in q:
                one(row)

        yield Case("Pinocchio, Python loop", loop, few)


def _pinocchio(arm: Arm) -> Callable[[Any], object]:
    """Its pose and Jacobian of one configuration."""
    pin: Any = importlib.import_module("pinocchio")
    model, frame = _model(pin, arm)
    data, axes, compute = model.createData(), pin.LOCAL_WORLD_ALIGNED, pin.computeFrameJacobian
    return lambda q: compute(model, data, q, frame, axes)


def _casadi(arm: Arm) -> Any:
    """Pose and geometric Jacobian from the axes and origins of the joints, equal parts shared."""
    casadi: Any = importlib.import_module("casadi")
    q = casadi.SX.sym("q", arm.dof)
    pose, frames = casadi.SX.eye(4), []
    for link in arm.links:
        theta = float(link.theta) + (q[link.joint] if link.joint is not None else 0)
        rows = link.matrix(casadi.cos(theta), casadi.sin(theta))
        if link.standard and link.joint is not None:
            frames.append(pose)
        pose = pose @ casadi.vertcat(*(casadi.horzcat(*row) for row in rows))
        if not link.standard and link.joint is not None:
            frames.append(pose)
    columns = [casadi.vertcat(casadi.cross(frame[:3, 2], pose[:3, 3] - frame[:3, 3]), frame[:3, 2]) for frame in frames]
    jacobian = casadi.densify(casadi.horzcat(*columns).T.reshape((6 * arm.dof, 1)))
    results = [casadi.densify(pose.T.reshape((16, 1))), jacobian]
    return casadi.Function("fk", [q], results, {"cse": True})


def _casadi_text(arm: Arm) -> dict[str, str]:
    casadi: Any = importlib.import_module("casadi")
    with tempfile.TemporaryDirectory() as folder:
        generator = casadi.CodeGenerator("fk.c")
        generator.add(_casadi(arm))
        generator.generate(f"{folder}/")
        text = (Path(folder) / "fk.c").read_text(encoding="utf-8")
    call = "const double *arg[] = {q};\n    double *res[] = {T, J};\n    fk(arg, res, 0, 0, 0);"
    return {"peer.c": f"{text}\nvoid call(const double *q, double *T, double *J)\n{{\n    {call}\n}}\n"} | _main(arm)


def _our_text(arm: Arm) -> dict[str, str]:
    kernels = RobotPrograms(arm.robot, (program_of(arm.robot, BOTH),), ())
    call = f"void call(const double *q, double *T, double *J)\n{{\n    {arm.name}_fk_jacobian(q, T, J);\n}}\n"
    return emit_kernel(kernels, ScalarType.DOUBLE) | {"call.c": f'#include "{arm.name}.h"\n{call}'} | _main(arm)


def _main(arm: Arm) -> dict[str, str]:
    return {"main.c": _MAIN.replace("DOF", str(arm.dof))}


def _instructions(files: Mapping[str, str], flags: tuple[str, ...]) -> float:
    with tempfile.TemporaryDirectory() as place:
        for name, text in files.items():
            Path(place, name).write_text(text, encoding="utf-8")
        sources = [name for name in files if name.endswith(".c")]
        subprocess.run(["gcc", *flags, "-o", "program", *sources, "-lm"], cwd=place, check=True)
        totals = []
        for calls in (FEW, MANY):
            command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", "./program", str(calls)]
            told = subprocess.run(command, cwd=place, capture_output=True, text=True, check=True).stderr
            totals += [int(found) for found in re.findall(r"Collected : (\d+)", told)]
    return (totals[1] - totals[0]) / (MANY - FEW)


_MAIN = """
#include <stdlib.h>

void call(const double *q, double *T, double *J);

static double q[1000 * DOF], T[16], J[6 * DOF];

int main(int argc, char **argv)
{
    unsigned state = 1;
    for (int i = 0; i < 1000 * DOF; i++) {
        state = state * 1664525u + 1013904223u;
        q[i] = (double)state / 4294967296.0 * 6.283185307179586 - 3.141592653589793;
    }
    for (int i = 0; i < atoi(argv[argc - 1]); i++) {
        call(q + DOF * i, T, J);
    }
    return 0;
}
"""


if __name__ == "__main__":
    sys.exit(main())
