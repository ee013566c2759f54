"""Figures of results, for screen and paper. They compute nothing: see dusttaichi.analysis.

Each function returns a matplotlib Figure of its own, without pyplot and without a display.
"""

from pathlib import Path

from dusttaichi.errors import DustError
from dusttaichi.plots.animation import animation
from dusttaichi.plots.compression import compression
from dusttaichi.plots.coordination import coordination
from dusttaichi.plots.fragments import mass_spectrum, restitution, sound_speed
from dusttaichi.plots.grains import grains
from dusttaichi.plots.ledger import ledger
from dusttaichi.plots.profile import profile
from dusttaichi.plots.style import styled

__all__ = [
    "animation",
    "compression",
    "coordination",
    "grains",
    "ledger",
    "mass_spectrum",
    "profile",
    "restitution",
    "save_all",
    "sound_speed",
]


@styled
def save_all(run, directory, suffix=".png"):
    """Write every figure that a Run has something for. Returns the paths.

    compression, coordination (closed boxes that compress), profile (where profiles were written)
    and ledger. suffix: what matplotlib knows, .png, .pdf, .svg. Raises DustError where the
    directory cannot be written.
    """
    figures = {"ledger": ledger(run)} if len(run.series.time) > 1 else {}
    if run.compresses:
        figures |= {"compression": compression([run]), "coordination": coordination([run])}
    if run.profiles is not None:
        figures["profile"] = profile(run)
    paths = []
    try:
        Path(directory).mkdir(parents=True, exist_ok=True)
        for name, figure in figures.items():
            paths.append(Path(directory) / f"{name}{suffix}")
            figure.savefig(paths[-1])
    except (OSError, ValueError) as error:
        raise DustError(f"The figures cannot be written to {directory}: {error}.") from error
    return paths
