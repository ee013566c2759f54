"""Progress of the commands: a live line on a terminal, a line every ten minutes in a log."""

import os
import time as real_time
from pathlib import Path

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
    """Times of the phases of a command, printed where `on` (--verbose); they add up to its time.

    The first phase begins with the process.
    """

    def __init__(self, on):
        self._on = on
        self._began = self._start = real_time.monotonic() - _age()

    def end(self, what, seconds=None):
        """End a phase and print its time; seconds: of the part of it that is meant."""
        seconds = real_time.monotonic() - self._began if seconds is None else seconds
        if self._on:
            remark(f"{seconds:8.2f} s  {what}")
        self._began += seconds

    def total(self):
        """Print the sum of all phases."""
        if self._on:
            remark(f"{self._began - self._start:8.2f} s  in all")


def _age():
    """Time since this process began [s]; its processor time where the system does not give it."""
    try:
        fields = Path("/proc/self/stat").read_text().rpartition(")")[2].split()
        began = int(fields[19]) / os.sysconf("SC_CLK_TCK")
        return real_time.clock_gettime(real_time.CLOCK_BOOTTIME) - began
    except (OSError, AttributeError):
        return real_time.process_time()


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
