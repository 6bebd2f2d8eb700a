"""The robot that `kinegen.load` returns: the model, with what people do with it as methods."""

from __future__ import annotations

from dataclasses import FrozenInstanceError, fields
from pathlib import Path
from typing import TYPE_CHECKING

from kinegen.errors import KinegenError, quote
from kinegen.io.format import EMPTY, FORMATS, Report, writable
from kinegen.model.robot import Convention
from kinegen.model.robot import Robot as Model
from kinegen.ui.api.robot_methods import Moving, model_of

if TYPE_CHECKING:
    from kinegen.ui.api.textbook_forms import ClosedForm, Table


class Robot(Moving):
    """A robot: its table, its closed form, its kinematics, and what reading it found.

    `kinegen.load` makes it. It is immutable, and compares, hashes and pickles by what the file says. Every function of
    kinegen that takes a robot takes it.

    Attributes:
        name: Name of the robot, which compiled modules and C functions get.
        description: What the file says about it, one line.
        units: `units.length` is the unit of all lengths: m, cm, mm or in. Angles are in radians everywhere.
        dof: Number of joint variables, the length of a joint vector.
        tips: Frames whose poses `fk` gives: `tool` for a chain, one for each end of a tree.
        frame_names: All frames that have names.

    Example:
        >>> import kinegen
        >>> arm = kinegen.load("robots/puma560.yaml")
        >>> arm
        <kinegen.Robot puma560: 6 joints, modified, lengths in m>
        >>> arm.joints
        ('waist', 'shoulder', 'elbow', 'forearm', 'wrist_bend', 'flange')
    """

    __slots__ = ("_report",)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joint variables, in the order of the joint vector."""
        return self.joint_names

    @property
    def report(self) -> Report:
        """What reading the file changed: numbers taken as exact ones, new names, what was left out.

        It belongs to what `load` returned; a copy or an unpickled robot has an empty one.
        """
        return getattr(self, "_report", EMPTY)

    @property
    def notes(self) -> tuple[str, ...]:
        """What should be looked at: numbers that are nearly special, and angles that look like the other unit.

        Example:
            >>> import kinegen
            >>> arm = kinegen.load({
            ...     "kinegen": 1, "name": "arm", "convention": "standard", "units": {"length": "m", "angle": "deg"},
            ...     "joints": [{"name": "turn", "theta": "q", "d": 0, "a": 0.5, "alpha": 89.9999}],
            ... })
            >>> print(arm.notes[0])  # doctest: +ELLIPSIS
            alpha of joint 1 (turn) is 89.9999 deg, close to 90, ...
        """
        from kinegen.verify.lint.numbers import nearly_special, wrong_unit

        found = (self.report.summary,) if self.report.is_noted else ()
        return (*found, *self.report.notes, *(note.text for note in (*wrong_unit(self), *nearly_special(self))))

    def table(self) -> Table:
        """The table as people read it, in the units of the file.

        Returns:
            The table; `print` shows it as text, a notebook as HTML.

        Example:
            >>> import kinegen
            >>> print(kinegen.load("robots/planar_3r.yaml").table())  # doctest: +ELLIPSIS
            planar_3r: ...
        """
        from kinegen.ui.api.textbook_forms import Table

        return Table(self)

    def closed_form(
        self,
        start: str | int | None = None,
        end: str | int | None = None,
        output: str = "pose",
        *,
        named: bool = False,
        blocks: bool = False,
        variables: str = "q",
    ) -> ClosedForm:
        """The closed form of a pose or a Jacobian, factored as a textbook prints it.

        Args:
            start: Frame of reference, by name or row number; the base if left out.
            end: Frame that is reached; the tool, or every tip of a tree, if left out.
            output: `pose`; or the geometric Jacobian, rows linear velocity and then angular: `jacobian` at the frame's
                origin in the axes of the base, `jacobian_local` in the frame's own axes, `jacobian_world` at the origin
                of the base; `singularities` is its determinant in factors, and where each vanishes; `rpy_zyx`,
                `rpy_xyz` and `euler_zyz` are the angles of the orientation.
            named: Whether what is used more than once has a name.
            blocks: Whether a Jacobian is its linear and its angular part, or of an arm in a plane its three rows.
            variables: What joint variables are called: `q`, or `theta,d` by the kind of the joint.

        Returns:
            The closed form. `print` shows text, a notebook typeset formulas; it has `latex()` and `sympy()`.

        Raises:
            KinegenError: If a frame or an output does not exist, or the formula is too long to be printed.

        Example:
            >>> import kinegen
            >>> arm = kinegen.load("robots/puma560.yaml")
            >>> print(arm.closed_form(start=1, end=3))  # doctest: +ELLIPSIS
                  [  c23  -s23  0   a2*c2 ]
            1T3 = [    0     0  1      d3 ]
                  [ -s23  -c23  0  -a2*s2 ]
                  [    0     0  0       1 ]
            ...
        """
        from kinegen.ui.api.textbook_forms import ClosedForm

        return ClosedForm(self, start, end, output, named=named, blocks=blocks, variables=variables)

    def convert(self, convention: str) -> Robot:
        """The same robot in another convention; every pose of every frame stays the same.

        Args:
            convention: `standard`, `modified` or `ets` (elementary transforms).

        Raises:
            KinegenError: If there is no such convention, or the robot cannot be written in it.

        Example:
            >>> import kinegen
            >>> kinegen.load("robots/puma560.yaml").convert("standard").convention.value
            'standard'
        """
        from kinegen.model.dh_conversion.convert import TARGETS, to_convention

        if convention not in TARGETS:
            raise KinegenError(f"unknown convention {quote(str(convention))} (expected {', '.join(TARGETS)})")
        return from_model(to_convention(model_of(self), Convention(convention)).robot)

    def to_yaml(self) -> str:
        """The robot as the text of a kinegen file, with exact values.

        Example:
            >>> import kinegen
            >>> arm = kinegen.load("robots/puma560.yaml")
            >>> kinegen.load(arm.to_yaml()).digest == arm.digest
            True
        """
        from kinegen.io.robot_file.write import write

        return write(model_of(self))

    def save(self, path: str | Path, *, force: bool = False) -> Path:
        """Write the robot to a file; the suffix names the format: .yaml, .urdf, .csv, .md or .tex.

        Args:
            path: The file.
            force: Whether to replace a file that exists.

        Returns:
            The path.

        Raises:
            KinegenError: If the format cannot be written or hold the robot, or the file exists.

        Example:
            >>> import kinegen, tempfile, pathlib
            >>> with tempfile.TemporaryDirectory() as folder:
            ...     file = kinegen.load("robots/scara.yaml").save(pathlib.Path(folder, "scara.urdf"))
            ...     kinegen.load(file).joints
            ('shoulder', 'elbow', 'stroke')
        """
        from kinegen.support.files.write import write_file

        target = Path(path)
        form = writable(target)
        if form is None or form.write is None:
            known = ", ".join(suffix for each in FORMATS if each.is_writable for suffix in each.suffixes)
            raise KinegenError(f"this suffix names no format that can be written (expected {known})", str(path))
        if target.exists() and not force:
            raise KinegenError("the file exists; force=True replaces it", str(path))
        write_file(target, form.write(model_of(self)))
        return target

    def __setattr__(self, name: str, value: object) -> None:
        raise FrozenInstanceError(f"a robot cannot be changed: {name}")

    def __delattr__(self, name: str) -> None:
        raise FrozenInstanceError(f"a robot cannot be changed: {name}")

    def __repr__(self) -> str:
        count = f"{self.dof} joint{'s' * (self.dof != 1)}"
        tips = f", {len(self.tips)} tips" if self.is_tree else ""
        words = {Convention.ETS: "elementary transforms"}
        kinds = " and ".join(words.get(each, str(each)) for each in self.row_conventions)
        return f"<kinegen.Robot {self.name}: {count}{tips}, {kinds}, lengths in {self.units.length}>"

    def _repr_html_(self) -> str:
        return self.table()._repr_html_()


def from_model(model: Model, report: Report = EMPTY) -> Robot:
    """Return a model, as a reader left it, with methods and what reading it changed."""
    robot = Robot(**{each.name: getattr(model, each.name) for each in fields(model)})
    object.__setattr__(robot, "_report", report)
    return robot
