"""Tables of softened contacts and of drafts for docs/studies/trade.md, from their measurements."""

from pathlib import Path

import numpy as np
from outcomes import CURVE, PHI, outcomes
from tables import markdown, read

from dusttaichi.grains.contact_table import ContactTable
from dusttaichi.scene import load
from dusttaichi.studies.suggest import AS_IT_IS

HERE = Path(__file__).parent
SCENE = HERE.parent / "configs/trade/omni.yaml"  # that of the causes
NAME, SLOW = "trade_omni", "trade_omni_slow"
STIFFNESS = "stiffness_scaling"
LEVELS = ("0.3", "0.1", "0.03", "0.01", "0.003")
DRAFT = "accuracy draft"
OF_DRAFT = ("draft", DRAFT)  # name in tables, and settings
CHOSEN, UNSEEN = "trade_", "unseen_"  # prefixes of the names of scenes
SHORT = {"strength": "tensile strength", "ratio": "pressure over T19 eq 9"}
CHANNELS = ("rolling", "twisting", "damping", "sliding", "breaking", "forming")


def pages():
    """The tables by the names of their files."""
    table = read("softening.csv")
    outcome_table = outcomes(table)
    return {
        "softening_levels.md": levels(outcome_table),
        "softening_pressures.md": pressures(table),
        "softening_speeds.md": speeds(table),
        "softening_causes.md": causes(table),
        "softening_drafts.md": drafts(outcome_table, CHOSEN),
        "softening_unseen.md": drafts(outcome_table, UNSEEN),
    }


def levels(outcome_table):
    """Cost and error of each scene and number at each level of stiffness."""
    outcomes_by_key = {
        (o.scene, o.grains, o.settings, o.observable): o for o in outcome_table.itertuples()
    }
    rows = []
    for base in outcome_table[
        (outcome_table.settings == AS_IT_IS) & _has_prefix(outcome_table, CHOSEN)
    ].itertuples():
        some, cells = [], {}
        for s in LEVELS:
            key = base.scene, base.grains, f"{STIFFNESS} {s}"
            some.append(outcomes_by_key.get((*key, base.observable)))
            cells[s] = _cell(some[-1], outcomes_by_key.get((*key, "")), base.seeds)
        if any(some):
            scatter = f"{base.seeds}, {_format_percent(base.scatter)}"
            about = {
                "scene, grains": _name(base),
                "number": _number(base),
                "seeds, scatter": scatter,
            }
            rows.append(about | cells | {"free down to": _free(some)})
    return markdown(rows)


def pressures(table):
    """Shift of the mean filling factor of SCENE at each pressure, and the scatter of seeds."""
    return _shifts(_runs(table, NAME), _list_softened_runs(table, NAME))


def speeds(table):
    """Shift as in `pressures` of SLOW, a wall a quarter as fast, and of SCENE against it."""
    faster = {
        f"{label}, 20 cm/s": _runs(table, NAME, s) for label, s in (("1", AS_IT_IS), OF_DRAFT)
    }
    return _shifts(_runs(table, SLOW), faster | _list_softened_runs(table, SLOW))


def _list_softened_runs(table, name):
    """{first cell of a row: runs} of the levels and the draft of a scene."""
    levels = [(s, f"{STIFFNESS} {s}") for s in LEVELS]
    return {label: _runs(table, name, settings) for label, settings in (*levels, OF_DRAFT)}


def _shifts(base, some):
    """Shifts of the mean filling factor at each pressure, over the seeds that both have."""
    names = [name for name in base if name.startswith(PHI)]
    mean, spread = base[names].mean(), base[names].std()
    cells = {n: f"{mean[n]:.3f}, scatter {_format_percent(spread[n] / mean[n])}" for n in names}
    rows = [(("1", len(base)), cells)]
    for label, runs in some.items():
        change = (runs[names] - base[names]).dropna(how="all")
        if len(change):
            shift, error = change.mean() / mean, change.sem() / mean
            rows.append(
                ((label, len(change)), {n: _format_signed(shift[n], error[n]) for n in names})
            )
    return markdown(
        {f"`{STIFFNESS}`": label, "seeds": f"{seeds}"}
        | {f"φ at {name.removeprefix(PHI)}": cell for name, cell in cells.items()}
        for (label, seeds), cells in rows
    )


