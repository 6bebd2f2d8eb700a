"""What `kinegen build` says: the verdict, how to use what was built, notes; all else with `-v`."""

from __future__ import annotations

import shlex
import textwrap
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from kinegen.backends.languages import LANGUAGES
from kinegen.driver.results import BuildResult, Stage
from kinegen.errors import shown
from kinegen.model.outputs import Quantity
from kinegen.support.system import has_posix_shell
from kinegen.support.text_layout import columns
from kinegen.ui.cli.build_record import percentage, said_stage, table_lines, worst_of
from kinegen.ui.cli.terminal import faint, filled, good, strong, width
from kinegen.verify.records import reasons

_INDENT = "  "
_NAMED = 4
"""Outputs that the verdict names; more are counted."""

_WIDE = 8
"""Joints that are written as zeros one by one."""

DETAILS = "details: -v (stages, operations, table of errors, files)"
"""The last line of a report that leaves them out."""


def report_lines(result: BuildResult, *, verbose: bool = False, is_wheel: bool = False) -> list[str]:
    """Return a finished build in lines; with `verbose` all that is known, and for a wheel not how to use the folder."""
    pairs = [*_verified(result), *(() if is_wheel else _uses(result))]
    lines = [_head(result), *(f"{_INDENT}{word:<9} {text}" for word, text in pairs), *_note_lines(result)]
    return [*lines, *_detail_lines(result)] if verbose else lines


def _head(result: BuildResult) -> str:
    """Return the verdict in a line."""
    name, seconds = strong(result.robot.name), sum(stage.seconds for stage in result.stages)
    if not any(file.changed for file in result.written) and len(result.stages) == 1:
        return f"{name}: {good('up to date')}, nothing has changed since the last verified build"
    alone = "" if result.backend == "c" else " with NumPy alone; the C files are not compiled"
    return f"{name}: {good('built and verified')} in {seconds:.1f} s{alone}"


def _verified(result: BuildResult) -> Iterator[tuple[str, str]]:
    """Yield what was compared with what, and how near the errors come to what is accepted."""
    comparisons = result.proof.comparisons
    names = list(dict.fromkeys(str(each.quantity) for each in comparisons))
    outputs = ", ".join(names) if len(names) <= _NAMED else f"{len(names)} outputs"
    poses = sum(each.poses for each in comparisons)
    yield "verified", f"{outputs}: {poses:,} results against an independent numeric reference"
    shares = [f"{percentage(worst)} in {real} ({worst.quantity})" for real, worst in worst_of(comparisons).items()]
    yield "errors", f"within tolerance; worst share of it {', '.join(shares)}"


def _uses(result: BuildResult) -> Iterator[tuple[str, str]]:
    """Yield how to use what was built."""
    name, paths = result.robot.name, {file.path for file in result.written if file.status != "removed"}
    # The first line to try in a shell.
    if result.folder / "__init__.py" in paths:
        call = f"print({name}.fk({_zeros(result.robot.dof)}))" if Quantity.POSE in result.counts else f"help({name})"
        yield "Python", f'{_on_path(shown(result.folder.parent))} python -c "import {name}; {call}"'
    elif result.folder / "README.md" in paths:
        yield "package", f"{shown(result.folder / 'README.md')} says how to use it"
    # The float kernels if there are any, since firmware takes these.
    kernels = next((found for suffix in ("_f32", "_q30", "") if (found := _kernel(paths, f"{name}{suffix}"))), ())
    if kernels:
        word = "C" if kernels[0].stem == name else "firmware"
        header, source = kernels
        beside = source.name if source.parent == header.parent else shown(source)
        yield word, f"{shown(header)}, {beside} (C99, no heap, no libm)"
    if result.costs:
        yield "flash", _cost(result)
    others = [each for each in LANGUAGES if any(path.is_relative_to(result.folder / each) for path in paths)]
    if others:
        yield "languages", ", ".join(shown(result.folder / each) for each in others)
    yield "files", f"{_statuses(result)} in {shown(result.folder)}"


def _on_path(folder: str) -> str:
    """Return what a shell wants before a command that imports from a folder."""
    return f"PYTHONPATH={shlex.quote(folder)}" if has_posix_shell() else f'cd "{folder}" &&'


def _zeros(dof: int) -> str:
    return f"[{', '.join('0' * dof)}]" if dof <= _WIDE else f"[0] * {dof}"


