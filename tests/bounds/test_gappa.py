"""A second opinion: gappa, a prover for rounding errors that knows nothing of ours, on px of the PUMA 560.

gappa multiplies and adds intervals and has no idea of geometry. It is told how large exact values get (which follows
from the lengths of the links, and is measured here over many poses) and how good the sines and cosines are, and has to
find the same bound from the same operations in the same order.
"""

from __future__ import annotations

import math
import re
import shutil
import subprocess
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from kinegen.backends.accuracy import error_bound
from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.routines import SINCOS
from kinegen.backends.scalar_types import ScalarType
from kinegen.driver.pipeline import lower_file
from kinegen.ir.program import Constant, Operand, Operator, Program, Statement, Temporary, Variable
from kinegen.model.joint_bounds import joint_box
from kinegen.model.outputs import Quantity

ROBOT = Path(__file__).resolve().parents[2] / "robots" / "puma560.yaml"
SYMBOLS = {Operator.ADD: "+", Operator.SUB: "-", Operator.MUL: "*"}
SEED = 20240229

pytestmark = pytest.mark.skipif(
    shutil.which("gappa") is None, reason="needs gappa (apt-get install --no-install-recommends gappa)"
)


def needed(program: Program, result: Operand) -> list[Statement]:
    """The statements that one result needs, in order, up to its sines and cosines."""
    wanted = {result}
    found = []
    for statement in reversed(program.statements):
        if not wanted.isdisjoint(map(Temporary, statement.results)):
            found.append(statement)
            if statement.operator is not Operator.SINCOS:
                wanted.update(statement.operands)
    return found[::-1]


def ranges(kernels: RobotPrograms) -> dict[str, float]:
    """The largest exact magnitude of every value, from many poses and a little more."""
    box = np.array(joint_box(kernels.robot))
    q = np.random.default_rng(SEED).uniform(box[:, 0], box[:, 1], (400_000, len(box)))
    values: dict[Operand, np.ndarray] = {Variable(index): column for index, column in enumerate(q.T)}
    functions = {
        Operator.ADD: (np.add,),
        Operator.SUB: (np.subtract,),
        Operator.MUL: (np.multiply,),
        Operator.NEG: (np.negative,),
        Operator.SINCOS: (np.sin, np.cos),
    }
    for statement in kernels.programs[0].statements:
        given = [float(one.value) if isinstance(one, Constant) else values[one] for one in statement.operands]
        for name, function in zip(statement.results, functions[statement.operator], strict=True):
            values[Temporary(name)] = function(*given)
    return {one.name: 1.001 * float(np.abs(value).max()) for one, value in values.items() if isinstance(one, Temporary)}


def operand(one: Operand, computed: bool) -> str:
    """An operand of the computed or of the exact formula."""
    if isinstance(one, Constant):
        number = f"{float(one.value)!r}"
        assert Fraction(number) == one.value
        return f"rnd({number})" if computed else number
    assert isinstance(one, Temporary)
    return f"f{one.name}" if computed else one.name


def formula(statement: Statement, computed: bool) -> str:
    """A statement, with a rounding or exact."""
    first, second = (operand(one, computed) for one in statement.operands)
    name = f"f{statement.name} rnd" if computed else f"{statement.name} "
    return f"{name}= {first} {SYMBOLS[statement.operator]} {second};"


def script(kernels: RobotPrograms, result: Temporary) -> str:
    """What gappa reads: the computed formula, the exact one, what is known, what is asked."""
    statements = needed(kernels.programs[0], result)
    largest = ranges(kernels)
    formulas = [statement for statement in statements if statement.operator is not Operator.SINCOS]
    lines = [formula(statement, computed) for computed in (True, False) for statement in formulas]
    known = " /\\ ".join(fact for statement in statements for fact in facts(statement, largest))
    question = f"{{ {known} -> |f{result.name} - {result.name}| in ? }}"
    return "\n".join(["@rnd = float<ieee_32, ne>;", *lines, question, ""])


def facts(statement: Statement, largest: dict[str, float]) -> Iterator[str]:
    """What gappa is told about one value."""
    if statement.operator is not Operator.SINCOS:
        yield f"|{statement.name}| <= {largest[statement.name]!r}"
        return
    angle = statement.operands[0]
    # A sum of two angles is rounded once before its sine is taken.
    rounding = 2.0 ** (math.ceil(math.log2(largest[angle.name])) - 25) if isinstance(angle, Temporary) else 0.0
    for name in statement.results:
        yield from (f"|{name}| <= 1", f"|f{name}| <= 1", f"@FLT(f{name}, 24)")
        yield f"|f{name} - {name}| <= {SINCOS[ScalarType.FLOAT].absolute_error + rounding!r}"


def test_gappa_finds_the_same_bound_for_px_of_the_puma() -> None:
    kernels = lower_file(ROBOT, (Quantity.POSITION,))
    px = kernels.programs[0].outputs[0]
    assert isinstance(px, Temporary)
    done = subprocess.run(["gappa"], input=script(kernels, px), capture_output=True, text=True, check=True)
    found = re.search(r"in \[0, \S+ \{([^,]+),", done.stderr + done.stdout)
    assert found, done.stderr

    assert error_bound(kernels, kernels.programs[0], ScalarType.FLOAT).position[0] == pytest.approx(
        float(found[1]), rel=0.01
    )
