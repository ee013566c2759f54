"""What all figures share: size, fonts, colours, units of the axes."""

from functools import wraps

from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

# Okabe and Ito: told apart with any colour vision
BLUE, ORANGE, GREEN, RED = "#0072B2", "#E69F00", "#009E73", "#D55E00"
SKY, PURPLE, YELLOW, BLACK, GREY = "#56B4E9", "#CC79A7", "#F0E442", "#000000", "#8C8C8C"
RUN_COLOURS = (BLUE, RED, GREEN, PURPLE, ORANGE, SKY)
RUN_DASHES = ("-", (0, (5, 1.5)), (0, (1.5, 1)), (0, (5, 1, 1, 1)), (0, (3, 1)), (0, (8, 2)))
CHANNEL_COLOURS = {
    "forming": BLUE,
    "breaking": SKY,
    "damping": GREEN,
    "rolling": ORANGE,
    "sliding": RED,
    "twisting": PURPLE,
}
_RC = {
    "font.size": 9,
    "axes.labelsize": 10,
    "legend.fontsize": 8,
    "legend.frameon": True,
    "legend.framealpha": 0.85,
    "legend.edgecolor": "none",
    "legend.facecolor": "white",
    "legend.handlelength": 2.4,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.top": True,
    "ytick.right": True,
    "axes.linewidth": 0.8,
    "lines.linewidth": 1.6,
    "figure.dpi": 200,
    "savefig.dpi": "figure",
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
}
WIDTH = 5.2  # inches: fits a text column, and is legible there


def styled(function):
    """Draw under this module's settings, without touching the user's own."""

    @wraps(function)
    def drawn(*args, **kwargs):
        with rc_context(_RC):
            return function(*args, **kwargs)

    return drawn


def new_figure(height=3.7, rows=1, ratios=None):
    """A Figure with `rows` axes above each other that share the x axis: (figure, [axes])."""
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, 1, sharex=True, squeeze=False, height_ratios=ratios)
    return figure, list(axes[:, 0])


def scaled(largest, units):
    """(factor, unit) for values up to `largest`: the first of `units` (scale, name) that fits."""
    for scale, name in units:
        if largest >= scale:
            return 1.0 / scale, name
    scale, name = units[-1]
    return 1.0 / scale, name


TIMES = ((1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns"))
ENERGIES = ((1e-6, "µJ"), (1e-9, "nJ"), (1e-12, "pJ"), (1e-15, "fJ"), (1e-18, "aJ"))


def run_style(number):
    """Colour and dashes of the run with this number, so that print in grey works too."""
    return {
        "color": RUN_COLOURS[number % len(RUN_COLOURS)],
        "linestyle": RUN_DASHES[number % len(RUN_DASHES)],
    }
