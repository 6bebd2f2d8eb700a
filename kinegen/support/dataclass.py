"""`dataclass` as the standard library has it, but for the time that a class takes to make.

The standard library writes and compiles six methods for each class, before anyone asks for one of them. A command
imports a hundred such classes, and that was a third of its start. Here a method that reads the fields is compiled when
it is called for the first time, and then replaces what stands for it. Fields, `replace`, `asdict` and matching by
position are the standard library's own. What is not offered, such as keyword-only fields and `InitVar`, is a TypeError
when the class is made.
"""

from __future__ import annotations

import dataclasses
import sys
from reprlib import recursive_repr
from typing import TYPE_CHECKING, Any

__all__ = ["dataclass"]

if TYPE_CHECKING:
    from collections.abc import Callable
    from dataclasses import dataclass
else:

    def dataclass(cls: type | None = None, /, *, frozen: bool = False, slots: bool = False, eq: bool = True) -> Any:
        """Make a class a data class; frozen ones that are compared by their fields are hashed by them."""
        if cls is None:
            return lambda made: _made(made, frozen, slots, eq)
        return _made(cls, frozen, slots, eq)


def _made(cls: type, frozen: bool, slots: bool, eq: bool) -> type:
    if not cls.__doc__:
        cls.__doc__ = cls.__name__  # otherwise one is made from the signature, which takes long
    own = cls.__dict__
    hashed = eq and ("__hash__" not in own or (own["__hash__"] is None and "__eq__" in own))
    compared = eq and "__eq__" not in own
    keep = {name for name in ("__init__", "__repr__", "__getstate__", "__setstate__") if name in own}
    if frozen and not own.keys().isdisjoint(("__setattr__", "__delattr__")):
        raise TypeError(f"{cls.__qualname__} is frozen and has a __setattr__ or __delattr__ of its own")
    # The standard library finds the fields; its own methods are left out.
    cls = dataclasses.dataclass(init=False, repr=False, eq=False, slots=slots)(cls)
    _refuse_fields(cls)
    _refuse_bases(cls, frozen)
    # What stands for a method until it is called, and what reads the fields each time.
    methods: dict[str, Any] = {"__init__": _late(cls, "__init__", _init)}
    methods["__repr__"] = _repr
    if compared:
        methods["__eq__"] = _late(cls, "__eq__", _eq)
    if hashed:
        methods["__hash__"] = _late(cls, "__hash__", _hash) if frozen else None
    if frozen:
        methods |= {"__setattr__": _refuse_to_set, "__delattr__": _refuse_to_delete}
        methods |= {"__getstate__": _state, "__setstate__": _restore} if slots else {}
    for name, method in methods.items():
        if name not in keep:
            setattr(cls, name, method)
    return cls


def _refuse_fields(cls: Any) -> None:
    """Raise TypeError for fields that the methods below would treat as other ones."""
    before = ""
    for each in cls.__dataclass_fields__.values():
        kind = each._field_type.name  # noqa: SLF001 - nothing else tells an InitVar from a ClassVar
        if kind == "_FIELD_CLASSVAR":
            continue
        has_default = each.default is not dataclasses.MISSING or each.default_factory is not dataclasses.MISSING
        reason = "an InitVar" if kind == "_FIELD_INITVAR" else "keyword-only" if each.kw_only is True else ""
        if not each.init and each.default_factory is not dataclasses.MISSING:
            reason = "made by a default_factory, but not an argument"
        if before and each.init and not has_default:
            reason = f"without a default, after {before}, which has one"
        if reason:
            raise TypeError(f"{cls.__qualname__}.{each.name} is {reason}: kinegen.support.dataclass has no such fields")
        before = each.name if has_default and each.init else before


def _refuse_bases(cls: Any, frozen: bool) -> None:
    """Raise TypeError where a frozen class derives from one that is not, or the other way round."""
    for base in cls.__mro__[1:]:
        if "__dataclass_fields__" in base.__dict__:
            is_frozen = base.__setattr__ is _refuse_to_set or base.__dataclass_params__.frozen
            if is_frozen != frozen:
                raise TypeError(f"{cls.__qualname__} and {base.__qualname__} are not both frozen, or both not")


