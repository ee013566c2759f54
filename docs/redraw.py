"""Figures of the docs from their committed tables: `python docs/redraw.py [NAME ...]`.

What took minutes to hours to compute is drawn anew here without being computed again.
"""

import sys
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import xarray as xr
from cake import draw_cake
from contact import draw_contact
from outcomes import figure as of_settings
from outcomes import outcomes
from sample_size import figure as sample_size
from tables import read

from dusttaichi import plots
from dusttaichi.continuum.analysis.observations import Curve
from dusttaichi.continuum.physics.material_numbers import MaterialNumbers
from dusttaichi.continuum.plots.fitted_material import continuum_fit, pressing_speeds
from dusttaichi.continuum.scene.material import ContinuumMaterial
from dusttaichi.physics import laws
from dusttaichi.plots import style
from dusttaichi.plots.tensile import strengths
from dusttaichi.scene import extensions, load
from dusttaichi.scene.material import NAMED, Material
from dusttaichi.studies.extremes_map import GROUPS
from dusttaichi.studies.suggest import COLUMNS, TABLE, classify_scene

HERE = Path(__file__).parent
LOOSEST = 0.01  # filling factor from which on compression is drawn
# words of the names of tensile runs at phi = 0.1, as docs/strength_size.md has them
SLOW = ("filling_factor_0.1", "tensile_4096", "n_4096-seed", "fiducial")
# scenes of the table of `dust trade --suggest`
SUGGESTED = (
    "trade_omni", "trade_omni_slow", "trade_omni_3000", "omni_box", "trade_uni", "uni_static",
    "trade_tensile", "tensile_ice", "trade_isotropic", "trade_shear",
)  # fmt: skip
DENSE = "tatsuuma2023/compressive_strength.py"
TABLES, FIGURES = HERE / "validation", HERE / "figures"
# of two scenes, as docs/studies/trade.md has them: the observable, its scatter between seeds, what
# the reference moves by at its check, the tolerance
TRADES = {
    "omni": ("phi_rms", 0.036, 0.02, "half its step", 0.05),
    "bead": ("depth", np.nan, 0.039, "twice its spacing", 0.1),
}


def trade(scene):
    """Cost against error of a scene of TRADES."""
    observable, scatter, convergence, check, tolerance = TRADES[scene]
    table = read("trade.csv").query("scene == @scene and observable == @observable")
    names = {"label": "point", "cost_ratio": "cost over default"}
    columns = ("parameter", "kind", "label", "cost_ratio", "error")
    data = xr.Dataset(
        {
            **{name: ("point", table[names.get(name, name)].values) for name in columns},
            "scatter": ("observable", [scatter]),
            "convergence": ("observable", [convergence]),
        },
        coords={"observable": [observable]},
        attrs={"observable": observable, "tolerance": tolerance, "check": check},
    )
    return plots.trade(data)


def softening():
    """Cost against error of softened contacts; and the table that `--suggest` reads."""
    table = outcomes(read("softening.csv"))
    # collisions refuse softened contacts: nothing to suggest
    suggested = table[table.scene.isin(SUGGESTED) & (table.refused == "")]
    scenes = {name: load(name.replace("trade_", "trade/")) for name in SUGGESTED}
    kinds_by_scene = {name: classify_scene(scene) for name, scene in scenes.items()}
    suggested = suggested.assign(kind=suggested.scene.map(kinds_by_scene))[COLUMNS]
    suggested.to_csv(TABLE, index=False, lineterminator="\n", float_format="%.4g", na_rep="nan")
    shown = table[table.scene.str.startswith("trade_")]
    return of_settings(shown, observables=("phi(P)", "strength", "ratio"))


def extremes():
    """How every cell ends; its row and column are those of the cell of that name."""
    table = read("extremes.csv")
    cells = {(c.group, c.name): c for make in GROUPS.values() for c in make(False)}
    for way in ("row", "column"):
        keys = zip(table.group, table.name, strict=True)
        table[way] = [str(getattr(cells[key], way)) for key in keys]
    return plots.extremes(table.rename_axis("cell").to_xarray())


