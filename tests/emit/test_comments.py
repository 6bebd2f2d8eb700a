"""Text without comments: equal exactly where the code is."""

from __future__ import annotations

import pytest

from kinegen.backends.files import code_of

ALIKE = [
    ("a.c", "int a; /* one\n * two */\n\nint b; // end\n", "int a;\n  int b;"),
    ("a.h", 'char *s = "/* kept */"; // gone', 'char *s = "/* kept */";'),
    ("a.hpp", "char c = '\"'; /* gone \" */ int b;", "char c = '\"';   int b;"),
    ("a.rs", "fn a<'b>(x: &'b f64) {} // it's gone", "fn a<'b>(x: &'b f64) {}"),
    ("a.m", "b = a' * c'; % it's gone\nd = 'kept % too';", "b = a' * c';\nd = 'kept % too';"),
    ("a.py", '"""Gone."""\ndef f(a):\n    """Gone."""\n    return "#" + a  # gone\n', 'def f(a):\n    return "#" + a'),
    ("a.h.jinja", "{# gone\n#}\nint {{ a }}; /* gone */", "int {{ a }};"),
    ("a.py.jinja", "{# gone #}\nif a:\n    {{ b }} = '#'  # gone\n", "if a:\n    {{ b }} = '#'"),
    ("a.cuh", "int a; // gone", "int a;"),
    ("a.js", "const s = 'http://a'; // gone", "const s = 'http://a';"),
    ("a.txt", "a\n\nb ", "a\nb"),
]

OTHER = [
    ("a.c", "int a;", "int b;"),
    ("a.c", '"// a"', '"// b"'),
    ("a.c", "#define A\nint b;", "#define A int b;"),
    ("a.rs", "a /* one */ b", "a /* one b */"),
    ("a.m", "fprintf('%d', a)", "fprintf('%g', a)"),
    ("a.py", "a = 1\nif a:\n    a = 2\n", "if a:\n    a = 2\na = 1\n"),
    ("a.py", "a = 'b'", "a = 'c'"),
    ("a.py.jinja", "if {{ a }}:\n    b\n    c", "if {{ a }}:\n    b\nc"),
    ("a.py", "print 'a'", "print 'b'"),
    ("a.toml", "# a", "# b"),
]


@pytest.mark.parametrize(("name", "one", "other"), ALIKE)
def test_comments_are_left_out(name: str, one: str, other: str) -> None:
    assert code_of(name, one) == code_of(name, other)


@pytest.mark.parametrize(("name", "one", "other"), OTHER)
def test_other_code_differs(name: str, one: str, other: str) -> None:
    assert code_of(name, one) != code_of(name, other)
