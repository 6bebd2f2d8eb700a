"""Calls that C takes without Python code around them, where the extension offers them. It needs nothing else.

A class in `KINDS` gets a subclass made in C; an object of that class answers plain calls there and leaves
all others to `__call__` of its base. Without such a class in C, objects work as before, but calls are slower.
"""

from __future__ import annotations

from typing import Any

_made: dict[tuple[type[Any], int], type[Any]] = {}
"""The classes made so far, by base and extension."""


def quick_class(base: type[Any], native: Any) -> type[Any]:
    """A class with the calls of `base`, plain ones taken by C; `base` itself where there is none.

    Args:
        base: A class of this package that says which `kind` of calls it has.
        native: What `load_native` gave.
    """
    make = getattr(native, "quick_class", None)
    if make is None or "kind" not in vars(base):
        return base  # also for classes that others derive: they may have a `__call__` of their own
    key = base, id(native)
    if key not in _made:
        made: Any = make(base) or base
        _made[key] = made
        if made is not base:
            for name in ("__name__", "__qualname__", "__module__", "__doc__"):
                setattr(made, name, getattr(base, name))
    return _made[key]


def quicken(kernel: Any, native: Any, structs: dict[Any, Any]) -> None:
    """Let C take the plain calls of a kernel.

    Args:
        kernel: An object of a class that `quick_class` made; others stay as they are.
        native: What `load_native` gave.
        structs: Its default parameters in C, by number type; they must live as long as the kernel.
    """
    if native is not None and any(type(kernel) is made is not base for (base, _), made in _made.items()):
        places = {real.itemsize: int(native.ffi.cast("uintptr_t", struct)) for real, struct in structs.items()}
        native.quicken(kernel, kernel.__name__, kernel.kind, places.get(8, 0), places.get(4, 0))
