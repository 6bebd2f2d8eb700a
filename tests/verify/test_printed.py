"""Text that no number proves: what differs from a second print is named, and what C files show to a linker."""

from __future__ import annotations

from pathlib import Path

import pytest

from kinegen.errors import ProofError
from kinegen.verify.headers import require_exported
from kinegen.verify.package_proof import require_printed
from tests.emit.emitted import robot

FILES = {"arm.c": "one\ntwo\n", "javascript/arm.d.ts": "export const DOF: 6;\n"}
HEADER = "/* void hidden(void); */\n#include <stddef.h>\nvoid arm_fk(const double q[6],\n            double t[16]);\n"


def test_the_same_text_passes() -> None:
    require_printed(robot("puma560"), FILES, dict(FILES))


@pytest.mark.parametrize(
    ("altered", "message"),
    [
        ({"arm.c": "one\ntwO\n"}, "line 2 of arm.c is not what kinegen prints there: 'twO'"),
        ({"arm.c": "one\n"}, "line 2 of arm.c is not what kinegen prints there: ''"),
        ({"arm.c": "one\ntwo\n\n// more\n"}, "line 4 of arm.c is not what kinegen prints there: '// more'"),
        ({"arm.c": "one\ntwo \n"}, "line 2 of arm.c is not what kinegen prints there: 'two'"),
        ({"x.js": ""}, "x.js is not one that kinegen prints"),
    ],
)
def test_a_difference_is_named_with_its_line(altered: dict[str, str], message: str) -> None:
    with pytest.raises(ProofError) as caught:
        require_printed(robot("puma560"), FILES | altered, FILES)

    assert str(caught.value) == f"puma560: {message}; nothing was written"


def test_a_file_that_is_missing_is_named() -> None:
    with pytest.raises(ProofError, match=r"javascript/arm\.d\.ts is missing"):
        require_printed(robot("puma560"), {"arm.c": FILES["arm.c"]}, FILES)


def exported(folder: Path, source: str, name: str = "arm.c") -> None:
    (folder / "arm.h").write_text(HEADER, encoding="utf-8")
    (folder / name).write_text(source, encoding="utf-8")
    require_exported(robot("puma560"), folder, (name,))


RIGHT = (
    '#include "arm.h"\n#include <float.h>\nvoid arm_fk(const double q[6],\n double t[16])\n{\n if (q[0]) { }\n}\n',
    "static void more(double x)\n{\n}\n/* int shown(void) { } */\n",
    "#define IN static inline A\n#define IN static inline\nIN void more(double x)\n{\n}\n",
    "static const double *\nmore(double x) { return 0; }\n",
)  # fmt: skip


@pytest.mark.parametrize("source", RIGHT)
def test_declared_and_static_functions_pass(source: str, tmp_path: Path) -> None:
    exported(tmp_path, source)


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("void more(double x)\n{\n}\n", "more is not static, and no header declares it"),
        ("const double *more(double x)\n{\n}\n", "more is not static"),
        ("inline double more(double x) { return x; }\n", "more is not static"),
        ("void hidden(void)\n{\n}\n", "hidden is not static"),
        ("int main(void)\n{\n}\n", "main is not static"),
        ("#define IN static\n#define IN inline\nIN void more(void)\n{\n}\n", "more is not static"),
        ("#include <math.h>\n", "it includes <math.h>"),
        ("  #  include\t<stdio.h>\n", "it includes <stdio.h>"),
        ('#include "other.h"\n', 'it includes "other.h"'),
        ("#include HEADER\n", "it includes HEADER"),
    ],
)  # fmt: skip
def test_other_functions_and_headers_are_refused(source: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(ProofError, match=message.replace("(", r"\(")):
        exported(tmp_path, source)


def test_a_self_test_may_have_a_main_program(tmp_path: Path) -> None:
    exported(tmp_path, "#include <stdio.h>\n#include <avr/pgmspace.h>\nint main(void)\n{\n}\n", "arm_selftest.c")
