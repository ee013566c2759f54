"""Figure of docs/forces.md: `dust run forces/settling`, `python docs/settling.py runs/settling`."""

import sys
from pathlib import Path

import numpy as np

from dusttaichi import analysis, plots
from dusttaichi.plots import style
from dusttaichi.scene import load

FIGURE = Path(__file__).parent / "figures" / "settling.png"


@style.apply_style
def draw_settling(path):
    """Speed of an aggregate that settles in a gas, beside its closed form."""
    with analysis.open_run(path) as run:
        momentum = run.series.momentum.sel(xyz="z", drop=True)
        grain, time = run.material, run.series.time
        mass = run.grains * grain.density * 4.0 / 3.0 * np.pi * grain.radius**3
    scene = load(Path(path) / "scene.yaml")
    stopping_time = scene.forces[0].stopping_time
    terminal_speed = -scene.gravity.acceleration[2] * stopping_time
    figure, (axes,) = style.create_figure()
    look = style.run_style(0)
    axes.plot(time * 1e9, -momentum / mass * 1e9, "o", ms=3, color=look["color"], label="run")
    exact = terminal_speed * (1.0 - np.exp(-time / stopping_time))
    axes.plot(time * 1e9, exact * 1e9, color=style.BLACK, label=r"$g\tau(1 - e^{-t/\tau})$")
    axes.set(xlabel="time (ns)", ylabel="speed (nm/s)")
    style.draw_legend(axes)
    return figure


if __name__ == "__main__":
    FIGURE.unlink(missing_ok=True)
    plots.save(draw_settling(sys.argv[1]), FIGURE)
