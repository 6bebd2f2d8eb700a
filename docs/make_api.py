"""Writes docs/api.md: what `import kinegen` offers, from the docstrings.

python docs/make_api.py           rewrites the page
python docs/make_api.py --check   compares, and fails with a diff if the page is not current
"""

from __future__ import annotations

import difflib
import inspect
import re
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import kinegen
from kinegen.ui.api import page, widget

PAGE = Path(__file__).resolve().parent / "api.md"
SECTIONS = ("Args", "Attributes", "Returns", "Raises", "Example")
ORDER = ("load", "Robot", "Table", "ClosedForm", "compile", "build", "view", "plot", "reference", "KinegenError")
SHOWN = {"View": widget.View, "Page": page.Page}
"""Classes that calls return, and that are not public names."""

EXAMPLES = ("Robot.fk", "Robot.inverse", "Robot.closed_form", "ClosedForm.singularities")
"""Members whose examples are shown."""

ALIASES = ("Robot.joints", "Robot.n", "Robot.qlim", "Robot.fkine", "Robot.jacob0")
"""Other names of members, which the table at the head of the page lists."""

MADE = ("kinegen.Table", "kinegen.ClosedForm", "Page")
"""Classes that methods of others make: their arguments are those of the methods."""

HEAD = """\
# Python interface

<!-- Written by docs/make_api.py from the docstrings; change these and run `make docs`. -->

`import kinegen` takes a few milliseconds; each name is imported when it is used. Lengths are in the unit of the robot
file, angles in radians, and the leading axes of arrays are the batch. A robot, an option or a folder that is wrong
raises `KinegenError`, and an array of another shape or a target that is not a pose `ValueError`.
[python.md](python.md) describes the modules that `compile` and `build` make. Four notebooks use all of this:
[first steps](../examples/first_steps.ipynb), [from a drawing to a verified table](../examples/from_a_drawing.ipynb),
[velocity control](../examples/velocity_control.ipynb) and [calibration](../examples/calibration.ipynb).

```python
import kinegen

arm = kinegen.load("robots/puma560.yaml")   # YAML, URDF, xacro, MJCF, CSV; a path, a text or a mapping
print(arm.closed_form())                    # or a cell of a notebook
poses = arm.fk(q)                           # q (..., 6) gives (..., 4, 4); the first call compiles the robot
solutions, valid = arm.inverse(poses)       # q (..., 8, 6)
puma = kinegen.compile(arm, "pose,twist")   # a module with any outputs, for loops and other processes
```

| kinegen | Robotics Toolbox | Pinocchio |
| --- | --- | --- |
| `arm.fk(q)`, or `arm.fkine(q)`: an array | `fkine(q)`: an `SE3` | `forwardKinematics`, `data.oMf` |
| `arm.jacobian(q)`, or `arm.jacob0(q)` | `jacob0(q)` | `computeFrameJacobian(..., LOCAL_WORLD_ALIGNED)` |
| output `jacobian_local` | `jacobe(q)` | `LOCAL` |
| `arm.inverse(T, nearest=q0)`, `q0=` is the same | `ikine_a(T)` | |
| output `numeric_inverse` | `ik_LM(T, q0=q0)` | |
| `arm.limits`, `arm.qlim` (2, n) | `qlim` | `lowerPositionLimit`, `upperPositionLimit` |
| `arm.joint_names` or `arm.joints`, `arm.dof` or `arm.n` | `n` | `names`, `nq` |
"""
MAGIC = """
## In notebooks

`%load_ext kinegen` adds the cell magic `%%robot`. The cell is the text of a robot file. The module gets the name of the
robot in the notebook, `NAME_robot` is the robot itself, and the closed form is shown. A mistake is one line with the
line of the cell.

```text
%%robot [NAME] [--outputs LIST] [--real double|float|both] [--quiet]
```

Robots show their table, closed forms are typeset, and `kinegen.view` is a cell in which the arm moves. The packages
come with `pip install 'kinegen[notebook]'`.
"""


def main(arguments: list[str]) -> int:
    """Rewrites or checks the page; returns the exit status."""
    before = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    after = HEAD + "".join(f"\n{text}" for text in entries()) + MAGIC
    if before == after:
        return 0
    if arguments == ["--check"]:
        sys.stdout.writelines(difflib.unified_diff(before.splitlines(True), after.splitlines(True), str(PAGE), "now"))
        print("The page is not current: run 'make docs' and commit what it changes")
        return 1
    PAGE.write_text(after, encoding="utf-8", newline="\n")
    print(PAGE.relative_to(PAGE.parent.parent))
    return 0


