"""Cost and error of each setting of a table of runs by scene, settings and seed, and its figure.

A setting is the mean over its seeds. Its error is the mean difference from the unchanged scene,
each run compared with that of the same seed: what the seeds have in common cancels, so that the
mean difference is known better than either mean.
"""

import numpy as np
import pandas as pd

from dusttaichi.plots import style
from dusttaichi.studies.suggest import AS_IT_IS

CURVE, PHI = "phi(P)", "phi at "
# of a stage, whose name follows
SHEAR, DEVIATOR = "shear strength ", "deviator "
LOAD, UNLOADING = "filling factor under load ", "unloading modulus "
MOST = 0.5  # share of the pairs of runs that must reach a pressure for it to count
STAGES = (SHEAR, DEVIATOR, LOAD, UNLOADING)
NUMBERS = ("cost", "value", "shift", "error", "uncertainty", "scatter")
# observables in the order of their priority
TEXTS = {
    CURVE: "filling factor against pressure",
    "strength": "tensile strength",
    "ratio": "pressure over T19 eq 9",
    "growth_efficiency": "growth efficiency",
    "largest_share": "share of the largest fragment",
}


def outcomes(table):
    """Outcomes of a table of runs: a DataFrame, scene by scene, in the order of the settings.

    A row is one observable of a setting, over all its seeds. cost: steps over those of the
    unchanged scene. value: mean (of a curve the mean filling factor). shift: mean difference from
    the unchanged scene with the same seeds, over its mean (of a curve the mean over its pressures).
    error: the same without its sign; of a curve the root mean square over its pressures.
    uncertainty: standard error of it, from the scatter of the differences; not a number for one
    seed. scatter: standard deviation between the seeds of the unchanged scene, relative as well.
    seeds: number of finished runs. refused: why there is no result, or "". hidden: whether the
    error is within the scatter of the seeds; resolved: whether it is more than twice its
    uncertainty, a shift and not chance.
    """
    result = []
    for scene, grains in table[["scene", "grains"]].dropna().drop_duplicates().values.tolist():
        # a run that was refused has no number of grains
        rows = table[(table.scene == scene) & table.grains.isin([grains, np.nan])]
        base = _select_finished(rows[rows.settings == AS_IT_IS])
        for settings, rows_of_settings in rows.groupby("settings", sort=False) if len(base) else ():
            about = {"scene": scene, "grains": int(grains), "settings": settings}
            result += [about | numbers for numbers in _compare_setting(rows_of_settings, base)]
    result_table = pd.DataFrame(result)
    result_table["hidden"] = result_table.error <= result_table.scatter
    result_table["resolved"] = result_table.error > 2.0 * result_table.uncertainty
    return result_table


def _select_finished(rows):
    return rows[rows.status.str.startswith("finished")]


def _compare_setting(rows, base):
    finished = _select_finished(rows)
    about = {"seeds": len(finished), "refused": "" if len(finished) else rows.status.iloc[0]}
    if finished.empty:
        return [about | dict.fromkeys(NUMBERS, np.nan) | {"observable": ""}]
    seeds = set(finished.seed) & set(base.seed)
    both = [some[some.seed.isin(seeds)].set_index("seed") for some in (finished, base)]
    about["cost"] = np.divide(*(some.steps.mean() for some in both))
    result = []
    for name, columns in _observables(base).items():
        mine, right = (some[columns] for some in both)
        paired = mine.notna() & right.notna()
        if available := [name for name in columns if paired[name].mean() > MOST]:
            mine, right = (some.where(paired)[available] for some in (mine, right))
            numbers = _numbers(mine, right, base[available].std())
            result.append(about | numbers | {"observable": name})
    return result


def _numbers(mine, right, spread):
    """Numbers of an outcome from tables (seed, pressure) of a setting and of the unchanged scene.

    Both are NaN where a pair of runs has no value. spread: standard deviation between seeds,
    (pressure,).
    """
    scale, change = abs(right.mean().mean()), mine - right
    rms = {"error": change.mean(), "uncertainty": change.sem(), "scatter": spread}
    numbers = {name: np.sqrt(np.mean(d.to_numpy() ** 2)) / scale for name, d in rms.items()}
    return numbers | {"value": mine.mean().mean(), "shift": change.mean().mean() / scale}


