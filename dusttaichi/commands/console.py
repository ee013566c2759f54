"""Consoles of the commands: tables and results to stdout, progress and remarks to stderr."""

import json
import sys
from itertools import accumulate

from rich.console import Console
from rich.table import Table

WIDE = 120  # columns where there is no terminal to ask
LONG = 40  # columns that a name may take before it is broken
GAP = 2  # columns between those of a table


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


def say_json(data):
    """Print plain data as JSON, which is then all that the output holds."""
    sys.stdout.write(json.dumps(data, ensure_ascii=False, allow_nan=False, indent=2) + "\n")


def say_written(paths, tell=say):
    """Tell which files there are now."""
    for path in paths:
        tell(f"wrote {path}")


def say_not_drawn(failed):
    """Name the figures, (title, why), that could not be drawn."""
    for title, why in failed:
        remark(f"figure not drawn: {title}: {why}")


def say_abreast(keys, columns, title=None):
    """Print columns (header, texts): below one another where the line is too short for all, with
    the `keys` in front each time. Headers are broken between words only, and where they must; of
    texts none but long keys."""
    front = [min(_width([head], texts), LONG) for head, texts in keys]
    room, rest = console.width - sum(front) - GAP * len(front), list(columns)
    while rest:
        broken = sum(_width([head], texts) + GAP for head, texts in rest) > room
        widths = [_width(head.split() if broken else [head], texts) for head, texts in rest]
        ends = list(accumulate(width + GAP for width in widths))
        here = max(1, sum(end - GAP <= room for end in ends))
        shown, rest = rest[:here], rest[here:]
        table = plain_table(
            *({"header": key[0], "width": n} for key, n in zip(keys, front, strict=True)),
            *(
                {"header": head, "justify": "right", "width": n}
                for (head, _), n in zip(shown, widths, strict=False)
            ),
            title=title,
        )
        for row in zip(*(texts for _, texts in [*keys, *shown]), strict=True):
            table.add_row(*row)
        say(table)
        title = None
        if rest:
            say()


def _width(words, texts):
    """Columns of a terminal that a column of a table takes."""
    return max(len(word) for word in [*words, *texts])


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
