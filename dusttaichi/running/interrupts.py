"""Signals that end a process in an orderly way: Ctrl-C, a kill, a closed terminal."""

from __future__ import annotations

import signal
import threading
import time as real_time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING, Any

from dusttaichi.errors import Interrupted

if TYPE_CHECKING:
    from typing_extensions import Self


PATIENCE = 15.0  # s to the next pause of a run before a further signal ends it immediately
NAMES = ("SIGINT", "SIGTERM", "SIGHUP")  # those of the system that are not ignored


@contextmanager
def handled_by(handler: Callable[[int, FrameType | None], Any]) -> Iterator[None]:
    """Context in which `handler` handles the signals, in the main thread."""
    former_handlers = {}
    if threading.current_thread() is threading.main_thread():
        signals = [getattr(signal, name) for name in NAMES if hasattr(signal, name)]
        handled = [n for n in signals if signal.getsignal(n) is not signal.SIG_IGN]
        former_handlers = {number: signal.signal(number, handler) for number in handled}
    try:
        yield
    finally:
        for number, former_handler in former_handlers.items():
            signal.signal(number, former_handler)


@contextmanager
def noted_signals() -> Iterator[list[int]]:
    """Context that yields a list of the signals received, instead of ending the process.

    A second signal raises KeyboardInterrupt; the workers then write their checkpoints and end. In a
    thread other than the main one, signals keep their effect.
    """
    seen = []

    def note(number: int, _: object) -> None:
        seen.append(number)
        if len(seen) > 1:
            raise KeyboardInterrupt

    with handled_by(note):
        yield seen


class Interrupts:
    """Context that handles the signals.

    A signal sets `requested`, which a run checks at its pauses, and until `collect` is called it
    also raises KeyboardInterrupt, which Python may lose while an object is deleted. A run without a
    pause in PATIENCE seconds is ended by the next signal.
    """

    def __init__(self) -> None:
        self._asked_at: float | None = None
        self._seen, self._collects = False, False
        self._handled = handled_by(self._take)

    @property
    def requested(self) -> bool:
        """True after a signal; the run then ends in an orderly way."""
        self._seen = self._asked_at is not None
        return self._seen

    def __enter__(self) -> Self:
        self._handled.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        self._handled.__exit__(*error)

    def collect(self) -> None:
        """From now on a signal raises no KeyboardInterrupt."""
        self._collects = True

    def _take(self, *_: object) -> None:
        received_at = real_time.monotonic()
        if self._asked_at is None:
            self._asked_at = received_at
        deaf = not self._seen and received_at - self._asked_at > PATIENCE
        if deaf or not self._collects:
            raise KeyboardInterrupt


@contextmanager
def before_the_first_step() -> Iterator[None]:
    """Context in which an interruption raises Interrupted: nothing was computed."""
    try:
        yield
    except KeyboardInterrupt:
        text = "interrupted before the first step: nothing was computed"
        raise Interrupted(text, resumable=False) from None


@contextmanager
def resumable(onward: str, progress: str | None = None) -> Iterator[None]:
    """Context in which an interruption raises an Interrupted that says how to continue.

    onward: how, such as a command. progress: sentence about the finished part of a study; without
    it a KeyboardInterrupt stays one.
    """
    try:
        yield
    except Interrupted as stop:
        if not stop.resumable:
            raise
        raise Interrupted(f"{stop}. Continue with: {onward}") from None
    except KeyboardInterrupt:
        if progress is None:
            raise
        raise Interrupted(f"interrupted; {progress}. Continue with: {onward}") from None


@contextmanager
def all_computed(onward: str) -> Iterator[None]:
    """Context after the last step, in which an interruption raises an Interrupted that says so.

    onward: sentence, without a full stop, on how to get what is missing.
    """
    try:
        yield
    except KeyboardInterrupt:
        raise Interrupted(f"interrupted; all is computed. {onward}", resumable=False) from None
