"""kinegen installs from a wheel and from a checkout, runs outside both, and starts quickly."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import tarfile
import zipfile
from importlib import metadata
from pathlib import Path

import pytest

import kinegen
from kinegen.backends.templates import template_folder
from kinegen.errors import KinegenError

ROOT = Path(__file__).resolve().parent.parent

ROBOT = """\
kinegen: 1
name: slider
convention: standard
units: {length: m, angle: deg}
joints:
  - {name: turn, alpha: 0, a: 0.5, d: 0, theta: q}
  - {name: slide, alpha: 90, a: 0, d: q, theta: 0}
"""

MJCF = """\
<mujoco model="arm"><worldbody><body name="a"><joint name="turn" axis="0 0 1"/>
<body name="b" pos="0.5 0 0"><joint name="slide" type="slide" axis="0 0 1" range="0 0.2"/></body></body>
</worldbody></mujoco>
"""


def run(*command: str | Path, cwd: Path) -> str:
    """Runs a command away from the checkout's own settings and returns what it printed."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "PYTEST"))}
    done = subprocess.run(command, cwd=cwd, env=kept, capture_output=True, text=True, check=False)

    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def fresh_environment(folder: Path) -> Path:
    """Makes an environment that sees this one's libraries, but not this one's kinegen; returns its bin folder.

    A folder named in a .pth file is put on the path without reading the .pth files inside it, and an editable install
    of kinegen is such a file.
    """
    run(sys.executable, "-m", "venv", "--without-pip", folder, cwd=folder.parent)
    (site,) = folder.glob("lib/python3*/site-packages")
    libraries = {sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}
    (site / "libraries.pth").write_text("".join(f"{path}\n" for path in sorted(libraries)), encoding="utf-8")
    return folder / "bin"


