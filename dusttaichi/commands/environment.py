"""Environment of a command: full disks behind its streams, variables for other programs."""

import codecs
import errno
import os
import sys
import warnings
from contextlib import contextmanager, suppress

from dusttaichi.compute.processes import HDF5_LOCKS
from dusttaichi.errors import DustError


class Output:
    """A stream that does not raise where it cannot be written; further output is discarded.

    A run of weeks does not end because the disk of its log is full. error: the first
    OSError, or None.
    """

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
            os.dup2(nowhere, self._stream.fileno())  # discards the buffer at the end
            os.close(nowhere)
            return 0


WORDS = {"µ": "u", "μ": "u", "φ": "phi", "Φ": "phi", "±": "+-", "·": "*", "×": "x", "≥": ">="}
WORDS |= {"≤": "<=", "–": "-", "—": "-", "−": "-", "…": "...", "°": "deg", "²": "^2", "³": "^3"}
WORDS |= {"Δ": "Delta", "Σ": "Sum", "σ": "sigma", "ρ": "rho", "γ": "gamma", "ξ": "xi", "ν": "nu"}


def _in_words(error):
    """Handler of characters that the encoding of a stream lacks: a word, or a question mark."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    lacking = error.object[error.start : error.end]
    words = "".join(WORDS.get(character, "?") for character in lacking)
    return words, error.end


codecs.register_error("dusttaichi.words", _in_words)


def _let_print_anything(stream):
    """Write words for characters that the encoding of a stream lacks, such as φ in ASCII."""
    with suppress(AttributeError, ValueError, OSError):  # not a text stream of Python
        if "utf" not in stream.encoding.lower():
            stream.reconfigure(errors="dusttaichi.words")


@contextmanager
def guard_streams():
    """Context in which streams and variables of the shell raise no exceptions.

    At its end, raises DustError if results could not be printed. A reader that has closed its end,
    such as `head`, is not an error.
    """
    _forget_foreign_settings()
    os.environ.setdefault(HDF5_LOCKS, "FALSE")
    for stream in (sys.stdout, sys.stderr):
        _let_print_anything(stream)
    original_streams = sys.stdout, sys.stderr, sys.__stdout__
    sys.stdout, sys.stderr = Output(sys.stdout), Output(sys.stderr)
    sys.__stdout__ = sys.stdout  # Taichi would assume a notebook if they differed
    try:
        yield
        sys.stdout.flush()
        error = sys.stdout.error
    finally:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        sys.stdout, sys.stderr, sys.__stdout__ = original_streams
    if error is not None and error.errno not in (errno.EPIPE, errno.EBADF):
        raise DustError(f"the output could not be printed: {error.strerror}")


def _forget_foreign_settings():
    """Select a backend without windows for figures, and ignore PYTHONWARNINGS.

    Warnings of libraries are then not errors.
    """
    os.environ["MPLBACKEND"] = "agg"
    os.environ.pop("PYTHONWARNINGS", None)
    warnings.filters[:] = [
        ("default" if rule[0] == "error" else rule[0], *rule[1:]) for rule in warnings.filters
    ]
