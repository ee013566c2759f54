"""Suggestions for unknown words and keys of a scene: similar ones, and where they belong."""

import difflib
import re
from collections.abc import Iterable
from typing import Any

from dusttaichi import method
from dusttaichi.scene.blocks import (
    Keys,
    Path,
    find_blocks,
    find_paths,
    get_item,
    list_tags,
    strip_union_members,
)
from dusttaichi.scene.keys import find_scene_class

ALIKE, SOMEWHAT_ALIKE = 0.8, 0.6  # of difflib: a misspelt word; a word that resembles it

# kinds of samples of grains -> equivalent ones of the continuum
EQUIVALENT = {
    **dict.fromkeys(("collision", "pair"), ("impact", "several")),
    **dict.fromkeys(("rbd", "pca", "bcca", "lattice", "random_packing"), ("block", "sphere")),
}
# other words for keys, and for words in their place; one that is not allowed there is ignored
SYNONYMS = {
    "gpu": ("cuda",), "nvidia": ("cuda",), "device": ("backend",),
    "double": ("f64",), "float64": ("f64",), "single": ("f32",), "float32": ("f32",),
    "cores": ("threads",), "workers": ("threads",), "processes": ("threads",),
    "dt": ("time_step",), "timestep": ("time_step",),
    "folder": ("directory",), "path": ("file", "directory"),
    "gamma": ("surface_energy",), "rho": ("density",), "e": ("young_modulus",),
    "nu": ("poisson_ratio",), "xi_crit": ("critical_rolling",),
    "velocity": ("speed",), "n": ("grains",), "number": ("grains",), "particles": ("grains",),
    "dim": ("dimension",), "dimensions": ("dimension",),
}  # fmt: skip
RATIO = {"diameter": ("radius", "half of it"), "radius": ("diameter", "twice of it")}
NUMBERS = {"two": "2", "three": "3"}


def split_words(expected: str) -> list[str]:
    """Words in pydantic's list of expected values, "'a', 'b' or 'c'" or "2 or 3"."""
    return re.findall(r"'([^']*)'", expected) or re.findall(
        r"[^\s,]+", expected.replace(" or ", " ")
    )


def join_alternatives(expected: str) -> str:
    """'a', 'b' -> "a" or "b", with the quotes of the other texts; 2 or 3 without quotes."""
    words = split_words(expected)
    quoted = [f'"{word}"' for word in words] if "'" in expected else words
    return " or ".join([", ".join(quoted[:-1]), quoted[-1]] if len(quoted) > 1 else quoted)


def find_similar(text: str, allowed: Iterable[str], cutoff: float = SOMEWHAT_ALIKE) -> str | None:
    """The allowed word that means the same or is spelt alike, in any case, or None."""
    by_case = {word.casefold(): word for word in allowed}
    word = text.casefold()
    synonyms = [by_case[synonym] for synonym in SYNONYMS.get(word, ()) if synonym in by_case]
    close = synonyms or [by_case[w] for w in difflib.get_close_matches(word, by_case, 1, cutoff)]
    return close[0] if close else None


def suggest_value(value: Any, expected: str) -> str:
    """A question about the intended value, where one is similar."""
    words = split_words(expected)
    if "'" in expected:
        close = find_similar(str(value), words)
        return f'did you mean "{close}"? ' if close else ""
    text = NUMBERS.get(str(value).strip().casefold(), str(value))
    number = re.match(r"\s*(\d+)(?![\d.]*[1-9])", text)
    if isinstance(value, (bool, list, dict)) or not number or number[1] not in words:
        return ""
    return f"did you mean {number[1]}, a plain number? "


def suggest_kind(root: type[Keys], loc: Path, kind: Any, expected: str, data: Any) -> str:
    """As `suggest_value`; for a kind of another method that method, and equivalent kinds."""
    names = [name for name in EQUIVALENT.get(str(kind), ()) if name in split_words(expected)]
    quoted = " or ".join(f'"{name}"' for name in names)
    owners = [
        name
        for name, scene_class in _list_other_scenes(root)
        if any(str(kind) in list_tags(block) for block in find_blocks(scene_class, loc, data))
    ]
    if not owners:
        return suggest_value(kind, expected)
    use = f"use {quoted} here: " if names else ""
    return f'"{kind}" belongs to method: {" or ".join(owners)}; {use}'


def suggest_method(root: type[Keys], path: Path, data: Any) -> str:
    """Methods with a block that may be written as this name, if this method has none; or ""."""
    for key in path:
        _, data = get_item(data, key)
    loc = path[:-1] if path[-1:] == ("base",) else path
    owners = [
        name
        for name, scene_class in _list_other_scenes(root)
        if isinstance(data, str)
        and any(data in block.shorthands for block in find_blocks(scene_class, loc, {}))
    ]
    return f'"{data}" belongs to method: {" or ".join(owners)}; ' if owners else ""


def _list_other_scenes(root: type[Keys]) -> list[tuple[str, type[Keys]]]:
    """(name, scene) of the other methods."""
    scenes = [(name, find_scene_class(name)) for name in method.METHODS]
    return [(name, scene) for name, scene in scenes if scene is not root]


def describe_unknown_key(root: type[Keys], loc: Path, data: Any) -> str:
    """Text about a key that the block at its location does not have."""
    key, blocks = str(loc[-1]), find_blocks(root, loc[:-1], data)
    for block in blocks:
        if key in block.refused:
            return block.refused[key]
    allowed = [name for block in blocks for name in (*block.extra_keys, *block.fields_in_order())]
    advice = _advise_key(root, loc, data, allowed)
    return f"unknown key; {advice}allowed: {', '.join(dict.fromkeys(allowed))}"


def _advise_key(root: type[Keys], loc: Path, data: Any, allowed: list[str]) -> str:
    """The key that was meant, or the kinds, methods or blocks that have this one."""
    key = str(loc[-1])
    counterpart, size = RATIO.get(key, ("", ""))
    if counterpart in allowed:
        return f'did you mean "{counterpart}", {size}? '
    if kinds := _list_kinds_with(root, loc, data):
        return f"it belongs to kind: {' or '.join(kinds)}; "
    if len(loc) > 1 and key in root.model_fields:
        return "it belongs at the top level of the file; "
    if close := find_similar(key, allowed, ALIKE):
        return f'did you mean "{close}"? '
    path = strip_union_members(loc, data)
    other_scenes = _list_other_scenes(root)
    owners = [
        name
        for name, scene_class in other_scenes
        if any(key in block.model_fields for block in find_blocks(scene_class, path[:-1], {}))
    ]
    path_keys = {
        str(location_key) for location_key in loc
    }  # with the names of the kinds on the way
    homes = [home for home in find_paths(root, key, data) if not set(home.split(".")) <= path_keys]
    if not owners and homes:
        return f"did you mean {homes[0]}? "
    owners = owners or [
        f"{name} ({paths[0]})"
        for name, scene_class in other_scenes
        if (paths := find_paths(scene_class, key, {}))
    ]
    if owners:
        return f"it belongs to method: {' or '.join(owners)}; "
    close = find_similar(key, allowed)
    return f'did you mean "{close}"? ' if close else ""


def _list_kinds_with(root: type[Keys], loc: Path, data: Any) -> list[str]:
    """Other kinds of the block at a location that have its last key."""
    if len(loc) < 2 or loc[-2] in strip_union_members(loc, data):
        return []
    siblings = find_blocks(root, loc[:-2], data)
    return sorted(
        {t for block in siblings if loc[-1] in block.model_fields for t in list_tags(block)}
    )
