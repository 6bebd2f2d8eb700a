"""Random expressions of Python's whole grammar, thrown at the evaluator of xacro in a process that watches itself.

    python -m tests.formats.expressions COUNT SEED

prints how many gave data, how many were refused, and what must never happen: another exception, a value that is not
plain data, or an event that Python reports to an audit hook (a file, an import, a process, a socket).
"""

from __future__ import annotations

import json
import random
import sys
from collections import Counter
from pathlib import Path
from typing import Any

from kinegen.io.xacro import sandbox
from kinegen.io.xacro.evaluate import evaluate
from kinegen.io.xacro.files import Arguments, Files, MissingPackageError, RefusedError, symbols
from kinegen.io.xacro.values import ExpressionError

DEEPEST = 5
NAMES = (
    "x y cfg words pi math python xacro list dict map len str float int bool min max round sorted range sqrt sin atan2 "
    "type open format vars eval exec compile globals getattr __import__ __builtins__ object self print i j k"
).split()
ATTRIBUTES = (
    "lower upper split join strip replace format format_map get keys values items index count copy append pop update "
    "limits joint sqrt load_yaml arg tokenize fatal warning dotify set zip isinstance filter abs sum enumerate "
    "__class__ __base__ __subclasses__ __globals__ __mro__ __dict__ __init__ __getattribute__ __reduce__ gi_frame "
    "f_back f_globals f_builtins cr_frame ag_frame tb_frame gi_yieldfrom gi_code func __code__ __self__ real mro "
    "parent root depth top unevaluated path environ modules os encode maketrans translate zfill center ljust"
).split()
TEXTS = (
    "'a'",
    "''",
    "'{0.__class__}'",
    "'{}'",
    "'%s'",
    "'%*d'",
    "'a b,c'",
    "'/etc/passwd'",
    "'os'",
    "'joint'",
    "'\\ud800'",
)
NUMBERS = ("0", "1", "-1", "2", "3.5", "1e308", "10**9", "1j", "0x10", "True", "False", "None", "...", "b'x'", "9" * 40)
BINARY = (
    "+ - * / // % ** << >> | & ^ @".split(),
    [*"== != < <= > >= in is".split(), "not in", "is not"],
    ["and", "or"],
)