def install(environment: Path, *what: str | Path, cwd: Path) -> None:
    """Installs into an environment without the network."""
    offline = ("--no-deps", "--no-index", "--no-build-isolation", "--disable-pip-version-check", "--quiet")
    # kinegen stands in the borrowed libraries too, and pip must not take it for installed.
    pip = (sys.executable, "-m", "pip", "--python", environment / "python")
    run(*pip, "install", "--ignore-installed", *offline, *what, cwd=cwd)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wheel of the checkout."""
    folder = tmp_path_factory.mktemp("wheel")
    run(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder, cwd=ROOT)
    (path,) = folder.glob("*.whl")
    return path


def templates() -> set[str]:
    """The templates of the checkout, by their paths inside the folder."""
    folder = ROOT / "templates"
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


def test_the_wheel_holds_the_package_and_nothing_else(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    inside = {name.removeprefix("kinegen/templates/") for name in names if name.startswith("kinegen/templates/")}

    assert inside == templates()
    assert "kinegen/py.typed" in names
    assert any(name.endswith("/licenses/LICENSE") for name in names)
    assert {name.split("/")[0] for name in names} == {"kinegen", f"kinegen-{kinegen.__version__}.dist-info"}


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The sources as they are handed out, unpacked."""
    folder = tmp_path_factory.mktemp("sdist")
    run(sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-d", folder, cwd=ROOT)
    (path,) = folder.glob("*.tar.gz")
    with tarfile.open(path) as archive:
        archive.extractall(folder, filter="data")
    return folder / f"kinegen-{kinegen.__version__}"


def test_the_sources_hold_all_that_make_takes(source: Path) -> None:
    for place in ("kinegen", "templates", "robots", "tests", "docs", "examples", "scripts", "benchmarks", "generated"):
        mine, theirs = (
            {path.relative_to(root).as_posix() for path in (root / place).rglob("*") if is_source(path)}
            for root in (ROOT, source)
        )

        assert mine == theirs
    names = ("Makefile", "README.md", "CONTRIBUTING.md", "LICENSE", "CHANGELOG.md", "CITATION.cff", "mkdocs.yml")
    for name in (*names, ".ci/run", ".github/SECURITY.md", ".github/workflows/tests.yml", ".pre-commit-config.yaml"):
        assert (source / name).read_bytes() == (ROOT / name).read_bytes()


def is_source(path: Path) -> bool:
    """Whether a file is no trace of work in the checkout."""
    is_made = path.suffix in {".so", ".pyd", ".o"} or "__pycache__" in path.parts or "results" in path.parts
    return path.is_file() and not is_made


@pytest.mark.parametrize("goal", ["demo", "test"])
def test_make_finds_what_it_needs_in_the_sources(goal: str, source: Path) -> None:
    assert "scripts/make_venv.py" in run("make", "--dry-run", f"PYTHON={sys.executable}", goal, cwd=source)


@pytest.mark.long
def test_every_test_of_the_sources_can_be_collected(source: Path) -> None:
    quick = ("--assert=plain", "-p", "no:cacheprovider")  # nothing runs, so no assertion needs its words
    printed = run(sys.executable, "-m", "pytest", "--collect-only", "-qq", *quick, cwd=source)

    assert "error" not in printed.splitlines()[-1]


@pytest.mark.parametrize("origin", ["wheel", "checkout"])
def test_an_installed_kinegen_builds_a_robot_elsewhere(
    origin: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    environment = fresh_environment(tmp_path / "environment")
    if origin == "wheel":
        install(environment, request.getfixturevalue("wheel"), cwd=tmp_path)
    else:
        install(environment, "--editable", ROOT, cwd=tmp_path)
    home = ROOT if origin == "checkout" else tmp_path
    (tmp_path / "slider.yaml").write_text(ROBOT, encoding="utf-8")
    run(environment / "kinegen", "build", "slider.yaml", "-o", "out", "--no-compile", cwd=tmp_path)
    place = "import kinegen, pathlib; print(pathlib.Path(kinegen.__file__).resolve())"
    pose = "from out import slider; print(*slider.fk([0.0, 0.25])[:3, 3].round(12))"

    assert Path(run(environment / "python", "-c", place, cwd=tmp_path).strip()).is_relative_to(home)
    assert run(environment / "python", "-c", pose, cwd=tmp_path).split() == ["0.5", "0.0", "0.25"]


BARE = """\
import sys

class Without:
    def __init__(self, finder):
        self.finder = finder

    def find_spec(self, name, *places):
        return None if name.partition(".")[0] in NAMES else self.finder.find_spec(name, *places)

    def __getattr__(self, name):
        return getattr(self.finder, name)

sys.meta_path[:] = [Without(finder) for finder in sys.meta_path]
"""
"""A sitecustomize.py after which Python has no package of an extra."""


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder for PYTHONPATH; see `BARE`."""
    folder = tmp_path_factory.mktemp("bare")
    names = ("xacro", "lxml", "matplotlib", "pyarrow", "scipy", "dask", "distributed", "zarr", "anywidget", "IPython")
    (folder / "sitecustomize.py").write_text(BARE.replace("NAMES", repr(names)), encoding="utf-8")
    return folder


@pytest.mark.parametrize(
    "arguments",
    [
        ("convert", "docs/examples/elbow_arm.urdf", "-o", "OUT/arm.yaml"),
        ("show", "OUT/arm.xml", "--format", "latex"),
        ("show", "docs/examples/table.csv", "--table", "standard,mm,deg"),
        ("convert", "robots/planar_3r.yaml", "-o", "OUT/arm.urdf"),
        ("view", "robots/planar_3r.yaml", "-o", "OUT/arm.html"),
        ("build", "OUT/arm.xml", "-o", "OUT/build", "--no-compile"),
    ],
    ids=lambda arguments: f"{arguments[0]} {Path(arguments[1]).suffix}",
)
def test_without_any_extra_all_but_figures_and_data_sets_is_read_and_written(
    arguments: tuple[str, ...], bare: Path, tmp_path: Path
) -> None:
    (tmp_path / "arm.xml").write_text(MJCF, encoding="utf-8")
    words = [word.replace("OUT", str(tmp_path)) for word in arguments]

    assert run_bare(bare, *words).returncode == 0


def test_what_needs_an_extra_says_which(bare: Path, tmp_path: Path) -> None:
    (tmp_path / "arm.xacro").write_text('<robot name="a"/>', encoding="utf-8")
    xacro = run_bare(bare, "show", str(tmp_path / "arm.xacro"))
    figure = run_bare(bare, "view", "robots/planar_3r.yaml", "-o", str(tmp_path / "arm.svg"))

    assert (xacro.returncode, figure.returncode) == (1, 1)
    assert "pip install 'kinegen[import]'" in xacro.stderr
    assert "pip install 'kinegen[plot]'" in figure.stderr
    assert (xacro.stderr + figure.stderr).count("\n") == 2


def run_bare(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a command of kinegen without what extras bring."""
    command = [sys.executable, "-m", "kinegen", *arguments]
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    return subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)


def test_the_version_is_told_alike_everywhere() -> None:
    assert metadata.version("kinegen") == kinegen.__version__


@pytest.mark.parametrize("arguments", [["--help"], ["build", "--help"], ["--version"]], ids=" ".join)
def test_help_comes_without_the_heavy_libraries(arguments: list[str], tmp_path: Path) -> None:
    """sympy alone takes longer to import than a person waits for help gladly."""
    script = (
        "import sys\n"
        "from kinegen.ui.cli import main\n"
        f"assert main({arguments}) in (0, None)\n"
        "print(*sorted({'cffi', 'jinja2', 'mpmath', 'numpy', 'sympy', 'yaml'} & set(sys.modules)))\n"
    )
    printed = run(sys.executable, "-c", script, cwd=tmp_path)

    assert printed.splitlines()[-1].split() == []


def test_templates_inside_the_package_come_first(tmp_path: Path) -> None:
    inside = tmp_path / "kinegen" / "templates"
    beside = tmp_path / "templates"
    inside.mkdir(parents=True)
    beside.mkdir()

    assert template_folder(tmp_path / "kinegen") == inside

    inside.rmdir()

    assert template_folder(tmp_path / "kinegen") == beside


def test_missing_templates_are_said_to_be_missing(tmp_path: Path) -> None:
    with pytest.raises(KinegenError, match="the templates are missing"):
        template_folder(tmp_path / "kinegen")
