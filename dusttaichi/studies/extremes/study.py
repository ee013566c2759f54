"""The map of `dust extremes`: a request to a task for each cell, and its files."""

from dataclasses import asdict, replace
from itertools import groupby
from pathlib import Path

from dusttaichi.errors import DustError
from dusttaichi.studies.extremes import results
from dusttaichi.studies.extremes.groups import GROUPS
from dusttaichi.studies.extremes.results import CellResult
from dusttaichi.studies.requests import Request, key_of

TASK = "dusttaichi.studies.extremes.trial:attempt_cell"


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
        """The dataset (results.dataset). A process that crashed or hung is WRONG, too."""
        made = (found[self._request(cell).label] for cell in self.cells)
        ends = [
            CellResult(**one.measured) if one.ok else CellResult("WRONG", one.text) for one in made
        ]
        return results.dataset(list(zip(self.cells, ends, strict=True)))


def _with_threads(cell, threads):
    numerics = cell.scene.get("numerics", {}) | {"threads": threads}
    return replace(cell, scene=cell.scene | {"numerics": numerics})