def tensile_strength():
    """Tensile strength of ice: 1024 grains, four seeds at each of three filling factors."""
    table = read("tensile.csv")
    table = table[table.name.str.startswith("tensile_ice-stages.0.stop")]
    results = [SimpleNamespace(**row._asdict(), passed=row.strength_passed)
               for row in table.itertuples()]  # fmt: skip
    labels = [f"{len(table)} runs", *["_"] * (len(table) - 1)]
    return strengths(results, labels, [Material(**NAMED["ice_t19"])])


def strength_size(name, *words):
    """Tensile strengths of samples of several sizes: Weibull plot, and against the size.

    name: table of `dust compare`; rows count whose name contains one of the words. Prints the
    Weibull statistics.
    """
    table = read(name).dropna(subset="strength")
    table = table[table.name.str.contains("|".join(words))]
    weibull = extensions.import_extension("kimura2020/weibull.py")
    strengths_by_size = [
        weibull.Strengths(f"{grains} grains", grains, size.values, weibull.fit_weibull(size.values))
        for grains, size in table.groupby("grains").strength
    ]
    for size in strengths_by_size:
        kpa = size.values / 1e3
        scatter = f" ± {kpa.std(ddof=1):.2f}" if len(kpa) > 1 else ""
        print(f"{size.grains} grains, {len(kpa)} samples: {kpa.mean():.2f}{scatter} kPa")
    columns, lines = weibull.tabulate_strengths(strengths_by_size)
    for texts in zip(*(texts for _, texts in columns), strict=True):
        print(", ".join(f"{head} {text}" for (head, _), text in zip(columns, texts, strict=True)))
    print(*lines, sep="\n")
    return weibull.draw_strengths(strengths_by_size)


@style.apply_style
def compression_law():
    """Pressure of ice and silicate that is compressed from all sides beside both laws, and the
    share of each channel in the losses of ice; runs of a seed that continue each other are one
    line."""
    compressive_strength = extensions.import_extension(DENSE).compressive_strength
    ice = Material(**NAMED["ice_t19"])
    constants = ice.surface_energy, ice.radius, ice.critical_rolling
    unit = laws.isotropic_pressure(1.0, *constants)
    table = read("compression_law.csv").query("filling_factor > @LOOSEST")
    figure, (axes, below) = style.create_figure(height=6.4, rows=2, ratios=[3, 2])
    phi = np.geomspace(LOOSEST, 0.65, 200)
    for law, look, text in (
        (laws.isotropic_pressure, "-", r"$\phi^3$, T19 eq 9"),
        (compressive_strength, (0, (4, 2)), r"$(1/\phi-1/0.74)^{-3}$, Tatsuuma+ 2023"),
    ):
        line = law(phi, *constants) / unit
        axes.plot(phi, line, color=style.BLACK, linewidth=1.1, linestyle=look, label=text)
    samples = table.groupby(["grains", "seed"], sort=False)
    for number, ((grains, seed), mine) in enumerate(samples):
        text = f"{grains} grains, seed {seed}"
        line = {"label": text, **style.run_style(number)}
        axes.plot(mine.filling_factor, mine.pressure_Pa / unit, **line)
    sand = Material(**NAMED["silicate_s12"])
    unit = laws.isotropic_pressure(1.0, sand.surface_energy, sand.radius, sand.critical_rolling)
    mine = read("compression_silicate.csv").query("run == 'silicate_1'")
    look = {"ms": 4, "mfc": "none", "color": style.BLACK, "label": "silicate, 1024 grains"}
    axes.plot(mine.filling_factor, mine.pressure_Pa / unit, "o", **look)
    largest = table.query("grains == 4096")
    for name, colour in style.CHANNEL_COLOURS.items():
        if f"share_{name}" in largest:
            line = {"color": colour, "label": name}
            below.plot(largest.filling_factor, largest[f"share_{name}"], **line)
    axes.set_xscale("log")
    axes.set_yscale("log")
    style.set_few_ticks(below.xaxis)
    below.set_xlabel(r"filling factor $\phi$")
    axes.set_ylabel(r"mean pressure over $E_{\rm roll}/r^3$")
    below.set_ylabel("share of the energy lost")
    style.draw_legend(axes)
    style.draw_legend(below, ncols=2)
    return figure


