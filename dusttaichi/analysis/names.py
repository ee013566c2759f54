"""Names of runs for people: by the symbols and values of the keys in which they differ."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from dusttaichi.analysis.symbols import label_key
from dusttaichi.analysis.texts import typeset

if TYPE_CHECKING:
    from dusttaichi.analysis.records import Records


MOST = 3  # largest number of differing keys in a name
# parts of a scene that say nothing about what is simulated
BESIDES = ("name", "output", "numerics.threads", "extensions")
TAGS = ("kind", "model", "law")


def format_run_name(title: str, scene: dict[str, Any], folder: str = "") -> str:
    """Name of a run with this title: of a point of a study by its changed keys.

    "cake-material.surface_energy_20mJ_m_2" is "cake, γ = 20 mJ/m²"; any other title remains.

    Parameters
    ----------
    title : str
    scene : dict
        Resolved scene, as plain data.
    folder : str
        Name of the folder of the run, which has the number of a replica.
    """
    base, changes = split_name(title, scene)
    return ", ".join([base, *changes, *_format_replica(folder, changes)])


def name_runs(runs: Sequence[Records]) -> list[str]:
    """A name for each of several Runs, by which they differ.

    Points of one study are named by their changed keys alone. Runs of the same name are named by
    the keys of their scenes that differ, if few, else by their folders.
    """
    names = [run.name for run in runs]
    names_and_changes = [split_name(run.title, run.scene) for run in runs]
    if (
        all(changes for _, changes in names_and_changes)
        and len({base for base, _ in names_and_changes}) == 1
    ):
        base = names_and_changes[0][0]
        names = [name.removeprefix(f"{base}, ") for name in names]
    if len(set(names)) == len(names):
        return names
    scenes = [dict(_iterate_entries(run.scene)) for run in runs]
    paths = [path for path in dict.fromkeys(p for s in scenes for p in s)
             if len({s.get(path) for s in scenes}) > 1]  # fmt: skip
    if not 0 < len(paths) <= MOST:
        return [
            f"{n}, {run.path.resolve().parent.name}" for n, run in zip(names, runs, strict=True)
        ]
    changed = [", ".join(format_change(path, scene.get(path, "-"), paths) for path in paths)
               for scene in scenes]  # fmt: skip
    if len(set(names)) == 1:
        return changed
    return [f"{name}, {text}" for name, text in zip(names, changed, strict=True)]


def format_change(path: str, value: object, among: Iterable[str] = ()) -> str:
    """ "γ = 20 mJ/m²": a key, by its path, with the text of its value."""
    return f"{label_key(path, among)} = {typeset(str(value))}"


def split_name(title: str, scene: dict[str, Any]) -> tuple[str, list[str]]:
    """(base, changed keys as texts) of the title of a run; (title, []) of one without such keys."""
    for dash in re.finditer("-", title):
        pairs = _parse_changes(title[dash.end() :], scene)
        if pairs:
            paths = [path for path, _ in pairs]
            return title[: dash.start()], [format_change(*pair, paths) for pair in pairs]
    return title, []


def _parse_changes(text: str, scene: dict[str, Any]) -> list[tuple[str, Any]]:
    """(path, value in the scene) of each change in "KEY_VALUE__KEY_VALUE", or []."""
    changes = text.split("__")
    pairs = [pair for change in changes if (pair := _parse_change(change, scene)) is not None]
    return pairs if len(pairs) == len(changes) else []


def _parse_change(text: str, scene: dict[str, Any]) -> tuple[str, Any] | None:
    """(path, value) of "KEY_VALUE", whose KEY is a path in the scene; None without."""
    path, block = [], scene
    while isinstance(block, (dict, list)):
        keys = block if isinstance(block, dict) else map(str, range(len(block)))
        # the longest one: radius_ratio, not radius
        fits = [key for key in keys if re.match(rf"{re.escape(str(key))}[._]", text)]
        if not fits:
            break
        key = max(fits, key=len)
        path.append(key)
        ends, text = text[len(key)] == "_", text[len(key) + 1 :]
        block = block[key] if isinstance(block, dict) else block[int(key)]
        if ends:
            value = _format_block(block)
            # a single word such as `method` may be of the name of the scene
            sure = len(path) > 1 or _keep_letters(text) == _keep_letters(value)
            return (".".join(path), value) if text and value is not None and sure else None
    return None


def _keep_letters(value: object) -> str:
    return re.sub(r"[\W_]", "", str(value))


def _format_block(block: Any) -> Any:
    """A value, or the word for a block."""
    if isinstance(block, dict):
        return next((block[tag] for tag in TAGS if tag in block), None)
    return ", ".join(map(str, block)) if isinstance(block, list) else block


def _iterate_entries(
    block: dict[str, Any] | list[Any], path: str = ""
) -> Iterator[tuple[str, Any]]:
    """(path, value) of all values of a scene that say what is simulated."""
    for key, value in block.items() if isinstance(block, dict) else enumerate(block):
        inner = f"{path}.{key}".lstrip(".")
        if inner in BESIDES:
            continue
        if isinstance(value, (dict, list)):
            yield from _iterate_entries(value, inner)
        else:
            yield inner, value


def _format_replica(folder: str, changes: Sequence[str]) -> list[str]:
    number = re.fullmatch(r"replica_(\d+)", folder)
    return [f"replica {number[1]}"] if number and changes else []
