"""Finished stages, kept: a run that begins with the same stages goes on from where they ended.

What a stage leads to is decided by the scene up to its end, by what stages still to come have the
result hold from its start (the lean of a cell that is going to be sheared), by the files that the
sample is read from, and by the code that computes it: a hash of all that names the folder in
`.stages`, beside the run directories, which holds the result and the checkpoint of that moment.
Replicas keep theirs beside the directory that holds them all, where other scenes find them.
"""

import hashlib
import json
import os
import shutil
from pathlib import Path

import yaml

from dusttaichi.errors import DustError
from dusttaichi.files import CHECKPOINT, RESULT, clone, run_files
from dusttaichi.run.same_scene import without, without_paths
from dusttaichi.scene.drive import SHEARS

FOLDER = ".stages"
REPLICA = "replica_"  # begin of the names of directories of replicas
# keys of a scene that do not change what is computed or kept
FREE = (
    ("name",),
    ("stages",),
    ("replicas",),
    ("output", "directory"),
    ("output", "checkpoint"),
    ("numerics", "threads"),
)


# keys of a drive that change what is compiled and written, in every stage
SHAPING = (*SHEARS, "push", "stiffness_scaling")


def folder_of(scene, stage, directory, origin):
    """Where the state at the end of the stage with that number is kept, for runs in `directory`.

    origin: the Origin of the run.
    """
    data = without_paths(yaml.safe_load(scene.to_yaml()))
    stages = data["stages"][: stage + 1]
    known = [without(data, FREE), stages, _shape(data["stages"]), origin.inputs, origin.code]
    digest = hashlib.sha256(json.dumps(known, sort_keys=True).encode())
    own = Path(directory).absolute()
    runs = own.parent.parent if own.name.startswith(REPLICA) else own.parent
    return runs / FOLDER / digest.hexdigest()[:20]


def _shape(stages):
    """Variables that some stage requests and the result has from its start."""
    drives = [stage.get("drive") or {} for stage in stages]
    profiles = any((stage.get("output") or {}).get("profiles") for stage in stages)
    return [key for key in SHAPING if any(drive.get(key) for drive in drives)], profiles


def keep(scene, stage, directory, origin):
    """Keep result and checkpoint of `directory`, at the end of that stage. OSError is let out."""
    folder = folder_of(scene, stage, directory, origin)
    if folder.exists():
        return
    temporary = folder.with_name(f"{folder.name}.{os.getpid()}.tmp")
    temporary.mkdir(parents=True, exist_ok=True)
    try:
        _copy_run(Path(directory), temporary)
        temporary.rename(folder)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def kept(scene, directory, origin):
    """(number of the stage, folder) of the states that this scene goes through, latest first.

    origin: the Origin of the run.
    """
    for stage in range(len(scene.stages) - 1, -1, -1):
        folder = folder_of(scene, stage, directory, origin)
        if all((folder / name).exists() for name in (RESULT, CHECKPOINT)):
            yield stage, folder


def take(folder, directory):
    """Copy a kept state into `directory`. Raises DustError."""
    try:
        _copy_run(folder, Path(directory))
    except OSError as error:
        raise DustError(f"The kept stage {folder} cannot be read: {error}.") from error


def _copy_run(source, target):
    """Copy what a run goes on from into a folder. Raises OSError."""
    for name in run_files(source):
        (target / name).parent.mkdir(exist_ok=True)
        clone(source / name, target / name)


def discard(folder):
    """Remove a kept state, such as one that is damaged."""
    shutil.rmtree(folder, ignore_errors=True)
