"""The map of `dust extremes`: runs all cells, stores the finished ones, writes the files."""

import json
from dataclasses import asdict
from itertools import groupby
from pathlib import Path

from dusttaichi import __version__
from dusttaichi.errors import DustError
from dusttaichi.processes import usable_cores
from dusttaichi.studies.extremes import pool, results
from dusttaichi.studies.extremes.groups import GROUPS
from dusttaichi.studies.extremes.results import VERDICTS, CellResult

STORED = "cells.jsonl"


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
    """Run the cells of the map; returns its dataset and the paths of the files.

    quick: fewer cells and steps. only: names of groups, by default all. output: directory, by
    default runs/extremes. force: run finished cells again. count: simultaneous processes, by
    default all cores. report(group, verdict -> number of cells, number of all): called after each
    cell. Raises DustError for an unknown group or a failure to write, and KeyboardInterrupt;
    finished cells are stored, and the next call continues with the others.
    """
    from dusttaichi import plots

    cells = _cells(quick, only)
    folder = Path(output or "runs/extremes")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if force:
            (folder / STORED).unlink(missing_ok=True)
        known = _known(folder / STORED)
        rest = [cell for cell in cells if _mark(cell) not in known]
        if len(rest) < len(cells):
            log(
                f"{len(cells) - len(rest)} of {len(cells)} cells are finished, in "
                f"{folder / STORED} (--force runs them again)"
            )
        known |= _run(rest, folder / STORED, count or usable_cores(), report)
        data, paths = results.save([(cell, known[_mark(cell)]) for cell in cells], folder)
        paths.append(plots.save(plots.extremes(data), folder / "extremes.png"))
    except OSError as error:
        raise DustError(f"The map cannot be written to {folder}: {error}.") from error
    return data, paths


def _cells(quick, only):
    for name in only or ():
        if name not in GROUPS:
            raise DustError(f'--only "{name}": unknown group; allowed: {", ".join(GROUPS)}')
    return [
        cell for name, make in GROUPS.items() if not only or name in only for cell in make(quick)
    ]


def _run(cells, path, count, report):
    """CellResults of the cells by mark, from runs; each is appended to the file `path` at once."""
    shared = groupby(cells, lambda cell: (cell.group, cell.kernels or cell.row))
    runs = [list(run) for _, run in shared]
    # the longest first, so that none of them runs alone at the end
    runs.sort(key=lambda run: -max(cell.steps for cell in run))
    found, counts = {}, dict.fromkeys(VERDICTS, 0)
    with open(path, "a", encoding="utf-8") as file:
        for cell, result in pool.attempts(runs, count):
            found[_mark(cell)] = result
            file.write(json.dumps([_mark(cell), asdict(result)]) + "\n")
            file.flush()
            counts[result.verdict] += 1
            report(cell.group, counts, len(cells))
    return found


def _mark(cell):
    """Key of a cell, different for each version."""
    return json.dumps([__version__, asdict(cell)], sort_keys=True)


def _known(path):
    """CellResults by mark of earlier calls, without a line that a kill has cut short."""
    known = {}
    if path.exists():
        for line in path.read_text(encoding="utf-8").splitlines():
            try:
                mark, result = json.loads(line)
                known[mark] = CellResult(**result)
            except (ValueError, TypeError):
                continue
    return known
