"""Identity of a run, its scene, code and files: that of its checkpoint, but for what may change."""

from __future__ import annotations

import copy
import hashlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import yaml

from dusttaichi import method
from dusttaichi.compute import compiler
from dusttaichi.errors import DustError
from dusttaichi.results.files import RESULT
from dusttaichi.scene import extensions
from dusttaichi.scene.extensions import KEY

if TYPE_CHECKING:
    from dusttaichi.scene.scene import Scene


# what may differ between a run and its continuation
FREE_TO_CHANGE = (
    ("name",),
    ("stop",),
    ("output", "directory"),
    ("output", "checkpoint"),
    ("replicas",),
    ("numerics", "threads"),
    ("numerics", "ledger_tolerance"),
    ("numerics", "debug"),
)


def input_files(scene: Scene) -> list[Path]:
    """Paths of the files and run directories that a scene reads, in order."""
    return list(_files(scene.plain))


def without(data: Any, keys: Iterable[tuple[str, ...]]) -> dict[str, Any]:
    """Plain data of a scene without the keys at these paths, such as ("output", "directory")."""
    out: dict[str, Any] = copy.deepcopy(data)
    for *blocks, key in keys:
        block = out
        for name in blocks:
            block = block.get(name, {})
        block.pop(key, None)
    return out


def without_paths(data: Any) -> Any:
    """Plain data of a scene without the paths of its files, whose contents are compared."""
    if isinstance(data, dict):
        content = {k: v for k, v in data.items() if k != KEY and (k != "file" or v is None)}
        return {k: without_paths(v) for k, v in content.items()}
    return [without_paths(v) for v in data] if isinstance(data, list) else data


def _files(data: Any) -> Iterator[Path]:
    if isinstance(data, dict):
        for key, value in data.items():
            if key == "file" and value is not None:
                yield Path(value)
            else:
                yield from _files(value)
    elif isinstance(data, list):
        for value in data:
            yield from _files(value)


def check_extensions(saved: Sequence[str], scene: Scene) -> None:
    """Raise DustError for other extensions than those of the checkpoint.

    saved: texts "name sha256:digest".
    """
    current = scene.imported_texts
    saved_digests, current_digests = (
        sorted(text.rsplit(" ", 1)[1] for text in texts) for texts in (saved, current)
    )
    if saved_digests == current_digests:
        return
    changed = sorted({text.rsplit(" ", 1)[0] for text in set(saved) ^ set(current)})
    raise DustError(
        "--resume: the extensions of the scene are not those of the start of this run; "
        f"{', '.join(changed)} differs. Restore it, or start again with --force."
    )


def stage_stop(text: str, stage: int) -> Any:
    """The stop block of a stage, of the text of a resolved scene."""
    data = yaml.safe_load(text)
    return data["stages"][stage]["stop"] if data.get("stages") else data["stop"]


def check_same_beginning(saved_text: str, scene: Scene, path: str | Path) -> None:
    """Raise DustError where a run without a checkpoint would replace the result of another scene.

    saved_text: the resolved scene of the result at a path.
    """
    trees = [_read_tree(text) for text in (saved_text, scene.to_yaml())]
    for tree in trees:
        tree["stages"] = {n: without(stage, [("stop",)]) for n, stage in tree["stages"].items()}
    if changed := sorted(differences(*trees)):
        raise DustError(
            f"--resume: {path} is of another scene, which differs in {', '.join(changed)}, and has "
            "no checkpoint to continue from. Restore the scene, choose another output directory, "
            "or overwrite the result with --force."
        )


def check_same(saved: Mapping[str, Any], scene: Scene, inputs: Sequence[str], stage: int) -> None:
    """Raise DustError for another scene than that of the checkpoint.

    saved: the metadata of the checkpoint; inputs: hashes of the files of the scene; stage: number
    of the stage of the checkpoint, whose end may change, as may later stages.
    """
    trees = [_read_tree(text) for text in (saved["scene"], scene.to_yaml())]
    for tree in trees:
        tree["stages"] = {n: begun for n, begun in tree["stages"].items() if int(n) <= stage}
        tree["stages"].get(str(stage), {}).pop("stop", None)
    changed = sorted(differences(*trees))
    saved_inputs = saved["inputs"]
    if len(saved_inputs) != len(inputs) or any(
        b and a != b for a, b in zip(saved_inputs, inputs, strict=True)
    ):
        changed.append("the contents of its files")
    if changed:
        raise DustError(
            "--resume: the scene is not that of the start of this run; it differs in "
            f"{', '.join(changed)}. Restore it, or start again with --force. (stop, "
            "numerics.threads, output.checkpoint and later stages may change.)"
        )


def _read_tree(text: str) -> Any:
    """Blocks of a resolved scene, without what may always change, and with stages by number."""
    tree = without(without_paths(yaml.safe_load(text)), FREE_TO_CHANGE)
    tree["stages"] = {str(n): stage for n, stage in enumerate(tree.get("stages") or ())}
    return tree


def differences(former: Any, current: Any, path: str = "") -> Iterator[str]:
    """Paths of the keys in which plain data differ, such as "boundary.wall_speed", in no order."""
    if isinstance(former, dict) and isinstance(current, dict):
        for key in former.keys() | current.keys():
            yield from differences(former.get(key), current.get(key), f"{path}.{key}".lstrip("."))
    elif former != current:
        yield path


@lru_cache(maxsize=1)
def package_hash() -> str:
    """Hash of the source of this package, and of its compiler and that one's version."""
    root, digest = Path(__file__).parents[1], hashlib.sha256()
    for path in sorted(root.rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    digest.update(compiler.label().encode())
    return digest.hexdigest()


def code_hash(scene: Scene) -> str:
    """Hash of all code that determines the numbers of a scene.

    The package, external code of its method, such as laws of the user, and the extensions.
    """
    digest = hashlib.sha256(package_hash().encode())
    code_files = [
        (extensions.find_imported(path), path) for path in method.find_method(scene).code(scene)
    ]
    # as imported, even if the files have changed since
    code_extensions = {
        *scene.imported_extensions,
        *(extension for extension, _ in code_files if extension is not None),
    }
    for content in sorted({extension.digest for extension in code_extensions}):
        digest.update(content.encode())
    for path in (path for extension, path in code_files if extension is None):
        digest.update(Path(path).read_bytes())
    return digest.hexdigest()


class Origin(NamedTuple):
    """Hashes of the code of a run and of its input files, in order, when it was opened."""

    code: str
    inputs: list[str]  #: "" of a missing file.

    @classmethod
    def read(cls, scene: Scene) -> Origin:
        paths = [path / RESULT if path.is_dir() else path for path in input_files(scene)]
        contents = (path.read_bytes() if path.is_file() else None for path in paths)
        hashes = ["" if c is None else hashlib.sha256(c).hexdigest() for c in contents]
        return cls(code_hash(scene), hashes)
