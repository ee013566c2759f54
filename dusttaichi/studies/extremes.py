"""`dust extremes`: where runs are stable, refused, or stopped, cell by cell."""

import json
from dataclasses import asdict, replace
from itertools import groupby
from pathlib import Path

import numpy as np
import xarray as xr

from dusttaichi.errors import DustError
from dusttaichi.results import outputs
from dusttaichi.studies import extremes_cells as cells
from dusttaichi.studies.extremes_cells import CellResult
from dusttaichi.studies.extremes_materials import continuum, materials, single_materials
from dusttaichi.studies.requests import Request, key_of

TASK = "dusttaichi.studies.extremes_task:attempt_cell"
VERDICTS = ("stable", "refused", "stopped", "WRONG")
GROUPS = {
    "time step": cells.time_step, "materials": materials, "one number": single_materials,
    "wall speeds": cells.wall_speeds, "size ratios": cells.size_ratios,
    "special states": cells.special, "filling factors": cells.filling_factors,
    "long runs": cells.long_runs, "precisions": cells.precisions, "continuum": continuum,
}  # fmt: skip


class ExtremesMap:
    """Study (engine.Study) of the cells of the map.

    directory: of its files. quick: fewer cells and steps. only: names of groups, by default all.
    threads: of each cell. Raises DustError for an unknown group.
    """

    scene = None
    timed = False

    def __init__(self, directory, *, quick=False, only=None, threads=1):
        self.directory = Path(directory)
        self.file = self.directory / "extremes.nc"
        for name in only or ():
            if name not in GROUPS:
                raise DustError(f'--only "{name}": unknown group; allowed: {", ".join(GROUPS)}')
        groups = [make(quick) for name, make in GROUPS.items() if not only or name in only]
        self.threads = threads
        self.cells = [_with_threads(cell, threads) for group in groups for cell in group]

    def points(self, found):
        """A request for each cell: those with the same kernels together, the longest first."""
        shared = groupby(self.cells, lambda cell: (cell.group, cell.kernels or cell.row))
        runs = [list(run) for _, run in shared]
        # none of them runs alone at the end
        runs.sort(key=lambda run: -max(cell.steps for cell in run))
        return [self._request(cell) for run in runs for cell in run]

    def _request(self, cell):
        data = asdict(cell)
        file = self.directory / "cells.jsonl"
        how = {"cores": self.threads, "seconds": cell.time_limit}
        return Request(key_of(data), TASK, {"cell": data}, file, **how)

    def dataset(self, found):
        """The dataset (`dataset`). A process that crashed or hung is WRONG, too."""
        made = (found[self._request(cell).label] for cell in self.cells)
        ends = [
            CellResult(**one.measured) if one.ok else CellResult("WRONG", one.text) for one in made
        ]
        return dataset(zip(self.cells, ends, strict=True))


def _with_threads(cell, threads):
    numerics = cell.scene.get("numerics", {}) | {"threads": threads}
    return replace(cell, scene=cell.scene | {"numerics": numerics})


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
    outputs.write_dataset(paths[0], data, "verdict")
    table = data.to_dataframe().astype({"steps": int})[columns]
    text = table.to_csv(index=False, float_format="%.6g")
    outputs.write(paths[1], text, ",".join(columns[:4]))
    return paths


def summary(data):
    """Rows of text for each group and for all, under HEADINGS.

    Cells by verdict, largest residual of the stable ones, range of the ratio of estimated to
    measured limit.
    """
    table = data.to_dataframe()
    return [_row(*part) for part in [*table.groupby("group", sort=False), ("all", table)]]


def _row(name, part):
    counts = [str((part.verdict == verdict).sum()) for verdict in VERDICTS]
    stable = part.residual[part.verdict == "stable"]
    ratio = part.ratio[np.isfinite(part.ratio)]
    worst = f"{stable.max():.1e}" if len(stable) else "-"
    span = f"{ratio.min():.3f} to {ratio.max():.3f}" if len(ratio) else "-"
    return [name, str(len(part)), *counts, worst, str(len(ratio)), span]


HEADINGS = ("group", "cells", *VERDICTS, "worst residual", "limits", "estimated/measured")
