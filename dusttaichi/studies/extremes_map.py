"""`dust extremes`: where runs are stable, refused, or stopped, cell by cell."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from itertools import groupby
from pathlib import Path

import numpy as np
import xarray as xr

from dusttaichi.errors import DustError
from dusttaichi.results import outputs
from dusttaichi.studies import extremes_cells as cells
from dusttaichi.studies.extremes_cells import Cell, CellResult
from dusttaichi.studies.extremes_continuum import vary_dust
from dusttaichi.studies.requests import Request, make_key
from dusttaichi.studies.study_types import PointResult
from dusttaichi.studies.verdicts import STABLE, VERDICTS, WRONG

TASK = "dusttaichi.studies.extremes_trial:attempt_cell"
GROUPS: dict[str, Callable[[bool], list[Cell]]] = {
    "time step": cells.vary_time_step,
    "materials": cells.vary_materials,
    "one number": cells.vary_number,
    "wall speeds": cells.vary_speed,
    "size ratios": cells.vary_size_ratio,
    "special states": cells.try_special_states,
    "filling factors": cells.vary_filling_factor,
    "long runs": cells.run_long,
    "precisions": cells.vary_precision,
    "continuum": vary_dust,
}


class ExtremesMap:
    """Study (study_types.Study) of the cells of the map.

    cells, requests: in the order of the dataset. directory: of its files. quick: fewer cells and
    steps. only: names of groups, by default all. threads: of each cell. Raises DustError for an
    unknown group.
    """

    timed = False

    def __init__(
        self,
        directory: str | Path,
        *,
        quick: bool = False,
        only: Sequence[str] | None = None,
        threads: int = 1,
    ) -> None:
        self.directory = Path(directory)
        self.file = self.directory / "extremes.nc"
        for name in only or ():
            if name not in GROUPS:
                raise DustError(f'--only "{name}": unknown group; allowed: {", ".join(GROUPS)}')
        self.cells = [
            _set_threads(cell, threads)
            for name, make_cells in GROUPS.items()
            if not only or name in only
            for cell in make_cells(quick)
        ]
        self.requests = [
            Request(
                make_key(asdict(cell)),
                TASK,
                {"cell": asdict(cell)},
                self.directory / "cells.jsonl",
                cores=threads,
                seconds=cell.time_limit,
            )
            for cell in self.cells
        ]

    def points(self, results: Mapping[str, PointResult]) -> list[Request]:
        """A request for each cell: those with the same kernels together, the longest first."""
        pairs = zip(self.cells, self.requests, strict=True)
        shared = groupby(pairs, lambda pair: (pair[0].group, pair[0].kernels or pair[0].row))
        runs = [list(run) for _, run in shared]
        # none of them runs alone at the end
        runs.sort(key=lambda run: -max(cell.steps for cell, _ in run))
        return [request for run in runs for _, request in run]

    def dataset(self, results: Mapping[str, PointResult]) -> xr.Dataset:
        """The dataset (`build_dataset`). A process that crashed or hung is WRONG, too."""
        ends = (results[request.label] for request in self.requests)
        cell_results = [
            CellResult(**r.measured) if r.ok else CellResult(WRONG, r.text) for r in ends
        ]
        return build_dataset(self.cells, cell_results)


NUMBERS = (
    ("residual", "1", "largest residual of the energy ledger over the turnover or bound energy"),
    ("steps", "1", "computed steps"),
    ("dt", "s", "time step"),
    ("estimated", "s", "largest stable step, from the contacts of the sample"),
    ("measured", "s", "largest stable step, by bisection"),
    ("ratio", "1", "estimated over measured"),
    ("seconds", "s", "machine time"),
)


def build_dataset(cells: Sequence[Cell], results: Sequence[CellResult]) -> xr.Dataset:
    """xarray.Dataset over `cell` of Cells and their CellResults; verdicts and reasons are text."""
    data = {
        name: (
            "cell",
            [float(getattr(o, name)) for o in results],
            {"units": unit, "long_name": text},
        )
        for name, unit, text in NUMBERS
    }
    texts = {name: [getattr(c, name) for c in cells] for name in ("group", "name", "row")}
    texts["column"] = [str(c.column) for c in cells]
    texts |= {name: [getattr(result, name) for result in results] for name in ("verdict", "reason")}
    texts |= {k: [json.dumps(getattr(c, k)) for c in cells] for k in ("scene", "sample")}
    return xr.Dataset(data | {k: ("cell", np.array(v, dtype=object)) for k, v in texts.items()})


def save(data: xr.Dataset, path: Path) -> list[Path]:
    """Write a dataset to the file `path` and a table beside it; returns both paths."""
    paths = [path, path.with_suffix(".csv")]
    columns = ["group", "name", "verdict", "reason", *(name for name, _, _ in NUMBERS)]
    outputs.write_dataset(paths[0], data, "verdict")
    table = data.to_dataframe().astype({"steps": int})[columns]
    text = table.to_csv(index=False, float_format="%.6g")
    outputs.write(paths[1], text, ",".join(columns[:4]))
    return paths


HEADINGS = ("group", "cells", *VERDICTS, "worst residual", "limits", "estimated/measured")


def summarise(data: xr.Dataset) -> list[list[str]]:
    """Rows of text for each group and for all, under HEADINGS.

    Cells by verdict, largest residual of the stable ones, range of the ratio of estimated to
    measured limit.
    """
    table, rows = data.to_dataframe(), []
    for name, cells_of_row in [*table.groupby("group", sort=False), ("all", table)]:
        counts = [str((cells_of_row.verdict == verdict).sum()) for verdict in VERDICTS]
        stable = cells_of_row.residual[cells_of_row.verdict == STABLE]
        ratio = cells_of_row.ratio[np.isfinite(cells_of_row.ratio)]
        worst = f"{stable.max():.1e}" if len(stable) else "-"
        span = f"{ratio.min():.3f} to {ratio.max():.3f}" if len(ratio) else "-"
        rows.append([name, str(len(cells_of_row)), *counts, worst, str(len(ratio)), span])
    return rows


def _set_threads(cell: Cell, threads: int) -> Cell:
    numerics = cell.scene.get("numerics", {}) | {"threads": threads}
    return replace(cell, scene=cell.scene | {"numerics": numerics})
