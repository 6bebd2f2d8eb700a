"""Calls the C++ header through a compiled program; see `templates/cpp/driver.cpp.jinja`."""

from __future__ import annotations

import re
from pathlib import Path

from kinegen.backends.bundle import RobotPrograms
from kinegen.backends.cpp.files import header_context
from kinegen.backends.cpp.syntax import SYNTAX, TRUTHS
from kinegen.backends.templates import environment
from kinegen.verify.runners.runner import Driven, require_forms, run_tool

FLAGS = ("-std=c++17", "-Wall", "-Wextra", "-Wconversion", "-Wpedantic", "-Werror", "-fno-exceptions", "-fno-rtti")
"""The header is compiled with these, so that a warning in it is an error of the build."""

_OPTIONS = ("-O1", "-ffp-contract=off")
_CHECKED = "-O0"
_NUMBER = r"-?\d[\d.]*(?:[eE][-+]?\d+)?F?"
_LITERAL = re.compile(rf"Real\(({_NUMBER})\)|detail::either<Real>\(({_NUMBER}), {_NUMBER}\)")


def run_cpp(tool: str, folder: Path, kernels: RobotPrograms) -> Driven:
    """Returns the kernels of a header; see `kinegen.verify.runners.runner.Runner`."""
    name, owner = f"{kernels.robot.name}.hpp", f"{kernels.robot.name}: {kernels.robot.name}.hpp"
    text = (folder / name).read_text(encoding="utf-8")
    heads = [
        rf"constexpr void {program.quantity.function}\(.*Real\* __restrict .*\) noexcept"
        for program in kernels.programs
    ]
    require_forms(SYNTAX, owner, bare(text), heads, "}", more=tuple(TRUTHS.forms.values()))
    driver = environment().get_template("cpp/driver.cpp.jinja").render(k=header_context(kernels))
    (folder / "driver.cpp").write_text(driver, encoding="utf-8", newline="\n")
    run_tool((tool, *FLAGS, *_OPTIONS, "driver.cpp", "-o", "driver"), folder, name)
    for test in sorted(folder.glob("*_test_*.cpp")):
        run_tool((tool, *FLAGS, _CHECKED, test.name, "-o", test.stem), folder, test.name)
        run_tool((f"./{test.stem}",), folder, f"the test vectors of {test.name}")
    return Driven(folder, kernels, name)


def bare(text: str) -> str:
    """Returns a header with numbers and types as they are, and without blank lines and comments of its own."""
    lines = (line for line in text.split("\n") if line.strip() and not re.match(r"\s*//[^\\]*$", line))
    bare = _LITERAL.sub(lambda found: (found[1] or found[2]).rstrip("F"), "\n".join(lines))
    of_numbers = bare.replace("const bool ", "const Real ")
    return re.sub(r"(noexcept)\n\{$", r"\1", of_numbers, flags=re.MULTILINE)
