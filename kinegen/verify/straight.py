"""That kernels are straight: sums, products, sines and cosines one after the other, without a question about data.

In: the emitted C and NumPy text. Out: nothing, or the first statement that is something else. Why it matters: what is
made of sums, products, sines and cosines alone is an analytic function. It cannot be right at twenty thousand random
points and wrong in a strip between them, so that comparisons at points say something of all points. (Roots, arc
tangents and the selections of orientations and linkages are compared at points alone.) Headers promise it as well:
no loop, and no branch on data.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping, Sequence

from kinegen.errors import ProofError
from kinegen.naming import c_file, function, prefix, sincos_macro
from kinegen.outputs import Quantity
from kinegen.robot.model import Robot

_BRACE = re.compile(r"[{}]")
_COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)
_NAME = r"[A-Za-z_]\w*"
_PLACE = rf"{_NAME}(?:->{_NAME})?(?:\[[^\]=?<>&|]*\])*"
_NUMBER = r"\d[\d.]*(?:[eE][-+]?\d+)?F?"
_OPERAND = rf"(?:-?{_PLACE}|-?{_NUMBER}|\(-{_NUMBER}\))"
_TERM = rf"(?:{_OPERAND}|{_OPERAND} [-+*/] {_OPERAND})"
_KIND = r"(?:const )?(?:double|float)"
_CALL = re.compile(rf"({_NAME})\((?:&?{_OPERAND}(?:, )?)*\)")
_STRAIGHT = re.compile(rf"(?:{_KIND} {_NAME}(?: = {_TERM})?|\*?{_PLACE} = {_TERM}|\(void\){_NAME})")
_SELECTION = re.compile(rf"(?:{_KIND} {_NAME}|{_PLACE}) = \({_OPERAND} < {_OPERAND}\) \? {_OPERAND} : {_OPERAND}")
_TILE = re.compile(r"for \(ptrdiff_t i = 0; i < \w+; i\+\+\) \{")
"""The loop over the configurations of a tile: all the control that there is around the statements of a batch kernel."""

_ARRAY = re.compile(r"(?:double|float) (?:sines|cosines)\[(\d+)\](?:\[\w+\])?;")
_PAIRS = re.compile(
    rf"for \(int k = 0; k < (?P<turns>\d+); k\+\+\) \{{\s*(?P<tile>{_TILE.pattern}\s*)?"
    rf"const (?:double|float) angle = {_PLACE};\s*"
    rf"(?P<pair>{_NAME})\(angle, &sines\[k\](?:\[i\])?, &cosines\[k\](?:\[i\])?\);\s*\}}(?(tile)\s*\}})"
)
"""The loop over the sines and cosines of a long chain: one call, and as many turns as its arrays have places."""

_HINT = re.compile(r"#ifdef (\w+_APART)\s+\1\s+#endif")
"""What tells a compiler before that loop that the rows of a result lie apart."""


def require_straight(
    robot: Robot, files: Mapping[str, str], quantities: Sequence[Quantity], reals: Sequence[str]
) -> None:
    """Read the kernels of a package as text.

    Args:
        robot: The robot.
        files: Emitted text by file name.
        quantities: The quantities of which a kernel was emitted.
        reals: The number types.

    Raises:
        ProofError: Naming the file and the statement.
    """
    for real in reals:
        stem = prefix(robot.name, real)
        allowed = {
            sincos_macro(robot.name, real),
            *(f"{stem}_{name}" for name in ("sincos", "sqrt", "atan2", "select_lt")),
        }
        for batch in (False, True):
            name = c_file(robot.name, "c", real, batch=batch)
            text = _COMMENT.sub(" ", files[name])
            parts = ("_tile", "_from_params") if batch else ("",)
            heads = [f"{function(robot.name, each.function, real)}{part}" for each in quantities for part in parts]
            for head in (*heads, f"{stem}_sincos"):
                wrong = next(_crooked(_body(text, head), allowed), None)
                if wrong is not None:
                    raise ProofError(f"{robot.name}: {name}: {head} is not straight: '{wrong}'; nothing was written")
    wrong = next(_crooked_formulas(files["_numpy.py"], {quantity.function for quantity in quantities}), None)
    if wrong is not None:
        raise ProofError(f"{robot.name}: _numpy.py: {wrong}; nothing was written")


def _body(text: str, head: str) -> str:
    """What stands between the outer braces of a function; empty where there is none."""
    found = re.search(rf"^[^\n;#]*\b{head}\([^;{{]*\)\s*\{{", text, re.MULTILINE)
    if found is None:
        return ""
    depth, start = 1, found.end()
    for brace in _BRACE.finditer(text, start):
        depth += 1 if brace[0] == "{" else -1
        if depth == 0:
            return text[start : brace.start()]
    return text[start:]


def _crooked(body: str, allowed: set[str]) -> Iterator[str]:
    """The statements of a body that are neither sums and products, nor calls of the functions that kernels have."""
    loop = _PAIRS.search(body)
    angles = ""
    if loop and loop["pair"] in allowed and {*_ARRAY.findall(body[: loop.start()])} == {loop["turns"]}:
        angles, body = _within_tile(_ARRAY.sub("", body[: loop.start()])), body[loop.end() :]
    inner = angles + _within_tile(_HINT.sub("", body, count=1))
    for statement in inner.split(";"):
        text = " ".join(statement.split())
        called = _CALL.fullmatch(text.partition(" = ")[2] or text)
        if not text or _STRAIGHT.fullmatch(text) or _SELECTION.fullmatch(text) or (called and called[1] in allowed):
            continue
        yield text


def _within_tile(text: str) -> str:
    """The statements in the loop over a tile, or all where there is none."""
    inner = _TILE.sub("", text, count=1)
    return inner.rstrip().removesuffix("}") if inner != text else text


_PARTS = "Name Constant BinOp UnaryOp Subscript Attribute Call Tuple Load Store Del Add Sub Mult Div USub Assign Return"
_ALLOWED = tuple(getattr(ast, name) for name in [*_PARTS.split(), "Delete", "Pass", "Compare", "Lt", "Gt"])
_CALLS = ("_sincos", "_atan2", "_sqrt", "np.where", "params._make", "map")
_NAMED = rf"(?:-?{_NAME}(?:\[\d+\])?|-?{_NUMBER}|\(-{_NUMBER}\))"
_SUM = re.compile(rf"^    {_NAME} = {_NAMED}(?: [-+*/] {_NAMED})?$", re.MULTILINE)
"""A statement of a function that is plainly straight, as most of a long form are: these need no parser."""


def _crooked_formulas(text: str, names: set[str]) -> Iterator[str]:
    """What the functions of the NumPy form have besides assignments of sums, products and calls."""
    for node in ast.parse(_SUM.sub("    pass", text)).body:
        if isinstance(node, ast.FunctionDef) and node.name in names:
            for statement in node.body[1:]:
                for part in ast.walk(statement):
                    if not isinstance(part, _ALLOWED) or (isinstance(part, ast.Call) and not _is_known(part)):
                        yield f"{node.name} is not straight: '{ast.unparse(part)}'"


def _is_known(call: ast.Call) -> bool:
    """Whether it is a function of kernels, or makes a constant of the type of another number."""
    name = ast.unparse(call.func)
    return name in _CALLS or name.endswith(".dtype.type")
