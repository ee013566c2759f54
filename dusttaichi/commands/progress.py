"""Progress of the commands: a live line on a terminal, a line every ten minutes in a log."""

import time as real_time

from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Column

from dusttaichi.commands.console import err, remark

SHOWN = 4  # largest number of simultaneous tasks in the line
ROOMY = 100  # width of a terminal from which the line contains a bar
LOG_EVERY = 600.0  # s between two lines of progress in a log


class ProgressBar:
    """Progress of a command on one line: task, share, state, time left.

    A context manager. quiet: show nothing but the lines of `log`. The line appears at the first
    `show`. On a narrow terminal it has no bar and is truncated; without a terminal (a log), there
    is a plain line every ten minutes. console: a rich Console, by default that of the errors.
    """

    def __init__(self, quiet=False, description=None, *, console=err):
        self._quiet, self._printed = quiet, real_time.monotonic()
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
        """Show that `completed` of `total` is done; total: None where it is not known."""
        self._bar.update(
            self._task,
            description=description,
            completed=completed,
            total=total,
            state=state,
            visible=True,
        )
        now = real_time.monotonic()
        log = not (self._bar.console.is_terminal or self._quiet)
        if log and now - self._printed > LOG_EVERY:
            self._printed = now
            share = f"{completed / total:.0%}  " if total else ""
            self._bar.console.print(f"{description}  {share}{state}", soft_wrap=True)

    def log(self, text):
        """Print a line above the bar."""
        self._bar.console.print(text, soft_wrap=True)


class Phases:
    """Times of the phases of a command, printed where `on` (--verbose)."""

    def __init__(self, on):
        self._on, self._began = on, real_time.monotonic()

    def end(self, what):
        """End a phase and print its time."""
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
    """Shares of the first few simultaneous tasks. running: label -> share that is done."""
    return "  ".join(f"{label} {share:.0%}" for label, share in list(running.items())[:SHOWN])
