"""The arguments of each kernel by their own names: for `help`, for `inspect.signature`, and in calls by name.

Nothing here is part of a plain call: C takes it before, and what is shown is made when somebody looks.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import inspect

_WORDS = {
    "params": "Values of the runtime parameters, a `Params`; each a number or an array that broadcasts with the batch.",
    "out": "{array} for the result, of {its} exact shape and type.",
    "threads": "Number of threads that share a batch; 0 for all cores.",
    "layout": "{layouts}",
    "nearest": "A joint vector, or one for each target: the valid solution nearest to it is returned.",
    "q0": "Another name of `nearest`.",
    "check": "Whether to see that targets are poses.",
}
_MATRICES = '"4x4", "3x4" without the last row, or "joint_major" with one row for each number.'
_NUMBERS = '"4x4", or "joint_major" with one row for each number.'


class OwnSignature:
    """Gives `inspect.signature` the arguments of a kernel; its class has those of any class."""

    def __get__(self, kernel: Any, owner: type[Any]) -> inspect.Signature:
        if kernel is None:
            raise AttributeError("__signature__")
        from inspect import Parameter, Signature

        given = [Parameter(each.name, Parameter.POSITIONAL_OR_KEYWORD) for each in kernel.inputs]
        options = [Parameter(name, Parameter.KEYWORD_ONLY, default=value) for name, value in options_of(kernel)]
        return Signature([*given, *options])


def options_of(kernel: Any) -> tuple[tuple[str, Any], ...]:
    """The named arguments of a kernel with what they are by default; `params` only where there are parameters."""
    return (*((("params", None),) if kernel._params is not None else ()), *kernel.options)  # noqa: SLF001 - its own file


def described(kernel: Any, text: str) -> str:
    """The docstring of a kernel: how it is called, what it computes, and what its arguments are.

    Args:
        kernel: A kernel whose inputs, results and parameters are known.
        text: What it computes.
    """
    options = options_of(kernel)
    several = len(kernel.results) > 1
    words = {
        "array": f"Tuple of {len(kernel.results)} arrays" if several else "Array",
        "its": "their" if several else "its",
        "layouts": _MATRICES if any(each.is_pose for each in kernel.results) else _NUMBERS,
    }
    names = [each.name for each in kernel.inputs]
    call = ", ".join([*names, "*", *(f"{name}={_shown(value)}" for name, value in options)])
    # What templates indent, since it is in the text of a module.
    plain = text.replace("\n    ", "\n").strip()
    lines = [f"    {each.name}: Shape ({', '.join(['...', *map(str, each.shape)])})." for each in kernel.inputs]
    lines += [f"    {name}: {_WORDS[name].format(**words)}" for name, _ in options]
    head = f"{kernel.__name__}({call})"
    return "\n".join([head, "", plain, "", "Args:", *lines, ""])


def by_place(kernel: Any, inputs: tuple[Any, ...], named: Mapping[str, Any]) -> tuple[Any, ...]:
    """The inputs of a call in order, some of them given by name.

    Args:
        kernel: The kernel.
        inputs: Those given by place.
        named: The others by name.

    Raises:
        TypeError: If there is no such input, or it is given twice or is missing.
    """
    names = [each.name for each in kernel.inputs]
    for name in named:
        if name not in names:
            known = ", ".join([*names, *(option for option, _ in options_of(kernel))])
            raise TypeError(f"{kernel.__name__} has no argument {name!r} (there are {known})")
        if name in names[: len(inputs)]:
            raise TypeError(f"{kernel.__name__}: {name} is given twice")
    missing = [name for name in names[len(inputs) :] if name not in named]
    if missing:
        raise TypeError(f"{kernel.__name__}: {missing[0]} is missing")
    return (*inputs, *(named[name] for name in names[len(inputs) :]))


def _shown(value: Any) -> str:
    return f'"{value}"' if isinstance(value, str) else repr(value)
