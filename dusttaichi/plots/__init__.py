"""Figures of results, for screen and paper. They compute nothing: see dusttaichi.analysis.

Each function returns a new matplotlib Figure, without pyplot and without a display. Those with a
row in the registry (`dusttaichi.plots.registry`) are imported by the names of their figures.
"""

from pathlib import Path

from dusttaichi.analysis.ensemble_tables import axes_of
from dusttaichi.errors import DustError
from dusttaichi.names import exported
from dusttaichi.plots import style as style
from dusttaichi.plots.animation import animation
from dusttaichi.plots.collisions import (
    fragment_spectrum,
    growth,
    outcome_map,
    phases,
    threshold_speeds,
)
from dusttaichi.plots.ensemble import ensemble, points
from dusttaichi.plots.extremes import extremes
from dusttaichi.plots.fragments import mass_spectrum
from dusttaichi.plots.grains import grains
from dusttaichi.plots.numbers import numbers
from dusttaichi.plots.registry import (
    Figure,
    drawn,
    drawn_together,
    figure,
    figures,
    in_package,
    register,
)
from dusttaichi.plots.restitution import restitution
from dusttaichi.plots.sound_speed import sound_speed
from dusttaichi.plots.style import bands, save, styled
from dusttaichi.plots.trade import trade
from dusttaichi.plots.weibull import weibull

_OF_RUNS = in_package(f"{__name__}.continuum") | in_package(__name__)
globals().update(_OF_RUNS)  # after their modules, whose names they have


def save_all(run, directory, suffix=".png", failed=None):
    """Write every figure of `figures_of`.

    Parameters
    ----------
    run : Run
    directory : path
    suffix : str
        Format of matplotlib: .png, .pdf, .svg.
    failed : list, optional
        As in `figures_of`.

    Returns
    -------
    list of pathlib.Path
        The files.

    Raises
    ------
    DustError
        The directory cannot be written.
    """
    return _save(figures_of(run, failed), directory, suffix)


@styled
def figures_of(run, failed=None):
    """Every figure of the registry that applies to a run, by name.

    Parameters
    ----------
    run : Run
    failed : list, optional
        Receives (title, error) of failed figures; without it they raise DustError.

    Returns
    -------
    dict
        Name -> matplotlib Figure.
    """
    return _collected(drawn(run), failed)


def _collected(found, failed):
    """Figures by name, of the results of `drawn` and `drawn_together`."""
    rows = list(found)
    problems = [(row.title, why) for row, _, why in rows if why]
    if failed is None and problems:
        raise DustError("; ".join(f"{title}: {why}" for title, why in problems))
    if failed is not None:
        failed += problems
    return {row.name: drawing for row, drawing, why in rows if not why}


def save_ensemble(data, directory, suffix=".png"):
    """Write the figures of `figures_of_ensemble`.

    Parameters
    ----------
    data : xarray.Dataset
    directory : path
    suffix : str
        Format of matplotlib: .png, .pdf, .svg.

    Returns
    -------
    list of pathlib.Path
        The files.
    """
    return _save(figures_of_ensemble(data), directory, suffix)


def figures_of_ensemble(data):
    """Figures of a dataset of `analysis.gather`, an ensemble or a sweep, by name.

    - sweep or ensemble: all curves in one panel
    - points: one panel for each
    - numbers: the numbers of the runs against the swept keys, or the replicas
    - weibull: tensile strengths of several samples
    """
    drawings = {"sweep" if axes_of(data) else "ensemble": ensemble(data)}
    more = {"points": points(data), "numbers": numbers(data), "weibull": weibull(data)}
    return drawings | {name: drawing for name, drawing in more.items() if drawing is not None}


def save_together(runs, directory, suffix=".png", failed=None):
    """Write the figures of `figures_together`.

    Parameters
    ----------
    runs : list of Run
    directory : path
    suffix : str
        Format of matplotlib: .png, .pdf, .svg.
    failed : list, optional
        As in `figures_of`.

    Returns
    -------
    list of pathlib.Path
        The files.

    Raises
    ------
    DustError
        There are no figures, or the directory cannot be written.
    """
    drawings = figures_together(runs, failed)
    if not drawings:
        raise DustError(
            "There is no figure of these runs together: no two of them are compressed, stretched, "
            "pushed or move."
        )
    return _save(drawings, directory, suffix)


@styled
def figures_together(runs, failed=None):
    """Figures of the registry for several runs together, by name.

    Parameters
    ----------
    runs : list of Run
    failed : list, optional
        As in `figures_of`.

    Returns
    -------
    dict
        Name -> matplotlib Figure.
    """
    return _collected(drawn_together(runs), failed)


def _save(drawings, directory, suffix):
    return [save(one, Path(directory) / f"{name}{suffix}") for name, one in drawings.items()]


__all__ = exported(globals())
