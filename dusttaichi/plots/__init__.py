"""Figures of results, for screen and paper. They compute nothing: see dusttaichi.analysis.

Each function returns a new matplotlib Figure, without pyplot and without a display. Those with a
row in the registry (`dusttaichi.plots.figure_registry`) are imported by the names of their figures.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr
from matplotlib.figure import Figure as MplFigure

from dusttaichi.analysis.ensemble_tables import axes_of
from dusttaichi.analysis.numbers.number_registry import Statistics
from dusttaichi.analysis.run import Run
from dusttaichi.errors import DustError
from dusttaichi.plots import style as style
from dusttaichi.plots.animation import animation
from dusttaichi.plots.collision_figures import restitution, restitution_map
from dusttaichi.plots.ensemble_bands import ensemble, points
from dusttaichi.plots.extremes_map import extremes
from dusttaichi.plots.figure_registry import (
    Figure,
    draw_run,
    draw_runs,
    draw_statistics,
    figure,
    find_figures,
    list_figures,
    register,
)
from dusttaichi.plots.fragments import mass_spectrum
from dusttaichi.plots.grain_picture import grains
from dusttaichi.plots.notebook import ShownFigures
from dusttaichi.plots.outcomes import (
    collision_figures,
    fragment_spectrum,
    growth,
    outcome_map,
    phases,
    threshold_speeds,
)
from dusttaichi.plots.pareto_front import trade
from dusttaichi.plots.style import apply_style, draw_bands, save
from dusttaichi.plots.swept_numbers import numbers

if TYPE_CHECKING:  # for editors and type checkers; found by the registry below
    from dusttaichi.plots.collision_figures import bodies, collision
    from dusttaichi.plots.compression_curves import compression, coordination, isotropic
    from dusttaichi.plots.cycles import cycles
    from dusttaichi.plots.dynamic_speeds import dynamic_speeds
    from dusttaichi.plots.energy_figures import kinetic, ledger, losses
    from dusttaichi.plots.fragments import fragment_dimension, fragments
    from dusttaichi.plots.penetration_figures import sphere, sphere_column
    from dusttaichi.plots.profile import profile
    from dusttaichi.plots.shear import loads, shear, triaxial
    from dusttaichi.plots.sound_speed import sound_speed
    from dusttaichi.plots.stress import stress
    from dusttaichi.plots.structure import fractal, pores, structure
    from dusttaichi.plots.surface_figures import surfaces
    from dusttaichi.plots.tensile import strength, tensile

_OF_RUNS = find_figures(__name__)
globals().update(_OF_RUNS)  # after their modules, whose names they have


def __getattr__(name: str) -> Any:
    """Drawing function of a figure that one method has; it is imported on first use."""
    drawings = {row.draw.__name__: row.draw for row in list_figures()} if name[0] != "_" else {}
    if name not in drawings:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return drawings[name]


def save_figures(
    source: Run | list[Run] | xr.Dataset,
    directory: str | Path,
    suffix: str = ".png",
    failed: list[tuple[str, str]] | None = None,
) -> list[Path]:
    """Write every figure of `draw_figures`.

    Parameters
    ----------
    source : Run, list of Run or xarray.Dataset
        As in `draw_figures`.
    directory : path
    suffix : str
        Format of matplotlib: .png, .pdf, .svg.
    failed : list, optional
        As in `draw_figures`.

    Returns
    -------
    list of pathlib.Path
        The files.

    Raises
    ------
    DustError
        There are no figures of several runs, or the directory cannot be written.
    """
    drawings = draw_figures(source, failed)
    if not drawings and isinstance(source, list):
        raise DustError(
            "There is no figure of these runs together: no two of them are compressed, stretched, "
            "pushed or move."
        )
    return [
        save(drawing, Path(directory) / f"{name}{suffix}") for name, drawing in drawings.items()
    ]


@apply_style
def draw_figures(
    source: Run | list[Run] | xr.Dataset, failed: list[tuple[str, str]] | None = None
) -> ShownFigures:
    """Draw every figure of a run, of several runs together, or of an ensemble or a sweep, by name.

    Runs have those of the registry that apply; a dataset of `analysis.gather` has:

    - sweep or ensemble: all curves in one panel
    - points: one panel for each
    - numbers: the numbers of the runs against the swept keys, or the replicas
    - those of the Statistics of extensions

    Parameters
    ----------
    source : Run, list of Run or xarray.Dataset
    failed : list, optional
        Receives (title, error) of failed figures; without it they raise DustError.

    Returns
    -------
    dict
        Name -> matplotlib Figure; a notebook shows them.
    """
    drawings: dict[str, MplFigure | None] = {}
    drawn: list[tuple[Figure | Statistics, MplFigure | None, str]] = []
    if isinstance(source, xr.Dataset):
        drawings = {
            "sweep" if axes_of(source) else "ensemble": ensemble(source),
            "points": points(source),
            "numbers": numbers(source),
        }
        drawn += draw_statistics(source)
    else:
        drawn += draw_runs(source) if isinstance(source, list) else draw_run(source)
    problems = [(row.title, problem) for row, _, problem in drawn if problem]
    if failed is None and problems:
        raise DustError("; ".join(f"{title}: {problem}" for title, problem in problems))
    if failed is not None:
        failed += problems
    drawings |= {row.name: drawing for row, drawing, problem in drawn if not problem}
    return ShownFigures({n: drawing for n, drawing in drawings.items() if drawing is not None})


__all__ = [
    "Figure",
    "ShownFigures",
    "animation",
    "apply_style",
    "bodies",
    "collision",
    "collision_figures",
    "compression",
    "coordination",
    "cycles",
    "draw_bands",
    "draw_figures",
    "draw_run",
    "draw_runs",
    "draw_statistics",
    "dynamic_speeds",
    "ensemble",
    "extremes",
    "figure",
    "find_figures",
    "fractal",
    "fragment_dimension",
    "fragment_spectrum",
    "fragments",
    "grains",
    "growth",
    "isotropic",
    "kinetic",
    "ledger",
    "list_figures",
    "loads",
    "losses",
    "mass_spectrum",
    "numbers",
    "outcome_map",
    "phases",
    "points",
    "pores",
    "profile",
    "register",
    "restitution",
    "restitution_map",
    "save",
    "save_figures",
    "shear",
    "sound_speed",
    "sphere",
    "sphere_column",
    "strength",
    "stress",
    "structure",
    "surfaces",
    "tensile",
    "threshold_speeds",
    "trade",
    "triaxial",
]
