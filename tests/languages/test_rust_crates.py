"""The crate with the features `nalgebra` and `glam`, tested by cargo.

Cargo takes the two crates from a folder: stand-ins of these tests, Debian's where its release has them, and what
`KINEGEN_CRATES` names, folders as `cargo vendor` writes them.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.emit.emitted import run
from tests.languages.test_rust import files

pytestmark = pytest.mark.languages

STANDINS = Path(__file__).resolve().parent / "standins"
DEBIAN = Path("/usr/share/cargo/registry")
FOLDERS = [STANDINS, *map(Path, filter(None, os.environ.get("KINEGEN_CRATES", "").split(os.pathsep)))]
FOLDERS += [DEBIAN] if all(list(DEBIAN.glob(f"{name}-[0-9]*")) for name in ("nalgebra", "glam")) else []

needs_cargo = pytest.mark.skipif(shutil.which("cargo") is None, reason="needs cargo (Debian: apt-get install cargo)")

NALGEBRA = """
use scara::convert::{from_nalgebra, to_nalgebra};

const Q: [f64; 3] = [0.3, -1.2, 0.05];

#[test]
fn poses_and_jacobians_are_the_same_entry_by_entry() {
    let pose = scara::fk(&Q);
    let single = scara::f32::fk(&Q.map(|joint| joint as f32));
    let wide = [[1.0, 2.0, 3.0], [4.0, 5.0, f64::NEG_INFINITY]];
    for row in 0..4 {
        for column in 0..4 {
            assert_eq!(to_nalgebra(&pose)[(row, column)].to_bits(), pose[row][column].to_bits());
            assert_eq!(to_nalgebra(&single)[(row, column)].to_bits(), single[row][column].to_bits());
        }
    }
    assert_eq!(to_nalgebra(&wide)[(0, 2)], 3.0);
    assert_eq!(from_nalgebra(&to_nalgebra(&wide)), wide);
    assert_eq!(from_nalgebra(&to_nalgebra(&pose)), pose);
    assert!(to_nalgebra(&scara::fk(&[f64::NAN; 3]))[(0, 3)].is_nan());
    let matrix: nalgebra::SMatrix<f64, 4, 4> = nalgebra::SMatrix::from_fn(|row, column| (10 * row + column) as f64);
    assert_eq!(from_nalgebra(&matrix)[1][3], 13.0);
}
"""

GLAM = """
use scara::convert::{from_glam, from_glam_f32, to_glam, to_glam_f32};

const Q: [f64; 3] = [0.3, -1.2, 0.05];

#[test]
fn poses_are_the_same_entry_by_entry() {
    let pose = scara::fk(&Q);
    let single = scara::f32::fk(&Q.map(|joint| joint as f32));
    for row in 0..4 {
        for column in 0..4 {
            let place = 4 * column + row;
            assert_eq!(to_glam(&pose).to_cols_array()[place].to_bits(), pose[row][column].to_bits());
            assert_eq!(to_glam_f32(&single).to_cols_array()[place].to_bits(), single[row][column].to_bits());
        }
    }
    assert_eq!(from_glam(&to_glam(&pose)), pose);
    assert_eq!(from_glam_f32(&to_glam_f32(&single)), single);
    assert!(to_glam(&scara::fk(&[f64::NAN; 3])).to_cols_array()[12].is_nan());
    let columns = [[0.0, 1.0, 2.0, 3.0], [4.0, 5.0, 6.0, 7.0], [8.0, 9.0, 10.0, 11.0], [12.0, 13.0, 14.0, 15.0]];
    assert_eq!(from_glam(&glam::DMat4::from_cols_array_2d(&columns))[1][3], 13.0);
}
"""

PROGRAMS = {"nalgebra": NALGEBRA, "glam": GLAM}


def kept(place: Path, crates: Path) -> Path:
    """A folder of crates for cargo; the stand-ins get the list of digests that cargo asks for, an empty one."""
    if crates != STANDINS:
        return crates
    shutil.copytree(crates, place)
    for description in place.glob("*/Cargo.toml"):
        description.with_name(".cargo-checksum.json").write_text(json.dumps({"files": {}}))
    return place


def cargo_test(place: Path, crates: Path, feature: str, change: tuple[str, str] = ("", "")) -> tuple[int, str]:
    """Exit status and words of `cargo test`, offline, for the crate with one feature."""
    for path, text in files("scara").items():
        (place / "rust" / path).parent.mkdir(parents=True, exist_ok=True)
        (place / "rust" / path).write_text(text, encoding="utf-8")
    convert = place / "rust" / "src" / "convert.rs"
    assert change[0] in convert.read_text(encoding="utf-8")
    convert.write_text(convert.read_text(encoding="utf-8").replace(*change) if change[0] else convert.read_text())
    (place / "rust" / "tests" / "conversions.rs").write_text(PROGRAMS[feature], encoding="utf-8")
    (place / "rust" / ".cargo").mkdir()
    (place / "rust" / ".cargo" / "config.toml").write_text(
        '[source.crates-io]\nreplace-with = "kept"\n'
        f"[source.kept]\ndirectory = {json.dumps(str(kept(place / 'crates', crates)))}\n"
    )
    done = subprocess.run(
        ["cargo", "test", "--tests", "--offline", "--features", feature],
        cwd=place / "rust",
        env={**os.environ, "CARGO_TARGET_DIR": str(place / "target"), "RUSTFLAGS": "-D warnings"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=300,
        check=False,
    )
    return done.returncode, done.stdout


@needs_cargo
def test_the_page_says_how_to_do_without_a_registry(tmp_path: Path) -> None:
    """No dependency is looked up then, and no name of a feature is unknown to the compiler."""
    page = Path(__file__).resolve().parents[2] / "docs" / "rust.md"
    (command,) = re.findall(r"^(sed .*Cargo\.toml)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    for path, text in files("puma560").items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(text, encoding="utf-8")
    run(["sh", "-c", f"cd '{tmp_path}' && {command}"])
    environment = {**os.environ, "CARGO_HOME": str(tmp_path / "empty"), "RUSTFLAGS": "-D warnings"}
    check = ["cargo", "check", "--offline"]
    done = subprocess.run(
        check, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr


@needs_cargo
@pytest.mark.parametrize("feature", PROGRAMS)
@pytest.mark.parametrize("crates", FOLDERS, ids=lambda folder: folder.name)
def test_conversions_keep_every_entry(crates: Path, feature: str, tmp_path: Path) -> None:
    status, words = cargo_test(tmp_path, crates, feature)

    assert status == 0, words
    assert "are_the_same_entry_by_entry ... ok" in words
    assert words.count("test result: ok") >= 3  # with the vectors of both number types


@needs_cargo
@pytest.mark.parametrize(
    ("feature", "change"),
    [
        ("nalgebra", ("matrix[row][column].clone()", "matrix[column % R][row % C].clone()")),
        ("nalgebra", ("matrix[(row, column)]", "matrix[(column % R, row % C)]")),
        ("glam", ("glam::DMat4::from_cols_array_2d(pose).transpose()", "glam::DMat4::from_cols_array_2d(pose)")),
        ("glam", ("    pose.transpose().to_cols_array_2d()", "    pose.to_cols_array_2d()")),
    ],
    ids=["to nalgebra", "from nalgebra", "to glam", "from glam"],
)
def test_an_altered_conversion_is_noticed(feature: str, change: tuple[str, str], tmp_path: Path) -> None:
    status, words = cargo_test(tmp_path, STANDINS, feature, change)

    assert status != 0
    assert "test result: FAILED" in words
