"""Table and figure of docs/studies/size.md, from docs/validation/sample_size.csv.

`dust compare RUN ... --output docs/validation/sample_size.csv` makes the table, and then
`python docs/sample_size.py RUN ...` adds periodic cells without walls, whose pressure is minus the
stress along z.
"""

import re
import sys

import numpy as np
import pandas as pd
from tables import VALIDATION, markdown, read

from dusttaichi import analysis
from dusttaichi.analysis.compression_fit import fit_compression, measure_deviation
from dusttaichi.physics.laws import EXPERIMENT_SCATTER, S12_STATIC
from dusttaichi.plots import style

TABLE = "sample_size.csv"
# what names of runs have beside their kind: seed, grains, and the end of the box's
BESIDE = re.compile(r"(__)?(sample\.(seed|grains)|stop\.pressure)_\w+?(?=__|$)| \(.*")
# name of the runs without these -> row of the table
KINDS = {
    "omni_box-boundary.wall_speed_20cm_s": "box",
    "omni_static-sample.periodic_false": "sides periodic, but cut",
    "omni_static-": "periodic deposit: `omni_static`",
    "omni_static-sample.base_0um": "… from the floor on",
    "omni_static-sample.aspect_1": "… as high as wide",
    "omni_static-numerics.accuracy_balanced": "… `accuracy: balanced`",
    "omni_static-numerics.mass_scaling_4": "… `mass_scaling: 4`",
    "omni_static-numerics.stiffness_scaling_0.3": "… `stiffness_scaling: 0.3`",
    "omni_static-cell": "… periodic along z too",
}
MARKERS = "s^Dv<>"  # of rows with one number of grains


def cell(path):
    """A row of the table for a periodic cell without walls that shrinks along z."""
    with analysis.open_run(path) as run:
        pressure = -run.series.stress.sel(xyz="z", axis="z", drop=True).expand_dims(
            wall=["top"], axis=1
        )
        curve = analysis.measure_compression_curve(
            analysis.Run(path, run.series.assign(pressure=pressure))
        )
        fit, near = fit_compression(curve), measure_deviation(curve, S12_STATIC)
        full_range = measure_deviation(curve, S12_STATIC, p_low=1e2, p_high=1.5e5)
        numbers = {
            "p_m": fit.p_m,
            "delta": fit.delta,
            "rms": near.rms,
            "rms_mean": near.mean,
            "largest": full_range.largest,
            "largest_p_low": full_range.p_low,
            "largest_p_high": full_range.p_high,
        }
        return {name: f"{value:.5g}" for name, value in numbers.items()} | {
            "name": f"omni_static-cell__sample.seed_{run.scene['sample']['seed']}",
            "grains": run.grains,
            "steps": int(run.series.step[-1]),
            "status": run.status,
            "version": run.attrs["git_commit"],
        }


def groups():
    """{(kind, grains): rows} of the table, in the order of KINDS."""
    table, order = read(TABLE), list(KINDS.values())
    table["cost"] = table.steps * table.grains / 1e9  # grain-steps
    row_kinds = [KINDS[BESIDE.sub("", name).replace("-__", "-")] for name in table.name]
    rows_by_kind = {
        (row_kind, int(n)): rows
        for (row_kind, n), rows in table.groupby([row_kinds, "grains"], sort=False)
    }
    return dict(
        sorted(rows_by_kind.items(), key=lambda item: (order.index(item[0][0]), item[0][1]))
    )


def page():
    """The table in Markdown; of several seeds the mean, or the range where it says more."""
    return markdown(
        {
            "sample": row_kind,
            "grains": f"{grains}",
            "seeds": f"{len(rows)}",
            "1e9 grain-steps": f"{rows.cost.mean():.2f}",
            "largest distance in φ": _range(rows.largest, 3),
            "compared, kPa": f"{rows.largest_p_low.max() / 1e3:.2f}"
            f"-{rows.largest_p_high.min() / 1e3:.0f}",
            "rms, 1-100 kPa": f"{rows.rms.mean():.3f}",
            "mean": f"{rows.rms_mean.mean():+.3f}",
            "… of the inner part": f"{rows.inner_mean.mean():+.3f}".replace("+nan", "-"),
            "$p_m$, kPa": _range(rows.p_m / 1e3, 1),
            "Δ": f"{rows.delta.mean():.2f}",
        }
        for (row_kind, grains), rows in groups().items()
    )


@style.apply_style
def figure():
    """Largest distance from S12 eq 31 against the cost; a point a sample, its grains beside it."""
    drawing, (axes,) = style.create_figure()
    axes.axhspan(0.0, EXPERIMENT_SCATTER, color="#D9D9D9", label="scatter of the experiment")
    rows_by_kind = groups()
    markers = iter(MARKERS)
    for number, row_kind in enumerate(dict.fromkeys(row_kind for row_kind, _ in rows_by_kind)):
        sizes = [
            (grains, rows)
            for (kind_of_rows, grains), rows in rows_by_kind.items()
            if kind_of_rows == row_kind
        ]
        label, several = row_kind.replace("`", "").replace("… ", ""), len(sizes) > 1
        look = style.run_style(number) if several else style.line_look(style.BLACK, linestyle="")
        look["marker"] = "o" if several else next(markers)
        means = [(rows.cost.mean(), rows.largest.mean()) for _, rows in sizes]
        axes.plot(*np.transpose(means), label=label, ms=4, **look)
        for _, rows in sizes:
            axes.plot(rows.cost, rows.largest, **look | {"linestyle": "", "ms": 2})
        if several:
            for (grains, _), point in zip(sizes, means, strict=True):
                axes.annotate(f"{grains}", point, (4, 4), textcoords="offset points", fontsize=7)
    axes.set(xscale="log", xlim=(0.15, 10.0), ylim=(0.0, 0.07))
    axes.set(xlabel=r"cost ($10^9$ grain-steps)", ylabel=r"largest distance in $\phi$ from eq 31")
    style.set_few_ticks(axes.xaxis)
    style.draw_legend(axes)
    return drawing


def _range(values, digits):
    low, high = (f"{value:.{digits}f}" for value in (values.min(), values.max()))
    return low if low == high else f"{low} to {high}"


if __name__ == "__main__":
    cells = pd.DataFrame([cell(path) for path in sys.argv[1:]])
    table = pd.concat([read(TABLE, dtype=str), cells])  # digits as they are
    table.to_csv(VALIDATION / TABLE, index=False, lineterminator="\r\n")
