"""The text of an expression -> plain data, by a walk over its syntax tree; nothing of it is run by Python.

In: one expression of a stranger, and a scope of names. Out: plain data as `values` defines it, of bounded size, after a
bounded number of steps. An attribute is a key of a dictionary, a name of a namespace or a method from the list in
`functions`; every other one is refused, as is each kind of syntax that has no method here.
"""

from __future__ import annotations

import ast
import re
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, ClassVar, Protocol

from kinegen.io.xacro.functions import METHODS
from kinegen.io.xacro.values import (
    BINARY,
    COMPARISONS,
    UNARY,
    ExpressionError,
    Function,
    Work,
    elements,
    formatted,
    is_namespace,
    refuse,
    size,
)

MAX_LENGTH = 10_000
_DEEPEST = 60
_FAILURES = (ArithmeticError, LookupError, TypeError, ValueError, AttributeError, re.error)
"""What plain data raises where an operation does not fit it."""

_WORDS = {"Lambda": "'lambda'", "NamedExpr": "':='", "MatMult": "'@'", "Starred": "'*'"}


class Scope(Protocol):
    """Names and what they stand for: plain data, functions and namespaces."""

    def __contains__(self, name: object, /) -> bool:
        """Tell whether there is such a name."""

    def __getitem__(self, name: str, /) -> Any:
        """Return what a name stands for."""


def evaluate(text: str, scope: Scope) -> Any:
    """Compute an expression in the syntax of Python to plain data, with the names of a scope.

    Raises:
        ExpressionError: If it is not an expression, does what is not allowed, or fails.
        Exception: Whatever the scope raises while it looks a name up.
    """
    if len(text) > MAX_LENGTH:
        raise ExpressionError("an expression is too long")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError) as error:
        raise ExpressionError(f"{getattr(error, 'msg', error)} in an expression") from None
    except (MemoryError, RecursionError):
        raise ExpressionError("an expression is nested too deeply") from None
    return _Walk(scope).result(tree.body)


