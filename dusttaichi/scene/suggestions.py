"""Suggestions for words and keys that a scene does not know: similar ones, where they belong."""

import difflib
import re
from collections.abc import Iterable
from typing import Any

from pydantic import BaseModel

from dusttaichi import method
from dusttaichi.scene.blocks import Path, blocks_at, path_in, paths_of, step, tags

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


def words_of(expected: str) -> list[str]:
    """Words in pydantic's list of expected values, "'a', 'b' or 'c'" or "2 or 3"."""
    return re.findall(r"'([^']*)'", expected) or re.findall(
        r"[^\s,]+", expected.replace(" or ", " ")
    )


def either(expected: str) -> str:
    """'a', 'b' -> "a" or "b", with the quotes of the other texts; 2 or 3 without quotes."""
    words = words_of(expected)
    quoted = [f'"{word}"' for word in words] if "'" in expected else words
    return " or ".join([", ".join(quoted[:-1]), quoted[-1]] if len(quoted) > 1 else quoted)


def similar(given: str, allowed: Iterable[str], cutoff: float = SOMEWHAT_ALIKE) -> str | None:
    """The allowed word that means the same or is spelt alike, in any case, or None."""
    by_case = {word.casefold(): word for word in allowed}
    word = given.casefold()
    meant = [by_case[other] for other in SYNONYMS.get(word, ()) if other in by_case]
    close = meant or [by_case[w] for w in difflib.get_close_matches(word, by_case, 1, cutoff)]
    return close[0] if close else None


def guess(given: Any, expected: str) -> str:
    """A question about the intended value, where one is similar."""
    words = words_of(expected)
    if "'" in expected:
        close = similar(str(given), words)
        return f'did you mean "{close}"? ' if close else ""
    text = NUMBERS.get(str(given).strip().casefold(), str(given))
    number = re.match(r"\s*(\d+)(?![\d.]*[1-9])", text)
    if isinstance(given, (bool, list, dict)) or not number or number[1] not in words:
        return ""
    return f"did you mean {number[1]}, a plain number? "


def kind_elsewhere(root: type[BaseModel], loc: Path, given: Any, expected: str, data: Any) -> str:
    """As `guess`; of a kind of another method, whose it is, and equivalent ones here."""
    names = [name for name in EQUIVALENT.get(str(given), ()) if name in words_of(expected)]
    quoted = " or ".join(f'"{name}"' for name in names)
    owners = [
        name
        for name, other in _other_scenes(root)
        if any(str(given) in tags(block) for block in blocks_at(other, loc, data))
    ]
    if not owners:
        return guess(given, expected)
    use = f"use {quoted} here: " if names else ""
    return f'"{given}" belongs to method: {" or ".join(owners)}; {use}'


def name_elsewhere(root: type[BaseModel], path: Path, data: Any) -> str:
    """Whose a name is that only a block of another method may be written as."""
    for key in path:
        _, data = step(data, key)
    loc = path[:-1] if path[-1:] == ("base",) else path
    owners = [
        name
        for name, other in _other_scenes(root)
        if isinstance(data, str)
        and any(data in block.shorthands for block in blocks_at(other, loc, {}))
    ]
    return f'"{data}" belongs to method: {" or ".join(owners)}; ' if owners else ""


def _other_scenes(root: type[BaseModel]) -> list[tuple[str, type[BaseModel]]]:
    """(name, scene) of the other methods."""
    scenes = [(name, method.named(name).scene) for name in method.METHODS]
    return [(name, scene) for name, scene in scenes if scene is not root]


def unknown_key(root: type[BaseModel], loc: Path, data: Any) -> str:
    """Text about a key that the block at its location does not have."""
    key, blocks = str(loc[-1]), blocks_at(root, loc[:-1], data)
    for block in blocks:
        if key in block.refused:
            return block.refused[key]
    allowed = [name for block in blocks for name in (*block.extra_keys, *block.fields_in_order())]
    advice = _advice(root, loc, data, allowed)
    return f"unknown key; {advice}allowed: {', '.join(dict.fromkeys(allowed))}"


def _advice(root: type[BaseModel], loc: Path, data: Any, allowed: list[str]) -> str:
    """The key that was meant, or the kinds, methods or blocks that have this one."""
    key = str(loc[-1])
    counterpart, size = RATIO.get(key, ("", ""))
    if counterpart in allowed:
        return f'did you mean "{counterpart}", {size}? '
    if kinds := _kinds_with(root, loc, data):
        return f"it belongs to kind: {' or '.join(kinds)}; "
    if len(loc) > 1 and key in root.model_fields:
        return "it belongs at the top level of the file; "
    if close := similar(key, allowed, ALIKE):
        return f'did you mean "{close}"? '
    path = path_in(loc, data)
    others = _other_scenes(root)
    owners = [
        name
        for name, other in others
        if any(key in block.model_fields for block in blocks_at(other, path[:-1], {}))
    ]
    parts = {str(part) for part in loc}  # with the names of the kinds on the way
    homes = [home for home in paths_of(root, key, data) if not set(home.split(".")) <= parts]
    if not owners and homes:
        return f"did you mean {homes[0]}? "
    owners = owners or [
        f"{name} ({paths[0]})" for name, other in others if (paths := paths_of(other, key, {}))
    ]
    if owners:
        return f"it belongs to method: {' or '.join(owners)}; "
    close = similar(key, allowed)
    return f'did you mean "{close}"? ' if close else ""


def _kinds_with(root: type[BaseModel], loc: Path, data: Any) -> list[str]:
    """Other kinds of the block at a location that have its last key."""
    if len(loc) < 2 or loc[-2] in path_in(loc, data):
        return []
    siblings = blocks_at(root, loc[:-2], data)
    return sorted({t for block in siblings if loc[-1] in block.model_fields for t in tags(block)})
