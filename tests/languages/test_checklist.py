"""A language is a syntax, its files, a runner and two lines: a toy language takes all the steps, and is proven."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

from kinegen.backends import languages
from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.javascript.syntax import SYNTAX as JAVASCRIPT_SYNTAX
from kinegen.backends.language import Language
from kinegen.backends.languages import LANGUAGES, emit_language, kept
from kinegen.backends.printing import Printer, Syntax
from kinegen.driver import artifacts
from kinegen.errors import KinegenError, ProofError
from kinegen.ir.fixed_point.program import Operation
from kinegen.ir.program import Operator
from kinegen.model.expression_parser import evaluate
from kinegen.model.expression_values import FLOAT64
from kinegen.model.outputs import Kind, Quantity, parse_quantity
from kinegen.ui.cli import main
from kinegen.verify import language_build
from kinegen.verify import languages as judge
from kinegen.verify.runners import RUNNERS
from tests.builds.workshop import ROBOTS, make
from tests.emit.emitted import kernels
from tests.emit.handwritten import POSITION

ROOT = Path(__file__).resolve().parents[2]
PAGES = ROOT / "docs"

# The toy: Python that evaluates one configuration, its sine and cosine read off the text of JavaScript's.
TOY = Syntax(
    language="Toy",
    literal=JAVASCRIPT_SYNTAX.literal,
    define="{name} = {value}",
    store="{place} = {value}",
    sincos=lambda sine, cosine, angle: (f"{sine}, {cosine} = sincos({angle})",),
    parameter="params[{name!r}]",
    forms=JAVASCRIPT_SYNTAX.forms,
)


def toy_files(given: RobotPrograms, _real: str = "double") -> dict[str, str]:
    text = next(text for path, text in emit_language(given, LANGUAGES["javascript"]).items() if path.endswith(".js"))
    pair = re.search(r"const x_b = [^\n]*\n(.*?)/\* The same", text, re.DOTALL)
    lines = re.findall(r"const (.*);", pair[1]) if pair else []
    parts = ["def sincos(x):", *(f"    {line}" for line in lines), "    return sine, cosine", ""]
    for program in given.programs:
        size = program.signature.inputs[0].size
        printer = Printer(TOY, [f"q[{index}]" for index in range(size)])
        body = printer.lines(program, [f"out[{index}]" for index in range(len(program.outputs))])
        parts += [f"def {program.quantity.function}(q, out):", *(f"    {line}" for line in body), "    return out", ""]
    return {"toy.py": "\n".join(parts)}


class ToyCall:
    """Runs the toy in this process."""

    def __init__(self, _tool: str, folder: Path, given: RobotPrograms) -> None:
        self.given, self.functions = given, dict[str, Any]()
        exec((folder / "toy.py").read_text(), self.functions)  # noqa: S102 - the toy itself

    def __call__(self, program: Any, inputs: Any, _parameters: Any, *, real: str, is_batch: bool) -> Any:
        """Evaluate poses one by one."""
        assert not is_batch, "the toy has no batches"
        del real
        function = self.functions[program.quantity.function]
        with np.errstate(all="ignore"):
            rows = [function(list(map(np.float64, q)), [0.0] * len(program.outputs)) for q in inputs[0]]
        found = np.array(rows).reshape(len(rows), 3, 4)
        last = np.broadcast_to([0.0, 0.0, 0.0, 1.0], (len(rows), 1, 4))
        return (np.concatenate([found, last], axis=1),)

    def others(self, _name: str, _inputs: Any, *, real: str) -> None:
        """The toy has nothing else."""

    def tables(self) -> dict[str, Any]:
        """What the toy says of the robot."""
        robot = self.given.robot
        limits = tuple(
            None if each.limits is None else tuple(float(evaluate(end, {}, FLOAT64)) for end in each.limits)
            for each in robot.variables
        )
        return {
            "DOF": robot.dof,
            "JOINTS": tuple(each.name for each in robot.variables),
            "LIMITS": limits,
            "MODEL": robot.digest,
        }


def toy_refuses(quantity: Quantity) -> str:
    return "" if quantity.kind is Kind.POSE else "it is a toy"


@pytest.fixture
def toy(monkeypatch: pytest.MonkeyPatch) -> Language:
    language = Language(
        name="toy",
        title="Toy",
        reals=("double",),
        syntax=lambda _real: TOY,
        files=toy_files,
        refuses=toy_refuses,
        tools=("sh",),
        install="a shell",
        reserved=frozenset({"ur5"}),
        has_batches=False,
    )
    table = MappingProxyType({**LANGUAGES, "toy": language})
    monkeypatch.setattr(languages, "LANGUAGES", table)
    monkeypatch.setattr(artifacts, "LANGUAGES", table)
    monkeypatch.setattr(judge, "LANGUAGES", table)
    monkeypatch.setattr(language_build, "RUNNERS", {**RUNNERS, "toy": ToyCall})
    return language


def test_a_toy_language_is_built_and_proven(toy: Language, tmp_path: Path) -> None:
    quantities = (Quantity.POSE, Quantity.POSITION)
    result = make(ROBOTS / "scara.yaml", tmp_path, quantities=quantities, languages=(toy.name,))

    targets = {comparison.target for comparison in result.proof.comparisons}
    assert {target for target in targets if target.startswith("Toy")} == {"Toy double", "Toy double, beyond limits"}
    assert "Toy has no position: it is a toy" in result.notes
    assert (tmp_path / "scara" / "toy" / "toy.py").exists()


def test_a_wrong_toy_is_refused(toy: Language, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(artifacts, "emit_languages", lambda *_: {"toy/toy.py": toy_files(kernels("ur5"))["toy.py"]})

    with pytest.raises(ProofError, match="Toy double"):
        make(ROBOTS / "puma560.yaml", tmp_path, languages=(toy.name,))

    assert not any(tmp_path.iterdir())


def test_words_of_a_language_are_refused_where_it_is_asked_for(toy: Language) -> None:
    with pytest.raises(KinegenError, match="robot name 'ur5' is a word of Toy; rename it or leave Toy out"):
        emit_language(kernels("ur5"), toy)
    assert emit_language(kernels("ur5"), LANGUAGES["javascript"])


EXTRA = [name for name, language in LANGUAGES.items() if language.is_extra]


def test_the_table_has_all_languages() -> None:
    assert set(LANGUAGES) == {"c", "python", "q30", "javascript", "cpp", "rust", "matlab", "cuda"}
    assert set(RUNNERS) == set(EXTRA) == {"javascript", "cpp", "rust", "matlab", "cuda"}


@pytest.mark.parametrize("name", EXTRA)
def test_every_extra_language_has_a_page(name: str) -> None:
    assert (PAGES / f"{name}.md").exists()


@pytest.mark.parametrize("name", LANGUAGES)
def test_every_language_prints_poses_and_says_what_it_refuses(name: str) -> None:
    language = LANGUAGES[name]
    given = kernels("puma560", (Quantity.POSE, Quantity.POSITION))

    assert language.name == name
    assert all(language.refuses(quantity) == "" for quantity in (Quantity.POSE, Quantity.FRAMES))
    assert language.tools
    assert language.install
    for real in language.reals:
        files = language.files(given, real)
        assert any("puma560" in text for text in files.values())
        assert not any(file.startswith("/") or ".." in file for file in files)


@pytest.mark.parametrize("name", EXTRA)
def test_every_closed_form_is_in_every_language(name: str) -> None:
    """Eigenvalues take loops; closed forms do not."""
    assert not LANGUAGES[name].refuses(parse_quantity("axis_inverse@cutter/workpiece"))
    assert not LANGUAGES[name].refuses(parse_quantity("inverse"))
    assert LANGUAGES[name].refuses(parse_quantity("complete_inverse"))


@pytest.mark.parametrize(("name", "real"), [(name, real) for name in LANGUAGES for real in LANGUAGES[name].reals])
def test_a_syntax_has_a_form_for_every_operator(name: str, real: str) -> None:
    forms = set(LANGUAGES[name].syntax(real).forms)
    (operators,) = {type(operator) for operator in forms}

    assert operators in (Operator, Operation)
    assert forms == set(operators) - {operators.SINCOS}


def test_integers_refuse_what_they_cannot_compute() -> None:
    reason = LANGUAGES["q30"].refuses(parse_quantity("inverse"))

    assert reason == "q30 kernels compute pose, frames and position, not inverse"
    assert [
        each.quantity for each in kept(kernels("puma560", (parse_quantity("inverse"),)), LANGUAGES["q30"]).programs
    ] == []


def test_the_help_of_a_build_lists_the_extra_languages(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["build", "--help"]) == 0

    text = " ".join(capsys.readouterr().out.split())
    assert f"each in its own folder: {', '.join(EXTRA)}." in text


def test_the_table_is_read_without_what_prints_the_files() -> None:
    """So that help appears at once."""
    code = "import sys, kinegen.backends.languages; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    parts = ("kinegen.ir", "kinegen.model.robot", "kinegen.backends.bundle", "numpy", "sympy", "jinja2")
    assert [name for name in done.stdout.split() if name.startswith(parts)] == []


def outside_of(name: str) -> list[str]:
    """The modules outside the folders of a language that name it.

    Without those of the viewer, whose pages use one, and of the readers, which read files of another.
    """
    found = []
    for path in sorted((ROOT / "kinegen").rglob("*.py")):
        place = path.relative_to(ROOT / "kinegen").as_posix()
        own = (
            place.startswith((f"backends/{name}/", "tools/viewer/", "ui/cli/view", "io/", "ui/cli/convert"))
            or place == f"verify/runners/{name}.py"
        )
        if not own and re.search(rf"(?<![-\w/.])(run_)?{name}\b(?!-)", path.read_text(encoding="utf-8"), re.IGNORECASE):
            found.append(place)
    return found


@pytest.mark.parametrize("name", EXTRA)
def test_a_language_is_named_in_two_lines_outside_its_folders(name: str) -> None:
    assert outside_of(name) == ["backends/languages.py", "verify/runners/__init__.py"]


def test_an_operator_without_a_form_is_an_error() -> None:
    less = Syntax(**{**{name: getattr(TOY, name) for name in TOY.__slots__}, "forms": {}})

    with pytest.raises(TypeError, match="Toy has no form for the operator"):
        Printer(less, ["q[0]", "q[1]"]).lines(POSITION, ["a", "b", "c"])