class _Walk:
    """One evaluation: the names of its comprehensions, the work that is left, how deep it is."""

    def __init__(self, scope: Scope) -> None:
        self.scope = scope
        self.names: dict[str, Any] = {}
        self.work = Work()
        self.depth = 0

    def result(self, node: ast.expr) -> Any:
        """Compute the whole, with every failure of plain data as an `ExpressionError`."""
        try:
            return self.value(node)
        except _FAILURES as error:
            # Keys print themselves in quotation marks.
            reason = f"there is no {error}" if isinstance(error, KeyError) else str(error) or type(error).__name__
            raise ExpressionError(reason) from None

    def value(self, node: ast.expr) -> Any:
        """Compute a part that has to be plain data."""
        return self._data(self.anything(node), node)

    def anything(self, node: ast.expr) -> Any:
        """Compute a part that may be a function or a namespace."""
        self.work.spend(1)
        method = self.nodes.get(type(node))
        if method is None:
            name = type(node).__name__
            refuse(_WORDS.get(name, name.lower()))
        self.depth += 1
        if self.depth > _DEEPEST:
            raise ExpressionError("an expression is nested too deeply")
        try:
            return method(self, node)
        finally:
            self.depth -= 1

    def _known(self, value: Any) -> Any:
        """Take what a scope holds: a collection has been made by an expression, or was read within the same bounds."""
        if isinstance(value, Function) or is_namespace(value) or type(value) in (list, tuple, dict, set):
            return value
        size(value)
        return value

    def _constant(self, node: ast.Constant) -> Any:
        return self.work.made(node.value)

    def _name(self, node: ast.Name) -> Any:
        if node.id in self.names:
            return self.names[node.id]
        return self._looked_up(self.scope, node.id)

    def _looked_up(self, scope: Scope, name: str) -> Any:
        if name not in scope:
            raise ExpressionError(f"name '{name}' is not defined")
        return self._known(scope[name])

    def _unary(self, node: ast.UnaryOp) -> Any:
        return self.work.made(UNARY[type(node.op)](self.value(node.operand)))

    def _binary(self, node: ast.BinOp) -> Any:
        # A long sum is a row of operations, not a deep one.
        row = [node]
        while isinstance(row[-1].left, ast.BinOp):
            row.append(row[-1].left)
        found = self.value(row[-1].left)
        for each in reversed(row):
            word = type(each.op).__name__
            operation = BINARY.get(type(each.op)) or refuse(_WORDS.get(word, word))
            self.work.spend(1)
            found = self.work.made(operation(found, self.value(each.right)))
        return found

    def _logic(self, node: ast.BoolOp) -> Any:
        stop = isinstance(node.op, ast.Or)
        for each in node.values[:-1]:
            found = self.value(each)
            if bool(found) is stop:
                return found
        return self.value(node.values[-1])

    def _comparison(self, node: ast.Compare) -> Any:
        left, found = self.value(node.left), True
        for operation, each in zip(node.ops, node.comparators, strict=True):
            right = self.value(each)
            self.work.made(right)
            found = COMPARISONS[type(operation)](left, right)
            if not found:
                return found
            left = right
        return found

    def _choice(self, node: ast.IfExp) -> Any:
        return self.value(node.body if self.value(node.test) else node.orelse)

    def _list(self, node: ast.List) -> Any:
        return self.work.made(self._several(node.elts))

    def _tuple(self, node: ast.Tuple) -> Any:
        return self.work.made(tuple(self._several(node.elts)))

    def _set(self, node: ast.Set) -> Any:
        return self.work.made(set(self._several(node.elts)))

    def _dict(self, node: ast.Dict) -> Any:
        found: dict[Any, Any] = {}
        for key, each in zip(node.keys, node.values, strict=True):
            found |= self._mapping(each) if key is None else {self.value(key): self.value(each)}
        return self.work.made(found)

    def _several(self, nodes: Sequence[ast.expr], *, functions: bool = False) -> list[Any]:
        found: list[Any] = []
        for node in nodes:
            if isinstance(node, ast.Starred):
                found.extend(self.work.passed_over(self.value(node.value)))
            else:
                found.append(self._argument(node, functions=functions))
        return found

    def _mapping(self, node: ast.expr) -> dict[Any, Any]:
        found = self.value(node)
        self.work.passed_over(found)
        return found if type(found) is dict else refuse("'**' before what is not a dictionary")

    def _data(self, found: Any, node: ast.expr) -> Any:
        if isinstance(found, Function) or is_namespace(found):
            refuse(f"a function or namespace as a value ({_shown(node)})")
        return found

    def _argument(self, node: ast.expr, *, functions: bool) -> Any:
        found = self.anything(node)
        return found if functions and isinstance(found, Function) else self._data(found, node)

    def _joined(self, node: ast.JoinedStr) -> Any:
        return self.work.made("".join(str(self.value(each)) for each in node.values))

    def _field(self, node: ast.FormattedValue) -> Any:
        conversion = chr(node.conversion) if node.conversion >= 0 else None
        specification = "" if node.format_spec is None else self.value(node.format_spec)
        return self.work.made(formatted(self.value(node.value), conversion, specification))

    def _element(self, node: ast.Subscript) -> Any:
        owner = self.anything(node.value)
        if is_namespace(owner):
            return self._looked_up(owner, str(self.value(node.slice)))
        if type(owner) not in (str, list, tuple, dict):
            raise ExpressionError(f"a value of type {type(owner).__name__} has no elements")
        if isinstance(node.slice, ast.Slice):
            bounds = (None if each is None else self.value(each) for each in _bounds(node.slice))
            return owner[slice(*bounds)]
        return owner[self.value(node.slice)]

    def _attribute(self, node: ast.Attribute, *, called: bool = False) -> Any:
        owner, name = self.anything(node.value), node.attr
        if is_namespace(owner):
            return self._looked_up(owner, name)
        method = METHODS.get(type(owner), {}).get(name)
        # A dictionary may have a key that is called as a method is.
        if type(owner) is dict and name in owner and not (called and method):
            return owner[name]
        if method is not None:
            self.work.weigh(owner)
            return Function(name, partial(method, owner))
        if type(owner) is dict and not name.startswith("_"):
            raise ExpressionError(f"there is no key '{name[:40]}'")
        return refuse(f"'{name[:40]}'")

    def _call(self, node: ast.Call) -> Any:
        called = node.func
        function = self._attribute(called, called=True) if isinstance(called, ast.Attribute) else self.anything(called)
        if not isinstance(function, Function):
            refuse(f"a call of {_shown(called)}")
        functions = function.takes_functions
        # The types of `isinstance(value, (int, float))` are functions, of which there are no tuples.
        kinds = node.args[1] if function.name == "isinstance" and len(node.args) == 2 else None
        nodes = [node.args[0], *kinds.elts] if isinstance(kinds, ast.Tuple) else node.args
        # Arguments are weighed before the call, results after it.
        values = self._several(nodes, functions=functions)
        named: dict[str, Any] = {}
        for each in node.keywords:
            if each.arg is None:
                named |= self._mapping(each.value)
            else:
                named[each.arg] = self._argument(each.value, functions=functions)
        for value in (*values, *named.values()):
            self.work.weigh(value)
        if not function.takes_sets:
            values = [elements(value) if type(value) is set else value for value in values]
        return self.work.made(function.call(*values, **named))

    def _loop(self, node: ast.ListComp | ast.GeneratorExp | ast.SetComp) -> Any:
        saved = dict(self.names)
        found = [self.value(node.elt) for _ in self._rounds(node.generators)]
        self.names = saved
        return self.work.made(found)

    def _set_loop(self, node: ast.SetComp) -> Any:
        return set(self._loop(node))

    def _dict_loop(self, node: ast.DictComp) -> Any:
        saved = dict(self.names)
        found = {self.value(node.key): self.value(node.value) for _ in self._rounds(node.generators)}
        self.names = saved
        return self.work.made(found)

    def _rounds(self, generators: Sequence[ast.comprehension]) -> Iterator[None]:
        """Go through the loops of a comprehension, with their names set."""
        if not generators:
            yield
            return
        first, *others = generators
        if first.is_async:
            refuse("async")
        for each in elements(self.value(first.iter)):
            self.work.spend(1)
            self._bind(first.target, each)
            if all(self.value(test) for test in first.ifs):
                yield from self._rounds(others)

    def _bind(self, target: ast.expr, value: Any) -> None:
        if isinstance(target, ast.Name):
            self.names[target.id] = value
            return
        if not isinstance(target, ast.Tuple | ast.List):
            refuse(f"a loop over {type(target).__name__.lower()}")
        parts = elements(value)
        if len(parts) != len(target.elts):
            raise ExpressionError(f"{len(target.elts)} names take {len(target.elts)} values, found {len(parts)}")
        for part, each in zip(target.elts, parts, strict=True):
            self._bind(part, each)

    nodes: ClassVar[Mapping[type[ast.expr], Callable[[_Walk, Any], Any]]] = {
        ast.Attribute: _attribute,
        ast.BinOp: _binary,
        ast.BoolOp: _logic,
        ast.Call: _call,
        ast.Compare: _comparison,
        ast.Constant: _constant,
        ast.Dict: _dict,
        ast.DictComp: _dict_loop,
        ast.FormattedValue: _field,
        ast.GeneratorExp: _loop,
        ast.IfExp: _choice,
        ast.JoinedStr: _joined,
        ast.List: _list,
        ast.ListComp: _loop,
        ast.Name: _name,
        ast.Set: _set,
        ast.SetComp: _set_loop,
        ast.Subscript: _element,
        ast.Tuple: _tuple,
        ast.UnaryOp: _unary,
    }
    """What is done for each kind of syntax; there is no other."""


def _shown(node: ast.expr) -> str:
    try:
        return ast.unparse(node)[:40]
    except RecursionError:
        return type(node).__name__


def _bounds(node: ast.Slice) -> tuple[ast.expr | None, ...]:
    return node.lower, node.upper, node.step