def causes(table):
    """Changes of SCENE and SLOW by softening: events of contacts, and shares of the losses."""
    base, some = _runs_of_scene(table)
    levels = {s: (s, rows) for s, rows in {"1": base, **some}.items()}
    for s, settings in (("1", AS_IT_IS), ("0.1", f"{STIFFNESS} 0.1")):
        levels[f"{s}, 5 cm/s"] = s, _runs(table, SLOW, settings).loc[base.index]
    scene, lines = load(SCENE), []
    for name, (s, runs) in levels.items():
        pair = ContactTable(scene.with_value(f"numerics.{STIFFNESS}", float(s))).farthest_pair
        lost = runs[[f"lost {name} [J]" for name in CHANNELS]].fillna(0.0).mean()
        touch = -float(pair.curve(np.array([0.0]))[1][0])
        formed = lost["lost forming [J]"] / touch / runs.grains.iloc[0]
        loss_shares = zip(CHANNELS, lost / lost.sum(), strict=True)
        lines.append(
            {
                f"`{STIFFNESS}`": name,
                "energy that binds a contact": f"{pair.bound * 1e18:.3g} aJ",
                "slides from": f"{pair.numbers['zeta_crit'] * 1e9:.2g} nm",
                "contacts formed per grain": f"{formed:.1f}",
                "contacts per grain at the end": f"{runs['contacts a grain'].mean():.2f}",
                **{
                    f"lost on {channel}": _format_percent(fraction)
                    for channel, fraction in loss_shares
                },
            }
        )
    return markdown(lines)


def _runs(table, name, settings=AS_IT_IS):
    """Numbers of the finished runs of a scene with these settings, by seed."""
    rows = table[(table.scene == name) & (table.settings == settings)]
    rows = rows[rows.status.str.startswith("finished")].set_index("seed")
    return rows.select_dtypes("number")


def _runs_of_scene(table):
    """Finished runs of SCENE by seed: as it is, and {level: those of the same seeds}."""
    base = _runs(table, NAME)
    some = {s: rows for s in LEVELS if len(rows := _runs(table, NAME, f"{STIFFNESS} {s}"))}
    seeds = sorted(set(base.index).intersection(*(rows.index for rows in some.values())))
    return base.loc[seeds], {s: rows.loc[seeds] for s, rows in some.items()}


def drafts(outcome_table, prefix):
    """Drafts of the scenes whose names have a prefix."""
    list_draft_errors = outcome_table[
        (outcome_table.settings == DRAFT)
        & (outcome_table.refused == "")
        & _has_prefix(outcome_table, prefix)
    ]
    return markdown(
        {
            "scene, grains": _name(o),
            "number": _number(o),
            "steps": f"{o.cost:.3f}",
            "error of the mean": _format_signed(_sign(o) * o.error, o.uncertainty),
            "scatter of seeds": _format_percent(o.scatter),
            "seeds": f"{o.seeds}",
            "verdict": verdict(o),
        }
        for o in list_draft_errors.itertuples()
    )


def _has_prefix(outcome_table, prefix):
    return outcome_table.scene.str.startswith(prefix)


def verdict(o):
    """Whether the error of an outcome is within the scatter of its seeds."""
    if o.seeds < 2:
        return "one seed"
    if o.hidden:
        return "within, a shift" if o.resolved else "within"
    return "open" if o.error - o.uncertainty <= o.scatter else "above"


def _cell(o, refused, seeds):
    """Cost and error of an outcome, if any; else why there is none."""
    if o is None and refused is None:
        return "not run"
    if o is None:
        return "refused" if "cannot be used" in refused.refused else "stopped"
    text = f"{o.cost:.2f}: {_format_signed(_sign(o) * o.error, o.uncertainty)}"
    text += f" ({o.seeds} seed{'s' * (o.seeds > 1)})" if o.seeds < seeds else ""
    return text if o.hidden else f"**{text}**"


def _free(some):
    """The last level up to which all errors are within the scatter."""
    last = "none"
    for s, o in zip(LEVELS, some, strict=True):
        if o is None or not o.hidden:
            break
        last = s
    return last


def _name(o):
    return f"`{o.scene.removeprefix(CHOSEN).removeprefix(UNSEEN)}`, {o.grains}"


def _number(o):
    if o.observable == CURVE:
        return "φ(P)"
    return SHORT.get(o.observable, o.observable.replace("_", " "))


def _sign(o):
    return -1.0 if o.shift < 0.0 else 1.0


def _format_signed(fraction, uncertainty):
    text = f"{'−' if fraction < 0.0 else '+'}{_format_percent(abs(fraction))}"
    return text if np.isnan(uncertainty) else f"{text[:-2]} ± {_format_percent(uncertainty)}"


def _format_percent(fraction):
    if np.isnan(fraction):
        return "-"
    return f"{100 * fraction:.1f} %" if fraction < 0.095 else f"{100 * fraction:.0f} %"
