"""Signals that end a study in order: what runs is stopped first, and writes its checkpoints."""

import signal
import threading
from contextlib import contextmanager

STOPPING = ("SIGINT", "SIGTERM", "SIGHUP")  # Ctrl-C, kill, and a terminal that is closed


@contextmanager
def noted_signals():
    """Yield a list that signals which would end this process are only noted in.

    A second signal raises KeyboardInterrupt; the workers then end by themselves, with their
    checkpoints. In a thread other than the main one, signals stay what they are.
    """
    seen = []

    def note(number, _):
        seen.append(number)
        if len(seen) > 1:
            raise KeyboardInterrupt

    old = {}
    if threading.current_thread() is threading.main_thread():
        for name in STOPPING:
            number = getattr(signal, name, None)
            if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
                old[number] = signal.signal(number, note)
    try:
        yield seen
    finally:
        for number, handler in old.items():
            signal.signal(number, handler)