def _late(cls: type, name: str, write: Callable[[type], tuple[str, dict[str, Any]]]) -> Callable[..., Any]:
    """Return a method that compiles itself when it is called for the first time."""

    def method(self: Any, /, *arguments: Any, **named: Any) -> Any:
        text, known = write(cls)
        exec(text, known)  # noqa: S102 - names of fields, which Python has read as names
        found = known[name]
        found.__qualname__ = f"{cls.__qualname__}.{name}"
        setattr(cls, name, found)
        return found(self, *arguments, **named)

    method.__name__, method.__qualname__ = name, f"{cls.__qualname__}.{name}"
    return method


def _init(cls: type) -> tuple[str, dict[str, Any]]:
    """Write the initialiser: its text, and what the text names."""
    known: dict[str, Any] = {"_missing": dataclasses.MISSING, "_set": object.__setattr__}
    arguments, lines = ["self"], []
    frozen = getattr(cls, "__setattr__", None) is _refuse_to_set
    for field in dataclasses.fields(cls):
        name = field.name
        if not field.init and field.default is dataclasses.MISSING:
            continue  # set by __post_init__
        # A default is a name in the text, so that it is the same object at each call.
        value, argument = name, name
        if field.default is not dataclasses.MISSING:
            known[f"_default_{name}"] = field.default
            value, argument = (name, f"{name}=_default_{name}") if field.init else (f"_default_{name}", "")
        elif field.default_factory is not dataclasses.MISSING:
            known[f"_default_{name}"] = field.default_factory
            value, argument = f"_default_{name}() if {name} is _missing else {name}", f"{name}=_missing"
        arguments += [argument] if argument else []
        lines.append(f"_set(self, {name!r}, {value})" if frozen else f"self.{name} = {value}")
    lines += ["self.__post_init__()"] if hasattr(cls, "__post_init__") else []
    return f"def __init__({', '.join(arguments)}):\n " + "\n ".join(lines or ["pass"]), known


def _eq(cls: type) -> tuple[str, dict[str, Any]]:
    """Write equality with objects of its class, by fields; as tuples until Python 3.13, where NaN equals itself."""
    names = [each.name for each in dataclasses.fields(cls) if each.compare]
    if sys.version_info >= (3, 13):
        same = " and ".join(f"self.{name} == other.{name}" for name in names) or "True"
    else:
        same = " == ".join(_tuple_of(who, names) for who in _BOTH)
    return f"def __eq__(self, other):\n return ({same}) if other.__class__ is self.__class__ else {_NOT}", {}


_BOTH = ("self", "other")
_NOT = "NotImplemented"


def _hash(cls: type) -> tuple[str, dict[str, Any]]:
    """Write the hash of the fields that are compared."""
    names = [each.name for each in dataclasses.fields(cls) if (each.compare if each.hash is None else each.hash)]
    return f"def __hash__(self):\n return hash({_tuple_of('self', names)})", {}


def _tuple_of(who: str, names: list[str]) -> str:
    return f"({''.join(f'{who}.{name}, ' for name in names)})"


@recursive_repr()
def _repr(self: Any) -> str:
    shown = (f"{each.name}={getattr(self, each.name)!r}" for each in dataclasses.fields(self) if each.repr)
    return f"{self.__class__.__qualname__}({', '.join(shown)})"


def _refuse_to_set(self: Any, name: str, value: object) -> None:  # noqa: ARG001 - Python's signature
    raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")


def _refuse_to_delete(self: Any, name: str) -> None:  # noqa: ARG001
    raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")


def _state(self: Any) -> list[Any]:
    return [getattr(self, each.name) for each in dataclasses.fields(self)]


def _restore(self: Any, state: list[Any]) -> None:
    for each, value in zip(dataclasses.fields(self), state, strict=True):
        object.__setattr__(self, each.name, value)
