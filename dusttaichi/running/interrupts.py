"""Signals that end a process in an orderly way: Ctrl-C, a kill, a closed terminal."""

import signal
import threading
import time as real_time
from contextlib import contextmanager

from dusttaichi.errors import Interrupted

PATIENCE = 15.0  # s to the next pause of a run before a further signal ends it immediately
NAMES = ("SIGINT", "SIGTERM", "SIGHUP")  # those of the system that are not ignored


@contextmanager
def handled_by(handler):
    """Context in which `handler` handles the signals, in the main thread."""
    before = {}
    if threading.current_thread() is threading.main_thread():
        known = [getattr(signal, name) for name in NAMES if hasattr(signal, name)]
        taken = [n for n in known if signal.getsignal(n) is not signal.SIG_IGN]
        before = {number: signal.signal(number, handler) for number in taken}
    try:
        yield
    finally:
        for number, old in before.items():
            signal.signal(number, old)


@contextmanager
def noted_signals():
    """Context that yields a list of the signals received, instead of ending the process.

    A second signal raises KeyboardInterrupt; the workers then write their checkpoints and end. In a
    thread other than the main one, signals keep their effect.
    """
    seen = []

    def note(number, _):
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

    def __init__(self):
        self._asked_at, self._seen, self._collects = None, False, False
        self._handled = handled_by(self._take)

    @property
    def requested(self):
        """True after a signal; the run then ends in an orderly way."""
        self._seen = self._asked_at is not None
        return self._seen

    def __enter__(self):
        self._handled.__enter__()
        return self

    def __exit__(self, *error):
        self._handled.__exit__(*error)

    def collect(self):
        """From now on a signal raises no KeyboardInterrupt."""
        self._collects = True

    def _take(self, *_):
        now = real_time.monotonic()
        if self._asked_at is None:
            self._asked_at = now
        deaf = not self._seen and now - self._asked_at > PATIENCE
        if deaf or not self._collects:
            raise KeyboardInterrupt


@contextmanager
def before_the_first_step():
    """Context in which an interruption raises Interrupted: nothing was computed."""
    try:
        yield
    except KeyboardInterrupt:
        text = "interrupted before the first step: nothing was computed"
        raise Interrupted(text, resumable=False) from None


@contextmanager
def resumable(onward, done=None):
    """Context in which an interruption raises an Interrupted that says how to continue.

    onward: how, such as a command. done: sentence about what is finished, of a study; without it a
    KeyboardInterrupt stays one.
    """
    try:
        yield
    except Interrupted as stop:
        if not stop.resumable:
            raise
        raise Interrupted(f"{stop}. Continue with: {onward}") from None
    except KeyboardInterrupt:
        if done is None:
            raise
        raise Interrupted(f"interrupted; {done}. Continue with: {onward}") from None
