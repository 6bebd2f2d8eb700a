"""What was found of each function, as records that can be printed, kept and read by programs.

The keys of `Evidence.record` are stable:

    robot       its name
    digest      of the model, as in the banners of the C files
    units       length and angle of the ranges
    parameters  the runtime parameters with their values, which are those of the file
    frama_c     version of Frama-C
    holds       whether everything that is claimed of all functions was shown
    not_analysed   outputs that were left out, each with the reason
    functions   for each: function, output, real, claim (`finite` or `defined`), holds, alarms, open (assertions that
                were not shown), unreached (statements), ranges (name, low, high, unit, source of each number of the
                inputs; none where they may be anything), results (name, low, high), messages (one for each alarm),
                command and seconds
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

from kinegen.prove.claims import Subject
from kinegen.prove.eva import Outcome, command_for


@dataclass(frozen=True, slots=True)
class Finding:
    """What Eva found in one function.

    Attributes:
        subject: The function.
        outcome: What Eva said.
        seconds: How long it took.
    """

    subject: Subject
    outcome: Outcome
    seconds: float

    @property
    def holds(self) -> bool:
        """Whether what is claimed of the function was shown."""
        return self.outcome.proves(self.subject.driver)

    @property
    def results(self) -> tuple[tuple[str, float, float], ...]:
        """Hulls of what the function gives: name, lower and upper bound."""
        prefix = f"{self.subject.called}_"
        return tuple((name.removeprefix(prefix), *hull) for name, hull in self.outcome.shown.items())

    def record(self) -> dict[str, object]:
        """The finding as plain data."""
        return {
            "function": self.subject.function,
            "output": self.subject.output,
            "real": self.subject.real,
            "claim": str(self.subject.driver.claim),
            "holds": self.holds,
            "alarms": self.outcome.alarms,
            "open": self.outcome.open,
            "unreached": self.outcome.unreached,
            "ranges": [asdict(each) for each in self.subject.ranges],
            "results": [{"name": name, "low": low, "high": high} for name, low, high in self.results],
            "messages": list(self.outcome.messages),
            "command": command_for(self.subject.driver),
            "seconds": round(self.seconds, 1),
        }


@dataclass(frozen=True, slots=True)
class Evidence:
    """What was found in all functions of a robot.

    Attributes:
        robot: Its name.
        digest: Of its model.
        length: The unit of lengths.
        parameters: The runtime parameters, each with the value at which the functions were analysed.
        version: Of Frama-C.
        findings: One for each function.
        left_out: Outputs that were not analysed, each with the reason.
    """

    robot: str
    digest: str
    length: str
    parameters: tuple[tuple[str, float], ...]
    version: str
    findings: tuple[Finding, ...]
    left_out: tuple[tuple[str, str], ...]

    @property
    def holds(self) -> bool:
        """Whether what is claimed of every function was shown."""
        return all(finding.holds for finding in self.findings)

    def record(self) -> dict[str, object]:
        """The evidence as plain data."""
        return {
            "robot": self.robot,
            "digest": self.digest,
            "units": {"length": self.length, "angle": "rad"},
            "parameters": dict(self.parameters),
            "frama_c": self.version,
            "holds": self.holds,
            "not_analysed": [{"output": output, "reason": reason} for output, reason in self.left_out],
            "functions": [finding.record() for finding in self.findings],
        }

    def files(self, report: str, document: str) -> dict[str, str]:
        """The files of a folder that keeps the evidence.

        Args:
            report: What is printed for people.
            document: The same for programs, as JSON.

        Returns:
            Text by path: the two, and for each function its program, the command and what Frama-C said.
        """
        found = {"report.txt": report, "report.json": document}
        for finding in self.findings:
            stem = finding.subject.function
            found |= {f"{stem}/{name}": text for name, text in finding.subject.driver.files.items()}
            found[f"{stem}/command.txt"] = command_for(finding.subject.driver) + "\n"
            found[f"{stem}/frama-c.txt"] = finding.outcome.text
        return found
