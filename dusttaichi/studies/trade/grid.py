"""Every combination of some parameters, at every seed: errors of means, and the scatter of seeds.

Where a change shifts the mean by less than the scatter of the seeds, single runs do not show it.
So each setting runs with all seeds, one after the other in this process, and its mean is compared
with that of the unchanged scene. Costs are numbers of steps: the time of a step depends neither on
stiffness nor on masses or speeds, and other load of the machine does not change the number.
Several scenes may share a table.
"""

import csv
import io
import json
import shutil
import time
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np

from dusttaichi import __version__, files
from dusttaichi.errors import DustError, Interrupted
from dusttaichi.results.provenance import git_commit
from dusttaichi.run.identity import differences, input_hashes, package_hash, without_paths
from dusttaichi.studies.ensemble.runs import core_of
from dusttaichi.studies.trade import scenes
from dusttaichi.studies.trade.point import parameters_of

PRESSURES = (1e3, 3e3, 1e4, 3e4, 6e4)  # Pa, for the comparison of curves
FILE = "grid.csv"
# The scenes that its rows are of, which have only their names: without these, runs of an edited
# YAML, or of a preset that has changed, would continue a table of the previous one.
SCENES = "grid.json"
PRESET = "accuracy"
SCENE = ("scene", "grains", "settings", "seed", "status")
RUN = ("steps", "time_step [s]", "ledger", "seconds", "version")


@dataclass(frozen=True)
class Setting:
    """One combination: text of the level of each parameter, and the changes of the scene."""

    levels: tuple[tuple[str, str], ...]
    changes: dict

    @property
    def text(self):
        """Text such as "stiffness_scaling 0.1, mass_scaling 4"; "as it is" for no change."""
        return ", ".join(f"{name} {level}" for name, level in self.levels) or "as it is"


def settings_of(scene, text):
    """Settings of a base scene from a text such as "stiffness_scaling 1 0.1; mass_scaling 1 4".

    The unchanged scene is the first, then all combinations; several texts are separated by "|".
    Raises DustError for an unknown parameter or level.
    """
    found = {(): {}}
    for part in text.split("|"):
        axes = [_axis(scene, words.split()) for words in part.split(";") if words.strip()]
        for chosen in product(*axes):
            levels = tuple((name, level) for name, level, changes in chosen if changes)
            changes = {path: value for _, _, own in chosen for path, value in own.items()}
            found.setdefault(levels, changes)
    return [Setting(levels, changes) for levels, changes in found.items()]


def _axis(scene, words):
    """[(parameter, text, changes)] of "mass_scaling 1 4"; no changes at the value of the scene."""
    name, *wanted = words
    known = {parameter.name: parameter.levels for parameter in parameters_of(scene).parameters}
    known[PRESET] = _presets
    levels = known[name](scene) if name in known else None
    if levels is None or isinstance(levels, str) or not wanted:
        why = f"needs a parameter and its levels; parameters: {', '.join(known)}"
        why = levels if isinstance(levels, str) else why
        raise DustError(f"--grid {' '.join(words)}: {why}")
    there = dict(levels)
    out = []
    for text in wanted:
        changes = {} if text == "1" else there.get(text) or _between(levels, text)
        if changes is None:
            raise DustError(f"--grid {name} {text}: allowed: 1, {', '.join(there)}")
        out.append((name, text, changes))
    return out


def _presets(scene):
    """Levels of `accuracy`: the presets."""
    return [(point.text, point.changes) for point in parameters_of(scene).presets(scene)]


def _between(levels, text):
    """Changes for a number that is not in `levels`, if those of the first level set its number."""
    first, changes = levels[0]
    try:
        number, own = float(text), float(first)
    except ValueError:
        return None
    found = {path: number if value == own else value for path, value in changes.items()}
    return None if found == changes else found


def grid(scene, directory, text, seeds, *, force=False, log=lambda text: None):
    """Run all settings at all seeds that `grid.csv` does not contain yet; returns its path.

    Rows of other scenes stay in it. Each row is written at once. Raises DustError, also where rows
    are of another version of the scene; KeyboardInterrupt, after which all finished rows are in the
    file.
    """
    base, directory = scenes.base(scene), Path(directory)
    settings = settings_of(base, text)
    wanted = [(setting, n) for n in range(seeds) for setting in settings]
    with files.RunLock(directory):
        path = directory / FILE
        table = _read(path)
        if force:
            table = [row for row in table if row["scene"] != base.name]
        done = {(row["scene"], row["settings"], int(row["seed"])) for row in table}
        _check(directory, base, settings, {s for name, s, _ in done if name == base.name})
        for k, (setting, n) in enumerate(wanted, 1):
            if (base.name, setting.text, n) in done:
                continue
            row = _row(base, directory / "run", setting, n)
            table.append(row)
            _write(path, table)
            log(f"{k} of {len(wanted)}: {setting.text}, seed + {n}: {row['steps']} steps, "
                f"{row['seconds']} s, {row['status']}")  # fmt: skip
    return path