def entries() -> Iterator[str]:
    """The parts of the page, each with its heading."""
    for name in ORDER:
        thing = getattr(kinegen, name)
        if isinstance(thing, ModuleType):
            yield entry(f"kinegen.{name}.fk", thing.fk, 2)
            continue
        yield entry(f"kinegen.{name}", thing, 2)
        yield from members(name, thing)
        if name == "view":
            for title, shown in SHOWN.items():
                yield entry(title, shown, 3)
                yield from members(title, shown)


def members(name: str, thing: Any) -> Iterator[str]:
    """The public methods and properties of a class."""
    if not inspect.isclass(thing) or issubclass(thing, Exception):
        return
    # Classes of the interface may derive from others of it.
    own = [each for each in reversed(thing.__mro__) if each.__module__.startswith(thing.__module__.rpartition(".")[0])]
    for part, member in (entry for each in own for entry in vars(each).items()):
        is_own = inspect.isfunction(member) or (isinstance(member, property) and bool(member.__doc__))
        if not part.startswith("_") and is_own and f"{name}.{part}" not in ALIASES:
            yield entry(f"{name}.{part}", member, 3)


def entry(title: str, thing: Any, level: int) -> str:
    """A heading, the signature and the docstring."""
    text = inspect.getdoc(thing.fget if isinstance(thing, property) else thing) or ""
    lines = [f"{'#' * level} {title}\n"]
    if inspect.isfunction(thing):
        lines.append(f"```python\n{signature(title, thing)}\n```\n")
    omitted = ["Raises"]
    if title in MADE:
        omitted.append("Args")
    # The examples of a class, and of the calls that everyone makes, are enough.
    if level > 2 and title not in EXAMPLES:
        omitted.append("Example")
    return "\n".join([*lines, *markdown(text, omitted)]).rstrip("\n") + "\n"


def signature(title: str, function: Any) -> str:
    """A call with its arguments, one a line where there are many; editors show the types, of the annotations."""
    found = inspect.signature(function)
    parameters, result = [], str(found.return_annotation)
    was_keyword = False
    for each in found.parameters.values():
        if each.name == "self":
            continue
        if each.kind is inspect.Parameter.KEYWORD_ONLY and not was_keyword:
            parameters.append("*")
            was_keyword = True
        default = "" if each.default is inspect.Parameter.empty else f"={each.default!r}".replace("'", '"')
        parameters.append(f"{each.name}{default}")
    line = f"{title}({', '.join(parameters)}) -> {result}"
    return (
        line
        if len(line) <= 110
        else "\n".join([f"{title}(", *(f"    {each}," for each in parameters), f") -> {result}"])
    )


def markdown(text: str, omitted: Sequence[str]) -> Iterator[str]:
    """A Google docstring as Markdown, without some of its sections."""
    parts = re.split(rf"^({'|'.join(SECTIONS)}):\n", text, flags=re.MULTILINE)
    yield f"{escaped(parts[0]).rstrip()}\n"
    for title, body in zip(parts[1::2], parts[2::2], strict=True):
        plain = inspect.cleandoc(body)
        if title in omitted:
            continue
        if title == "Example":
            # The page imports kinegen once.
            plain = plain.removeprefix(">>> import kinegen\n")
            yield f"```pycon\n{plain}\n```\n".replace("  # doctest: +ELLIPSIS", "")
        elif title == "Returns":
            yield f"**Returns:** {escaped(flat(plain))}\n"
        else:
            yield f"**{title}:**\n"
            yield "\n".join(f"- {item}" for item in items(plain)) + "\n"


def items(text: str) -> Iterator[str]:
    """The entries of a section: `name: what it is`."""
    for each in re.split(r"\n(?=\S)", text):
        name, _, what = flat(each).partition(": ")
        yield f"`{name}`: {escaped(what)}"


def flat(text: str) -> str:
    """A paragraph in one line."""
    return " ".join(text.split())


def escaped(text: str) -> str:
    """Text in which nothing is taken for markup; code in backquotes stays."""
    parts = re.split(r"(`[^`]*`)", text)
    return "".join(
        part if place % 2 else part.replace("<", "\\<").replace("*", "\\*") for place, part in enumerate(parts)
    )


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
