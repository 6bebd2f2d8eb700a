"""Work in a process of its own: its result and its errors come back, and its death is an error with a name."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from types import FrameType

import pytest

from kinegen.errors import ProofError, RobotFileError
from kinegen.verify import isolation as processes
from kinegen.verify.isolation import calling, isolated, latest_call

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere the work is done in the same process")


def crash() -> None:
    calling("C double pose")
    ctypes.memset(0, 0, 1)


def abort() -> None:
    calling("C float jacobian")
    os.abort()


def leave() -> None:
    calling("C double frames")
    os._exit(3)


def test_a_result_comes_back_from_another_process() -> None:
    own, number = isolated("arm", lambda: (os.getpid(), 7))

    assert own != os.getpid()
    assert number == 7


def test_an_error_comes_back_with_its_file_and_line() -> None:
    def refuse() -> None:
        raise RobotFileError("no rows", "arm.yaml", 3)

    with pytest.raises(RobotFileError) as caught:
        isolated("arm", refuse)

    assert (caught.value.path, caught.value.line, caught.value.message) == ("arm.yaml", 3, "no rows")
    assert "in refuse" in str(caught.value.__cause__)


def test_an_error_that_cannot_be_pickled_comes_back_as_its_words() -> None:
    def refuse() -> None:
        raise type("Odd", (Exception,), {})("in words")

    with pytest.raises(RuntimeError, match="Odd: in words"):
        isolated("arm", refuse)


def test_a_result_that_cannot_be_pickled_is_an_error() -> None:
    with pytest.raises(ProofError, match=r"exit status 70"):
        isolated("arm", lambda: lambda: 1)


@pytest.mark.parametrize(
    ("work", "message"),
    [
        (crash, r"arm: C double pose crashes \(SIGSEGV\); nothing was written"),
        (abort, r"arm: C float jacobian crashes \(SIGABRT\); nothing was written"),
        (leave, "arm: C double frames ends the process that calls it, with exit status 3; nothing was written"),
        (lambda: os.kill(os.getpid(), signal.SIGKILL), "arm: the compiled module was ended from outside"),
    ],
    ids=["crash", "abort", "exit", "killed"],
)
def test_a_death_is_an_error_that_names_the_call(
    work: Callable[[], None], message: str, capfd: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(ProofError, match=message):
        isolated("arm", work)

    assert capfd.readouterr() == ("", "")


def test_a_call_that_does_not_return_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(processes, "PATIENCE", 0.05)

    def hang() -> None:
        calling("C double pose")
        while True:
            pass

    with pytest.raises(ProofError, match="C double pose does not return within 0 s of CPU time"):
        isolated("arm", hang)


def test_waiting_costs_no_patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine that is busy with other things ends nothing."""
    monkeypatch.setattr(processes, "PATIENCE", 0.08)

    def work() -> int:
        time.sleep(0.15)
        return 5

    assert isolated("arm", work) == 5


def test_temporary_files_of_a_process_that_dies_are_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))

    def work() -> None:
        tempfile.mkdtemp()
        crash()

    with pytest.raises(ProofError):
        isolated("arm", work)

    assert not any(tmp_path.iterdir())


def test_the_process_ends_with_the_wait_for_it(tmp_path: Path) -> None:
    def press(_number: int, frame: FrameType | None) -> None:
        # What is raised while Python forks is lost: on a slow machine the key is pressed again, until the wait is on.
        callers = {each.f_code for each, _ in traceback.walk_stack(frame)}
        if processes._awaited.__code__ not in callers:
            signal.setitimer(signal.ITIMER_REAL, 0.01)
            return
        raise KeyboardInterrupt

    def work() -> None:
        time.sleep(0.15)
        (tmp_path / "late").touch()

    before = signal.signal(signal.SIGALRM, press)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.05)
        with pytest.raises(KeyboardInterrupt):
            isolated("arm", work)
    finally:
        signal.signal(signal.SIGALRM, before)
    time.sleep(0.2)

    assert not any(tmp_path.iterdir())


def test_a_call_is_noted_without_such_a_process_too() -> None:
    calling("C double pose")

    assert latest_call() == "C double pose"
