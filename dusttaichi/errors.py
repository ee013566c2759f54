"""Errors that speak to the user. The command line prints them without a traceback."""


class DustError(Exception):
    """Something the user can mend: bad input, a missing file, a full disk. Exit code 2."""

    exit_code = 2


class GuardStop(DustError):
    """A guard stopped a run because its numbers can no longer be trusted. Exit code 3.

    What was computed up to there is kept.
    """

    exit_code = 3


class Interrupted(DustError):
    """Ctrl-C or SIGTERM ended what was going on. Exit code 130.

    kept: something was computed, and is on disk to go on from.
    """

    exit_code = 130

    def __init__(self, text="interrupted", kept=True):
        super().__init__(text)
        self.kept = kept
