"""The table and the closed form of a robot for people: text, HTML, LaTeX, MathML, Markdown, CSV and sympy."""

from __future__ import annotations

from functools import cached_property
from html import escape
from typing import Any

from kinegen.backends.textbook import OUTPUTS, SINGULARITIES, VARIABLES
from kinegen.backends.textbook import sheet_sentences as words
from kinegen.backends.textbook.notation import TableText
from kinegen.backends.textbook.sheet import Sheet, make_sheet
from kinegen.backends.textbook.sheet_latex import latex_forms, latex_table
from kinegen.backends.textbook.sheet_mathml import mathml_forms
from kinegen.backends.textbook.sheet_python import python_sheet
from kinegen.backends.textbook.sheet_text import text_forms, text_table
from kinegen.backends.textbook.table import TableRow, read_table
from kinegen.errors import KinegenError, quote
from kinegen.model.robot import Robot
from kinegen.model.variants import frame_named

_NUMBERS = TableText()


class Table:
    """The table of a robot, in the units of its file; `robot.table()` makes it.

    Args:
        robot: The robot.

    Example:
        >>> import kinegen
        >>> table = kinegen.load("robots/scara.yaml").table()
        >>> table.rows[0]["joint"], table.rows[0]["theta"]
        ('shoulder', 'q1')
    """

    def __init__(self, robot: Robot) -> None:
        self.robot = robot

    @cached_property
    def _sheet(self) -> Sheet:
        return Sheet(self.robot, read_table(self.robot), (), (), ())

    @property
    def rows(self) -> tuple[dict[str, str], ...]:
        """One mapping for each row: `joint`, the columns of the convention, or `transforms` for a sequence.

        Entries are text, exact as in the file: `q1 - 90`, `pi/7`, `0.4318`. `pandas.DataFrame(table.rows)` takes them.
        """
        return tuple(self._row(row) for row in self._sheet.table.rows)

    def latex(self) -> str:
        """A fragment for amsmath."""
        return latex_table(self._sheet).rstrip("\n")

    def markdown(self) -> str:
        """A table for pages in Markdown.

        Raises:
            KinegenError: If a table cannot hold the robot, such as a tree with elementary sequences.
        """
        from kinegen.io.table_text import write_markdown

        return write_markdown(self.robot)

    def csv(self) -> str:
        """Comma-separated values, which `kinegen.load` reads again.

        Raises:
            KinegenError: If a table cannot hold the robot.
        """
        from kinegen.io.table_text import write_csv

        return write_csv(self.robot)

    def __str__(self) -> str:
        return text_table(self._sheet)

    def __repr__(self) -> str:
        return f"<kinegen.Table of {self.robot.name}: {len(self._sheet.table.rows)} rows>"

    def _repr_html_(self) -> str:
        sheet = self._sheet
        rows = self.rows
        heads = list(dict.fromkeys(name for row in rows for name in row))
        lines = [f"<p><b>{escape(words.title(sheet.robot))}</b><br>", f"{escape('; '.join(self._facts))}</p>"]
        lines += ["<table><thead><tr>", *(f"<th>{escape(self._head(name))}</th>" for name in heads), "</tr></thead>"]
        for row in rows:
            lines += ["<tr>", *(f"<td>{escape(row.get(name, ''))}</td>" for name in heads), "</tr>"]
        lines.append("</table>")
        fixed = [f"{each.name} on {each.parent}: {_sequence(each.steps)}" for each in sheet.table.frames]
        return "".join([*lines, *(f"<div>{escape(line)}</div>" for line in fixed)])

    @property
    def _facts(self) -> tuple[str, ...]:
        return (*words.conventions(self._sheet), words.units(self.robot))

    def _head(self, name: str) -> str:
        units = self.robot.units
        unit = {"a": units.length, "d": units.length, "alpha": units.angle, "theta": units.angle, "beta": units.angle}
        return f"{name} [{unit[name]}]" if name in unit else name

    def _row(self, row: TableRow) -> dict[str, str]:
        parents = words.has_parents(self.robot)
        found = {"i": str(row.number), **({"from": words.parent_number(row, self.robot)} if parents else {})}
        found["joint"] = row.name
        entries = zip(self._sheet.table.columns, row.entries, strict=True)
        found |= {name: _NUMBERS.entry(entry) for name, entry in entries if entry is not None}
        return found | ({"transforms": _sequence(row.steps)} if row.steps else {})


def _sequence(steps: object) -> str:
    return " ".join(f"{step.kind}({_NUMBERS.entry(step.value)})" for step in steps)  # type: ignore[attr-defined]