class Grammar:
    """Makes expressions from a seed."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)

    def text(self) -> str:
        """One expression; some are not in the language."""
        found = self.part(0)
        if self.random.random() < 0.08:
            place = self.random.randrange(len(found) + 1)
            found = found[:place] + self.random.choice("()[]{}.,:=*'\"\\@ \n\t#\0é`$;!~lambda") + found[place:]
        return found

    def part(self, depth: int) -> str:
        """A part of one."""
        if depth >= DEEPEST or self.random.random() < 0.2:
            return self.random.choice(self.random.choice((NAMES, TEXTS, NUMBERS, NAMES)))
        make = self.random.choice(
            (
                self.operation,
                self.operation,
                self.call,
                self.call,
                self.attribute,
                self.attribute,
                self.element,
                self.collection,
                self.loop,
                self.loop,
                self.choice,
                self.rare,
            )
        )
        return make(depth + 1)

    def parts(self, depth: int, most: int = 3) -> list[str]:
        """Several parts."""
        return [self.part(depth) for _ in range(self.random.randrange(most + 1))]

    def operation(self, depth: int) -> str:
        """Operators of all kinds."""
        if self.random.random() < 0.15:
            return f"({self.random.choice(('-', '+', '~', 'not '))}{self.part(depth)})"
        words = self.random.choice(self.random.choice(BINARY))
        return f"({self.part(depth)} {words} {self.part(depth)})"

    def call(self, depth: int) -> str:
        """A call with all kinds of arguments."""
        stars = ("", "", "", "*")
        values = [self.random.choice(stars) + each for each in self.parts(depth)]
        if self.random.random() < 0.2:
            values.append(
                self.random.choice((f"key={self.part(depth)}", f"**{self.part(depth)}", f"sep={self.part(depth)}"))
            )
        called = self.random.choice(NAMES) if self.random.random() < 0.4 else self.attribute(depth)
        return f"{called}({', '.join(values)})"

    def attribute(self, depth: int) -> str:
        """An attribute, often one of those that lead out of a sandbox."""
        owner = self.random.choice(
            (self.random.choice(("python", "math", "xacro", "cfg", "''", "[]")), self.part(depth))
        )
        return f"({owner}).{self.random.choice(ATTRIBUTES)}"

    def element(self, depth: int) -> str:
        """An element, or a slice."""
        bounds = ":".join(self.random.choice(("", self.part(depth))) for _ in range(self.random.choice((1, 2, 3))))
        return f"({self.part(depth)})[{bounds or 0}]"

    def collection(self, depth: int) -> str:
        """A list, tuple, set or dictionary."""
        first, last = self.random.choice(("[]", "()", "{}"))
        if self.random.random() < 0.3:
            return "{" + ", ".join(f"{each}: {self.part(depth)}" for each in self.parts(depth)) + "}"
        return first + "".join(f"{each}, " for each in self.parts(depth)) + last

    def loop(self, depth: int) -> str:
        """A comprehension of any kind."""
        first, last = self.random.choice(("[]", "()", "{}"))
        target = self.random.choice(("i", "j", "i, j", "(i, (j, k))", "*i, j", "cfg.x", "cfg['x']"))
        rounds = f"for {target} in {self.part(depth)}"
        if self.random.random() < 0.4:
            rounds += f" if {self.part(depth)}"
        if self.random.random() < 0.3:
            rounds += f" for k in {self.part(depth)}"
        key = f"{self.part(depth)}: " if first == "{" and self.random.random() < 0.5 else ""
        return f"{first}{key}{self.part(depth)} {rounds}{last}"

    def choice(self, depth: int) -> str:
        """A conditional expression."""
        return f"({self.part(depth)} if {self.part(depth)} else {self.part(depth)})"

    def rare(self, depth: int) -> str:
        """What no robot needs."""
        inner = self.part(depth)
        return self.random.choice(
            (
                f"(lambda x=1, *a, **k: {inner})",
                f"(lambda: (yield {inner}))()",
                f"(z := {inner})",
                f"(await {inner})",
                f"(yield from {inner})",
                f"[i async for i in {inner}]",
                "f'{pi!r:>{x}}'",
                "f'{cfg.joint:.3f}{x!s}'",
                f"[*{inner}, *{inner}]",
                f"{{**{inner}}}",
                f"{inner}, {inner}",
                f"[g.gi_frame for g in [(i for i in [{inner}])]]",
                f"[{inner} for g in [[]] if not g.append(b.gi_frame.f_back for b in g)]",
            )
        )


def is_plain(value: object) -> bool:
    """Whether a value is data by exact types, all through."""
    kind = type(value)
    if kind is dict:
        return all(is_plain(key) and is_plain(each) for key, each in value.items())  # type: ignore[attr-defined]
    if kind in (list, tuple, set):
        return all(map(is_plain, value))  # type: ignore[call-overload]
    return kind in (int, float, str, bool, type(None))


def scope(folder: Path) -> dict[str, Any]:
    """The names of a file with a few properties; its files are read as in the real process."""
    # What the real process has loaded before it looks at a file.
    import unicodedata  # noqa: F401

    import xacro
    import yaml  # noqa: F401
    from xacro import substitution_args

    files = Files(folder / "arm.xacro", {}, 10_000)
    sandbox._replace_in(xacro, files.opened, files.matching)
    substitution_args._eval_find = files.find
    xacro.init_stacks(str(folder / "arm.xacro"))
    data = {"x": 3, "y": 0.5, "words": "a b c", "cfg": {"joint": {"limits": [1, 2]}, "type": "z"}, "type": "revolute"}
    return symbols(lambda name, values: values.get(name, "")) | data


def thrown(count: int, seed: int, folder: Path) -> dict[str, Any]:
    """Evaluate many expressions, and say what came out."""
    grammar, names, outcomes = Grammar(seed), scope(folder), Counter[str]()
    before, watching, escapes = repr(names["cfg"]), [False], []

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        # An abstract syntax tree is made by `compile`; whoever runs it raises `exec`.
        if watching[0] and event != "compile":
            escapes.append(f"{event} {arguments!r:.100}")

    sys.addaudithook(hook)
    for _ in range(count):
        text = grammar.text()
        in_eval = grammar.random.random() < 0.2
        watching[0] = True
        try:
            found = Arguments.evaluated(text, {"arg": {"k": "1"}}) if in_eval else evaluate(text, names)
            outcomes["data" if is_plain(found) else "escape"] += 1
            if not is_plain(found):
                escapes.append(f"{text} gave {type(found)}")
        except (ExpressionError, RefusedError, MissingPackageError):
            outcomes["refused"] += 1
        except BaseException as error:  # noqa: BLE001 - the claim is that there is no other one
            escapes.append(f"{text} raised {error!r}")
        watching[0] = False
    if repr(names["cfg"]) != before:
        escapes.append("a property was changed")
    return {"outcomes": outcomes, "escapes": escapes}


if __name__ == "__main__":
    print(json.dumps(thrown(int(sys.argv[1]), int(sys.argv[2]), Path.cwd())))
