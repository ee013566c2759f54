"""Symbols and words of the keys of a scene, as figures and tables show them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

OF_MATERIALS = {
    "surface_energy": "γ",
    "radius": "r",
    "density": "ρ",
    "young_modulus": "E",
    "poisson_ratio": "ν",
    "critical_rolling": "ξ_crit",
}
BY_PATH = {
    "interaction.rolling.modifier": "m_r",
    "interaction.sliding.modifier": "m_s",
    "interaction.twisting.modifier": "m_t",
    "sample.filling_factor": "φ",
    "gravity": "g",
}
# keys that say nothing without the block that has them
GENERAL = {"kind", "model", "modifier", "coefficient", "file", "size", "law", "number"}
BLOCKS = ("stop", "stages", "output")  # whose keys mean something else than the same ones elsewhere


def label_key(path: str, among: Iterable[str] = ()) -> str:
    """Symbol of a key in the literature, or its own words: γ of material.surface_energy.

    Parameters
    ----------
    path : str
        Keys joined by dots, as for `Scene.with_value`.
    among : sequence of str
        Paths of the other keys, from which the label must differ.
    """
    text = _find_label(path)
    if any(sibling != path and _find_label(sibling) == text for sibling in among):
        return _join_words(path.split(".")[-3:])
    return text


def _find_label(path: str) -> str:
    block, *inner = path.split(".")
    if path in BY_PATH:
        return BY_PATH[path]
    if block in ("material", "materials") and inner and inner[-1] in OF_MATERIALS:
        symbol = OF_MATERIALS[inner[-1]]
        return f"{symbol} of {inner[0]}" if block == "materials" and len(inner) == 2 else symbol
    named = [key for key in path.split(".") if not key.isdigit()]
    alone = named[-1] not in GENERAL and block not in BLOCKS
    return _join_words(named[-1:] if alone else named[-2:])


def _join_words(keys: Sequence[str]) -> str:
    return " ".join(keys).replace("_", " ")
