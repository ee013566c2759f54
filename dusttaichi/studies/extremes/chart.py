"""The map of `dust extremes`: all cells are tried, what is finished is kept, files are written."""

import json
from dataclasses import asdict
from itertools import groupby
from pathlib import Path

from dusttaichi import __version__
from dusttaichi.errors import DustError
from dusttaichi.processes import usable_cores
from dusttaichi.studies.extremes import pool, results
from dusttaichi.studies.extremes.cell import VERDICTS, CellResult
from dusttaichi.studies.extremes.groups import GROUPS

KEPT = "cells.jsonl"


def chart(
    *,
    quick=False,
    only=None,
    output=None,
    force=False,
    count=None,
    report=lambda group, counts, total: None,
    log=lambda text: None,
):
    """Try the cells of the map; returns its dataset and the paths of the files.

    quick: fewer cells and steps. only: names of groups, all by default. output: directory,
    runs/extremes by default. force: try again what is finished. count: of processes side by side,
    as many as there are cores by default. report(group, verdict -> number of cells, number of all):
    called after each cell.
    Raises DustError for a group that there is not or a directory that cannot be written, and
    KeyboardInterrupt; finished cells are kept, and the next call goes on with the rest.
    """
    from dusttaichi import plots

    cells = _cells(quick, only)
    folder = Path(output or "runs/extremes")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if force:
            (folder / KEPT).unlink(missing_ok=True)
        known = _known(folder / KEPT)
        rest = [cell for cell in cells if _mark(cell) not in known]
        if len(rest) < len(cells):
            log(
                f"{len(cells) - len(rest)} of {len(cells)} cells are finished and kept in "
                f"{folder / KEPT} (--force tries them again)"
            )
        known |= _tried(rest, folder / KEPT, count or usable_cores(), report)
        data, paths = results.save([(cell, known[_mark(cell)]) for cell in cells], folder)
        paths.append(plots.save(plots.extremes(data), folder / "extremes.png"))
    except OSError as error:
        raise DustError(f"The map cannot be written to {folder}: {error}.") from error
    return data, paths


def _cells(quick, only):
    for name in only or ():
        if name not in GROUPS:
            raise DustError(
                f'--only "{name}": there is no such group; allowed: {", ".join(GROUPS)}'
            )
    return [
        cell for name, make in GROUPS.items() if not only or name in only for cell in make(quick)
    ]


def _tried(cells, kept, count, report):
    """CellResult by mark of these cells, which are tried now and written to the file `kept`."""
    shared = groupby(cells, lambda cell: (cell.group, cell.kernels or cell.coordinates["row"]))
    runs = [list(run) for _, run in shared]
    # the longest first, so that no process is left alone with it
    runs.sort(key=lambda run: -max(cell.steps for cell in run))
    found, counts = {}, dict.fromkeys(VERDICTS, 0)
    with open(kept, "a", encoding="utf-8") as file:
        for cell, result in pool.attempts(runs, count):
            found[_mark(cell)] = result
            file.write(json.dumps([_mark(cell), asdict(result)]) + "\n")
            file.flush()
            counts[result.verdict] += 1
            report(cell.group, counts, len(cells))
    return found


def _mark(cell):
    """Key of a cell, which differs between versions too."""
    return json.dumps([__version__, cell.to_dict()], sort_keys=True)


def _known(kept):
    """CellResults by mark of an earlier call; a line cut short by a kill is left out."""
    known = {}
    if kept.exists():
        for line in kept.read_text(encoding="utf-8").splitlines():
            try:
                mark, result = json.loads(line)
                known[mark] = CellResult(**result)
            except (ValueError, TypeError):
                continue
    return known
