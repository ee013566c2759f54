"""Signals that end a process in order: Ctrl-C, a kill, a closed terminal."""

import signal
import threading
from contextlib import contextmanager

from dusttaichi.errors import Interrupted

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
    raises KeyboardInterrupt as well: Python loses that where an object is just being deleted.
    """

    def __init__(self):
        self.asked, self._collects = False, False
        self._handled = handled_by(self._take)

    def __enter__(self):
        self._handled.__enter__()
        return self

    def __exit__(self, *error):
        self._handled.__exit__(*error)

    def collect(self):
        """From here on a signal raises no KeyboardInterrupt."""
        self._collects = True

    def _take(self, *_):
        self.asked = True
        if not self._collects:
            raise KeyboardInterrupt


@contextmanager
def before_the_first_step():
    """An interruption of what is done inside says that nothing was computed. Raises Interrupted."""
    try:
        yield
    except KeyboardInterrupt:
        text = "interrupted before the first step: nothing was computed"
        raise Interrupted(text, kept=False) from None
