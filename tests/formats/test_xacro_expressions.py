"""Expressions of xacro give what Python gives, on plain data alone; whatever else they try is refused."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import xacro

from kinegen.io.xacro.evaluate import evaluate
from kinegen.io.xacro.files import symbols
from kinegen.io.xacro.functions import METHODS
from kinegen.io.xacro.values import MAX_SIZE, ExpressionError
from tests.formats.expressions import is_plain

ROOT = Path(__file__).resolve().parents[2]
DATA: dict[str, Any] = {
    "name": "arm_",
    "type": "revolute",
    "format": "{:.2f}",
    "limits": [-1.5, 1.5],
    "fields": "{f}={sensor}",
}
NAMES = symbols(lambda name, values: values[name]) | DATA


def plain_xacro(text: str) -> Any:
    """What xacro itself makes of an expression."""
    return xacro.safe_eval(text, xacro.create_global_symbols() | DATA)


@pytest.mark.parametrize(
    "text",
    [
        "1 + 2*3 - 4/5 // 6 % 7 ** 2",
        "-pi/2 + radians(90) + math.atan2(1, 2) + sqrt(2)*tau",
        "(1 << 4 | 3) & ~2 ^ 5 >> 1",
        "+".join(["1"] * 300) + "-2*3",
        "dict(" + ", ".join(f"joint_{i}=[-{i}.25, {i}.25]" for i in range(100)) + ")",
        "[(-1)**10001, 1**100000, 0**9999, (-1)**-3, 2**-1, 2**0.5]",
        "1 < 2 <= 2 != 3 and not 0 or None",
        "name + type if type == 'revolute' else ''",
        "limits[0] + limits[-1]",
        "name[:-1] + name[::-1]",
        "[x*y for x in range(4) if x % 2 for y in limits]",
        "{k: v for k, v in python.zip('ab', limits)}",
        "[a + c for a, (b, c) in [(1, (2, 3))]]",
        "dict(a=1, **dict([('b', 2)]))",
        "[*limits, *'ab']",
        "max(limits) + min(3, 1) + max('a', 'ccc', key=len) * 0 if False else min([2, 1], key=str)",
        "sorted([3, 1, 2], reverse=True)",
        "list(map(float, '1 2 3'.split()))",
        "[python.abs(-1), python.sum([1, 2], 3), python.any([0, 1]), python.all([]), python.divmod(7, 2)]",
        "list(python.enumerate('ab', 1)) + list(python.reversed([1, 2]))",
        "list(python.filter(None, [0, 1, '']))",
        "python.isinstance(limits, list) and python.isinstance(1.0, (python.tuple, float))",
        "python.set('abc') - python.set('ab') == {'c'}",
        "', '.join(python.set(['x']))",
        "' a,b;c '.strip().replace('a', 'b').upper().split(';')",
        "name.startswith('arm') and name.endswith('_') and 'r' in name and 'x' not in name",
        "format.format(pi) + '{0}-{n:>4}-{0!r}'.format(1, n='x') + '{}{}{{}}'.format(1, None)",
        "' '.join([fields.format(f=k, sensor=v) for k, v in [('ff', 'pst')]])",
        "'%s_%03d %.2f %(x)s' % dict(x=1) if 0 else '%s_%03d %.2f%%' % (name, 7, pi)",
        "f'{pi:.3f}|{name!r:>10}|{1:{2}}'",
        "xacro.tokenize('a=b, c;d')",
        "xacro.tokenize('ff=pst', sep='=')",
        "len(limits) + int('12') + int(2.5) + round(2.567, 2) + len({1, 2})",
        "str(limits) + str(None) + str(bool('x')) + str({'a': (1,)})",
        "math.comb(5, 2) + math.factorial(5) + math.gcd(12, 18) + math.hypot(3, 4) + math.prod([2, 3])",
        "dict(a=1).get('b', 2) + dict(a=1).get('a')",
        "list(dict(a=1).items()) + list(dict(a=1).keys()) + list(dict(a=1).values())",
        "xacro.dotify(dict(joint=dict(lower=1))).joint.lower",
        "xacro.warning('look') + xacro.message('x')",
    ],
)
def test_an_expression_is_what_xacro_makes_of_it(text: str) -> None:
    found = evaluate(text, NAMES)
    assert is_plain(found)
    assert found == plain_xacro(text)
    assert type(found) is type(plain_xacro(text))


@pytest.mark.parametrize(
    "text",
    [
        "().__class__.__base__.__subclasses__()",
        "[g.gi_frame for g in [(i for i in [1])]]",
        "[g.gi_frame.f_back.f_globals['os'].system('true') for g in [(i for i in [1])]]",
        "max.__self__",
        "sqrt.__call__(2)",
        "xacro.load_yaml.__globals__",
        "xacro.__class__",
        "math.__loader__",
        "python.parent",
        "name.format.__self__",
        "'{0.__class__}'.format(1)",
        "'{0[a]}'.format(dict(a=1))",
        "'{:{}}'.format(1, 99)",
        "'%*d' % (10, 1)",
        "f'{name.__class__}'",
        "str.mro()",
        "str.join(',', 'ab')",
        "(lambda: 1)()",
        "[x := 1]",
        "(yield 1)",
        "(await 1)",
        "[i async for i in 'a']",
        "__import__('os')",
        "eval('1')",
        "open('/etc/passwd')",
        "python.type(1)",
        "python.vars(math)",
        "[max]",
        "(" + "+".join(["1"] * 800) + ")()",
        "max",
        "math",
        "str(max)",
        "list(map(map, [1]))",
        "[1 for cfg.x in 'a']",
        "limits.append(1)",
        "name.encode()",
        "b'a'",
        "1j",
        "(-1)**0.5",
        "...",
        "xacro.tokenize('aa', sep='](a+)+[b')",
        "xacro.tokenize('aa', sep='a\\\\')",
    ],
)
def test_what_leads_elsewhere_is_refused(text: str) -> None:
    with pytest.raises(ExpressionError, match=r"not allowed|not defined|function is needed"):
        evaluate(text, NAMES)


@pytest.mark.parametrize(
    "text",
    [
        "9**9**9",
        "1 << 10**10",
        "10**4000 * 10**4000",
        "'a' * 10**9",
        "[[0] * 1000] * 1000 * 1000",
        "len(list(range(10**9)))",
        "range(10**30)",
        "[1 for i in range(1000) for j in range(1000)]",
        "['a' * 10**6 for i in range(1000)]",
        "'x'.join(['a' * 10**5] * 10**5)",
        "'a'.replace('', 'b' * 10**6).replace('', 'c' * 10**6)",
        "'%999d' % 1",
        "('%' + '0' * 10**5) % 1",
        "'{:99999}'.format(1)",
        "f'{1:>99999}'",
        "'a'.ljust(10**9)",
        "'\\t'.expandtabs(10**9)",
        "math.factorial(10**6)",
        "math.comb(10**8, 10**7)",
        "math.perm(10**6)",
        "math.prod([10**1000] * 1000)",
        "round(1, -10**9)",
        "list(map(range, [10**5] * 20))",
        "sorted([10**5] * 20, key=range)",
        "python.sum([[0] * 10**5] * 100, [])",
        "[" * 50 + "]" * 50,
        "-" * 500 + "1",
        "(" * 500 + ")" * 500,
        "1+" * 3000 + "1",
        "1+" * 6000 + "1",
        "(1+" * 80 + "1" + ")" * 80,
    ],
)
def test_work_and_results_are_bounded(text: str) -> None:
    with pytest.raises(ExpressionError, match=r"too (large|many|long|deeply)|so (large|many)|width of more|a? format"):
        evaluate(text, NAMES)


def test_a_mistake_says_what_it_is() -> None:
    for text, reason in [
        ("1/0", "division by zero"),
        ("who", "name 'who' is not defined"),
        ("xacro.who", "name 'who' is not defined"),
        ("dict(a=1)['b']", "there is no 'b'"),
        ("dict(a=1).b", "there is no key 'b'"),
        ("1 +", "invalid syntax"),
        ("[1][2]", "out of range"),
        ("xacro.fatal('wrong', 'hand')", "wrong hand"),
        ("'a' + 1", "can only concatenate str"),
    ]:
        with pytest.raises(ExpressionError, match=reason):
            evaluate(text, NAMES)


def test_no_method_of_the_list_changes_what_it_is_called_on() -> None:
    values: dict[type, Any] = {str: "ab", list: [1, 2], tuple: (1, 2), dict: {"a": 1}, set: {1}, int: 3, float: 0.5}
    assert set(METHODS) <= set(values)
    for kind, methods in METHODS.items():
        before = repr(values[kind])
        for method in methods.values():
            for arguments in ((), ("a",), (1,), ({},), (1, 2), ("a", "b")):
                try:
                    method(values[kind], *arguments)
                except (TypeError, ValueError, AttributeError, KeyError, IndexError, ExpressionError):
                    continue
        assert repr(values[kind]) == before


def test_sets_come_in_the_same_order_in_every_process() -> None:
    assert evaluate("list({'b', 'c', 'a'})", NAMES) == ["a", "b", "c"]
    assert evaluate("[x for x in {'b', 'c', 'a'}]", NAMES) == ["a", "b", "c"]


def test_a_text_from_outside_is_bounded_too() -> None:
    with pytest.raises(ExpressionError, match="too large"):
        evaluate("long", {"long": "a" * (MAX_SIZE + 1)})


def thrown(count: int, seed: int, folder: Path) -> dict[str, Any]:
    """What random expressions did, in a process that an audit hook watches."""
    done = subprocess.run(
        [sys.executable, "-m", "tests.formats.expressions", str(count), str(seed)],
        cwd=folder,
        env={"PYTHONPATH": str(ROOT)},
        capture_output=True,
        check=True,
    )
    assert done.stderr == b""
    return dict(json.loads(done.stdout))


def test_random_expressions_give_data_or_are_refused(tmp_path: Path) -> None:
    found = thrown(1_000, 1, tmp_path)
    assert found["escapes"] == []
    assert found["outcomes"]["data"] > 50
    assert sum(found["outcomes"].values()) == 1_000


@pytest.mark.long
def test_a_hundred_thousand_random_expressions_give_data_or_are_refused(tmp_path: Path) -> None:
    found = thrown(100_000, 2, tmp_path)
    assert found["escapes"] == []
    assert found["outcomes"]["data"] > 5_000
    assert sum(found["outcomes"].values()) == 100_000