def _kernel(paths: set[Path], stem: str) -> tuple[Path, ...]:
    """Return header and source of a number type; nothing where they were not written."""
    found = [[path for path in paths if path.name == f"{stem}{suffix}"] for suffix in (".h", ".c")]
    # Folders of other languages may hold a copy, further down.
    return tuple(min(each, key=lambda path: (len(path.parts), path)) for each in found) if all(found) else ()


def _cost(result: BuildResult) -> str:
    """Return flash and instructions of the pose, or of the first kernel, where they were measured."""
    cost = next((each for each in result.costs if each.quantity == Quantity.POSE), result.costs[0])
    calls = f", {cost.calls} {cost.unit}" if cost.calls else ""
    return f"{cost.flash} B{calls} ({cost.name} on {cost.target})"


def _note_lines(result: BuildResult) -> list[str]:
    """Return sentences that the user should read."""
    lines = []
    for note in result.notes:
        first, *others = textwrap.wrap(f"{_INDENT}note: {note}", width(), subsequent_indent=_INDENT * 4)
        lines += [first.replace("note", strong("note"), 1), *others]
    return lines


def _statuses(result: BuildResult) -> str:
    counted = Counter(file.word for file in result.written)
    return ", ".join(f"{number} {status}" for status, number in counted.items())


def _detail_lines(result: BuildResult) -> list[str]:
    """Return all that is known of a build."""
    return [
        *("", f"{_INDENT}{strong('stages')}", *map(_stage_line, result.stages)),
        *("", *_operations(result), *_sums(result), *_choices(result), *cost_lines(result)),
        *("", *_file_lines(result)),
        *("", *table_lines(result)),
    ]


def _stage_line(stage: Stage) -> str:
    """Return a finished stage."""
    return f"{_INDENT * 2}{said_stage(stage.name):<8}{stage.seconds:6.2f} s  {faint(stage.detail)}".rstrip()


def _operations(result: BuildResult) -> list[str]:
    """Return our operations beside those of the plain product, which there is for the pose alone."""
    plain = f"a plain product of link matrices: {result.plain}"
    rows = [(quantity, str(count)) for quantity, count in result.counts.items()]
    rows += [(Quantity.POSE, "not built")] * (Quantity.POSE not in result.counts)
    texts = ((str(quantity), f"{text}  {plain}" if quantity == Quantity.POSE else text) for quantity, text in rows)
    table = columns([(f"{_INDENT}  {name}", text) for name, text in texts], left=frozenset({0, 1}))
    return [f"{_INDENT}{strong('operations')}", *table]


def _choices(result: BuildResult) -> list[str]:
    """Return how many ways to compute each kernel were tried, which was kept, and what the search made of it."""
    from kinegen.derive.dispatch import derive
    from kinegen.ir.lower import choice_of

    rows = []
    for quantity, count in result.counts.items():
        choice = choice_of(derive(result.robot, quantity))
        searched = (
            f"searched: {choice.before} became {count}" if str(choice.before) != str(count) else "searched: as it came"
        )
        kept = f"; kept of {choice.tried} ways: {choice.way}" if choice.tried > 1 else ""
        rows.append((f"{_INDENT}  {quantity}", searched + kept))
    return [f"{_INDENT}{strong('choices')}", *columns(rows, left=frozenset({0, 1}))]


def _sums(result: BuildResult) -> list[str]:
    names = [f"c{angle.label} = cos({angle.text})" for angle in result.angles if angle.is_sum]
    lines = filled(names, f"{_INDENT}  ") if names else [f"{_INDENT}  none"]
    return [f"{_INDENT}{strong('angle sums')}", *lines]


def cost_lines(result: BuildResult) -> list[str]:
    """Return what the float kernels cost on a microcontroller."""
    if not result.costs:
        return []
    rows = [("    kernel", "flags", "flash", "stack", result.costs[0].unit)]
    for cost in result.costs:
        figures = (f"{cost.flash} B", f"{cost.stack} B", str(cost.calls or "-"))
        rows.append((f"    {cost.name}", cost.optimisation, *figures))
    title = f"float on {result.costs[0].target} ({result.costs[0].compiler})"
    missing = [
        line
        for reason in reasons(result.costs)
        for line in textwrap.wrap(f"{_INDENT}  {reason}", width(), subsequent_indent=f"{_INDENT}    ")
    ]
    return [f"{_INDENT}{strong(title)}", *columns(rows, left=frozenset({0, 1})), *missing]


def _file_lines(result: BuildResult) -> list[str]:
    rows = [(f"{_INDENT}{file.word}", shown(file.path)) for file in result.written]
    return columns(rows, left=frozenset({0, 1}))
