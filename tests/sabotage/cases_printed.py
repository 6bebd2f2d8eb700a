"""What no number proves: words, types, packaging, what tests accept, and what linkers see."""

from __future__ import annotations

from kinegen.errors import CompileError, ProofError
from tests.sabotage.case import Sabotage
from tests.sabotage.workshop import PRINTED

# Language, name, file, place, what it becomes.
_WORDS = (
    ("javascript", "the type of a result", "puma560.d.ts", r"\): Float64Array", "): number[]"),
    ("javascript", "the type of an input", "puma560.d.ts", r"fk\(q: Numbers", "fk(q: string"),
    ("javascript", "the type of a table", "puma560.d.ts", r"JOINTS: readonly string", "JOINTS: readonly number"),
    ("javascript", "a length in the types", "puma560.d.ts", r"DOF: 6", "DOF: 7"),
    ("javascript", "a function that is not declared", "puma560.d.ts", r"export function fk_batch[^;]*;", ""),
    ("javascript", "another main file", "package.json", r'"default": "\./puma560\.js"', '"default": "./index.js"'),
    ("javascript", "a main file besides", "package.json", r'"type": "module"', '"type": "module", "main": "x.js"'),
    ("javascript", "what bundlers may leave out", "package.json", r'"sideEffects": false', '"sideEffects": true'),
    ("javascript", "types of another file", "package.json", r'"types": "\./puma560\.d\.ts",\n  "f', '"types": "./index.d.ts",\n  "f'),
    ("javascript", "a script after the installation", "package.json", r'"scripts": \{', '"scripts": { "postinstall": "echo",'),
    ("javascript", "another licence", "package.json", r'"0BSD"', '"GPL-3.0"'),
    ("javascript", "a test that accepts anything", "test.mjs", r"<= accepted\[i\]", "<= 1e3"),
    ("javascript", "a test that accepts much", "test.mjs", r"\[(\d\.\d+e-\d+), ", "[0.5, "),
    ("javascript", "a test that compares nothing", "test.mjs", r"expected\.forEach", "[].forEach"),
    ("javascript", "how good sines are", "puma560.js", r"within 0\.85 units", "within 0.5 units"),
    ("javascript", "the unit", "puma560.js", r"lengths in m\.", "lengths in mm."),
    ("javascript", "joints in the comment", "puma560.js", r"q\[0\]  waist", "q[0]  elbow"),
    ("javascript", "a limit in the comment", "puma560.d.ts", r"-2\.79253 to", "-3.1 to"),
    ("rust", "another edition", "Cargo.toml", r'edition = "2021"', 'edition = "2018"'),
    ("rust", "another name", "Cargo.toml", r'name = "puma560"', 'name = "puma"'),
    ("rust", "a feature that is on", "Cargo.toml", r"default = \[\]", 'default = ["std"]'),
    ("rust", "a dependency more", "Cargo.toml", r"\[dependencies\]", '[dependencies]\nlibm = "0.2"'),
    ("rust", "a conversion that is turned", "src/convert.rs", r"\(\w+\)", "()"),
    ("rust", "a limit in the comment", "src/lib.rs", r"-2\.79253 to", "-3.1 to"),
    ("rust", "how good sines are", "src/f32.rs", r"up to 12000 rad", "up to 1e5 rad"),
    ("rust", "the licence", "src/lib.rs", r"0BSD", "MIT"),
    ("rust", "a wrong version in the README", "README.md", r"Rust 1\.63", "Rust 1.56"),
    ("rust", "a test that accepts much", "tests/vectors.rs", r"(ACCEPTED\w*[^=]*= \[)[^,]*", r"\g<1>0.5"),
    ("cpp", "contraction", "CMakeLists.txt", r"-ffp-contract=off", "-ffp-contract=fast"),
    ("cpp", "the standard", "CMakeLists.txt", r"cxx_std_17", "cxx_std_11"),
    ("cpp", "tests of floats that are not built", "CMakeLists.txt", r"double float", "double"),
    ("cpp", "a header that is not installed", "CMakeLists.txt", r"install\(FILES puma560\.hpp", "install(FILES puma.hpp"),
    ("cpp", "fast-math is a warning", "puma560.hpp", r'#error "-ffast', '#warning "-ffast'),
    ("cpp", "a limit in the comment", "puma560.hpp", r"-2\.79253 to", "-3.1 to"),
    ("cpp", "the version", "CMakeLists.txt", r"VERSION 0\.1", "VERSION 1.1"),
    ("cpp", "Eigen, row by column", "puma560.hpp", r"Eigen::RowMajor", "Eigen::ColMajor"),
    ("matlab", "contraction", "build_mex.m", r"-ffp-contract=off '", "-ffast-math '"),
    ("matlab", "a source that is not compiled", "build_mex.m", r"  fullfile\(here, 'csrc/puma560_mex_f32_batch\.c'\)[^\n]*\n", ""),
    ("matlab", "the unit", "+puma560/Contents.m", r"lengths in m\.", "lengths in mm."),
    ("matlab", "a limit in the comment", "+puma560/Contents.m", r"-2\.79253 to", "-3.1 to"),
    ("matlab", "the words of a function", "+puma560/fk.m", r"joint vector", "actuator vector"),
    ("matlab", "a test that accepts anything", "run_tests.m", r"<= ", "< 1e9 + "),
    ("cuda", "the words of a kernel", "puma560.cuh", r"row by row", "column by column"),
    ("cuda", "a limit in the comment", "puma560.cuh", r"-2\.79253 to", "-3.1 to"),
    ("cuda", "how kernels are launched", "_launch.py", r"def ", "def  "),
)  # fmt: skip
_KERNELS = (
    (
        "a word of the header of a batch",
        "puma560_batch.h",
        r"number of configurations",
        "twice the number of configurations",
    ),
    ("a word of a batch", "puma560_batch.c", r"/\* ", "/* Not: "),
    ("a stride in words", "puma560_batch.h", r"\bstride", "width"),
    ("a licence", "puma560.c", r"SPDX-License-Identifier: 0BSD", "SPDX-License-Identifier: MIT"),
    ("a word of a self-test", "puma560_selftest.c", r"Generated", "Written"),
    ("a docstring", "__init__.py", r'"""[A-Z]', '"""x'),
    ("a comment in NumPy", "_numpy.py", r"# ", "#  "),
    ("the module for JAX", "jax.py", r"_library\.__dir__$", "dir"),
)
_PACKAGES = (
    ("cmake", "CMakeLists.txt", r"-ffp-contract=off", "-ffp-contract=fast"),
    ("cmake", "README.md", r"C99", "C89"),
    ("platformio", "library.json", r'"license": "[^"]*"', '"license": "MIT"'),
    ("arduino", "library.properties", r"category=Data", "category=Display"),
    ("esp-idf", "CMakeLists.txt", r"idf_component_register", "idf_component_unregister"),
)
_LINKED = (
    ("a function of a batch that is not static", "puma560_batch.c", r"PUMA560_INLINE void puma560_fk_tile", "void puma560_fk_tile", "puma560_fk_tile is not static"),
    ("a function that is not static", "puma560.c", r"static void puma560_sincos", "void puma560_sincos", "puma560_sincos is not static"),
    ("a pair that is not static", "puma560_f32.c", r"static void puma560_f32_sincos", "void puma560_f32_sincos", "puma560_f32_sincos is not static"),
    ("the mathematical library", "puma560.c", r"#include <float\.h>", "#include <float.h>\n#include <math.h>", "it includes <math.h>"),
    ("headers of an operating system", "puma560_batch.c", r"#include <float\.h>", "#include <float.h>\n#include <unistd.h>", "it includes <unistd.h>"),
    ("the standard output", "puma560_f32.c", r'#include "puma560_f32\.h"', '#include "puma560_f32.h"\n#  include <stdio.h>', "it includes <stdio.h>"),
)  # fmt: skip

CASES = (
    *(
        Sabotage(
            f"printed in {language}: {name}", "puma560", "pose", f"{language}/{file}", old, new, "double",
            (f"--languages={language}",), message=PRINTED,
        )
        for language, name, file, old, new in _WORDS
    ),
    *(
        Sabotage(f"printed: {name}", "puma560", "pose", file, old, new, "double", message=PRINTED)
        for name, file, old, new in _KERNELS
    ),
    *(
        Sabotage(
            f"printed for {kind}: {old}", "puma560", "pose", file, old, new, "both", (f"--package={kind}",), message=PRINTED
        )
        for kind, file, old, new in _PACKAGES
    ),
    *(
        Sabotage(
            f"linked: {name}", "puma560", "pose", file, old, new, "both", errors=(ProofError, CompileError), message=message
        )
        for name, file, old, new, message in _LINKED
    ),
)  # fmt: skip
