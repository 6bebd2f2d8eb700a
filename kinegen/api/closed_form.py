"""The closed form of a robot for people and for sympy."""

from __future__ import annotations

from html import escape
from typing import Any

from kinegen.errors import KinegenError, quote
from kinegen.outputs import Reference
from kinegen.robot.model import Robot
from kinegen.textbook import sheet_words as words
from kinegen.textbook.notation import TableText
from kinegen.textbook.sheet import make_sheet
from kinegen.textbook.sheet_latex import latex_forms
from kinegen.textbook.sheet_mathml import mathml_forms
from kinegen.textbook.sheet_python import python_sheet
from kinegen.textbook.sheet_text import text_forms

OUTPUTS = {
    "pose": None,
    "jacobian": Reference.LOCAL_WORLD_ALIGNED,
    "jacobian_local": Reference.LOCAL,
    "jacobian_world": Reference.WORLD,
}
"""What is printed, with the reference of a Jacobian."""


class ClosedForm:
    """The closed form of a pose or a Jacobian; `robot.closed_form()` makes it.

    `c1` and `s1` are the cosine and sine of the first joint variable, `c23` is cos(q2 + q3). Lengths are in the unit of
    the file, angles in radians.

    Args:
        robot: The robot.
        start: Frame of reference, by name or row number.
        end: Frame that is reached.
        output: One of `pose`, `jacobian`, `jacobian_local`, `jacobian_world`.

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
        self, robot: Robot, start: str | int | None = None, end: str | int | None = None, output: str = "pose"
    ) -> None:
        if output not in OUTPUTS:
            raise KinegenError(f"unknown output {quote(str(output))} of a closed form (expected {', '.join(OUTPUTS)})")
        frames = [None if each is None else str(each) for each in (start, end)]
        self.robot, self.output = robot, output
        self.sheet = make_sheet(robot, *frames, jacobian=OUTPUTS[output])

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
            A 4x4 matrix, or 6 rows for a Jacobian, in the symbols `q1`, `q2`, ... and the parameters by name; they have
            no assumptions. A product that is printed in parts is a `MatMul` of its parts; `.doit()` multiplies them.

        Raises:
            KinegenError: If there are several matrices and `name` is none of them.

        Example:
            >>> import kinegen
            >>> pose = kinegen.load("robots/planar_3r.yaml").closed_form().sympy()
            >>> pose.shape, pose[2, 2]
            ((4, 4), 1)
        """
        from kinegen.textbook.sheet_sympy import sympy_product

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
