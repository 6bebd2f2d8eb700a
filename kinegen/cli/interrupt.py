"""Ctrl-C, also where a library swallows what it raises.

Python turns Ctrl-C into an exception wherever the program happens to be. Some libraries below catch every exception in
places, and the build would go on as if nothing had been pressed. So it is remembered too, and looked at between stages.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_pressed = threading.Event()


@contextmanager
def remembering() -> Iterator[None]:
    """Remember Ctrl-C while a command runs; it is raised as ever. Where signals go elsewhere, nothing is changed."""
    _pressed.clear()
    ours = threading.current_thread() is threading.main_thread()
    if not ours or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    signal.signal(signal.SIGINT, _press)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def raise_if_pressed() -> None:
    """Raise what got lost.

    Raises:
        KeyboardInterrupt: If Ctrl-C was pressed since the command began.
    """
    if _pressed.is_set():
        raise KeyboardInterrupt


def _press(number: int, frame: FrameType | None) -> None:
    _pressed.set()
    signal.default_int_handler(number, frame)
