"""A bead in dust: map, profile and motion in one figure."""

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from dusttaichi.analysis.continuum import read_particles
from dusttaichi.plots.continuum.bead_profile import draw_profile
from dusttaichi.plots.continuum.deceleration import draw_way
from dusttaichi.plots.continuum.dust import COLOURS, EVERYDAY, extent_of, intrudes, limits_of, paint
from dusttaichi.plots.registry import figure


@figure("The bead: map, profile, motion", 173, applies=intrudes)
def impact(run, color=EVERYDAY):
    """A bead in dust in one figure: map, profile along the axis, normalised motion.

    Parameters
    ----------
    run : Run
    color : str
        As in `dust`.

    Raises
    ------
    DustError
        The run has no rigid projectile.
    """
    figure = Figure(figsize=(10.0, 3.2), layout="constrained")
    figure.get_layout_engine().set(w_pad=0.08)
    FigureCanvasAgg(figure)
    wide, *beside = figure.subplots(1, 3, width_ratios=[1.7, 1.0, 1.0])
    frame = read_particles(run, -1)
    image = paint(wide, run, frame, color, limits_of([frame], color), extent=extent_of([frame]))
    figure.colorbar(image, ax=wide, label=COLOURS[color][0], extend="max", shrink=0.85)
    draw_profile(beside[0], [run], ["_"])
    draw_way(beside[1], [run], [None])
    return figure
