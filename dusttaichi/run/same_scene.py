"""Whether a run may go on with a scene: the one of its checkpoint, but for what may change."""

import copy
import hashlib
from pathlib import Path

import yaml

from dusttaichi.errors import DustError
from dusttaichi.files import RESULT
from dusttaichi.scene.extensions import KEY

# what may differ between a run and its continuation
FREE_TO_CHANGE = (
    ("name",),  # a stage that was taken over may be that of a run of another name
    ("stop",),
    ("output", "directory"),
    ("output", "checkpoint"),
    ("replicas",),
    ("numerics", "threads"),
    ("numerics", "ledger_tolerance"),
    ("numerics", "debug"),
)


def input_hashes(scene):
    """Hashes of the files that a scene reads, in order; "" for one that is not there (any more)."""
    return [_hash(path) for path in input_files(scene)]


def input_files(scene):
    """Paths of the files and run directories that a scene reads, in order."""
    return list(_files(yaml.safe_load(scene.to_yaml())))


def without(data, keys):
    """Plain data of a scene without the keys at these paths, such as ("output", "directory")."""
    data = copy.deepcopy(data)
    for *blocks, key in keys:
        block = data
        for name in blocks:
            block = block.get(name, {})
        block.pop(key, None)
    return data


def without_paths(data):
    """Plain data of a scene without the places of its files: what counts is what they hold."""
    if isinstance(data, dict):
        kept = {k: v for k, v in data.items() if k != KEY and not (k == "file" and v is not None)}
        return {k: without_paths(v) for k, v in kept.items()}
    return [without_paths(v) for v in data] if isinstance(data, list) else data


def _files(data):
    if isinstance(data, dict):
        for key, value in data.items():
            if key == "file" and value is not None:
                yield Path(value)
            else:
                yield from _files(value)
    elif isinstance(data, list):
        for value in data:
            yield from _files(value)


def _hash(path):
    path = path / RESULT if path.is_dir() else path
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""


def check_extensions(saved, scene):
    """Refuse to go on with other extensions than those of the checkpoint. Raises DustError.

    saved: what it has of them, texts "name sha256:digest".
    """
    now = scene.imported_texts
    old, new = (sorted(text.rsplit(" ", 1)[1] for text in texts) for texts in (saved, now))
    if old == new:
        return
    changed = sorted({text.rsplit(" ", 1)[0] for text in set(saved) ^ set(now)})
    raise DustError(
        "--resume: the extensions of the scene are not those that this run was started with; "
        f"{', '.join(changed)} differs. Put that back, or start anew with --force."
    )


def stage_stop(text, stage):
    """The stop block of a stage, of the text of a resolved scene."""
    data = yaml.safe_load(text)
    return data["stages"][stage]["stop"] if data.get("stages") else data["stop"]


def check_same(saved, scene, inputs, stage):
    """Refuse to go on with another scene than the one the checkpoint is of. Raises DustError.

    saved: the meta data of the checkpoint; inputs: hashes of the files of the scene; stage: number
    of the one that the checkpoint stands in, whose end may change, as may later stages.
    """
    old, new = (
        without(without_paths(yaml.safe_load(text)), FREE_TO_CHANGE)
        for text in (saved["scene"], scene.to_yaml())
    )
    for tree in (old, new):
        done = tree.get("stages", [])[: stage + 1]
        tree["stages"] = {str(n): s for n, s in enumerate(done)}
        tree["stages"].get(str(stage), {}).pop("stop", None)
    changed = sorted(_differences(old, new))
    old = saved["inputs"]
    if len(old) != len(inputs) or any(b and a != b for a, b in zip(old, inputs, strict=True)):
        changed.append("the contents of its files")
    if changed:
        raise DustError(
            "--resume: the scene is not the one that this run was started with; it differs in "
            f"{', '.join(changed)}. Put that back, or start anew with --force. (stop, "
            "numerics.threads, output.checkpoint and stages still to come may change.)"
        )


def _differences(old, new, path=""):
    if isinstance(old, dict) and isinstance(new, dict):
        for key in old.keys() | new.keys():
            yield from _differences(old.get(key), new.get(key), f"{path}.{key}".lstrip("."))
    elif old != new:
        yield path
