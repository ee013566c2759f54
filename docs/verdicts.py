"""Verdicts of the validation: the tables of its pages from `validation/verdicts.csv`.

A row states a quantity, its expected value, ours with the error, the verdict, a link to details
and the command or test that gives our value.
"""

import csv
import re

from tables import VALIDATION, markdown

# pages of the validation: name -> (title, file)
PAGES = {
    "closed": ("Closed forms and conservation", "validation_closed.md"),
    "s12": ("S12: compression of silicate", "validation_s12.md"),
    "pd08": ("PD08: a cake of silica, sound", "validation_pd08.md"),
    "t19": ("T19: tensile strength of ice", "validation_t19.md"),
    "g09": ("G09: beads and spheres of the continuum", "validation_g09.md"),
    "later": ("Later papers", "validation_later.md"),
    "trade": ("Drafts beside full runs", "studies/trade.md#drafts"),
}
VERDICTS = ("agrees", "differs", "fitted")
COLUMNS = ("quantity", "expected", "here", "error", "verdict", "link")
VALUE = re.compile(r"(?:(1)/)?([+-]?\d+(?:\.\d+)?(?:e-?\d+)?)(?: ± [\d.]+)?(?: (.+))?")


def rows():
    """All rows, dicts of texts, with the error where two numbers give it."""
    with open(VALIDATION / "verdicts.csv", newline="", encoding="utf-8") as file:
        listed = list(csv.DictReader(file))
    for row in listed:
        row["error"] = row["error"] or compute_error(row["expected"], row["here"])
    return listed


def compute_error(expected, computed):
    """Deviation of one value from another in percent; "" unless both are numbers of one unit."""
    values = [VALUE.fullmatch(text) for text in (expected, computed)]
    if not all(values) or values[0][3] != values[1][3]:
        return ""
    numbers = [1 / float(v[2]) if v[1] else float(v[2]) for v in values]
    if not numbers[0]:
        return ""
    percent = round(100 * (numbers[1] / numbers[0] - 1), 1)
    if not percent:
        return "0 %"
    return f"{percent:+.1f} %" if abs(percent) < 9.95 else f"{percent:+.0f} %"


def pages():
    """Generated tables by the name of their file."""
    by_page = {name: [row for row in rows() if row["page"] == name] for name in PAGES}
    tables = {f"verdicts_{name}.md": table_of(by_page[name], name) for name in PAGES}
    return tables | {"verdicts.md": overview(by_page), "verdicts_all.md": glance(by_page)}


def table_of(listed, name):
    """Six columns, and the commands of the rows below."""
    columns = COLUMNS[:-1] if name == "trade" else COLUMNS  # the links lead to its own page
    shown = [{column: row[column] for column in columns} for row in listed]
    commands = {}
    for row in listed:
        commands.setdefault(row["command"], []).append(row["quantity"].removeprefix("… "))
    lines = [f"- `{command}`: {'; '.join(of)}" for command, of in commands.items()]
    return "\n".join(
        [markdown(shown), ":::{dropdown} Commands and tests of these rows", *lines, ":::", ""]
    )


def overview(by_page):
    """How many rows agree, differ and are fitted, page by page."""
    counts = [
        {"page": f"[{PAGES[name][0]}]({PAGES[name][1]})"}
        | {word: str(sum(row["verdict"] == word for row in listed)) for word in VERDICTS}
        for name, listed in by_page.items()
    ]
    total = {word: str(sum(int(row[word]) for row in counts)) for word in VERDICTS}
    return markdown([*counts, {"page": "**all**"} | total])


def glance(by_page):
    """Every row of the validation: quantity, error and verdict, those of a page together."""
    marks = {"agrees": "✓\u00a0agrees", "differs": "✗\u00a0differs", "fitted": "○\u00a0fitted"}
    listed = []
    for name, members in by_page.items():
        title, file = PAGES[name]
        for number, row in enumerate(members):
            listed.append(
                {
                    "page": f"[{title.split(':')[0]}]({file})" if not number else "",
                    "quantity": row["quantity"],
                    "expected": row["expected"],
                    "here": row["here"],
                    "verdict": marks[row["verdict"]],
                }
            )
    return markdown(listed)
