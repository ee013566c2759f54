"""Figures of the docs from their committed tables: `python docs/redraw.py`.

What took minutes to hours to compute is drawn anew here without being computed again.
"""

import csv
from importlib.resources import files
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import xarray as xr
from sample_size import figure as sample_size
from strength_size import groups as strength_groups
from strength_size import weibull

from dusttaichi import plots
from dusttaichi.analysis.grid import outcomes, read
from dusttaichi.physics import laws
from dusttaichi.physics.continuum.numbers import MaterialNumbers
from dusttaichi.plots import style
from dusttaichi.plots.continuum_fit import continuum_fit, pressing_speeds
from dusttaichi.plots.grid import grid
from dusttaichi.plots.tensile import strengths
from dusttaichi.scene import extensions
from dusttaichi.scene.continuum_material import ContinuumMaterial
from dusttaichi.scene.material import NAMED, Material
from dusttaichi.studies.continuum_fit.speeds import Curve
from dusttaichi.studies.extremes.groups import GROUPS
from dusttaichi.studies.trade.suggest import COLUMNS, TABLE, to_table

HERE = Path(__file__).parent
LOOSEST = 0.01  # filling factor from which on compression is drawn
# words of the names of tensile runs at phi = 0.1, as docs/strength_size.md has them
SLOW = ("filling_factor_0.1", "tensile_4096", "n_4096-seed", "fiducial")
DENSE = "tatsuuma2023/compressive_strength.py"
TABLES, FIGURES = HERE / "validation", HERE / "figures"
# of two scenes, as docs/studies/trade.md has them: the observable, its scatter between seeds, what
# the reference moves by at its check, the tolerance
TRADES = {
    "omni": ("phi_rms", 0.036, 0.02, "half its step", 0.05),
    "bead": ("depth", np.nan, 0.039, "twice its spacing", 0.1),
}