def _observables(rows):
    """Observable -> its columns, of those that the first row has; of a curve all pressures."""
    available = rows.columns[rows.iloc[0].notna()]
    curve = [name for name in rows if name.startswith(PHI)]
    result = {CURVE: curve} if set(curve) & set(available) else {}
    single = [n for n in TEXTS if n in available] + [n for n in available if n.startswith(STAGES)]
    return result | {name: [name] for name in single}


def text_of(observable):
    """Description of an observable."""
    prefix = next((p for p in STAGES if observable.startswith(p)), None)
    return f"{prefix}in stage {observable[len(prefix) :]}" if prefix else TEXTS[observable]


# -- figure ----------------------------------------------------------------------------------------

KINDS = (  # parameters in the settings -> colour, marker, label
    (("accuracy",), style.BLACK, "*", "preset"),
    (("stiffness_scaling",), style.RED, "s", "stiffness"),
    (("mass_scaling",), style.ORANGE, "s", "mass"),
    (("speed",), style.BLUE, "s", "speed"),
    (("step_fraction",), style.GREEN, "o", "step"),
    (("mass_scaling", "stiffness_scaling"), style.PURPLE, "D", "stiffness and mass"),
    (("speed", "stiffness_scaling"), style.SKY, "D", "stiffness and speed"),
    (("step_fraction", "stiffness_scaling"), style.YELLOW, "D", "stiffness and step"),
)
OTHER = (style.BLACK, "D", "three or more")
COLUMNS = 2


@style.apply_style
def figure(table, observables=()):
    """The figure of outcomes: a panel for each scene.

    A panel shows the first of `observables` that the scene has, else its first. Dashed: a fifth of
    the cost; bars: standard errors; open: of a single seed.
    """
    shown = table[(table.refused == "") & (table.settings != AS_IT_IS)]
    panels = list(shown.groupby(["scene", "grains"], sort=False))
    figure, axes = style.create_grid(len(panels), COLUMNS, height=2.3)
    handles = {}
    for axes_of_scene, ((scene, grains), rows) in zip(axes, panels, strict=True):
        names = rows.observable.unique()
        name = next((n for n in observables if n in names), names[0])
        _panel(axes_of_scene, rows[rows.observable == name])
        title = f"{scene.removeprefix('trade_')}, {grains} grains:\n{text_of(name)}"
        axes_of_scene.set_title(title, fontsize=7)
        handles |= dict(zip(*reversed(axes_of_scene.get_legend_handles_labels()), strict=True))
    figure.legend(handles.values(), handles, loc="outside lower center", ncols=4, fontsize=7)
    return figure


def _panel(axes, rows):
    scatter, errors = rows.scatter.iloc[0], rows.error.clip(lower=1e-4)
    axes.axhspan(1e-5, scatter, color=style.GREY, alpha=0.18, linewidth=0, label="scatter of seeds")
    axes.axvline(0.2, **style.line_look(style.BLACK, 0.8, (0, (5, 2))))
    for o, error in zip(rows.itertuples(), errors, strict=True):
        colour, marker, label = _look(o.settings)
        open_ = {"markerfacecolor": "white"} if o.seeds < 2 else {}
        bar = 0.0 if np.isnan(o.uncertainty) else o.uncertainty
        bars = [[min(bar, 0.9 * error)], [bar]]  # on a logarithmic axis
        look = open_ | {"color": colour, "markersize": 7 if marker == "*" else 4}
        axes.errorbar(o.cost, error, bars, fmt=marker, label=label, elinewidth=0.8, **look)
    axes.set(xscale="log", yscale="log")
    axes.set_xlabel("steps over those as it is", fontsize=7)
    axes.set_ylabel("error of the mean", fontsize=7)
    axes.set_xlim(min(0.05, 0.8 * rows.cost.min()), 1.2)
    axes.tick_params(labelsize=7, which="both")
    style.set_few_ticks(axes.xaxis)
    axes.set_ylim(0.5 * min(errors.min(), scatter), 2.0 * max(errors.max(), scatter))


def _look(settings):
    varied = tuple(sorted(text.split()[0] for text in settings.split(", ")))
    return next((look for parameters, *look in KINDS if parameters == varied), OTHER)
