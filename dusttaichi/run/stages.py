"""Finished stages, kept: a run that begins with the same stages goes on from where they ended.

What a stage leads to is decided by the scene up to its end, by the files that the sample is read
from, and by the code that computes it: a hash of all that names the folder in `.stages`, beside the
run directories, which holds the result and the checkpoint of that moment.
"""

import hashlib
import json
import os
import shutil
from functools import lru_cache
from pathlib import Path

import yaml

from dusttaichi.files import CHECKPOINT, RESULT, clone

FOLDER = ".stages"
# keys of a scene that do not change what is computed or kept
FREE = (
    ("name",),
    ("stages",),
    ("replicas",),
    ("output", "directory"),
    ("output", "checkpoint"),
    ("numerics", "threads"),
)


@lru_cache(maxsize=1)
def code_hash():
    """Hash of the source that the numbers come from."""
    root, digest = Path(__file__).parents[1], hashlib.sha256()
    for path in sorted(root.rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()


def _files(block):
    """Bytes of all files that a sample block names."""
    if isinstance(block, dict):
        for key, value in block.items():
            if key == "file" and value is not None:
                path = Path(value)
                path = path / RESULT if path.is_dir() else path
                yield path.read_bytes() if path.exists() else b""
            else:
                yield from _files(value)


def folder_of(scene, stage, directory):
    """Where the state at the end of the stage with that number is kept, for runs in `directory`."""
    data = yaml.safe_load(scene.to_yaml())
    stages = data["stages"][: stage + 1]
    for path in FREE:
        block = data
        for key in path[:-1]:
            block = block.get(key, {})
        block.pop(path[-1], None)
    digest = hashlib.sha256(json.dumps([data, stages], sort_keys=True).encode())
    digest.update(code_hash().encode())
    for content in _files(data["sample"]):
        digest.update(hashlib.sha256(content).digest())
    return Path(directory).absolute().parent / FOLDER / digest.hexdigest()[:20]


def keep(scene, stage, directory):
    """Keep result and checkpoint of `directory`, at the end of that stage. OSError is let out."""
    folder = folder_of(scene, stage, directory)
    if folder.exists():
        return
    temporary = folder.with_name(f"{folder.name}.{os.getpid()}.tmp")
    temporary.mkdir(parents=True, exist_ok=True)
    try:
        for name in (RESULT, CHECKPOINT):
            clone(Path(directory) / name, temporary / name)
        temporary.rename(folder)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def take(scene, directory):
    """Copy the latest kept state that this scene goes through into `directory`.

    Returns (number of the stage, folder), or None where none is kept.
    """
    for stage in range(len(scene.stages) - 1, -1, -1):
        folder = folder_of(scene, stage, directory)
        if all((folder / name).exists() for name in (RESULT, CHECKPOINT)):
            for name in (RESULT, CHECKPOINT):
                clone(folder / name, Path(directory) / name)
            return stage, folder
    return None