class ClosedForm:
    """The closed form of a pose or a Jacobian; `robot.closed_form()` makes it.

    `c1` and `s1` are the cosine and sine of the first joint variable, `c23` is cos(q2 + q3). Lengths are in the unit of
    the file, angles in radians.

    Args:
        robot: The robot.
        start: Frame of reference, by name or row number.
        end: Frame that is reached.
        output: One of `pose`, `jacobian`, `jacobian_local`, `jacobian_world`, `singularities`, `rpy_zyx`, `rpy_xyz`,
            `euler_zyz`.
        named: Whether what is used more than once has a name.
        blocks: Whether a Jacobian is its linear and its angular part, or of an arm in a plane its three rows.
        variables: What joint variables are called: `q`, or `theta,d` by the kind of the joint.

    Raises:
        KinegenError: If a frame or an output does not exist, or the formula is too long to be printed.

    Example:
        >>> import kinegen
        >>> form = kinegen.load("robots/puma560.yaml").closed_form(end=3)
        >>> form.names
        ('0T3',)
        >>> form.sympy()[2, 3]
        -a2*sin(q2)
    """

    def __init__(
        self,
        robot: Robot,
        start: str | int | None = None,
        end: str | int | None = None,
        output: str = "pose",
        *,
        named: bool = False,
        blocks: bool = False,
        variables: str = "q",
    ) -> None:
        if output not in OUTPUTS:
            raise KinegenError(f"unknown output {quote(str(output))} of a closed form (expected {', '.join(OUTPUTS)})")
        if variables not in VARIABLES:
            raise KinegenError(f"unknown variables {quote(str(variables))} (expected {' or '.join(VARIABLES)})")
        frames = [None if each is None else frame_named(robot, str(each)) for each in (start, end)]
        self.robot, self.output = robot, output
        self.sheet = make_sheet(robot, *frames, output=output, named=named, blocks=blocks, variables=variables)

    @property
    def singularities(self) -> tuple[tuple[tuple[Any, ...], str], ...]:
        """Where the Jacobian is singular: expressions of sympy that vanish together there, and words; needs that output.

        Raises:
            KinegenError: If the closed form is that of another output.

        Example:
            >>> import kinegen
            >>> arm = kinegen.load("robots/puma560.yaml")
            >>> for zeros, words in arm.closed_form(output="singularities").singularities:
            ...     print(*zeros, "|", words)
            sin(q5) | wrist aligned: axes 4 and 6 coincide
            a3*sin(q3) + d4*cos(q3) | elbow stretched or folded: the point where axes 4, 5 and 6 meet is in the plane of axes 2 and 3
            a2*cos(q2) + a3*cos(q2 + q3) - d4*sin(q2 + q3) | shoulder: the point where axes 4, 5 and 6 meet is in the plane of axes 1 and 2
        """  # noqa: E501
        from kinegen.backends.textbook.sheet_python import sympy_places

        if self.output != SINGULARITIES:
            raise KinegenError(
                f"this is the closed form of {quote(self.output)}; closed_form(output={SINGULARITIES!r}) has them"
            )
        return tuple(place for form in self.sheet.loci for place in sympy_places(form, self.sheet.angles))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the matrices, such as `base_T_tool`; one for each tip of a tree."""
        return tuple(product.name for product in self.sheet.products)

    def latex(self) -> str:
        r"""A fragment for amsmath, with the sines, cosines and values that it uses.

        Example:
            >>> import kinegen
            >>> text = kinegen.load("robots/planar_3r.yaml").closed_form().latex()
            >>> text.splitlines()[0], "c_{123}" in text
            ('\\begin{equation*}', True)
        """
        return latex_forms(self.sheet)

    def mathml(self) -> str:
        """One complete `<math>` element for each matrix, for web pages."""
        return mathml_forms(self.sheet)

    def python(self) -> str:
        """The text of a Python module with a function for each matrix; it needs the standard library alone."""
        return python_sheet(self.sheet)

    def sympy(self, name: str | None = None) -> Any:
        """The closed form as a matrix of sympy, with the factors and brackets of the printout.

        Args:
            name: Which one of `names`, where there are several.

        Returns:
            A 4x4 matrix, 6 rows for a Jacobian, or one column with its determinant (or minors), in the symbols `q1`,
            `q2`, ... and the parameters by name; they have no assumptions. A product that is printed in parts is a
            `MatMul` of its parts; `.doit()` multiplies them.

        Raises:
            KinegenError: If there are several matrices and `name` is none of them.

        Example:
            >>> import kinegen
            >>> pose = kinegen.load("robots/planar_3r.yaml").closed_form().sympy()
            >>> pose.shape, pose[2, 2]
            ((4, 4), 1)
        """
        from kinegen.backends.textbook.sheet_python import sympy_product

        if not self.names:
            raise KinegenError(f"the determinant of the Jacobian of {self.robot.name} is too long to be printed")
        wanted = self.names[0] if name is None and len(self.names) == 1 else name
        for product in self.sheet.products:
            if product.name == wanted:
                return sympy_product(product)
        reason = "name one of them" if name is None else f"{quote(name)} is not one of them"
        raise KinegenError(f"{self.robot.name} has several closed forms, and {reason}: {', '.join(self.names)}")

    def __str__(self) -> str:
        return text_forms(self.sheet)

    def __repr__(self) -> str:
        return f"<kinegen.ClosedForm of {self.robot.name}: {', '.join(self.names)}>"

    def _repr_latex_(self) -> str:
        return self.latex()

    def _repr_html_(self) -> str:
        numbers = TableText()
        values = [f"{each.name} = {numbers.entry(each.value)} {each.unit}" for each in self.sheet.table.parameters]
        joints = ", ".join(words.joint_words(self.sheet))
        where = escape("; ".join(filter(None, (joints, ", ".join(value.rstrip() for value in values)))))
        return f'<div style="overflow-x: auto">{self.mathml()}</div><div>{where}</div>'
