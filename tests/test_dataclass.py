"""Classes of `support/dataclass.py` are those of the standard library; their methods are compiled at the first call."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import math
import pickle
from collections.abc import Callable
from dataclasses import field
from typing import Any, Generic, TypeVar

import pytest

import kinegen.support.dataclass

Kind = TypeVar("Kind")

SHAPES = [{"frozen": True, "slots": True}, {"frozen": True}, {"slots": True}, {}, {"frozen": True, "eq": False}]


def pair(**options: bool) -> tuple[type, type]:
    """The same class by kinegen and by the standard library."""
    return tuple(make(decorate(**options)) for decorate in (kinegen.support.dataclass.dataclass, dataclasses.dataclass))  # type: ignore[return-value]


def make(decorated: Callable[[type], type]) -> type:
    """A class with every kind of field that kinegen uses."""

    @decorated
    class Sample:
        """A sample."""

        a: float
        b: str = "b"
        _c: list[int] = field(default_factory=list)
        d: int = field(default=4, compare=False)
        e: int = field(default=5, repr=False)
        f: int = field(default=6, init=False)

    return Sample


@pytest.mark.parametrize("options", SHAPES, ids=str)
def test_objects_are_made_printed_compared_and_changed_as_by_the_standard_library(options: dict[str, bool]) -> None:
    ours, theirs = pair(**options)
    calls: list[Callable[[Any], Any]] = [
        lambda cls: repr(cls(1.0)),
        lambda cls: repr(cls(1, b="x", _c=[2])),
        lambda cls: cls(1) == cls(1),
        lambda cls: cls(1) == cls(2),
        lambda cls: cls(1, d=3) == cls(1),
        lambda cls: cls(1) == (1, "b", [], 4, 5, 6),
        lambda cls: cls(1) != cls(1),
        lambda cls: cls(math.nan) == cls(math.nan),
        lambda cls: cls.__hash__ is None,
        lambda cls: hash(cls(1, _c=())) == hash((1, "b", (), 5, 6)),
        lambda cls: cls(),
        lambda cls: cls(1, f=2),
        lambda cls: cls(1, g=2),
        lambda cls: cls(1)._c is cls(1)._c,
        lambda cls: setattr(cls(1), "a", 2),
        lambda cls: delattr(cls(1), "a"),
        lambda cls: dataclasses.replace(cls(1), a=3).a,
        lambda cls: dataclasses.asdict(cls(1)),
        lambda cls: copy.copy(cls(1, d=9)).d,
        lambda cls: copy.deepcopy(cls(1, _c=[[7]]))._c,
        lambda cls: cls.__match_args__,
        lambda cls: hasattr(cls(1), "__dict__"),
        lambda cls: cls.__doc__,
        lambda cls: [each.name for each in dataclasses.fields(cls)],
    ]

    for number, call in enumerate(calls):
        assert outcome(call, ours) == outcome(call, theirs), number
        assert outcome(call, ours) == outcome(call, theirs), number  # the methods have been compiled by now


def outcome(call: Callable[[Any], Any], cls: type) -> object:
    """The result of a call, or the kind of its error."""
    try:
        return call(cls)
    except (TypeError, AttributeError) as error:
        return type(error)


def test_a_frozen_object_takes_no_other_attribute_either() -> None:
    """The standard library's first versions raise a TypeError here that speaks of super()."""
    with pytest.raises(dataclasses.FrozenInstanceError, match="cannot assign to field 'z'"):
        Sent(1).z = 2  # type: ignore[attr-defined]


def test_methods_that_a_class_has_itself_stay() -> None:
    for decorate in (kinegen.support.dataclass.dataclass, dataclasses.dataclass):

        @decorate(frozen=True)
        class Own:
            a: int
            b: int = field(init=False)

            def __post_init__(self) -> None:
                object.__setattr__(self, "b", 2 * self.a)

            def __hash__(self) -> int:
                return 7

            def __repr__(self) -> str:
                return "own"

        assert (Own(2).b, hash(Own(2)), repr(Own(2)), Own(2) == Own(2)) == (4, 7, "own", True)


