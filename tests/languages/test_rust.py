"""The Rust crate as its user compiles it, with rustc alone."""

from __future__ import annotations

import re
import shutil
from functools import cache
from pathlib import Path

import pytest

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.languages import LANGUAGES, emit_language
from kinegen.derive.dispatch import derive
from kinegen.errors import KinegenError
from kinegen.io.load import load
from kinegen.ir.lower import lower, runtime_defaults
from kinegen.model.outputs import parse_quantity
from tests.emit.emitted import ROBOTS, kernels, run, vectors
from tests.emit.handwritten import KERNELS

RUST = LANGUAGES["rust"]
TOOL = shutil.which("rustc") or ""
needs_rust = pytest.mark.skipif(not TOOL, reason="needs rustc (Debian: apt-get install rustc)")
OUTPUTS = tuple(map(parse_quantity, ("pose", "fk_jacobian", "inverse", "numeric_inverse")))


@cache
def files(name: str) -> dict[str, str]:
    """The files of a robot, without their folder."""
    wanted = OUTPUTS if name == "puma560" else OUTPUTS[:1]
    emitted = emit_language(kernels(name, wanted), RUST, vectors(name, wanted))
    return {path.removeprefix("rust/"): text for path, text in emitted.items()}


def crate(name: str, folder: Path, *more: str) -> Path:
    """A crate, compiled without a warning."""
    for path, text in files(name).items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(text, encoding="utf-8")
    options = ["--edition", "2021", "--crate-type", "lib", "--crate-name", name, "-D", "warnings", *more]
    run([TOOL, *options, str(folder / "src" / "lib.rs"), "--out-dir", str(folder)])
    return folder / f"lib{name}.rlib"


def evaluate(name: str, folder: Path, code: str, *more: str, link: tuple[str, ...] = ()) -> str:
    """What a program prints that uses a crate."""
    library = crate(name, folder, *more)
    (folder / "main.rs").write_text(f"fn main() {{\n{code}\n}}\n", encoding="utf-8")
    program = folder / "main"
    linked = ["--extern", f"{name}={library}", *(word for each in link for word in ("-C", f"link-arg={each}"))]
    run([TOOL, "--edition", "2021", *linked, str(folder / "main.rs"), "-o", str(program)])
    return run([str(program)])


@needs_rust
def test_arrays_branches_and_slices(tmp_path: Path) -> None:
    code = """
    use puma560::{fk, fk_batch, fk_jacobian, inverse, inverse_nearest, Branch, DOF};
    let q = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6];
    let (pose, jacobian) = fk_jacobian(&q);
    let found = inverse(&pose);
    let alone = fk(&q);
    assert!((0..16).all(|k| (pose[k / 4][k % 4] - alone[k / 4][k % 4]).abs() < 1e-15));
    assert_eq!((jacobian.len(), pose[3]), (6, [0.0, 0.0, 0.0, 1.0]));
    assert!(found.iter().count() > 0 && found.iter().all(|(branch, q)| found.get(branch) == Some(q)));
    let near = inverse_nearest(&pose, &q).unwrap();
    assert!((0..DOF).all(|i| (near[i] - q[i]).abs() < 1e-12));
    assert_eq!(inverse_nearest(&pose, &[f64::NAN; DOF]), None);
    assert_eq!(Branch::ALL.map(Branch::name)[0], "shoulder left, elbow up, wrist no-flip");
    let mut poses = [[[7.0; 4]; 4]; 2];
    println!("{}", fk_batch(&[q], &mut poses).unwrap_err());
    assert_eq!(poses[0][0][0], 7.0);
    fk_batch(&[q, q], &mut poses).unwrap();
    assert_eq!(poses, [alone, alone]);
    fk_batch(&[], &mut []).unwrap();
    assert!(fk(&[f64::NAN; DOF])[0][3].is_nan() && puma560::f32::fk(&[f32::INFINITY; DOF])[0][3].is_nan());
    assert_eq!(puma560::clamp(&[9.0, f64::NAN, 9.0, -9.0, 0.0, 1.0])[0], puma560::LIMITS[0].unwrap().1);
    assert!(!puma560::within_limits(&[f64::NAN; DOF]) && puma560::within_limits(&[0.0; DOF]));
    """

    assert evaluate("puma560", tmp_path, code).strip() == "base_T_tool has 2 configurations; it takes 1"


@needs_rust
def test_runtime_parameters_have_defaults(tmp_path: Path) -> None:
    code = """
    use calibrated_2r::{fk, Params, DOF};
    let longer = Params { L1: 7.0, ..Params::default() };
    assert!(fk(&[0.0; DOF], &longer)[0][3] > fk(&[0.0; DOF], &Params::default())[0][3] + 6.0);
    """

    assert evaluate("calibrated_2r", tmp_path, code) == ""


