"""Signals that end a process in order: Ctrl-C, a kill, a closed terminal."""

import signal
import threading
import time as real_time
from contextlib import contextmanager

from dusttaichi.errors import Interrupted

PATIENCE = 15.0  # s that a run may take to its next pause before a further signal ends it at once
NAMES = ("SIGINT", "SIGTERM", "SIGHUP")  # as far as the system has them and does not ignore them


@contextmanager
def handled_by(handler):
    """The signals go to `handler` meanwhile; nothing changes in threads beside the main one."""
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


class Interrupts:
    """Takes the signals while it is entered.

    A signal sets `asked`, which a run sees at its next pause, and until `collect` is called it
    raises KeyboardInterrupt as well: Python loses that where an object is just being deleted. A run
    that does not come to its next pause in PATIENCE seconds is ended by the next signal.
    """

    def __init__(self):
        self._asked_at, self._seen, self._collects = None, False, False
        self._handled = handled_by(self._take)

    @property
    def asked(self):
        """True once there was a signal. Who reads it ends the run in order."""
        self._seen = self._asked_at is not None
        return self._seen

    def __enter__(self):
        self._handled.__enter__()
        return self

    def __exit__(self, *error):
        self._handled.__exit__(*error)

    def collect(self):
        """From here on a signal raises no KeyboardInterrupt."""
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
    """An interruption of what is done inside says that nothing was computed. Raises Interrupted."""
    try:
        yield
    except KeyboardInterrupt:
        text = "interrupted before the first step: nothing was computed"
        raise Interrupted(text, kept=False) from None
