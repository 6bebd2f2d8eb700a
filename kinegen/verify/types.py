"""The types of a package against the package: the same public names, and for each kernel the arguments that it has."""

from __future__ import annotations

import ast
import inspect
from pathlib import Path
from types import ModuleType

from kinegen.emit.python.stub import STUB
from kinegen.errors import ProofError
from kinegen.robot.model import Robot


def require_types(robot: Robot, package: ModuleType, folder: Path) -> None:
    """Compare the stub of a package with the package.

    Args:
        robot: The robot.
        package: Its generated package, imported.
        folder: Where its files lie.

    Raises:
        ProofError: Naming what differs.
    """
    try:
        tree = ast.parse((folder / STUB).read_text(encoding="utf-8"))
    except (OSError, SyntaxError) as error:
        raise ProofError(f"{robot.name}: {STUB} cannot be read: {error}; nothing was written") from None
    classes = {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}
    declared = [node for node in tree.body if isinstance(node, ast.AnnAssign)]
    types = {ast.unparse(node.target): ast.unparse(node.annotation) for node in declared}
    lists = [ast.literal_eval(node.value) for node in tree.body if isinstance(node, ast.Assign)]
    exported = lists[0] if lists else None
    if exported != package.__all__:
        raise ProofError(f"{robot.name}: {STUB} has other names than the module; nothing was written")
    for name in package.__all__:
        kernel = getattr(package, name)
        if not hasattr(kernel, "inputs"):
            continue
        found = _arguments(classes.get(types.get(name, "")))
        wanted = list(inspect.signature(kernel).parameters)
        if found != wanted:
            reason = f"{STUB} has the arguments {', '.join(found)} for {name}, expected {', '.join(wanted)}"
            raise ProofError(f"{robot.name}: {reason}; nothing was written")


def _arguments(kernel: ast.ClassDef | None) -> list[str]:
    """The arguments of a call by the type of a kernel."""
    for node in kernel.body if kernel else ():
        if isinstance(node, ast.FunctionDef) and node.name == "__call__":
            given = node.args
            return [each.arg for each in (*given.posonlyargs, *given.args, *given.kwonlyargs) if each.arg != "self"]
    return []