def test_classes_inherit() -> None:
    @kinegen.support.dataclass.dataclass(slots=True)
    class Base(Generic[Kind]):
        a: int

    @kinegen.support.dataclass.dataclass(slots=True)
    class Derived(Base[int]):
        b: int = 2

    class Plain(Base[int]):
        pass

    assert (Derived(1), Plain(3).a, Base(4) == Plain(4)) == (Derived(1, 2), 3, False)
    assert repr(Derived(1)).endswith("Derived(a=1, b=2)")


@kinegen.support.dataclass.dataclass(frozen=True, slots=True)
class Sent:
    """One at the top of a module, which can be pickled."""

    a: int
    b: str = "b"


def test_objects_are_pickled() -> None:
    sent = pickle.dumps(Sent(1))

    assert pickle.loads(sent) == Sent(1)  # noqa: S301 - made here


def test_nothing_is_compiled_before_it_is_called(monkeypatch: pytest.MonkeyPatch) -> None:
    compiled: list[str] = []
    execute = exec
    monkeypatch.setattr("builtins.exec", lambda text, *rest: (compiled.append(text), execute(text, *rest))[1])
    ours, theirs = make(kinegen.support.dataclass.dataclass(frozen=True)), make(dataclasses.dataclass(frozen=True))

    assert inspect.getmodule(ours) is inspect.getmodule(theirs)
    assert len(compiled) >= 1, "the standard library's"
    before = len(compiled)
    first = make(kinegen.support.dataclass.dataclass(frozen=True))
    assert len(compiled) == before
    assert first(1) != first(2)
    assert len(compiled) == before + 2
    assert first(1) != first(2)
    assert len(compiled) == before + 2


def _frozen() -> type:
    @kinegen.support.dataclass.dataclass(frozen=True)
    class Frozen:
        a: int

    return Frozen


def _refused() -> dict[str, Callable[[], type]]:
    """Classes that would silently get other methods than the standard library gives them, by a word of the message."""
    decorated = kinegen.support.dataclass.dataclass

    def keyword_only() -> type:
        return decorated(type("Own", (), {"__annotations__": {"a": int}, "a": field(kw_only=True)}))

    def sentinel() -> type:
        return decorated(type("Own", (), {"__annotations__": {"_": dataclasses.KW_ONLY, "a": int}}))

    def init_variable() -> type:
        return decorated(type("Own", (), {"__annotations__": {"a": dataclasses.InitVar[int]}}))

    def init_variable_in_words() -> type:
        body = {"__annotations__": {"a": "dataclasses.InitVar[int]"}, "__module__": __name__}
        return decorated(type("Own", (), body))

    def factory() -> type:
        body = {"__annotations__": {"a": list}, "a": field(default_factory=list, init=False)}
        return decorated(type("Own", (), body))

    def order() -> type:
        return decorated(type("Own", (), {"__annotations__": {"a": int, "b": int}, "a": 1}))

    def setter() -> type:
        return decorated(frozen=True)(type("Own", (), {"__annotations__": {"a": int}, "__setattr__": setattr}))

    def thawed() -> type:
        return decorated(type("Own", (_frozen(),), {"__annotations__": {"b": int}}))

    def frozen_late() -> type:
        base = decorated(type("Base", (), {"__annotations__": {"a": int}}))
        return decorated(frozen=True)(type("Own", (base,), {"__annotations__": {"b": int}}))

    made = (keyword_only, sentinel, init_variable, init_variable_in_words, factory, order, setter, thawed, frozen_late)
    return {each.__name__: each for each in made}


@pytest.mark.parametrize("name", _refused())
def test_what_is_not_offered_is_an_error_when_the_class_is_made(name: str) -> None:
    with pytest.raises(TypeError, match="Own"):
        _refused()[name]()


@pytest.mark.parametrize("option", ["kw_only", "order", "unsafe_hash", "init", "repr", "match_args", "weakref_slot"])
def test_options_that_are_not_offered_are_errors(option: str) -> None:
    with pytest.raises(TypeError, match=option):
        kinegen.support.dataclass.dataclass(**{option: True})(object)


def test_an_initialiser_of_its_own_is_kept() -> None:
    @kinegen.support.dataclass.dataclass
    class Own:
        a: int

        def __init__(self) -> None:
            self.a = 3

    assert Own().a == 3
