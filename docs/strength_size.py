"""Tensile strength against the number of grains: `python docs/strength_size.py TABLE.csv WORD...`.

TABLE.csv is written by `dust compare RUN... --output TABLE.csv`. Rows count whose name contains one
of the words; without words all. Rows of the same number of grains are samples of one size.
"""

import csv
import sys

import numpy as np

from dusttaichi.scene import extensions

weibull = extensions.module("kimura2020/weibull.py")


def groups(path, words):
    """A Strengths for each number of grains in a table, in order."""
    with open(path, newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["strength"]]
    rows = [row for row in rows if not words or any(word in row["name"] for word in words)]
    found = {}
    for row in rows:
        found.setdefault(int(row["grains"]), []).append(float(row["strength"]))
    known = {n: np.array(own) for n, own in sorted(found.items())}
    return [
        weibull.Strengths(f"{n} grains", n, own, weibull.weibull(own)) for n, own in known.items()
    ]


def main(path, *words):
    """Print mean and scatter of each size, and the Weibull statistics."""
    known = groups(path, words)
    for group in known:
        kpa = group.values / 1e3
        scatter = f" ± {kpa.std(ddof=1):.2f}" if len(kpa) > 1 else ""
        print(f"{group.grains} grains, {len(kpa)} samples: {kpa.mean():.2f}{scatter} kPa")
    columns, lines = weibull.strength_tables(known)
    for row in zip(*(texts for _, texts in columns), strict=True):
        print(", ".join(f"{head} {text}" for (head, _), text in zip(columns, row, strict=True)))
    for line in lines:
        print(line)
    if not lines and (effect := weibull.size_effect(known)) is not None:
        print(f"N^({effect.exponent:.3f} ± {effect.exponent_sigma:.3f})")


if __name__ == "__main__":
    main(*sys.argv[1:])
