"""What a worker process does for a cell of the map."""

import warnings
from dataclasses import asdict


def attempt_cell(parent, *, cell):
    """Try a Cell (as its dict); returns its CellResult as a dict."""
    from dusttaichi.studies.extremes.cell import Cell
    from dusttaichi.studies.extremes.trial import attempt

    warnings.simplefilter("ignore")
    return asdict(attempt(Cell(**cell)))
