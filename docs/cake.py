"""Table and figure of docs/validation_pd08.md: `python docs/cake.py docs/validation/cake.csv RUN`.

A row for each ten records of the cake of PD08: the largest and the mean pressure on the top wall,
and the mean filling factors of the cake and of its inner cylinder (PD08 section 3.1).
"""

import numpy as np
from tables import main, read

from dusttaichi import analysis
from dusttaichi.physics.laws import UNIDIRECTIONAL
from dusttaichi.plots import style
from dusttaichi.plots.compression_curves import draw_laboratory_laws

RECORDS = 10
ONSET, FILLING_FACTORS = 0.5, (0.146, 0.35)
"""Pressure [kPa] from which the cake of PD08 yields; before, and at the end (section 3.1)."""


def rows(path):
    """Dicts of the groups of records of a run."""
    with analysis.open_run(path) as run:
        series = run.series.isel(time=slice(run.series.sizes["time"] % RECORDS, None))
        names = ["pressure", "filling_factor", "inner_filling_factor"]
        groups = series[names].sel(wall="top").coarsen(time=RECORDS)
        largest, mean = groups.max().pressure.values, groups.mean()
        version = run.attrs.get("git_commit", "")
    for n, pressure in enumerate(largest):
        yield {
            "largest_pressure_Pa": f"{pressure:.5g}",
            "pressure_Pa": f"{mean.pressure.values[n]:.5g}",
            "filling_factor": f"{mean.filling_factor.values[n]:.5g}",
            "inner_filling_factor": f"{mean.inner_filling_factor.values[n]:.5g}",
            "version": version,
        }


@style.apply_style
def draw_cake():
    """Filling factor of the cake against the largest pressure, beside what PD08 give."""
    table = read("cake.csv")
    figure, (axes,) = style.create_figure()
    draw_laboratory_laws(axes, np.geomspace(50.0, 1e5, 200), (UNIDIRECTIONAL,))
    look = {"color": style.run_style(0)["color"]}
    axes.plot(
        table.largest_pressure_Pa / 1e3, table.filling_factor, "o", ms=2.5, **look,
        label="cake of 291 grains, largest of ten records",
    )  # fmt: skip
    order = table.sort_values("filling_factor")
    mean = order.groupby((order.filling_factor / 0.01).round())[["pressure_Pa", "filling_factor"]]
    binned = mean.mean().query("pressure_Pa > 0")
    axes.plot(binned.pressure_Pa / 1e3, binned.filling_factor, label="mean pressure", **look)
    for n, phi in enumerate(FILLING_FACTORS):
        line = {"color": style.GREY, "linestyle": style.DASHED, "linewidth": 1.0}
        axes.axhline(phi, label=None if n else "PD08: onset, first and last filling factor", **line)
    axes.axvline(ONSET, **line)
    axes.set(xscale="log", xlabel="pressure on the top wall (kPa)", xlim=(0.05, 100.0))
    axes.set(ylabel=r"filling factor $\phi$", ylim=(0.1, 0.42))
    style.draw_legend(axes)
    return figure


if __name__ == "__main__":
    main(rows)
