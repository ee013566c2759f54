"""Stored stages: a run that begins with the same stages continues from their end.

The end of a stage depends on the scene up to its end, on variables that later stages request from
the start (such as the tilt of a cell that will be sheared), on the input files of the sample and on
the code: a hash of all these is the name of the folder in `.stages`, beside the run directories,
with the result and the checkpoint. Replicas store theirs beside their common directory, for other
scenes.
"""

import hashlib
import json
import os
import shutil
from pathlib import Path

import yaml

from dusttaichi.errors import DustError
from dusttaichi.files import CHECKPOINT, RESULT, clone, run_files
from dusttaichi.run.identity import without, without_paths
from dusttaichi.scene.drive import SHEARS

FOLDER = ".stages"
REPLICA = "replica_"  # begin of the names of directories of replicas
# keys of a scene that change neither results nor stored stages
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
    """Folder of the stored end of the stage with that number, for runs in `directory`.

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


def store(scene, stage, directory, origin):
    """Store result and checkpoint of `directory`, at the end of that stage. Raises OSError."""
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


def stored(scene, directory, origin):
    """(number of the stage, folder) of the stored stages of this scene, latest first.

    origin: the Origin of the run.
    """
    for stage in range(len(scene.stages) - 1, -1, -1):
        folder = folder_of(scene, stage, directory, origin)
        if all((folder / name).exists() for name in (RESULT, CHECKPOINT)):
            yield stage, folder


def reuse(folder, directory):
    """Copy a stored stage into `directory`. Raises DustError."""
    try:
        _copy_run(folder, Path(directory))
    except OSError as error:
        raise DustError(f"The stored stage {folder} cannot be read: {error}.") from error


def _copy_run(source, target):
    """Copy the files for a continuation into a folder. Raises OSError."""
    for name in run_files(source):
        (target / name).parent.mkdir(exist_ok=True)
        clone(source / name, target / name)


def discard(folder):
    """Remove a stored stage, such as a damaged one."""
    shutil.rmtree(folder, ignore_errors=True)
