"""Figures of results, for screen and paper. They compute nothing: see dusttaichi.analysis.

Each function returns a matplotlib Figure of its own, without pyplot and without a display. One that
has a row in the registry (`dusttaichi.plots.registry`) is a file of the name of its figure, and is
here by its name.
"""

from pathlib import Path

from dusttaichi.analysis.ensemble_tables import axes_of
from dusttaichi.errors import DustError
from dusttaichi.plots import style as style
from dusttaichi.plots.animation import animation
from dusttaichi.plots.collisions import fragment_spectrum, growth, outcome_map, threshold_speeds
from dusttaichi.plots.ensemble import ensemble, points
from dusttaichi.plots.extremes import extremes
from dusttaichi.plots.grains import grains
from dusttaichi.plots.mass_spectrum import mass_spectrum
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

_OF_RUNS = in_package(f"{__name__}.continuum") | in_package(__name__)
globals().update(_OF_RUNS)  # after their modules, whose names they have

__all__ = [
    *_OF_RUNS,
    "Figure",
    "animation",
    "bands",
    "drawn",
    "drawn_together",
    "ensemble",
    "extremes",
    "figure",
    "figures",
    "figures_of",
    "figures_of_ensemble",
    "figures_together",
    "fragment_spectrum",
    "grains",
    "growth",
    "mass_spectrum",
    "numbers",
    "outcome_map",
    "points",
    "register",
    "restitution",
    "save",
    "save_all",
    "save_ensemble",
    "save_together",
    "sound_speed",
    "threshold_speeds",
    "trade",
]


def save_all(run, directory, suffix=".png", failed=None):
    """Write every figure of `figures_of`. Returns the paths.

    suffix: what matplotlib knows, .png, .pdf, .svg. Raises DustError where the directory cannot
    be written.
    """
    return _save(figures_of(run, failed), directory, suffix)


@styled
def figures_of(run, failed=None):
    """Every figure of the registry that a Run has something for, by name.

    failed: a list that takes (title, why) of those that could not be drawn; without it, these raise
    DustError.
    """
    return _collected(drawn(run), failed)


def _collected(found, failed):
    """Figures by name of what `drawn` and `drawn_together` find."""
    drawings, problems = {}, [] if failed is None else failed
    for row, one, why in found:
        if why:
            problems.append((row.title, why))
        else:
            drawings[row.name] = one
    if failed is None and problems:
        raise DustError("; ".join(f"{title}: {why}" for title, why in problems))
    return drawings


def save_ensemble(data, directory, suffix=".png"):
    """Write the figures of `figures_of_ensemble`. Returns the paths."""
    return _save(figures_of_ensemble(data), directory, suffix)


def figures_of_ensemble(data):
    """The figures of a dataset of `analysis.gather`, an ensemble or a sweep, by name.

    sweep or ensemble: its curves in one; points: each of them by itself; numbers: the numbers of
    the runs against the swept keys, or the replicas.
    """
    figures = {"sweep" if axes_of(data) else "ensemble": ensemble(data)}
    drawn = {"points": points(data), "numbers": numbers(data)}
    return figures | {name: figure for name, figure in drawn.items() if figure is not None}


def save_together(runs, directory, suffix=".png", failed=None):
    """Write the figures of `figures_together`. Returns the paths.

    Raises DustError where there are none, or the directory cannot be written.
    """
    figures = figures_together(runs, failed)
    if not figures:
        raise DustError(
            "There is no figure to show these runs together: no two of them are compressed, "
            "stretched, pushed or move."
        )
    return _save(figures, directory, suffix)


@styled
def figures_together(runs, failed=None):
    """The figures of the registry that show several Runs in one, by name; failed: as `figures_of`
    takes it."""
    return _collected(drawn_together(runs), failed)


def _save(figures, directory, suffix):
    return [save(figure, Path(directory) / f"{name}{suffix}") for name, figure in figures.items()]
