"""Speed of the pose of a PUMA 560 in other languages, each beside what it is measured against, in one run.

    python -m benchmarks.languages

Rust against the scalar C kernel (both for any x86-64 or ARM processor, without contraction); WebAssembly batches in
Node.js against the batch of C for this processor; JavaScript against the closed form as people write it by hand, with
Math.sin and Math.cos, at random angles and along a path, where its branches are foreseen; the MEX file in GNU Octave,
with one thread, against the same batch of C, and the function in MATLAB's language beside it. The best of many rounds
counts. What is not installed is left out.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.c.batch import emit_batch
from kinegen.backends.c.kernel import emit_kernel
from kinegen.backends.javascript.wasm import compile_command
from kinegen.backends.languages import LANGUAGES, emit_language
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import lower_file
from kinegen.model.outputs import Quantity

ROOT = Path(__file__).resolve().parent.parent

RUST = """
use std::time::Instant;
extern "C" { fn puma560_fk(q: *const f64, pose: *mut f64); }
fn main() {
    let some = [0.1, -0.2, 0.3, 0.7, -1.0, 2.0];
    let joints: Vec<[f64; 6]> = (0..2000).map(|i| some.map(|a| a * f64::from(i) * 1e-3)).collect();
    let (mut best, mut sum) = ([f64::MAX; 2], 0.0);
    for _ in 0..500 {
        let start = Instant::now();
        for q in &joints { sum += puma560::fk(q)[0][3]; }
        best[0] = best[0].min(start.elapsed().as_secs_f64());
        let start = Instant::now();
        for q in &joints {
            let mut pose = [0.0; 16];
            unsafe { puma560_fk(q.as_ptr(), pose.as_mut_ptr()) };
            sum += pose[3];
        }
        best[1] = best[1].min(start.elapsed().as_secs_f64());
    }
    println!("{} {} {}", best[0] / 2e-6, best[1] / 2e-6, sum);
}
"""

BATCH = """
#include <stdio.h>
#include <time.h>
#include "puma560_batch.h"
static double q[1024 * 6], pose[1024 * 16];
int main(void)
{
    double best = 1e9;
    for (int i = 0; i < 1024 * 6; i++) { q[i] = (i % 997) * 3e-3 - 1.5; }
    for (int round = 0; round < 5000; round++) {
        struct timespec a, b;
        clock_gettime(CLOCK_MONOTONIC, &a);
        puma560_fk_batch(1024, q, 6, 1, pose, 16, 0);
        clock_gettime(CLOCK_MONOTONIC, &b);
        const double spent = ((b.tv_sec - a.tv_sec) * 1e9 + (b.tv_nsec - a.tv_nsec)) / 1024;
        best = spent < best ? spent : best;
    }
    printf("%g %g\\n", best, pose[3]);
    return 0;
}
"""

NODE = """
import { load } from "./puma560_wasm.js";
const robot = await load();
const a2 = 0.4318, a3 = 0.0203, d3 = 0.15005, d4 = 0.4318;
function byHand(q, T) {
  const c1 = Math.cos(q[0]), s1 = Math.sin(q[0]), c2 = Math.cos(q[1]), s2 = Math.sin(q[1]);
  const c23 = Math.cos(q[1] + q[2]), s23 = Math.sin(q[1] + q[2]), c4 = Math.cos(q[3]), s4 = Math.sin(q[3]);
  const c5 = Math.cos(q[4]), s5 = Math.sin(q[4]), c6 = Math.cos(q[5]), s6 = Math.sin(q[5]);
  T[0] = c1 * (c23 * (c4 * c5 * c6 - s4 * s6) - s23 * s5 * c6) + s1 * (s4 * c5 * c6 + c4 * s6);
  T[4] = s1 * (c23 * (c4 * c5 * c6 - s4 * s6) - s23 * s5 * c6) - c1 * (s4 * c5 * c6 + c4 * s6);
  T[8] = -s23 * (c4 * c5 * c6 - s4 * s6) - c23 * s5 * c6;
  T[1] = c1 * (c23 * (-c4 * c5 * s6 - s4 * c6) + s23 * s5 * s6) + s1 * (c4 * c6 - s4 * c5 * s6);
  T[5] = s1 * (c23 * (-c4 * c5 * s6 - s4 * c6) + s23 * s5 * s6) - c1 * (c4 * c6 - s4 * c5 * s6);
  T[9] = -s23 * (-c4 * c5 * s6 - s4 * c6) + c23 * s5 * s6;
  T[2] = -c1 * (c23 * c4 * s5 + s23 * c5) - s1 * s4 * s5;
  T[6] = -s1 * (c23 * c4 * s5 + s23 * c5) + c1 * s4 * s5;
  T[10] = s23 * c4 * s5 - c23 * c5;
  T[3] = c1 * (a2 * c2 + a3 * c23 - d4 * s23) - d3 * s1;
  T[7] = s1 * (a2 * c2 + a3 * c23 - d4 * s23) + d3 * c1;
  T[11] = -a3 * s23 - a2 * s2 - d4 * c23;
  T[12] = T[13] = T[14] = 0;
  T[15] = 1;
  return T;
}
const n = 1024, some = [1, -2, 3, 7, -9, 20];
const path = Array.from({ length: n }, (_, i) => Float64Array.from(some, (a) => a * i * 1e-3));
const joints = path.map(() => Float64Array.from(some, () => (2 * Math.random() - 1) * Math.PI));
const T = new Float64Array(16), all = new Float64Array(n * 6), poses = new Float64Array(n * 16);
joints.forEach((q, i) => all.set(q, i * 6));
const [one, other] = [robot.fk(joints[500]), byHand(joints[500], new Float64Array(16))];
one.forEach((x, i) => { if (Math.abs(x - other[i]) > 1e-12) throw new Error(`they differ in ${i}`); });
const ways = [
  () => joints.forEach((q) => robot.fk(q, T)),
  () => joints.forEach((q) => byHand(q, T)),
  () => path.forEach((q) => robot.fk(q, T)),
  () => path.forEach((q) => byHand(q, T)),
  () => robot.fk_batch(all, poses),
];
const best = ways.map(() => Infinity);
for (let round = 0; round < 2000; round++) {
  ways.forEach((way, i) => {
    const start = process.hrtime.bigint();
    way();
    best[i] = Math.min(best[i], Number(process.hrtime.bigint() - start) / n);
  });
}
console.log(...best, robot.isWasm ? 1 : 0);
"""

OCTAVE = """
warning('off', 'all');
build_mex('-O3 -march=native');
q = 0.1 * ones(6, 20000);
mkoctfile --mex -o floor_mex.mex floor_mex.c
best = [Inf, Inf, Inf];
for round = 1:300
  tic; T = puma560_mex('fk', q); best(1) = min(best(1), toc);
  tic; T = floor_mex(columns(q)); best(3) = min(best(3), toc);
