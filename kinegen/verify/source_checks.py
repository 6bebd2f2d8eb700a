"""What the text of C kernels shows: statements without a question about data, and arrays of constant size.

Why it matters: what is made of sums, products, sines and cosines alone is an analytic function. It cannot be right at
twenty thousand random points and wrong in a strip between them, so that comparisons at points say something of all
points. (Roots, arc tangents and the selections of orientations and linkages are compared at points alone.) Headers
promise it as well: no loop, and no branch on data.

Every size in brackets is read, wherever it stands, with the enumerators and macros of its file.
"""

from __future__ import annotations

import ast
import math
import operator
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

from kinegen.errors import ProofError
from kinegen.model.outputs import Quantity
from kinegen.model.robot import Robot
from kinegen.support.naming import c_file, function, prefix, sincos_macro

MOST = 1 << 15
"""Entries of an array, those of a tile not counted; the largest kernels have some thousand numbers."""

_TILE = "TILE"
COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)
_MACRO = re.compile(r"^#define (\w+) ([^\n]+)$", re.MULTILINE)
_ENUMERATION = re.compile(r"\benum\b[^{};]*\{([^}]*)\}")
_ENUMERATOR = re.compile(r"(\w+)\s*=\s*([^,]+)")
_SIZES = re.compile(r"\b(\w+)((?:\s*\[[^\[\]]*\])+)")
_DECLARED = re.compile(r"\b(?:double|float|int|char|unsigned|long|short|\w+_t)\s+(\w+)((?:\s*\[[^\[\]]+\])+)\s*[;,=]")
_KEPT = re.compile(r"^[ \t]*static (?!const\b|inline\b)[^()\n;]*\b(\w+)(?:\[[^\]\n]*\])*(?: = [^;\n]*)?;", re.MULTILINE)
_GLOBAL = re.compile(
    r"^(?!static |typedef |return |extern |enum |struct )(?:\w+ )+\*?(\w+)(?:\[[^\]\n]*\])*(?: = [^;()\n]*)?;",
    re.MULTILINE,
)
_GROWING = re.compile(r"\b\w*(?:alloca|malloc)\s*\(")

_OPERATIONS: Mapping[type[ast.operator], Callable[[int, int], int]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.FloorDiv: operator.floordiv,
    ast.LShift: operator.lshift,
}
_LARGEST_SHIFT = 62