LABORATORY = ((0.15, 1.0e3), (0.41, 2.4e3), (0.54, 3.7e3), (0.66, 6.3e3))
"""Filling factor and tensile strength [Pa] of cakes of 1.5 um spheres (G09 section 3.1)."""


@style.apply_style
def diametral_strength():
    """Strength of discs beside cells that were pulled, and beside the laboratory."""
    figure, (axes,) = style.create_figure()
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
        axes.plot(phi, law / 1e3, label=text, **style.line_look(style.BLACK, 1.1, dash))
    x, y = np.array(LABORATORY).T
    axes.plot(x, y / 1e3, "s", color=style.BLACK, ms=5, mfc="white", label="laboratory, G09 3.1")
    pulled = read("dust_grains.csv").query("quantity == 'tension'")
    look = {"color": style.run_style(0)["color"], "ms": 5, "label": "periodic cells, pulled"}
    axes.plot(pulled["filling factor"], pulled["grains show [Pa]"] / 1e3, "^", **look)
    table = read("diametral.csv")
    look["color"] = style.run_style(1)["color"]
    for passed, text in ((True, "discs"), (False, "discs, largest value")):
        discs = table[table.diametral_passed == passed]
        look |= {"label": text, "mfc": look["color"] if passed else "white"}
        if len(discs):
            axes.plot(discs.diametral_phi, discs.diametral_strength / 1e3, "o", **look)
    axes.set(yscale="log", xlabel=r"filling factor $\phi$", ylabel="tensile strength (kPa)")
    style.set_few_ticks(axes.yaxis)
    style.draw_legend(axes)
    return figure


def dust_grains():
    """A material fitted to grains."""
    seen = [
        (SimpleNamespace(seed=seed), SimpleNamespace(quantity=quantity, phi=phi, value=value))
        for seed, quantity, phi, value in read("dust_grains.csv")[
            ["seed", "quantity", "filling factor", "grains show [Pa]"]
        ].itertuples(index=False)
    ]
    numbers_of = MaterialNumbers.from_material(ContinuumMaterial.model_validate("dust_grains"))
    return continuum_fit(SimpleNamespace(numbers=numbers_of, rows=seen))


def dust_grains_speeds():
    """Curves of grains at each rate of pressing."""
    keys = ["run", "seed", "grains", "rate [1/s]"]
    names = ("filling factor", "p [Pa]", "axial stress [Pa]")
    groups = read("dust_grains_speeds.csv").groupby(keys, sort=False)
    curves = [Curve(*key, *(of[name].values for name in names)) for key, of in groups]
    return pressing_speeds(curves)


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


@style.apply_style
def fragmentation():
    """Growth efficiency against the speed, and against the energy over that of all contacts."""
    table = read("fragmentation.csv")
    figure, panels = style.create_figure(height=8.6, rows=3, ratios=[1, 1, 1], shared=False)
    columns = "speed_m_per_s", "speed_m_per_s", "energy_over_breaking"
    energy = r"impact energy / $(N E_{\rm break})$"
    labels = "relative speed (m/s)", "relative speed (m/s)", energy
    choices = DISSIPATION, BODIES, BODIES
    for axes, column, label, lines in zip(panels, columns, labels, choices, strict=True):
        axes.axhline(0.0, color=style.GREY, linewidth=0.8)
        for number, (key, text) in enumerate(lines.items()):
            rows = table[(table.study == key[0]) & (table.body == key[1])]
            line = {**style.run_style(number), "label": text, "marker": "o", "ms": 4, "capsize": 2}
            axes.errorbar(
                rows[column], rows.growth_efficiency, rows.growth_efficiency_error, **line
            )
        axes.set_xscale("log")
        style.set_few_ticks(axes.xaxis)
        axes.set(xlabel=label, ylabel="growth efficiency")
        style.draw_legend(axes)
    return figure