@needs_rust
@pytest.mark.skipif(shutil.which("gcc") is None, reason="needs gcc")
def test_the_search_is_called_in_c(tmp_path: Path) -> None:
    crate("puma560", tmp_path)  # lays out the files
    sources = sorted((tmp_path / "csrc").glob("*.c"))
    objects = [tmp_path / f"{source.stem}.o" for source in sources]
    for source, target in zip(sources, objects, strict=True):
        run(["gcc", "-std=c99", "-O1", "-ffp-contract=off", "-c", str(source), "-o", str(target)])
    code = """
    use puma560::numeric_inverse::{numeric_inverse, Search};
    let q = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6];
    let found = numeric_inverse(&puma560::fk(&q), &[0.0; 6], &Search::default());
    assert!(found.is_solution && found.position_error < 1e-9);
    let single = puma560::f32::numeric_inverse::numeric_inverse(
        &puma560::f32::fk(&q.map(|joint| joint as f32)), &[0.0; 6], &puma560::f32::numeric_inverse::Search::default());
    assert!(single.is_solution);
    assert!(!numeric_inverse(&[[f64::NAN; 4]; 4], &q, &Search::default()).is_solution);
    """

    assert (
        evaluate("puma560", tmp_path, code, "--cfg", 'feature="numeric-inverse"', link=tuple(map(str, objects))) == ""
    )


@needs_rust
@pytest.mark.skipif(shutil.which("rustfmt") is None, reason="needs rustfmt")
@pytest.mark.parametrize("name", ["puma560", "calibrated_2r", "blocks", "hand"])
def test_files_are_laid_out_as_rustfmt_does(name: str, tmp_path: Path) -> None:
    crate(name, tmp_path)
    tests = sorted(map(str, (tmp_path / "tests").glob("*.rs")))
    run(["rustfmt", "--check", "--edition", "2021", str(tmp_path / "src" / "lib.rs"), *tests])


@needs_rust
@pytest.mark.skipif(shutil.which("clippy-driver") is None, reason="needs clippy")
def test_clippy_has_nothing_to_say(tmp_path: Path) -> None:
    crate("puma560", tmp_path)
    options = ["--edition", "2021", "--crate-type", "lib", "--crate-name", "puma560", "--out-dir", str(tmp_path)]
    run(["clippy-driver", *options, "-D", "clippy::pedantic", "-D", "warnings", str(tmp_path / "src" / "lib.rs")])


def test_nothing_is_unsafe_without_the_search() -> None:
    assert "#![forbid(unsafe_code)]" in files("scara")["src/lib.rs"]
    assert 'cfg_attr(not(feature = "numeric-inverse"), forbid(unsafe_code))' in files("puma560")["src/lib.rs"]
    assert not any("unsafe {" in text for path, text in files("puma560").items() if "numeric_inverse" not in path)


@pytest.mark.parametrize("word", ["match", "crate", "core", "self"])
def test_words_of_rust_are_refused(word: str, tmp_path: Path) -> None:
    path = tmp_path / "arm.yaml"
    text = (ROBOTS / "calibrated_2r.yaml").read_text(encoding="utf-8")
    path.write_text(re.sub(r"^name: .*", f"name: {word}", text, flags=re.MULTILINE), encoding="utf-8")
    arm = load(path)
    with pytest.raises(KinegenError, match=f"robot name '{word}' is a word of Rust"):
        emit_language(RobotPrograms(arm, (lower(derive(arm, OUTPUTS[0])),), runtime_defaults(arm)), RUST)


def test_every_operator_is_printed() -> None:
    text = emit_language(KERNELS, RUST)["rust/src/lib.rs"]

    for line in (
        "let (s1, c1) = sincos(q[0]);",
        "let t1 = c1 * -0.3333333333333333;",
        "let t2 = params.far / params.lambda;",
        "let t6 = sqrt(t2);",
        "let t7 = atan2(t3, t6);",
        "let t8 = select(q[0], 0.5, t3, t7);",
    ):
        assert f"    {line}\n" in text


@needs_rust
@pytest.mark.parametrize("features", [(), ("std",)])
def test_roots_alone_bring_all_that_they_call(features: tuple[str, ...], tmp_path: Path) -> None:
    """A triangle of an actuator has a square root, and no arc tangent or selection of its own."""
    robot = load(ROBOTS.parent / "docs" / "examples" / "arm.yaml")
    program = lower(derive(robot, parse_quantity("actuators_to_joints")))
    given = RobotPrograms(robot, (program,), runtime_defaults(robot))
    for path, text in emit_language(given, LANGUAGES["rust"]).items():
        place = tmp_path / path
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(text, encoding="utf-8")
    chosen = [word for each in features for word in ("--cfg", f'feature="{each}"')]
    library = ["--edition", "2021", "--crate-type", "lib", "--crate-name", "arm", *chosen, "src/lib.rs"]

    run([TOOL, *library, "-o", str(tmp_path / "arm.rlib")], tmp_path / "rust")
