"""What the commands print on: tables and results to the output, progress and remarks beside it."""

import sys

from rich.console import Console
from rich.table import Table

WIDE = 120  # columns where there is no terminal to ask


def _console(stderr):
    stream = sys.stderr if stderr else sys.stdout
    # no markup: texts have file names and YAML in them, whose brackets are their own
    return Console(
        stderr=stderr, highlight=False, markup=False, width=None if stream.isatty() else WIDE
    )


console = _console(stderr=False)
err = _console(stderr=True)


def say(text="", **how):
    """Print a line of a result, which is not cut where the terminal is narrower."""
    console.print(text, soft_wrap=True, **how)


def remark(text):
    """Print a line beside the result."""
    err.print(text, soft_wrap=True)


def say_written(paths):
    """Tell which files there are now."""
    for path in paths:
        say(f"wrote {path}")


def plain_table(*headings, title=None):
    """A rich Table without lines.

    headings: dicts of `header`, `justify`, `no_wrap` and `overflow`, or the headers alone,
    right-justified but the first.
    """
    table = Table(title=title, title_justify="left", box=None, pad_edge=False)
    for n, heading in enumerate(headings):
        if isinstance(heading, str):
            heading = {"header": heading, "justify": "right" if n else "left"}
        # no digit is lost where columns are narrow
        table.add_column(**({"overflow": "fold"} | heading))
    return table
