"""Changes the meaning of one line of kinegen at a time, in a copy, and sees that a test fails.

python scripts/mutants.py                 all of tests/mutants.yaml
python scripts/mutants.py --sample        one in seven, drawn by the commit
python scripts/mutants.py --list          prints them
python scripts/mutants.py "a name" ...    those alone

A mutant is tried with the quick tests that it names, and where these pass with the slow ones. Nothing in the working
tree is written.
"""

from __future__ import annotations

import argparse
import compileall
import os
import py_compile
import re
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue

import yaml

sys.path.append(str(Path(__file__).parent))
import sampling

ROOT = Path(__file__).resolve().parent.parent
TABLE = ROOT / "tests" / "mutants.yaml"

ALLOWED = 0
"""So many may survive."""

LEFT_OUT = (
    ".git",
    ".venv",
    ".hypothesis",
    ".mypy_cache",
    ".pytest_cache",
    ".ruff_cache",
    "__pycache__",
    "build",
    "dist",
    "*.so",
)
"""What tests of a copy do not need."""

FAILURE = re.compile(r"^(?:FAILED|ERROR) (\S+?(?:\[.*?\])?)(?: - |$)", re.MULTILINE)
"""How pytest names a test that failed; parameters may hold spaces."""

SECONDS = 900
"""A selection of tests that takes longer has found that the mutant does not end."""


@dataclass(frozen=True)
class Mutant:
    """One change of meaning."""

    stage: str  # The part of kinegen that it is in
    name: str  # What is wrong then, unique among all
    file: str  # The file, below the top of the repository
    old: str  # A piece of its text, which is there once
    new: str  # What replaces it
    tests: tuple[str, ...]  # Files or names of tests, of which one has to fail

    def applied(self, root: Path = ROOT) -> str:
        """The text of the file with the change.

        Raises:
            ValueError: If the piece is not there, or there several times.
        """
        text = (root / self.file).read_text(encoding="utf-8")
        if text.count(self.old) != 1:
            raise ValueError(f"{self.name}: {self.file} has {text.count(self.old)} matches of {self.old!r}")
        return text.replace(self.old, self.new)


@dataclass(frozen=True)
class Outcome:
    """What became of a mutant."""

    mutant: Mutant
    killer: str  # The test that failed; empty where none did
    seconds: float  # What the tests took

    def __str__(self) -> str:
        state = f"killed by {self.killer}" if self.killer else "SURVIVES"
        return f"{self.mutant.stage:<9} {self.mutant.name}: {state} ({self.seconds:.0f} s)"


def mutants(table: Path = TABLE) -> tuple[Mutant, ...]:
    """All mutants, in the order of the table."""
    stages = yaml.safe_load(table.read_text(encoding="utf-8"))
    return tuple(
        Mutant(stage, each["name"], each["file"], each["old"], each["new"], tuple(each["tests"].split()))
        for stage, some in stages.items()
        for each in some
    )


def copies_in(folder: Path, count: int) -> tuple[Path, ...]:
    """Copies of the repository, in which Python takes a compiled module by what its source holds, whatever its time."""
    first, *others = copies = tuple(folder / str(number) for number in range(count))
    shutil.copytree(ROOT, first, ignore=shutil.ignore_patterns(*LEFT_OUT))
    compileall.compile_dir(first, quiet=2, invalidation_mode=py_compile.PycInvalidationMode.CHECKED_HASH)
    for copy in others:
        shutil.copytree(first, copy)
    return copies


def failing(copy: Path, tests: tuple[str, ...], *options: str) -> str:
    """The first test that fails in a copy, what else ended the run, or nothing."""
    home = copy.parent / f"{copy.name}.home"
    home.mkdir(exist_ok=True)
    command = (sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *options, *tests)
    variables = {**os.environ, "PYTHONPATH": str(copy), "XDG_CACHE_HOME": str(home), "TMPDIR": str(home)}
    variables.pop("PYTHONDONTWRITEBYTECODE", None)
    try:
        done = subprocess.run(
            command, cwd=copy, env=variables, capture_output=True, text=True, check=False, timeout=SECONDS
        )
    except subprocess.TimeoutExpired:
        return f"a test that does not end within {SECONDS} s"
    if done.returncode in (0, 5):  # all pass, or `-m` leaves none
        return ""
    if (found := FAILURE.search(done.stdout)) is None:
        raise RuntimeError(f"pytest ended with {done.returncode}: {(done.stdout + done.stderr)[-2000:]}")
    return found[1]


def tried(mutant: Mutant, copy: Path) -> Outcome:
    """Try one mutant: its quick tests, then its slow ones."""
    path, begin = copy / mutant.file, time.monotonic()
    try:
        path.write_text(mutant.applied(copy), encoding="utf-8")
        killer = failing(copy, mutant.tests) or failing(copy, mutant.tests, "-m", "slow")
    finally:
        shutil.copy2(ROOT / mutant.file, path)
    return Outcome(mutant, killer, time.monotonic() - begin)


def run(chosen: tuple[Mutant, ...], jobs: int) -> list[Outcome]:
    """Try mutants, some at a time, each in a copy that no other one uses meanwhile."""
    copies: SimpleQueue[Path] = SimpleQueue()

    def next_one(mutant: Mutant) -> Outcome:
        copy = copies.get()
        try:
            outcome = tried(mutant, copy)
        finally:
            copies.put(copy)
        print(outcome, flush=True)
        return outcome

    with tempfile.TemporaryDirectory(prefix="kinegen-mutants-", ignore_cleanup_errors=True) as folder:
        for copy in copies_in(Path(folder), max(1, min(jobs, len(chosen)))):
            copies.put(copy)
        with ThreadPoolExecutor(jobs) as pool:
            outcomes = list(pool.map(next_one, chosen))
        # A test that fails without a mutant has killed none.
        killers = dict.fromkeys(outcome.killer for outcome in outcomes if "::" in outcome.killer)
        if killers and (broken := failing(copies.get(), tuple(killers), "-m", "")):
            raise RuntimeError(f"{broken} fails without any mutant")
    return outcomes


def main() -> int:
    """Run it; the exit code."""
    parser = argparse.ArgumentParser(description="Sees that a test fails for every mutant of tests/mutants.yaml.")
    parser.add_argument("names", nargs="*", help="mutants; all if left out")
    parser.add_argument("--sample", action="store_true", help="one in seven, drawn by the commit")
    parser.add_argument("--list", action="store_true", help="print the mutants and try none")
    parser.add_argument("--jobs", type=int, default=2, help="mutants at a time")
    options = parser.parse_args()
    commit, names = sampling.commit() if options.sample else "", options.names
    chosen = tuple(each for each in mutants() if not names or each.name in names)
    chosen = tuple(each for each in chosen if not options.sample or sampling.is_in_sample(each.name, commit))
    if options.list:
        print(*(f"{each.stage:<9} {each.file}: {each.name}" for each in chosen), sep="\n")
        return 0

    survivors = [outcome for outcome in run(chosen, options.jobs) if not outcome.killer]
    print(
        f"{len(chosen) - len(survivors)} of {len(chosen)} mutants are killed, {len(survivors)} survive",
        *survivors,
        sep="\n",
    )
    return int(len(survivors) > ALLOWED)


if __name__ == "__main__":
    sys.exit(main())
