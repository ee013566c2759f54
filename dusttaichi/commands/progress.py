"""The progress of the commands: a line that moves on a terminal, a line now and then in a log."""

import time as real_time

from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Column

from dusttaichi.commands.console import err, remark

SHOWN = 4  # tasks side by side that the bar tells of
ROOMY = 100  # columns of a terminal from which there is room for the bar itself
LOG_EVERY = 600.0  # s between two lines of progress in a log


class ProgressBar:
    """One line that tells how far a command is: what it does, a share, a state, the time left.

    A context manager. quiet: show nothing; then `log` is silent, too, if `log_quietly` is false.
    The bar is seen from the first `show` on. On a narrow terminal the line has no bar and what does
    not fit is cut; where there is no terminal (a log), there is a plain line every ten minutes.
    console: a rich Console, by default that of the errors.
    """

    def __init__(self, quiet=False, description=None, *, log_quietly=True, console=err):
        self._logs, self._quiet = log_quietly or not quiet, quiet
        self._told = real_time.monotonic()
        self._bar = Progress(
            *_columns(console.width), console=console, disable=quiet or not console.is_terminal
        )
        self._task = self._bar.add_task(
            description or "", total=None, state="", visible=description is not None
        )

    def __enter__(self):
        self._bar.start()
        return self

    def __exit__(self, *_):
        self._bar.stop()

    def show(self, description, completed, total, state=""):
        """Show that `completed` of `total` is done; total None where it is not known."""
        self._bar.update(
            self._task,
            description=description,
            completed=completed,
            total=total,
            state=state,
            visible=True,
        )
        now = real_time.monotonic()
        if not self._bar.console.is_terminal and not self._quiet and now - self._told > LOG_EVERY:
            self._told = now
            share = f"{completed / total:.0%}  " if total else ""
            self._bar.console.print(f"{description}  {share}{state}", soft_wrap=True)

    def log(self, text):
        """Print a line above the bar."""
        if self._logs:
            self._bar.console.print(text, soft_wrap=True)


class Phases:
    """Tells what each phase of a command took, where `on` (--verbose) asks for it."""

    def __init__(self, on):
        self._on, self._began = on, real_time.monotonic()

    def tell(self, what):
        """A phase ends here."""
        now = real_time.monotonic()
        if self._on:
            remark(f"{now - self._began:8.1f} s  {what}")
        self._began = now


def _columns(width):
    """Columns of the progress line on a terminal of this width."""

    def text(pattern, least):
        column = Column(no_wrap=True, overflow="ellipsis", min_width=least)
        return TextColumn(pattern, markup=False, table_column=column)

    left = Column(no_wrap=True, min_width=5)
    return [
        text("{task.description}", 13),
        *([BarColumn()] if width >= ROOMY else []),
        text("{task.percentage:>5.1f} %", 7),
        TimeRemainingColumn(compact=width < ROOMY, table_column=left),
        text("{task.fields[state]}", 8),
    ]


def shares_text(running):
    """The first few of what runs side by side. running: label -> share that is done."""
    return "  ".join(f"{label} {share:.0%}" for label, share in list(running.items())[:SHOWN])
