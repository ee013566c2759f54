"""Errors for the user. The command line prints them without a traceback."""

import re
from collections.abc import Iterator
from contextlib import contextmanager


class DustError(Exception):
    """Error that the user can correct: bad input, a missing file, a full disk. Exit code 2."""

    exit_code = 2


class StartError(DustError):
    """The backend cannot start on this machine, for no scene that asks for it. Exit code 2."""


class GuardStop(DustError):
    """A guard stopped a run because its numbers are no longer valid. Exit code 3.

    Results up to there are saved.
    """

    exit_code = 3


class Interrupted(DustError):
    """Ctrl-C or SIGTERM ended the command. Exit code 130.

    resumable: results are on disk, from which the command can continue.
    """

    exit_code = 130

    def __init__(self, text: str = "interrupted", resumable: bool = True) -> None:
        super().__init__(text)
        self.resumable = resumable


def with_keywords(text: str) -> str:
    """The text of an error with keywords of Python in place of options of `dust`."""
    text = re.sub(r"--(force|resume)\b", r"\1=True", text)
    text = text.replace("--set ", "").replace("--output", "directory")
    return re.sub(r"(?<![\w-])--([a-z]+)\b", r"\1", text)


@contextmanager
def naming_keywords() -> Iterator[None]:
    """Context in which a DustError names keywords of Python in place of options of `dust`."""
    try:
        yield
    except DustError as error:
        error.args = tuple(with_keywords(text) for text in error.args)
        raise
