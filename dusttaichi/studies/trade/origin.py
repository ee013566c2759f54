"""The scenes that the rows of `grid.csv` are of, in a file beside it.

A row has the name of its scene only: without these, runs of an edited YAML, or of a preset that has
changed, would continue a table of the previous one.
"""

import json

from dusttaichi import files
from dusttaichi.errors import DustError
from dusttaichi.run.same_scene import differences, input_hashes, without_paths
from dusttaichi.studies.ensemble.runs import core_of
from dusttaichi.studies.trade import scenes

FILE = "grid.json"


def check(directory, base, settings, ran):
    """Store the scenes of settings in a directory; those of rows there must be the same.

    base: scene before the changes. ran: texts of the settings that have rows. Raises DustError
    where a row is of another scene.
    """
    path, new = directory / FILE, {own.text: _identity(base, own.changes) for own in settings}
    stored = _read(path)
    old = stored.get(base.name, {})
    for text in (own.text for own in settings if own.text in ran):
        if text not in old:
            raise _refusal(directory, base.name, text, f"an unknown scene, as {FILE} lacks it")
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


def _read(path):
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
