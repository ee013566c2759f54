"""Signals that end a study in order: what runs is stopped first, and writes its checkpoints."""

from contextlib import contextmanager

from dusttaichi.run.interrupts import handled_by


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

    with handled_by(note):
        yield seen
