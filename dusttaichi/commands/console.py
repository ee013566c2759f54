"""Consoles of the commands: tables and results to stdout, progress and remarks to stderr."""

import json
import sys
from itertools import accumulate

from rich.console import Console
from rich.table import Table

WIDE = 120  # width of the output without a terminal
LONG = 40  # width from which a name is wrapped
GAP = 2  # between the columns of a table


def _console(stderr):
    stream = sys.stderr if stderr else sys.stdout
    # no markup: texts contain file names and YAML with brackets
    return Console(
        stderr=stderr, highlight=False, markup=False, width=None if stream.isatty() else WIDE
    )


console = _console(stderr=False)
err = _console(stderr=True)


def say(text="", **print_options):
    """Print a line of a result, which a narrow terminal does not truncate."""
    console.print(text, soft_wrap=True, **print_options)


def remark(text):
    """Print a line to stderr, beside the result."""
    err.print(text, soft_wrap=True)


def say_json(data):
    """Print plain data as JSON, the only output then; escaped where the encoding is not UTF-8."""
    escaped = "utf" not in (sys.stdout.encoding or "utf-8").lower()
    sys.stdout.write(json.dumps(data, ensure_ascii=escaped, allow_nan=False, indent=2) + "\n")


def say_written(paths, write=say):
    """List the written files."""
    for path in paths:
        write(f"wrote {path}")


def say_not_drawn(failed):
    """List the figures, (title, reason), that could not be drawn."""
    for title, reason in failed:
        remark(f"figure not drawn: {title}: {reason}")


def say_abreast(keys, columns, title=None):
    """Print columns (header, texts) as one table, or several where the line is too short.

    Each table begins with the `keys`. Headers are wrapped between words, if necessary; of the texts
    only long keys.
    """
    front = [min(_width([head], texts), LONG) for head, texts in keys]
    available_width, remaining = console.width - sum(front) - GAP * len(front), list(columns)
    while remaining:
        broken = sum(_width([head], texts) + GAP for head, texts in remaining) > available_width
        widths = [_width(head.split() if broken else [head], texts) for head, texts in remaining]
        ends = list(accumulate(width + GAP for width in widths))
        fitting = max(1, sum(end - GAP <= available_width for end in ends))
        shown, remaining = remaining[:fitting], remaining[fitting:]
        say_table(
            zip(*(texts for _, texts in [*keys, *shown]), strict=True),
            *({"header": key[0], "width": n} for key, n in zip(keys, front, strict=True)),
            *(
                {"header": head, "justify": "right", "width": n}
                for (head, _), n in zip(shown, widths, strict=False)
            ),
            title=title,
        )
        title = None
        if remaining:
            say()


def _width(words, texts):
    """Width of a column of a table."""
    return max(len(word) for word in [*words, *texts])


def say_table(rows, *headings, title=None, wrap=False):
    """Print rows of texts as a table without lines.

    headings: dicts of `header`, `justify`, `no_wrap` and `overflow`, or the headers alone,
    right-justified except the first. wrap: where the terminal is too narrow.
    """
    table = Table(title=title, title_justify="left", box=None, pad_edge=False)
    for n, heading in enumerate(headings):
        if isinstance(heading, str):
            heading = {"header": heading, "justify": "right" if n else "left"}
        # narrow columns fold digits instead of cutting them
        table.add_column(**({"overflow": "fold"} | heading))
    for row in rows:
        table.add_row(*row)
    console.print(table, soft_wrap=not wrap)
