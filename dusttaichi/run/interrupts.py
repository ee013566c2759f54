"""Ctrl-C, SIGTERM, a closed terminal: an exception while a run opens, a request once it goes."""

import signal
import threading

NAMES = ("SIGINT", "SIGTERM", "SIGHUP")  # as far as the system has them and does not ignore them


class Interrupts:
    """Takes the signals while it is entered; in a thread other than the main one it does nothing.

    Until `collect` is called a signal raises KeyboardInterrupt; from then on it sets `asked`, which
    the run sees at its next pause.
    """

    def __init__(self):
        self.asked, self._collects, self._before = False, False, {}

    def __enter__(self):
        if threading.current_thread() is threading.main_thread():
            known = [getattr(signal, name) for name in NAMES if hasattr(signal, name)]
            taken = [n for n in known if signal.getsignal(n) is not signal.SIG_IGN]
            self._before = {number: signal.signal(number, self._take) for number in taken}
        return self

    def __exit__(self, *_):
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def collect(self):
        """From here on signals only ask."""
        self._collects = True

    def _take(self, *_):
        if not self._collects:
            raise KeyboardInterrupt
        self.asked = True
