"""Environment of a command: full disks behind its streams, variables of other programs."""

import errno
import os
import sys
import warnings
from contextlib import contextmanager

from dusttaichi.errors import DustError


class Output:
    """A stream that does not raise where it cannot be written: what follows goes nowhere, so that
    a run of weeks does not end with the disk of its log. `error`: the first one, or None."""

    def __init__(self, stream):
        self._stream, self.error = stream, None

    def __getattr__(self, name):
        return getattr(self._stream, name)

    def write(self, text):
        return self._safely(self._stream.write, text)

    def flush(self):
        self._safely(self._stream.flush)

    def _safely(self, function, *arguments):
        try:
            return function(*arguments)
        except OSError as error:
            self.error = self.error or error
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self._stream.fileno())  # what is buffered goes there at the end
            os.close(nowhere)
            return 0


@contextmanager
def guarded():
    """Inside, nothing of the shell's makes an exception of its own; at the end, a DustError where
    the results could not be printed. A reader that has gone, as `head`, is none."""
    _forget_foreign_settings()
    before = sys.stdout, sys.stderr, sys.__stdout__
    sys.stdout, sys.stderr = Output(sys.stdout), Output(sys.stderr)
    sys.__stdout__ = sys.stdout  # Taichi takes another one than this for a notebook
    try:
        yield
        sys.stdout.flush()
        error = sys.stdout.error
    finally:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        sys.stdout, sys.stderr, sys.__stdout__ = before
    if error is not None and error.errno not in (errno.EPIPE, errno.EBADF):
        raise DustError(f"the output could not be printed: {error.strerror}")


def _forget_foreign_settings():
    """Figures are files: no backend with windows is needed, whatever is set. A warning of a library
    is no error, whatever PYTHONWARNINGS says."""
    os.environ["MPLBACKEND"] = "agg"
    os.environ.pop("PYTHONWARNINGS", None)
    warnings.filters[:] = [
        ("default" if rule[0] == "error" else rule[0], *rule[1:]) for rule in warnings.filters
    ]
