"""What reading a file changed, and what it kept although it looks like a slip: the report of an import.

In: findings about single numbers. Out: a record that the command line prints and writes as JSON. Effects are upper
bounds in the length unit of the robot, by lengths along the chain; no pose is computed here.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Finding:
    """One number of the file that is nearly something else.

    Attributes:
        line: Its line in the file.
        where: Where it is, such as `joint 'elbow', rpy[2]`.
        text: As it is printed in the file.
        exact: What it became, or what it is near to.
        digits: How far the two are apart, in units of the last printed digit.
        effect: How far the difference moves a tip at most, in the length unit of the robot.
        changed: Whether the exact value was taken; otherwise every printed digit was kept.
    """

    line: int
    where: str
    text: str
    exact: str
    digits: float
    effect: float
    changed: bool


@dataclass(frozen=True, slots=True)
class Report:
    """Everything that a reader has to say.

    Attributes:
        findings: The numbers that were changed, and those that were kept, in the order of the file.
        renamed: Names of the file that are not identifiers or are taken, each with the name used instead.
        notes: What could not be carried, or was chosen, one sentence each.
        links: The frame of each link of the file, by name.
    """

    findings: tuple[Finding, ...] = ()
    renamed: tuple[tuple[str, str], ...] = ()
    notes: tuple[str, ...] = ()
    links: tuple[tuple[str, str], ...] = ()

    @property
    def changed(self) -> tuple[Finding, ...]:
        """The numbers that were changed."""
        return tuple(each for each in self.findings if each.changed)

    @property
    def kept(self) -> tuple[Finding, ...]:
        """The numbers that are nearly special and were kept."""
        return tuple(each for each in self.findings if not each.changed)

    @property
    def effect(self) -> float:
        """How far all changes together move a tip at most."""
        return sum(each.effect for each in self.changed)

    @property
    def summary(self) -> str:
        """What was changed, in one line; only where something was."""
        count = len(self.changed)
        several = f"{count} numbers were taken as the exact values that their digits stand for"
        one = "1 number was taken as the exact value that its digits stand for"
        return f"{one if count == 1 else several} (a tip moves at most {self.effect:.2g} m)"


EMPTY = Report()