def require_little_stack(robot: Robot, folder: Path, names: Sequence[str]) -> None:
    """Refuse C files with arrays that no stack holds, and with variables that outlive a call.

    Raises `ProofError` naming the file and the array or variable.
    """
    shared = constants("\n".join(path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.h"))))
    for name in names:
        found = too_large((folder / name).read_text(encoding="utf-8"), shared)
        if found:
            raise ProofError(f"{robot.name}: {name}: {found}; nothing was written")


def too_large(text: str, shared: Mapping[str, int]) -> str:
    """Look for what is too large in a C file.

    `shared`: the constants of the headers that it reads. Returns the end of a sentence; empty where nothing is.
    """
    code = COMMENT.sub(" ", text).replace("[restrict ", "[")
    if found := _GROWING.search(code):
        return f"it takes memory by {found[0].rstrip('(').strip()}"
    if found := _KEPT.search(code) or _GLOBAL.search(code):
        return f"{found[1]} outlives a call, and functions have no state"
    names = constants(code, shared)
    for name, brackets in _SIZES.findall(code):
        entries = entries_of(brackets, names)
        if entries is not None and entries > MOST:
            return f"{name} has {entries:,} entries on the stack"
    for name, brackets in _DECLARED.findall(code):
        if entries_of(brackets, names) is None:
            return f"no constant says how many entries {name}{brackets} has on the stack"
    return ""


def constants(text: str, shared: Mapping[str, int] | None = None) -> dict[str, int]:
    """Enumerators and macros that are whole numbers, each as large as any place gives it.

    `shared`: others that it may use.
    """
    code = COMMENT.sub(" ", text)
    listed = [pair for body in _ENUMERATION.findall(code) for pair in _ENUMERATOR.findall(body)]
    names = dict(shared or {})
    for _ in range(2):  # one may be computed from another that stands further below
        for name, meaning in (*_MACRO.findall(code), *listed):
            found = _number(meaning, names)
            if found is not None:
                names[name] = max(found, names.get(name, found))
    return {**names, _TILE: 1}


def entries_of(brackets: str, names: Mapping[str, int]) -> int | None:
    """Returns the product of sizes in brackets, such as `[ARM_DOF][16]`; None where one is no constant."""
    sizes = [_number(size, names) for size in re.findall(r"\[([^\[\]]*)\]", brackets)]
    return None if None in sizes else math.prod(size for size in sizes if size is not None)


def _number(text: str, names: Mapping[str, int]) -> int | None:
    """Returns the value of a constant expression of C in whole numbers; None for anything else."""
    if text.isdecimal():
        return int(text)
    plain = re.sub(r"\b(\d+|0[xX][0-9a-fA-F]+)[uUlL]+\b", r"\1", re.sub(r"\((?:int|size_t|ptrdiff_t)\)", "", text))
    try:
        return _value(ast.parse(plain.strip().replace("/", "//"), mode="eval").body, names)
    except (SyntaxError, ValueError, ZeroDivisionError, RecursionError):
        return None


def _value(node: ast.expr, names: Mapping[str, int]) -> int:
    match node:
        case ast.Constant(value=int(value)):
            return value
        case ast.Name(id=name) if name in names:
            return names[name]
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_value(operand, names)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATIONS:
            first, second = _value(left, names), _value(right, names)
            if isinstance(op, ast.LShift) and not 0 <= second <= _LARGEST_SHIFT:
                raise ValueError
            return _OPERATIONS[type(op)](first, second)
    raise ValueError


_BRACE = re.compile(r"[{}]")
_NAME = r"[A-Za-z_]\w*"
_PLACE = rf"{_NAME}(?:->{_NAME})?(?:\[[^\]=?<>&|]*\])*"
_NUMBER = r"\d[\d.]*(?:[eE][-+]?\d+)?F?"
_OPERAND = rf"(?:-?{_PLACE}|-?{_NUMBER}|\(-{_NUMBER}\))"
_TERM = rf"(?:{_OPERAND}|{_OPERAND} [-+*/] {_OPERAND})"
_KIND = r"(?:const )?(?:double|float)"
_CALL = re.compile(rf"({_NAME})\((?:&?{_OPERAND}(?:, )?)*\)")
_STRAIGHT = re.compile(rf"(?:{_KIND} {_NAME}(?: = {_TERM})?|\*?{_PLACE} = {_TERM}|\(void\){_NAME})")
_SELECTION = re.compile(rf"(?:{_KIND} {_NAME}|{_PLACE}) = \({_OPERAND} < {_OPERAND}\) \? {_OPERAND} : {_OPERAND}")
_TILE_LOOP = re.compile(r"for \(ptrdiff_t i = 0; i < \w+; i\+\+\) \{")
"""The loop over the configurations of a tile: all the control that there is around the statements of a batch kernel."""

_ARRAY = re.compile(r"(?:double|float) (?:sines|cosines)\[(\d+)\](?:\[\w+\])?;")
_PAIRS = re.compile(
    rf"for \(int k = 0; k < (?P<turns>\d+); k\+\+\) \{{\s*(?P<tile>{_TILE_LOOP.pattern}\s*)?"
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

    `quantities`: the quantities of which a kernel was emitted. Raises `ProofError` naming the file and the statement.
    """
    for real in reals:
        stem = prefix(robot.name, real)
        allowed = {
            sincos_macro(robot.name, real),
            *(f"{stem}_{name}" for name in ("sincos", "sqrt", "atan2", "select_lt")),
        }
        for batch in (False, True):
            name = c_file(robot.name, "c", real, batch=batch)
            text = COMMENT.sub(" ", files[name])
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
    """Returns what stands between the outer braces of a function; empty where there is none."""
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
    """Returns the statements in the loop over a tile, or all where there is none."""
    inner = _TILE_LOOP.sub("", text, count=1)
    return inner.rstrip().removesuffix("}") if inner != text else text


_PARTS = "Name Constant BinOp UnaryOp Subscript Attribute Call Tuple Load Store Del Add Sub Mult Div USub Assign Return"
_ALLOWED = tuple(getattr(ast, name) for name in [*_PARTS.split(), "Delete", "Pass", "Compare", "Lt", "Gt"])
_CALLS = ("_sincos", "_atan2", "_sqrt", "np.where", "params._make", "map")
_NAMED = rf"(?:-?{_NAME}(?:\[\d+\])?|-?{_NUMBER}|\(-{_NUMBER}\))"
_SUM = re.compile(rf"^    {_NAME} = {_NAMED}(?: [-+*/] {_NAMED})?$", re.MULTILINE)
"""A statement of a function that is plainly straight, as most of a long form are: these need no parser."""


def _crooked_formulas(text: str, names: set[str]) -> Iterator[str]:
    """Yields what the functions of the NumPy form have besides assignments of sums, products and calls."""
    for node in ast.parse(_SUM.sub("    pass", text)).body:
        if isinstance(node, ast.FunctionDef) and node.name in names:
            for statement in node.body[1:]:
                for part in ast.walk(statement):
                    if not isinstance(part, _ALLOWED) or (isinstance(part, ast.Call) and not _is_known(part)):
                        yield f"{node.name} is not straight: '{ast.unparse(part)}'"


def _is_known(call: ast.Call) -> bool:
    """Returns whether it is a function of kernels, or makes a constant of the type of another number."""
    name = ast.unparse(call.func)
    return name in _CALLS or name.endswith(".dtype.type")
