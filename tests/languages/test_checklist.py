"""A language is a syntax, its files, a runner and two lines: a toy language takes all the steps, and is proven."""

from __future__ import annotations

import re
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

from kinegen import build as builds
from kinegen.emit import languages
from kinegen.emit.javascript.syntax import SYNTAX as JAVASCRIPT_SYNTAX
from kinegen.emit.kernels import Kernels
from kinegen.emit.language import Language
from kinegen.emit.languages import LANGUAGES, emit_language
from kinegen.emit.printing import Printer, Syntax
from kinegen.errors import ProofError
from kinegen.ir.program import Operator
from kinegen.outputs import Kind, Quantity
from kinegen.robot.expressions import evaluate
from kinegen.robot.floats import FLOATS
from kinegen.verify import languages as judge
from kinegen.verify.runners import RUNNERS
from tests.builds.workshop import ROBOTS, make
from tests.emit.emitted import kernels
from tests.emit.handwritten import POSITION

PAGES = Path(__file__).resolve().parents[2] / "docs"

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


def toy_files(given: Kernels) -> dict[str, str]:
    text = next(text for path, text in emit_language(given, LANGUAGES["javascript"]).items() if path.endswith(".js"))
    pair = re.search(r"function sincos\(x\) \{(.*?)\n\}", text, re.DOTALL)
    lines = re.findall(r"const (.*);", pair[1]) if pair else []
    parts = ["def sincos(x):", *(f"    {line}" for line in lines), "    return ss + sc, cc - cs", ""]
    for program in given.programs:
        size = program.signature.inputs[0].size
        printer = Printer(TOY, [f"q[{index}]" for index in range(size)])
        body = printer.lines(program, [f"out[{index}]" for index in range(len(program.outputs))])
        parts += [f"def {program.quantity.function}(q, out):", *(f"    {line}" for line in body), "    return out", ""]
    return {"toy.py": "\n".join(parts)}


class ToyCall:
    """Runs the toy in this process."""

    def __init__(self, _tool: str, folder: Path, given: Kernels) -> None:
        self.given, self.functions = given, dict[str, Any]()
        exec((folder / "toy.py").read_text(), self.functions)  # noqa: S102 - the toy itself

    def __call__(self, program: Any, inputs: Any, _parameters: Any, *, is_batch: bool) -> Any:
        """Evaluate a pose; batches are evaluated one by one."""
        del is_batch
        function = self.functions[program.quantity.function]
        with np.errstate(all="ignore"):
            rows = [function(list(map(np.float64, q)), [0.0] * len(program.outputs)) for q in inputs[0]]
        found = np.array(rows).reshape(len(rows), 3, 4)
        last = np.broadcast_to([0.0, 0.0, 0.0, 1.0], (len(rows), 1, 4))
        return (np.concatenate([found, last], axis=1),)

    def tables(self) -> dict[str, Any]:
        """What the toy says of the robot."""
        robot = self.given.robot
        limits = tuple(
            None if each.limits is None else tuple(float(evaluate(end, {}, FLOATS)) for end in each.limits)
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
    language = Language("toy", "Toy", toy_refuses, toy_files, ("sh",), "a shell")
    table = MappingProxyType({**LANGUAGES, "toy": language})
    monkeypatch.setattr(languages, "LANGUAGES", table)
    monkeypatch.setattr(builds, "LANGUAGES", table)
    monkeypatch.setattr(judge, "LANGUAGES", table)
    monkeypatch.setattr(judge, "RUNNERS", {**RUNNERS, "toy": ToyCall})
    return language


def test_a_toy_language_is_built_and_proven(toy: Language, tmp_path: Path) -> None:
    quantities = (Quantity.POSE, Quantity.POSITION)
    result = make(ROBOTS / "scara.yaml", tmp_path, quantities=quantities, languages=(toy.name,))

    targets = {comparison.target for comparison in result.proof.comparisons}
    assert {"Toy double", "Toy double, batch", "Toy double, beyond limits"} <= targets
    assert "Toy has no position: it is a toy" in result.notes
    assert (tmp_path / "scara" / "toy" / "toy.py").exists()


def test_a_wrong_toy_is_refused(toy: Language, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(builds, "emit_languages", lambda *_: {"toy/toy.py": toy_files(kernels("ur5"))["toy.py"]})

    with pytest.raises(ProofError, match="Toy double"):
        make(ROBOTS / "puma560.yaml", tmp_path, languages=(toy.name,))

    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("name", LANGUAGES)
def test_every_language_has_a_runner_and_a_page(name: str) -> None:
    assert name in RUNNERS
    assert (PAGES / f"{name}.md").exists()
    assert LANGUAGES[name].name == name
    assert all(LANGUAGES[name].refuses(quantity) == "" for quantity in (Quantity.POSE, Quantity.FRAMES))


def test_a_syntax_has_a_form_for_every_operator() -> None:
    assert set(JAVASCRIPT_SYNTAX.forms) == set(Operator) - {Operator.SINCOS}


def test_an_operator_without_a_form_is_an_error() -> None:
    less = Syntax(**{**{name: getattr(TOY, name) for name in TOY.__slots__}, "forms": {}})

    with pytest.raises(TypeError, match="Toy has no form for the operator"):
        Printer(less, ["q[0]", "q[1]"]).lines(POSITION, ["a", "b", "c"])
