"""Progress of runs and studies on one line: in a notebook, on a terminal, or in a log."""

from __future__ import annotations

import sys
import threading
import time as real_time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from html import escape
from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    from rich.progress import ProgressColumn
    from typing_extensions import Self

    from dusttaichi.running.state import Report


SHOWN = 4  # largest number of simultaneous tasks in the line
ROOMY = 100  # width of a terminal from which the line contains a bar
LOG_EVERY = 600.0  # s between two lines of progress in a log, where nothing else is set
REDRAW = 0.2  # s between two updates of a notebook


class ProgressBar:
    """Progress on one line of a terminal: task, share, state, time left.

    A context manager. quiet: show nothing but the lines of `log`. The line appears at the first
    `show`. On a narrow terminal it has no bar and is truncated; without a terminal (a log), there
    is a plain line after every `every` s. console: a rich Console, by default one of the errors.
    """

    def __init__(
        self,
        quiet: bool = False,
        description: str | None = None,
        *,
        console: Any = None,
        every: float = LOG_EVERY,
    ) -> None:
        from rich.console import Console  # with the progress 0.1 s, which no worker waits for
        from rich.progress import Progress

        console = console or Console(stderr=True, highlight=False, markup=False)
        self._quiet, self._printed, self._every = quiet, real_time.monotonic(), every
        self._bar = Progress(
            *_columns(console.width), console=console, disable=quiet or not console.is_terminal
        )
        self._task = self._bar.add_task(
            description or "", total=None, state="", visible=description is not None
        )

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def show(
        self, description: str, completed: float, total: float | None, state: str = ""
    ) -> None:
        """Show that `completed` of `total` is done; total: None where it is not known."""
        self._bar.update(
            self._task,
            description=description,
            completed=completed,
            total=total,
            state=state,
            visible=True,
        )
        current_time = real_time.monotonic()
        log = not (self._bar.console.is_terminal or self._quiet)
        if log and current_time - self._printed > self._every:
            self._printed = current_time
            percentage = f"{completed / total:.0%}  " if total else ""
            self._bar.console.print(f"{description}  {percentage}{state}", soft_wrap=True)

    def log(self, text: str) -> None:
        """Print a line above the bar."""
        self._bar.console.print(text, soft_wrap=True)


def _columns(width: int) -> list[ProgressColumn]:
    """Columns of the progress line on a terminal of this width."""
    from rich.progress import BarColumn, TextColumn, TimeRemainingColumn
    from rich.table import Column

    def text(pattern: str, least: int) -> TextColumn:
        column = Column(no_wrap=True, overflow="ellipsis", min_width=least)
        return TextColumn(pattern, markup=False, table_column=column)

    remaining = Column(no_wrap=True, min_width=5)
    return [
        text("{task.description}", 13),
        *([BarColumn()] if width >= ROOMY else []),
        text("{task.percentage:>5.1f} %", 7),
        TimeRemainingColumn(compact=width < ROOMY, table_column=remaining),
        text("{task.fields[state]}", 8),
    ]


class NotebookBar:
    """Progress as one output of a notebook cell, which needs no widgets; used as `ProgressBar`.

    The output remains when the bar ends, with the time that it took.
    """

    def __init__(self) -> None:
        self._began = self._drawn = real_time.monotonic()
        self._handle: Any = None
        self._last: tuple[str, float | None, str] | None = None
        self._first_share: float | None = None
        self._lock = threading.Lock()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._last is not None:
            self._draw(*self._last, f"{real_time.monotonic() - self._began:.1f} s")

    def show(
        self, description: str, completed: float, total: float | None, state: str = ""
    ) -> None:
        """As that of ProgressBar."""
        with self._lock:  # reports of a study come from several threads
            fraction = min(completed / total, 1.0) if total else None
            self._last, current_time = (description, fraction, state), real_time.monotonic()
            if self._handle is None or current_time - self._drawn > REDRAW:
                self._drawn = current_time
                self._draw(*self._last, self._remaining(fraction, current_time))

    def log(self, text: str) -> None:
        """Print a line."""
        print(text)

    def _remaining(self, fraction: float | None, current_time: float) -> str:
        """Text of the time that remains, "" where it is not known."""
        if fraction is None:
            return ""
        if self._first_share is None:
            self._first_share = fraction  # of a run that continues more than 0
        progress = fraction - self._first_share
        seconds = (
            (current_time - self._began) * (1.0 - fraction) / progress if progress > 0.0 else None
        )
        return "" if seconds is None else f"{seconds // 60:.0f}:{seconds % 60:02.0f} left"

    def _draw(self, description: str, fraction: float | None, state: str, timing: str) -> None:
        from IPython.display import display

        percent = "" if fraction is None else f"{fraction:.0%}"
        text = "  ".join(filter(None, [description, percent, state, timing]))
        value = "" if fraction is None else f' value="{fraction:.4f}"'
        html = (
            f'<progress max="1"{value} style="width:16em;vertical-align:middle"></progress> '
            f'<span style="font-variant-numeric:tabular-nums;white-space:pre">{escape(text)}</span>'
        )
        shown = {"text/plain": text, "text/html": html}
        if self._handle is None:
            self._handle = cast(Any, display)(shown, raw=True, display_id=True)
        else:
            self._handle.update(shown, raw=True)


Bar = ProgressBar | NotebookBar


def in_notebook() -> bool:
    """True in the kernel of a notebook."""
    get_shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)
    return hasattr(get_shell(), "kernel")


def open_bar(quiet: bool = False) -> Bar:
    """The bar for this process, of a notebook or a terminal. quiet: one that shows nothing."""
    return NotebookBar() if in_notebook() and not quiet else ProgressBar(quiet)


def shares_text(running: Mapping[str, float]) -> str:
    """Shares of the first few simultaneous tasks. running: label -> share that is done."""
    return "  ".join(f"{label} {fraction:.0%}" for label, fraction in list(running.items())[:SHOWN])


def show_run(bar: Bar) -> Callable[[Report], None]:
    """Function that shows a Report of a run in a bar."""
    from dusttaichi.scene import quantities

    def show(report: Report) -> None:
        state = []
        if report.filling_factor is not None:
            state.append(f"phi {report.filling_factor:.3f}")
        if report.pressure is not None:
            state.append(f"P {report.pressure / 1e3:.3g} kPa")
        if report.steps_per_second > 0.0:
            state.append(f"{quantities.format_rate(report.steps_per_second)} steps/s")
        bar.show(f"step {report.step:,}", report.step, report.end, "  ".join(state))

    return show


@contextmanager
def show_progress(run: Any, quiet: bool = False) -> Iterator[None]:
    """Context in which a bar shows the reports of a Run, and at last why it ended."""
    silent = run.report
    with open_bar(quiet) as bar:
        run.report = show_run(bar)
        try:
            yield
            bar.show(f"step {run.sim.step:,}", 1, 1, f"end: {run.end.reason}")
        finally:
            run.report = silent


def show_study(bar: Bar, noun: str = "runs") -> Callable[[Any], None]:
    """Function that shows the Progress of a study in a bar; things: name of its points."""

    def show(progress: Any) -> None:
        running = progress.running
        finished = progress.finished + sum(running.values())
        heading = f"{progress.finished} of {progress.total} {noun}"
        bar.show(heading, finished, progress.total, shares_text(running))

    return show
