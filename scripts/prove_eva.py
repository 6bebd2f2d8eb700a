"""Proves with Frama-C that the emitted kernels have no run-time error, and writes docs/proof.md.

    python scripts/prove_eva.py             proves everything and rewrites the page; fails at an alarm
    python scripts/prove_eva.py --current   says whether the page is about the kernels as they are emitted now

What is proved, and how, is in the page and in kinegen/verify/frama_c/. On Debian, Frama-C is the package frama-c-base.
"""

from __future__ import annotations

import os
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))  # The drivers are part of the tests and in no package.

from kinegen.verify.frama_c.eva import Outcome, analyse, require_program, version  # noqa: E402
from tests.prove.page import Proof, digests, digests_of, page, proofs  # noqa: E402

PAGE = ROOT / "docs" / "proof.md"
LOGS = ROOT / "build" / "prove"


def main(arguments: list[str]) -> int:
    """Proves, or says whether a proof is due; returns the exit status."""
    before = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    if arguments == ["--current"]:
        return _tell_whether_current(before)
    require_program()
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        done = list(pool.map(_prove, proofs()))
    failed = [proof.subject for proof, outcome in done if not outcome.proves(proof.driver)]
    if failed:
        print(f"not proved: {', '.join(failed)}; {LOGS.relative_to(ROOT)} has the output of Frama-C")
        return 1
    after = page(done, version())
    if after != before:
        PAGE.write_text(after, encoding="utf-8", newline="\n")
        print(PAGE.relative_to(ROOT))
    return 0


def _prove(proof: Proof) -> tuple[Proof, Outcome]:
    begin = time.perf_counter()
    outcome = analyse(proof.driver)
    LOGS.mkdir(parents=True, exist_ok=True)
    (LOGS / f"{proof.driver.name}.txt").write_text(outcome.text, encoding="utf-8")
    word = "proved" if outcome.proves(proof.driver) else f"NOT PROVED, {outcome.alarms} alarms, {outcome.open} open"
    print(f"{proof.subject:<32}{time.perf_counter() - begin:6.1f} s  {word}", flush=True)
    return proof, outcome


def _tell_whether_current(page: str) -> int:
    now = digests()
    stale = [name for name, found in now.items() if digests_of(page).get(name) != found]
    if stale:
        print(
            f"docs/proof.md is about other kernels than {', '.join(stale)}: run 'make prove' and commit what it changes"
        )
    return int(bool(stale))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
