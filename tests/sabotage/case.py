r"""What a sabotage is: one alteration of the emitted text, which the build has to refuse.

A module `cases_*.py` beside this one exports `CASES`, a tuple of `Sabotage`; `test_sabotage.py` takes up all of them
without naming them. To add a case:

1. Build the robot with the outputs, `real` and `options` of the case, and open the emitted file.
2. Write a regular expression that matches the place to alter, and its replacement as for `re.sub`. `count` matches are
   replaced, the first ones; 0 replaces all. `after` is a plain text behind which the search begins, for example the
   name of the function. The expression has to match in every file that `file` names, and the text has to change:
   otherwise the test fails, so that a case cannot become void when a template changes.
3. The build must end with one of `errors`, by default a `ProofError`: text that does not compile proves nothing.
   `message` is a regular expression that its text must contain, for cases that could be refused for another reason.

The alteration is made where the text is emitted, so everything after it happens as in any build: the digest of the
sources is taken from the altered files, they are compiled, and the package is proven.

    Sabotage(
        "float: the sign of d in the batch",      # unique; says what is wrong
        "puma560",                                # robots/puma560.yaml; or in robots/ of these tests, of tests/inverse
        "pose,frames",                            # as for --outputs
        "puma560_f32_batch.c",                    # a glob of emitted names; paths below the folder with --package
        r"0\.1254F",
        "-0.1254F",
        after="puma560_f32_fk_tile(",
    )

Options are those of `kinegen build`, a word each: `--portable`, `--wrt=dh`, `--package=cmake`, `--no-compile`. Kernels
are compiled quickly (-O1, for any processor, without contraction), except with `--portable` or `--march=...`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase

from kinegen.errors import KinegenError, ProofError


@dataclass(frozen=True, slots=True)
class Sabotage:
    """One alteration.

    Attributes:
        name: What is wrong, unique among all cases.
        robot: Stem of the robot file.
        outputs: What is built, as for `--outputs`.
        file: Which emitted files are altered, as a glob of their names.
        old: Regular expression of what is replaced.
        new: The replacement, as for `re.sub`.
        real: Number types, as for `--real`.
        options: Further options of `kinegen build`.
        count: How many matches are replaced; 0 for all.
        after: Plain text behind which the first match is looked for.
        errors: One of these is raised.
        message: Regular expression that the message must contain.
    """

    name: str
    robot: str
    outputs: str
    file: str
    old: str
    new: str
    real: str = "both"
    options: tuple[str, ...] = ()
    count: int = 1
    after: str = ""
    errors: tuple[type[KinegenError], ...] = (ProofError,)
    message: str = ""

    @property
    def setting(self) -> Setting:
        """What is built."""
        return Setting(self.robot, self.outputs, self.real, self.options)

    def applied(self, files: Mapping[str, str]) -> dict[str, str]:
        """The files with the alteration; those that it does not name stay as they are.

        Args:
            files: Emitted text by name.

        Raises:
            AssertionError: If a file that is named has no such place, or stays the same.
        """
        return {name: self._altered(name, text) for name, text in files.items()}

    def _altered(self, name: str, text: str) -> str:
        if not fnmatchcase(name, self.file):
            return text
        head, mark, rest = text.partition(self.after) if self.after else ("", "", text)
        altered, found = re.subn(self.old, self.new, rest, count=self.count, flags=re.DOTALL | re.MULTILINE)

        assert mark == self.after, f"{self.name}: {name} does not contain {self.after!r}"
        assert found >= max(1, self.count), f"{self.name}: {name} has {found} matches of {self.old!r}"
        assert altered != rest, f"{self.name}: {name} stays the same"
        return head + mark + altered


@dataclass(frozen=True, slots=True)
class Setting:
    """A build: a robot and the options that decide what is emitted.

    Attributes:
        robot: Stem of the robot file.
        outputs: As for `--outputs`.
        real: As for `--real`.
        options: Further options of `kinegen build`.
    """

    robot: str
    outputs: str
    real: str
    options: tuple[str, ...]

    def __str__(self) -> str:
        return " ".join([self.robot, self.outputs, self.real, *self.options])
