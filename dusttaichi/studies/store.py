"""Runs of a study on the disk: which are finished, what came back, what they cost."""

import json
import shutil

import yaml

from dusttaichi import files
from dusttaichi.errors import DustError, GuardStop
from dusttaichi.files import CHECKPOINT, RESULT
from dusttaichi.results.reading import open_tree
from dusttaichi.run.identity import package_hash, without

# keys whose change does not invalidate a finished run
BESIDES = (("output", "directory"), ("output", "checkpoint"), ("numerics", "threads"))
COST = "cost.json"


def mode_of(point, force, resume, *, timed=False):
    """Mode of a run: "new", "force", "resume", or None where it is finished.

    timed: its cost is wanted, so that it runs in one piece and by this code.
    """
    if force or not resume:
        return "force" if force else "new"
    status = _status(point, timed)
    if status.startswith("finished") and not (timed and cost_of(point) is None):
        return None
    if status and timed and stopped(point):
        return None
    # without a checkpoint a run cannot continue, whatever other files there are
    return "resume" if not timed and (point.directory / CHECKPOINT).exists() else "force"


def _status(point, timed):
    """End of the result of the scene of the point, "" without one.

    timed: one of other threads counts for none, as they have another cost.
    """
    try:
        with open_tree(point.directory / RESULT) as result:
            status, scene = result.attrs["status"], result.attrs["scene_resolved"]
            extensions = str(result.attrs.get("extensions", ""))
    except (DustError, OSError, RuntimeError, ValueError, KeyError):
        return ""  # without a result, or with a damaged one
    if extensions != "\n".join(point.scene.imported_texts):
        return ""
    threads = point.scene.numerics.threads
    if timed and threads not in ("auto", yaml.safe_load(scene)["numerics"]["threads"]):
        return ""
    return status if core_of(scene) == core_of(point.scene.to_yaml()) else ""


def core_of(text):
    """Scene of a YAML text as plain data, without the keys that do not change the result."""
    return without(yaml.safe_load(text), BESIDES)


def cost_of(point):
    """Processor time of the steps of a finished run [s], None of other code or without it."""
    return _stored(point, "cost")


def stopped(point):
    """Reason why a guard has stopped a timed run; "" if none has, or other code ran."""
    return _stored(point, "stopped") or ""


def _stored(point, key):
    try:
        found = json.loads((point.directory / COST).read_text(encoding="utf-8"))
        return found[key] if found["code"] == package_hash() else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def store(result, directory, *, timed=False):
    """Write the files that came back from a temporary directory.

    With them go the cost of a timed run, or why a guard has stopped it, as it would again.
    """
    try:
        if RESULT in result.files:  # parts belong to the previous result
            shutil.rmtree(files.parts_folder(directory / RESULT), ignore_errors=True)
        for name, content in result.files.items():
            (directory / name).parent.mkdir(parents=True, exist_ok=True)
            files.write_whole(directory / name, content)
        if timed and result.code in (0, GuardStop.exit_code):
            end = {"stopped": result.text} if result.code else {"cost": result.found["cost"]}
            text = json.dumps(end | {"code": package_hash()})
            files.write_whole(directory / COST, text.encode())
    except OSError as error:
        raise DustError(
            f"Cannot write {directory}: {files.explain(error, directory / RESULT)}."
        ) from error
