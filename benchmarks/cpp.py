"""The C++ header beside the C kernels, in one program: words that differ, and nanoseconds for a single pose.

    python -m benchmarks.cpp                     # the words of ten robots, and the speed
    python -m benchmarks.cpp --configurations 1000 scara

Inputs are random: joint values within and beyond limits, targets of inverses from poses, and in one of sixteen
configurations a NaN, an infinity or a number out of range. Both sides are compiled with -O1 for the words, and with -O2
for the speed, without contraction.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.arguments import flat_call
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.cpp.files import header_context
from kinegen.backends.languages import LANGUAGES, emit_language, kept
from kinegen.backends.scalar_types import ScalarType
from kinegen.backends.templates import environment
from kinegen.derive.dispatch import derive
from kinegen.errors import KinegenError
from kinegen.io.load import load
from kinegen.ir.lower import lower, runtime_defaults
from kinegen.ir.program import Program
from kinegen.model.joint_bounds import joint_box
from kinegen.model.outputs import Kind, Quantity, every_quantity
from kinegen.support.naming import c_file, function

ROOT = Path(__file__).resolve().parents[1]

TEN = (
    "puma560", "ur5", "scara", "iiwa14", "calibrated_2r", "hand", "differential_wrist", "palletiser", "screw", "al5d",
)  # fmt: skip
"""Closed-form inverses, seven joints, runtime parameters, a tree, actuators, a linkage, an angle that is a length."""

CONFIGURATIONS = 100_000
"""Of each robot, so that those of ten are a million."""

_PLAIN = ("-ffp-contract=off", "-fno-tree-slp-vectorize")

_COMPARE = Path(__file__).resolve().parent / "compare.cpp"


def kernels_of(name: str) -> RobotPrograms:
    """A robot of `robots/` with every output that it has and C++ prints."""
    robot, programs = load(ROOT / "robots" / f"{name}.yaml"), []
    for quantity in every_quantity():
        if quantity.kind not in (Kind.NUMERIC_INVERSE, Kind.PARAMETER_JACOBIAN):
            try:
                programs.append(lower(derive(robot, quantity)))
            except KinegenError:
                continue
    return kept(RobotPrograms(robot, tuple(programs), runtime_defaults(robot)), LANGUAGES["cpp"])


def measure(kernels: RobotPrograms, configurations: int, *, is_race: bool = False) -> dict[str, object]:
    """Compile the header and the C kernels into one program and run it.

    Args:
        kernels: The robot and its programs, the pose among them.
        configurations: How many of each output and number type.
        is_race: Whether the time of a pose is taken too.

    Returns:
        `words`, `wrong`, and for a race `double` and `float`: nanoseconds in C and in C++.
    """
    with tempfile.TemporaryDirectory(prefix="kinegen-") as name:
        folder = Path(name)
        _write(folder, kernels)
        level = "-O2" if is_race else "-O1"
        sources = ["calls.c", *(c_file(kernels.robot.name, "c", real) for real in ScalarType)]
        _run(folder, "gcc", "-std=c99", level, *_PLAIN, "-c", *sources)
        objects = [f"{Path(source).stem}.o" for source in sources]
        _run(folder, "g++", "-std=c++17", level, *_PLAIN, "compare.cpp", *objects, "-o", "compare")
        found: dict[str, object] = json.loads(_run(folder, "./compare", str(configurations), f"{int(is_race)}"))
    return found


def _run(folder: Path, *command: str) -> str:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(done.stderr[:2000])
    return done.stdout


def _write(folder: Path, kernels: RobotPrograms) -> None:
    """Write the header with its driver, the C kernels, calls of these in one form, and what compares both."""
    robot, context = kernels.robot, header_context(kernels)
    texts = {path.partition("/")[2]: text for path, text in emit_language(kernels, LANGUAGES["cpp"]).items()}
    texts["driver.cpp"] = environment().get_template("cpp/driver.cpp.jinja").render(k=context)
    texts["compare.cpp"] = _COMPARE.read_text(encoding="utf-8")
    calls = []
    for real in ScalarType:
        texts |= emit_kernel(kernels, real)
        calls += [_call(kernels, program, real) for program in kernels.programs]
    headers = "".join(f'#include "{c_file(robot.name, "h", real)}"\n' for real in ScalarType)
    texts["calls.c"] = headers + "\n".join(calls)
    box = ", ".join(f"{{{float(low)!r}, {float(high)!r}}}" for low, high in joint_box(robot)) or "{0.0, 0.0}"
    params = f", const {robot.name}::Params<Real>*" if kernels.defaults else ""
    declared = [call.partition(" {")[0] + ";" for call in calls]
    for mark, text in (
        ("@DECLARED@", "\n".join(declared)),
        ("@BOX@", box),
        ("@PARAMS@", params),
        ("@NONE@", ", nullptr" if params else ""),
        ("@DOF@", str(robot.dof)),
        ("@TIPS@", str(len(robot.tips))),
        ("@TABLES@", "\n".join(_table(kernels, real) for real in ScalarType)),
        ("@ROBOT@", robot.name),
    ):
        texts["compare.cpp"] = texts["compare.cpp"].replace(mark, text)
    for file, text in texts.items():
        (folder / file).write_text(text, encoding="utf-8")


def _call(kernels: RobotPrograms, program: Program, real: ScalarType) -> str:
    name = function(kernels.robot.name, program.quantity.function, real)
    body = flat_call(kernels, program, real, name, ("given", "found"))
    head = f"void c_{program.quantity.function}_{real}(const {real} *given, {real} *found)"
    return f"{head} {{ (void)given; (void)found; {body}; }}"


def _table(kernels: RobotPrograms, real: ScalarType) -> str:
    """The functions of both sides in one number type, and their comparison."""
    rows = []
    for program in kernels.programs:
        inputs, results = program.signature.inputs, program.signature.results
        sizes = [sum(array.blocks * array.stored for array in arrays) for arrays in (inputs, results)]
        first, name = inputs[0], program.quantity.function
        kinds = [str(each).lower() for each in (first.is_pose, first.name == "q")]
        rows.append(f'{{"{name}", {sizes[0]}, {sizes[1]}, {", ".join(kinds)}, c_{name}_{real}, one_{name}<{real}>}}')
    table = f"    const Both<{real}> all_{real}[] = {{{', '.join(rows)}}};\n"
    pose = f"c_{Quantity.POSE.function}_{real}"
    return table + f"    compare<{real}>(n, all_{real}, {len(rows)}, {pose}, &words, &wrong);"


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the words that differ for each robot, and what a pose takes."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("robots", nargs="*", default=TEN)
    parser.add_argument("--configurations", type=int, default=CONFIGURATIONS)
    chosen = parser.parse_args(arguments)
    if shutil.which("g++") is None:
        print("this takes g++ (Debian: apt-get install g++)")
        return 2
    total = 0
    for name in chosen.robots:
        found = measure(kernels_of(name), chosen.configurations)
        total += int(str(found["wrong"]))
        print(f"{name:<20} {found['words']:>14,} words, {found['wrong']} differ", flush=True)
    pose = kernels_of("puma560")
    fast = measure(RobotPrograms(pose.robot, pose.programs[:1], pose.defaults), 1000, is_race=True)
    for real in ScalarType:
        of_c, of_cpp = fast[real]  # type: ignore[misc]
        print(f"pose of puma560 in {real}: C {of_c} ns, C++ {of_cpp} ns, {of_c / of_cpp:.2f} times as fast")
    return int(total > 0)


if __name__ == "__main__":
    raise SystemExit(main())
