"""Cells of the map with their results, as a dataset, a CSV file and rows of a table."""

import json
from dataclasses import dataclass
from math import nan

import numpy as np
import xarray as xr

from dusttaichi.results.outputs import check

VERDICTS = ("stable", "refused", "stopped", "WRONG")


@dataclass(frozen=True)
class Cell:
    """One point of the map, as plain numbers and texts for another process.

    scene: the blocks of its YAML. sample: a name of `arrangements` with its numbers, in place of
    the scene's. fraction: time step over the stiffest period of the contacts of the sample, also
    one that a scene would refuse. limit: measure the largest stable step, too. row, column: in the
    figure of the group. time_limit [s]: a longer cell counts as WRONG. kernels: name shared by
    cells with the same compiled kernels, by default that of the row.
    """

    group: str
    name: str
    scene: dict
    sample: dict | None = None
    steps: int = 1000
    fraction: float | None = None
    limit: bool = False
    time_limit: float = 120.0
    row: str = ""
    column: str | float = ""
    kernels: str = ""


@dataclass(frozen=True)
class CellResult:
    """Verdict on a cell, with its reason.

    residual: largest of the ledger at any check, relative to run.ledger.turnover. steps: computed.
    dt, estimated, measured [s]: time step and largest stable one, nan where not requested. seconds:
    wall time.
    """

    verdict: str
    reason: str = ""
    residual: float = nan
    steps: int = 0
    dt: float = nan
    estimated: float = nan
    measured: float = nan
    seconds: float = nan

    @property
    def ratio(self):
        """Estimated over measured limit."""
        return self.estimated / self.measured


NUMBERS = (
    ("residual", "1", "largest residual of the energy ledger over the turnover or bound energy"),
    ("steps", "1", "computed steps"),
    ("dt", "s", "time step"),
    ("estimated", "s", "largest stable step, from the contacts of the sample"),
    ("measured", "s", "largest stable step, by bisection"),
    ("ratio", "1", "estimated over measured"),
    ("seconds", "s", "machine time"),
)


def dataset(found):
    """xarray.Dataset over `cell` of (Cell, CellResult) pairs; verdicts and reasons are text."""
    cells, ends = zip(*found, strict=True)
    data = {
        name: ("cell", [float(getattr(o, name)) for o in ends], {"units": unit, "long_name": text})
        for name, unit, text in NUMBERS
    }
    texts = {
        "group": [c.group for c in cells],
        "name": [c.name for c in cells],
        "row": [c.row for c in cells],
        "column": [str(c.column) for c in cells],
        "verdict": [o.verdict for o in ends],
        "reason": [o.reason for o in ends],
        "scene": [json.dumps(c.scene) for c in cells],
        "sample": [json.dumps(c.sample) for c in cells],
    }
    return xr.Dataset(data | {k: ("cell", np.array(v, dtype=object)) for k, v in texts.items()})


def save(data, path):
    """Write a dataset to the file `path` and a table beside it; returns both paths."""
    paths = [path, path.with_suffix(".csv")]
    columns = ["group", "name", "verdict", "reason", *(name for name, _, _ in NUMBERS)]
    check(paths[1], ",".join(columns[:4]))
    data.to_netcdf(check(paths[0], "verdict"))
    table = data.to_dataframe().astype({"steps": int})[columns]
    table.to_csv(paths[1], index=False, float_format="%.6g")
    return paths


def summary(data):
    """Rows of text for each group and for all.

    Cells by verdict, largest residual of the stable ones, range of the ratio of estimated to
    measured limit.
    """
    groups = list(dict.fromkeys(data.group.values.tolist()))
    parts = [(name, data.where(data.group == name, drop=True)) for name in groups]
    return [_row(name, part) for name, part in [*parts, ("all", data)]]


def _row(name, part):
    verdict = part.verdict.values
    stable = part.residual.values[verdict == "stable"].astype(float)
    ratio = part.ratio.values.astype(float)
    ratio = ratio[np.isfinite(ratio)]
    counts = [str(int(np.sum(verdict == v))) for v in VERDICTS]
    worst = f"{stable.max():.1e}" if len(stable) else "-"
    span = f"{ratio.min():.3f} to {ratio.max():.3f}" if len(ratio) else "-"
    return [name, str(len(verdict)), *counts, worst, str(len(ratio)), span]


HEADINGS = ("group", "cells", *VERDICTS, "worst residual", "limits", "estimated/measured")