def _row(base, folder, setting, n):
    """A row of the table: the run of a setting with n added to its seeds."""
    from dusttaichi.run import execute

    row = {"scene": base.name, "settings": setting.text, "seed": n}
    row |= {"version": git_commit() or f"{__version__} {package_hash()[:8]}"}
    row |= dict(setting.levels)
    began = time.process_time()
    try:
        scene = scenes.changed(base, setting.changes | scenes.seeds_moved(base, n))
        execute(scene, folder, force=True, fresh=True)
        row |= _measured(folder)
    except Interrupted:
        raise
    except DustError as error:
        row |= {"status": " ".join(str(error).split()), "steps": ""}
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return row | {"seconds": f"{time.process_time() - began:.1f}"}


def _measured(folder):
    """Numbers of a run by name, as text, for a row of the table."""
    from dusttaichi import analysis
    from dusttaichi.analysis import observables
    from dusttaichi.analysis.ledger import losses_by_channel

    with analysis.open_run(folder) as run:
        found, last = observables.measured(run), run.series.isel(time=-1)
        loads = analysis.controlled_loads(run)
        numbers = found.values | _of_stages(run, loads)
        # under a controlled load a pressure occurs at several filling factors
        if found.curve is not None and not loads:
            lg, phi = found.curve
            for p in PRESSURES:
                known = lg[0] <= np.log10(p) <= lg[-1]
                if known:
                    numbers[f"phi at {p / 1e3:g} kPa"] = float(np.interp(np.log10(p), lg, phi))
        numbers["contacts a grain"] = float(last.contact_count) / run.grains
        through = losses_by_channel(run.series)
        numbers |= {f"lost {name} [J]": float(loss[-1]) for name, loss in through.items()}
        return {
            "grains": run.grains,
            "status": run.status,
            "steps": int(last.step),
            "time_step [s]": run.attrs["time_step"],
            "ledger": analysis.ledger(run).worst,
        } | {name: f"{value:.6g}" for name, value in numbers.items()}


def _of_stages(run, loads):
    """Numbers of single stages.

    Strength in shear and triaxial tests, filling factor under a controlled load, slope of
    unloading; none of a test that missed its load. loads: those that the run controls.
    """
    from dusttaichi import analysis
    from dusttaichi.analysis.grid import DEVIATOR, LOAD, SHEAR, UNLOADING

    numbers = {}
    if "shear_strain" in run.series:
        numbers |= {SHEAR + own.stage: own.strength for own in _reached(analysis.shearings(run))}
    if analysis.is_triaxial(run):
        numbers |= {DEVIATOR + own.stage: own.strength for own in _reached(analysis.triaxials(run))}
    if run.unloads:
        numbers |= {UNLOADING + own.stage: own.modulus for own in analysis.unloadings(run)}
    return numbers | {LOAD + own.stage: own.filling_factor for own in _reached(loads)}


def _reached(tests):
    """Tests that ran under their prescribed loads."""
    return [own for own in tests if not own.missed]


def _read(path):
    try:
        with open(path, newline="", encoding="utf-8") as file:
            return [{k: v for k, v in row.items() if v} for row in csv.DictReader(file)]
    except OSError:
        return []


def _write(path, table):
    names = dict.fromkeys([*SCENE, *RUN, *(name for row in table for name in row)])
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, list(names), restval="")
    writer.writeheader()
    writer.writerows(table)
    files.write_whole(path, text.getvalue().encode())


def _check(directory, base, settings, ran):
    """Store the scenes of settings in SCENES; those of rows that are there must be the same.

    base: scene before the changes. ran: texts of the settings that have rows. Raises DustError
    where a row is of another scene.
    """
    path, new = directory / SCENES, {own.text: _identity(base, own.changes) for own in settings}
    stored = _stored(path)
    old = stored.get(base.name, {})
    for text in (own.text for own in settings if own.text in ran):
        if text not in old:
            raise _refusal(directory, base.name, text, f"an unknown scene, as {SCENES} lacks it")
        if changed := sorted(differences(old[text], new[text])):
            why = f"another scene, which differs in {', '.join(changed)}"
            raise _refusal(directory, base.name, text, why)
    stored[base.name] = {text: own for text, own in old.items() if text in ran} | new
    files.write_whole(path, json.dumps(stored, indent=1).encode())


def _identity(base, changes):
    """Plain data that determine the runs of a setting: scene, extensions, contents of files."""
    try:
        scene = scenes.changed(base, changes)
    except DustError:  # its row is the refusal
        scene = base
    core = without_paths(core_of(scene.to_yaml()))
    extensions = {"extensions": sorted(scene.imported_texts)} if scene.imported_texts else {}
    found = core | extensions | {"contents of its files": input_hashes(scene)}
    return json.loads(json.dumps(found, default=str))


def _refusal(directory, name, text, why):
    return DustError(
        f"{directory}: its runs of {name} ({text}) are of {why}. Restore the scene, give it "
        "another name, choose another directory with -o, or run its settings again with --force."
    )


def _stored(path):
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