end
for round = 1:10
  tic; T = puma560.fk(q); best(2) = min(best(2), toc);
end
printf('%g ', best / columns(q) * 1e9);
"""

FLOOR = """
#include "mex.h"
void mexFunction(int nlhs, mxArray *plhs[], int nrhs, const mxArray *prhs[])
{
    const mwSize shape[3] = {4, 4, (mwSize)mxGetScalar(prhs[0])};
    (void)nlhs;
    (void)nrhs;
    plhs[0] = mxCreateUninitNumericArray(3, shape, mxDOUBLE_CLASS, mxREAL);
}
"""
"""A MEX file that returns memory for the poses and computes nothing: what no kernel can be quicker than."""


def main() -> int:
    """Measure and print."""
    kernels = lower_file(ROOT / "robots" / "puma560.yaml", (Quantity.POSE,))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _write(folder, kernels)
        if shutil.which("rustc"):
            rust, c = _rust(folder)
            print(f"Rust, one pose          {rust:6.1f} ns   C {c:6.1f} ns   C / Rust {c / rust:.2f} (asked 0.9)")
        if shutil.which("node") and shutil.which("clang") and shutil.which("wasm-ld"):
            _run(folder, *compile_command(kernels).split())
            single, hand, along, along_hand, batch, is_wasm = _run(folder, "node", "bench.mjs")
            c = _batch(folder)
            print(
                f"JavaScript, one pose    {single:6.1f} ns   by hand {hand:6.1f} ns   "
                f"by hand / JavaScript {hand / single:.2f} (asked 1.2)   "
                f"along a path {along_hand / along:.2f}"
            )
            what = "WebAssembly" if is_wasm else "JavaScript"
            print(f"{what}, batch      {batch:6.1f} ns   C {c:6.1f} ns   C / {what} {c / batch:.2f} (asked 0.3)")
        if shutil.which("octave-cli") and shutil.which("mkoctfile"):
            mex, function, floor = _run(folder / "matlab", "octave-cli", "--norc", "--quiet", "bench.m")
            c = _batch(folder)
            print(
                f"MEX, batch              {mex:6.1f} ns   C {c:6.1f} ns   C / MEX {c / mex:.2f} (asked 0.8)   "
                f"without MEX {function:.0f} ns   a MEX file that returns memory alone {floor:.1f} ns, "
                f"C / (MEX without that) {c / (mex - floor):.2f}"
            )
    return 0


def _write(folder: Path, kernels: RobotPrograms) -> None:
    for path, text in emit_language(kernels, LANGUAGES["rust"]).items():
        _put(folder / path, text)
    for path, text in emit_language(kernels, LANGUAGES["matlab"]).items():
        _put(folder / path, text)
    for path, text in emit_language(kernels, LANGUAGES["javascript"]).items():
        _put(folder / path.removeprefix("javascript/"), text)
    for path, text in (emit_kernel(kernels, ScalarType.DOUBLE) | emit_batch(kernels, ScalarType.DOUBLE)).items():
        _put(folder / path, text)
    for path, text in (("bench.rs", RUST), ("bench.c", BATCH), ("bench.mjs", NODE), ("matlab/bench.m", OCTAVE)):
        _put(folder / path, text)
    _put(folder / "matlab" / "floor_mex.c", FLOOR)


def _put(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def _rust(folder: Path) -> tuple[float, float]:
    options = ("rustc", "--edition", "2021", "-C", "opt-level=3")
    _run(folder, *options, "--crate-type", "lib", "--crate-name", "puma560", "rust/src/lib.rs")
    _run(folder, "gcc", "-O3", "-std=c99", "-ffp-contract=off", "-c", "puma560.c")
    _run(folder, *options, "--extern", "puma560=libpuma560.rlib", "-C", "link-arg=puma560.o", "bench.rs")
    rust, c, _ = _run(folder, "./bench")
    return rust, c


def _batch(folder: Path) -> float:
    flags = ("-O3", "-march=native", "-std=gnu99", "-ffp-contract=off")
    _run(folder, "gcc", *flags, "bench.c", "puma560_batch.c", "-o", "bench_c")
    return _run(folder, "./bench_c")[0]


def _run(folder: Path, *command: str) -> list[float]:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"{command[0]}: {done.stderr}")
    return [float(word) for word in done.stdout.split()]


if __name__ == "__main__":
    sys.exit(main())
