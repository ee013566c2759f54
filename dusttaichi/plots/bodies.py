"""Two colliding bodies: their velocities and angular momenta."""

import numpy as np

from dusttaichi.analysis import bodies as bodies_of
from dusttaichi.plots import style
from dusttaichi.plots.registry import figure

AXES = ("x", "y", "z")
MOMENTA = tuple((10.0**-n, rf"$10^{{-{n}}}$") for n in (15, 18, 21, 24, 27))


def _has_bodies(run):
    return len(run.series.time) > 1 and "body_angular_momentum" in run.series


@figure("Velocities and angular momenta", 20, applies=_has_bodies)
def bodies(run):
    """Velocities and angular momenta of the two bodies of a run over time.

    Velocities along x and y; angular momenta along z: orbital, of each about its centre, total.

    Raises
    ------
    DustError
        There are not two bodies.
    """
    two = bodies_of(run)
    figure, (speeds, turning) = style.new_figure(height=5.2, rows=2)
    per_time, seconds = style.scaled(two.time[-1], style.TIMES)
    time = two.time * per_time
    for number, name in enumerate(two.names):
        line = style.run_style(number)
        speeds.plot(time, two.velocity[:, number, 0], label=f"{name}, along x", **line)
        faint = line | {"linestyle": (0, (1, 1.5)), "linewidth": 1.0}
        speeds.plot(time, two.velocity[:, number, 1], label=f"{name}, along y", **faint)
    speeds.set_ylabel("velocity (m/s)")
    style.legend(speeds, ncols=2)
    parts = {"about each other": two.orbital[:, 2]}
    parts |= {f"of the {name}": two.spin[:, k, 2] for k, name in enumerate(two.names)}
    parts["of all"] = two.orbital[:, 2] + two.spin[:, :, 2].sum(axis=1)
    per_unit, unit = style.scaled(max(np.abs(a).max() for a in parts.values()), MOMENTA)
    for number, (name, values) in enumerate(parts.items()):
        line = style.run_style(number)
        if name == "of all":
            line = {"color": style.BLACK, "linewidth": 1.0, "linestyle": style.DASHED}
        turning.plot(time, values * per_unit, label=name, **line)
    turning.set(ylabel=f"angular momentum\nalong z ({unit} kg m²/s)", xlabel=f"time ({seconds})")
    style.legend(turning, ncols=2)
    return figure