def rows(name):
    """The rows of a table as dicts of text."""
    with open(TABLES / name, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def numbers(table, column):
    """A column of numbers, NaN where it is empty."""
    return np.array([float(row[column] or "nan") for row in table])


def trade(scene):
    """Cost against error of a scene of TRADES."""
    observable, scatter, convergence, check, tolerance = TRADES[scene]
    table = [
        row
        for row in rows("trade.csv")
        if row["scene"] == scene and row["observable"] == observable
    ]
    columns = {name: np.array([row[name] for row in table]) for name in ("parameter", "kind")}
    data = xr.Dataset(
        {
            **{name: ("point", column) for name, column in columns.items()},
            "label": ("point", np.array([row["point"] for row in table])),
            "cost_ratio": ("point", numbers(table, "cost over default")),
            "error": ("point", numbers(table, "error")),
            "scatter": ("observable", [scatter]),
            "convergence": ("observable", [convergence]),
        },
        coords={"observable": [observable]},
        attrs={"observable": observable, "tolerance": tolerance, "check": check},
    )
    return plots.trade(data)


def softening():
    """Cost against error of softened contacts; and the table that `--suggest` reads."""
    found = outcomes(read(TABLES / "softening.csv"))
    # collisions refuse softened contacts: nothing to suggest
    table = to_table(own for own in found if own.scene != "trade_collision")
    path = files("dusttaichi.studies.trade") / TABLE
    pd.DataFrame(table, columns=COLUMNS).to_csv(path, index=False, lineterminator="\n")
    shown = [own for own in found if own.scene.startswith("trade_")]
    return grid(shown, observables=("phi(P)", "strength", "ratio"))


def extremes():
    """How every cell ends; its row and column are those of the cell of that name."""
    table = rows("extremes.csv")
    cells = {(c.group, c.name): c for make in GROUPS.values() for c in make(False)}
    found = [cells[row["group"], row["name"]] for row in table]
    texts = {name: [row[name] for row in table] for name in ("group", "name", "verdict")}
    texts |= {way: [str(getattr(c, way)) for c in found] for way in ("row", "column")}
    data = xr.Dataset(
        {name: ("cell", np.array(column, dtype=object)) for name, column in texts.items()}
        | {name: ("cell", numbers(table, name)) for name in ("residual", "measured", "ratio")}
    )
    return plots.extremes(data)


def tensile_strength():
    """Tensile strength of ice: 1024 grains, four seeds at each of three filling factors."""
    names = ("strength", "strength_sigma", "phi_init")
    chosen = [r for r in rows("tensile.csv") if r["name"].startswith("tensile_ice-stages.0.stop")]
    results = [
        SimpleNamespace(
            **{name: float(row[name]) for name in names}, passed=row["strength_passed"] == "True"
        )
        for row in chosen
    ]
    labels = [f"{len(chosen)} runs", *["_"] * (len(chosen) - 1)]
    return strengths(results, labels, [Material(**NAMED["ice_t19"])])


def strength_size(table, *words):
    """Tensile strengths of samples of several sizes: Weibull plot, and against the size."""
    return weibull.strength_samples(strength_groups(TABLES / table, words))


@style.styled
def compression_law():
    """Pressure of ice and silicate that is compressed from all sides beside both laws, and the
    share of each channel in the losses of ice; runs of a seed that continue each other are one
    line."""
    compressive_strength = extensions.module(DENSE).compressive_strength
    ice = Material(**NAMED["ice_t19"])
    own = ice.surface_energy, ice.radius, ice.critical_rolling
    unit = laws.isotropic_pressure(1.0, *own)
    table = [r for r in rows("compression_law.csv") if float(r["filling_factor"]) > LOOSEST]
    figure, (axes, below) = style.new_figure(height=6.4, rows=2, ratios=[3, 2])
    phi = np.geomspace(LOOSEST, 0.65, 200)
    for law, look, text in (
        (laws.isotropic_pressure, "-", r"$\phi^3$, T19 eq 9"),
        (compressive_strength, (0, (4, 2)), r"$(1/\phi-1/0.74)^{-3}$, Tatsuuma+ 2023"),
    ):
        line = law(phi, *own) / unit
        axes.plot(phi, line, color=style.BLACK, linewidth=1.1, linestyle=look, label=text)
    for number, (grains, seed) in enumerate(dict.fromkeys((r["grains"], r["seed"]) for r in table)):
        mine = [r for r in table if (r["grains"], r["seed"]) == (grains, seed)]
        pressure = numbers(mine, "pressure_Pa") / unit
        text = f"{grains} grains, seed {seed}"
        axes.plot(numbers(mine, "filling_factor"), pressure, label=text, **style.run_style(number))
    sand = Material(**NAMED["silicate_s12"])
    unit = laws.isotropic_pressure(1.0, sand.surface_energy, sand.radius, sand.critical_rolling)
    mine = [r for r in rows("compression_silicate.csv") if r["run"] == "silicate_1"]
    phi, pressure = numbers(mine, "filling_factor"), numbers(mine, "pressure_Pa") / unit
    axes.plot(
        phi, pressure, "o", ms=4, mfc="none", label="silicate, 1024 grains", color=style.BLACK
    )
    largest = [r for r in table if r["grains"] == "4096"]
    for name, colour in style.CHANNEL_COLOURS.items():
        if f"share_{name}" in largest[0]:
            share = numbers(largest, f"share_{name}")
            below.plot(numbers(largest, "filling_factor"), share, color=colour, label=name)
    axes.set_xscale("log")
    axes.set_yscale("log")
    style.few_ticks(below.xaxis)
    below.set_xlabel(r"filling factor $\phi$")
    axes.set_ylabel(r"mean pressure over $E_{\rm roll}/r^3$")
    below.set_ylabel("share of the energy lost")
    style.legend(axes)
    style.legend(below, ncols=2)
    return figure


LABORATORY = ((0.15, 1.0e3), (0.41, 2.4e3), (0.54, 3.7e3), (0.66, 6.3e3))
"""Filling factor and tensile strength [Pa] of cakes of 1.5 um spheres (G09 section 3.1)."""


@style.styled
def diametral_strength():
    """Strength of discs beside cells that were pulled, and beside the laboratory."""
    figure, (axes,) = style.new_figure()
    phi = np.linspace(0.13, 0.7, 200)
    silicate = Material(**NAMED["silicate_s12"])
    for law, dash, text in (
        (laws.tensile_strength_laboratory(phi), style.DASHED, "laboratory, G09 eq 8"),
        (
            laws.tensile_strength(phi, silicate.surface_energy, silicate.radius),
            style.DOTTED,
            "T19 eq 33",
        ),
    ):
        axes.plot(phi, law / 1e3, label=text, **style.look(style.BLACK, 1.1, dash))
    x, y = np.array(LABORATORY).T
    axes.plot(x, y / 1e3, "s", color=style.BLACK, ms=5, mfc="white", label="laboratory, G09 3.1")
    pulled = [r for r in rows("dust_grains.csv") if r["quantity"] == "tension"]
    x, y = numbers(pulled, "filling factor"), numbers(pulled, "grains show [Pa]")
    look = style.run_style(0)["color"]
    axes.plot(x, y / 1e3, "^", color=look, ms=5, label="periodic cells, pulled")
    table = rows("diametral.csv")
    colour = style.run_style(1)["color"]
    for passed, text in (("True", "discs"), ("False", "discs, largest value")):
        own = [r for r in table if r["diametral_passed"] == passed]
        x, y = numbers(own, "diametral_phi"), numbers(own, "diametral_strength")
        fill = colour if passed == "True" else "white"
        if own:
            axes.plot(x, y / 1e3, "o", color=colour, mfc=fill, ms=5, label=text)
    axes.set(yscale="log", xlabel=r"filling factor $\phi$", ylabel="tensile strength (kPa)")
    style.few_ticks(axes.yaxis)
    style.legend(axes)
    return figure


def dust_grains():
    """A material fitted to grains, and their curves at each rate of pressing."""
    seen = [
        (
            SimpleNamespace(seed=int(row["seed"])),
            SimpleNamespace(
                quantity=row["quantity"],
                phi=float(row["filling factor"]),
                value=float(row["grains show [Pa]"]),
            ),
        )
        for row in rows("dust_grains.csv")
    ]
    numbers_of = MaterialNumbers.of(ContinuumMaterial.model_validate("dust_grains"))
    fit = SimpleNamespace(numbers=numbers_of, rows=seen)
    return continuum_fit(fit), pressing_speeds(curves())


def curves():
    """The curves of docs/validation/dust_grains_speeds.csv."""
    groups = {}
    for row in rows("dust_grains_speeds.csv"):
        key = (row["run"], int(row["seed"]), int(row["grains"]), float(row["rate [1/s]"]))
        groups.setdefault(key, []).append(row)
    names = ("filling factor", "p [Pa]", "axial stress [Pa]")
    return [Curve(*key, *(numbers(of, name) for name in names)) for key, of in groups.items()]


# lines of the panels of the figure of fragmentation: (study, body) -> label
DISSIPATION = {
    ("base", "sample"): "500 and 500 grains",
    ("none", "sample"): "the same, no damping",
    ("rolling32", "sample"): r"the same, $\xi_{\rm crit}$ = 3.2 nm",
}
BODIES = {
    ("base", "sample"): "500 and 500 grains",
    ("ratio", "sample"): "500 and 125 grains",
    ("ratio16", "sample"): "500 and 31 grains",
    ("sizes", "n250"): "250 and 250 grains",
    ("sizes", "n125"): "125 and 125 grains",
}


@style.styled
def fragmentation():
    """Growth efficiency against the speed, and against the energy over that of all contacts."""
    table = rows("fragmentation.csv")
    figure, panels = style.new_figure(height=8.6, rows=3, ratios=[1, 1, 1], shared=False)
    columns = "speed_m_per_s", "speed_m_per_s", "energy_over_breaking"
    energy = r"impact energy / $(N E_{\rm break})$"
    labels = "relative speed (m/s)", "relative speed (m/s)", energy
    choices = DISSIPATION, BODIES, BODIES
    for axes, column, label, lines in zip(panels, columns, labels, choices, strict=True):
        axes.axhline(0.0, color=style.GREY, linewidth=0.8)
        for number, (key, text) in enumerate(lines.items()):
            own = [row for row in table if (row["study"], row["body"]) == key]
            growth, error = (numbers(own, f"growth_efficiency{end}") for end in ("", "_error"))
            line = {**style.run_style(number), "label": text, "marker": "o", "ms": 4, "capsize": 2}
            axes.errorbar(numbers(own, column), growth, error, **line)
        axes.set_xscale("log")
        style.few_ticks(axes.xaxis)
        axes.set(xlabel=label, ylabel="growth efficiency")
        style.legend(axes)
    return figure


# level and speed [m/s] of the lines of the figure of bouncing -> label
BOUNCING = {
    ("phi60", "4"): r"$\phi$ = 0.57, 4 m/s",
    ("phi60", "16"): r"$\phi$ = 0.57, 16 m/s",
    ("phi60", "10"): r"$\phi$ = 0.57, 10 m/s",
    ("phi60", "1"): r"$\phi$ = 0.57, 1 m/s",
    ("phi55", "10"): r"$\phi$ = 0.53 and 0.49, 10 m/s",
}


@style.styled
def bouncing_threshold():
    """Share of the pairs that bounce, against the number of grains of a body."""
    table = rows("bouncing_levels.csv")
    figure, (axes,) = style.new_figure()
    for number, (key, text) in enumerate(BOUNCING.items()):
        own = [row for row in table if (row["level"], row["speed_m_per_s"]) == key]
        own.sort(key=lambda row: int(row["grains_per_body"]))
        share = numbers(own, "bouncing") / numbers(own, "pairs")
        line = {**style.run_style(number), "label": text, "marker": "o", "ms": 4}
        axes.plot(numbers(own, "grains_per_body"), share, **line)
    axes.set(xscale="log", xlabel="grains per body", ylabel="share of the pairs that bounce")
    style.legend(axes)
    return figure


def main():
    """Entry point."""
    for scene in TRADES:
        plots.save(trade(scene), FIGURES / f"trade_{scene}.png")
    plots.save(softening(), FIGURES / "softening.png")
    plots.save(extremes(), FIGURES / "extremes.png")
    plots.save(tensile_strength(), FIGURES / "tensile_strength.png")
    plots.save(compression_law(), FIGURES / "compression_law.png")
    plots.save(fragmentation(), FIGURES / "fragmentation.png")
    plots.save(bouncing_threshold(), FIGURES / "bouncing_threshold.png")
    plots.save(sample_size(), FIGURES / "sample_size.png")
    plots.save(diametral_strength(), FIGURES / "diametral_strength.png")
    plots.save(strength_size("strength_size.csv"), FIGURES / "strength_size.png")
    slow = strength_size("tensile.csv", *SLOW)
    plots.save(slow, FIGURES / "strength_size_slow.png")
    for name, figure in zip(("dust_grains", "dust_grains_speeds"), dust_grains(), strict=True):
        plots.save(figure, FIGURES / f"{name}.png")


if __name__ == "__main__":
    main()