# level and speed [m/s] of the lines of the figure of bouncing -> label
BOUNCING = {
    ("phi60", 4): r"$\phi$ = 0.57, 4 m/s",
    ("phi60", 16): r"$\phi$ = 0.57, 16 m/s",
    ("phi60", 10): r"$\phi$ = 0.57, 10 m/s",
    ("phi60", 1): r"$\phi$ = 0.57, 1 m/s",
    ("phi55", 10): r"$\phi$ = 0.53 and 0.49, 10 m/s",
}


@style.apply_style
def bouncing_threshold():
    """Share of the pairs that bounce, against the number of grains of a body."""
    table = read("bouncing_levels.csv").sort_values("grains_per_body")
    figure, (axes,) = style.create_figure()
    for number, (key, text) in enumerate(BOUNCING.items()):
        rows = table[(table.level == key[0]) & (table.speed_m_per_s == key[1])]
        line = {**style.run_style(number), "label": text, "marker": "o", "ms": 4}
        axes.plot(rows.grains_per_body, rows.bouncing / rows.pairs, **line)
    axes.set(xscale="log", xlabel="grains per body", ylabel="share of the pairs that bounce")
    style.draw_legend(axes)
    return figure


@style.apply_style
def draw_speed():
    """Time per contact and step on one thread against the number of grains, beside LAMMPS."""
    table = read("pages/speed_lammps.csv")
    grains = table.grains.astype(float)
    figure, (axes,) = style.create_figure()
    columns = ("dusttaichi", "1 thread: ns per contact"), ("LAMMPS", "LAMMPS: ns per contact")
    for number, (code, column) in enumerate(columns):
        for dash, (phi, rows) in zip(
            ("-", style.DASHED, style.DOTTED),
            table.groupby(table["φ"].replace(0.54, 0.55)),  # as near as a wall comes
            strict=True,
        ):
            look = style.line_look(style.run_style(number)["color"], 1.4, dash)
            label = rf"{code}, $\phi$ = {phi:.2g}"
            axes.plot(grains[rows.index], rows[column], marker="o", ms=4, label=label, **look)
    axes.set(
        xscale="log", yscale="log", xlabel="grains", ylabel="ns per contact and step, 1 thread"
    )
    style.set_few_ticks(axes.yaxis)
    style.draw_legend(axes, ncols=2)
    return figure


DRAWN = {
    **{f"trade_{scene}": partial(trade, scene) for scene in TRADES},
    "softening": softening,
    "speed": draw_speed,
    "extremes": extremes,
    "cake": draw_cake,
    "contact": draw_contact,
    "tensile_strength": tensile_strength,
    "compression_law": compression_law,
    "fragmentation": fragmentation,
    "bouncing_threshold": bouncing_threshold,
    "sample_size": sample_size,
    "diametral_strength": diametral_strength,
    "strength_size": partial(strength_size, "strength_size.csv"),
    "strength_size_slow": partial(strength_size, "tensile.csv", *SLOW),
    "dust_grains": dust_grains,
    "dust_grains_speeds": dust_grains_speeds,
}


def main(*names):
    """Entry point: draw these figures, or all."""
    for name in names or DRAWN:
        path = FIGURES / f"{name}.png"
        figure = DRAWN[name]()
        path.unlink(missing_ok=True)  # one of an earlier version is not replaced
        plots.save(figure, path)


if __name__ == "__main__":
    main(*sys.argv[1:])
