"""Materials of grains from the columns of a file, and densities that differ from theirs."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dusttaichi.errors import DustError
from dusttaichi.samples.formats.text import is_integer_column, is_text
from dusttaichi.samples.materials import Materials
from dusttaichi.samples.sample import Sample

AGREES = 0.01  # relative difference of a mass or density up to which it is that of the material


def materials_of(
    state: dict[str, Any], materials: Materials, origin: str
) -> list[int | str] | None:
    """Names or numbers of materials (N,) of a state, or None where it says nothing about them.

    They are its `material`; else its `type`, from 1 on as in LAMMPS, its `matid`, from 0 on as in
    YADE, or its `species`. Texts, also type labels of LAMMPS, count where they are names of the
    scene's materials, and are not read where all are one and the same. Raises DustError for a type
    without a material.
    """
    if (stored_materials := state.get("material")) is not None:
        return [
            int(v) if isinstance(v, float) and v.is_integer() else v for v in list(stored_materials)
        ]
    for name, first in (("type", 1), ("matid", 0)):
        values = state.get(name)
        if values is None or is_text(values):
            continue
        if not is_integer_column(values):
            raise DustError(f"{origin}: its {name} are no whole numbers; allowed: these, or "
                            "sample.columns with _ for that column.")  # fmt: skip
        labels = {n: text for n, text in state.get("labels", {}).items() if n in values}
        if labels and set(labels.values()) <= set(materials.names) and set(values) <= set(labels):
            return [labels[value] for value in values]
        _check_types(values, name, first, materials, origin)
        numbers: list[int | str] = (values - first).astype(int).tolist()
        return numbers
    texts = next((v for k in ("type", "matid", "species") if (v := state.get(k)) is not None), None)
    return None if texts is None else _by_name(texts, state, materials, origin)


def _check_types(
    values: NDArray[Any], name: str, first: int, materials: Materials, origin: str
) -> None:
    """Raise DustError for a type that the scene has no material for."""
    count = len(materials.names)
    missing = np.unique(values[(values < first) | (values >= first + count)])
    if not len(missing):
        return
    shown_name = "matId" if name == "matid" else name
    material_list = ", ".join(f"{n + first} {text}" for n, text in enumerate(materials.names))
    raise DustError(
        f"{origin}: its {shown_name} {missing[0]:g} has no material in the scene, whose materials "
        "are "
        f"by {shown_name}: {material_list} (material, then materials in their order). Add one "
        "under materials, "
        "or leave the column out with sample.columns and _ in its place."
    )


def _by_name(
    texts: NDArray[Any], state: dict[str, Any], materials: Materials, origin: str
) -> list[int | str] | None:
    labels = [f"{v:g}" if isinstance(v, float) else str(v) for v in np.unique(texts)]
    if all(label in materials.names for label in labels) and is_text(texts):
        names: list[int | str] = texts.tolist()
        return names
    if len(labels) > 1 and len(materials.names) > 1:
        raise DustError(
            f"{origin}: its grains are {', '.join(labels)}, and the materials of the scene are "
            f"{', '.join(materials.names)}; allowed: the same names, or sample.columns with _ in "
            "place of that column, so that all grains are of `material`."
        )
    if len(labels) > 1:
        state.setdefault("unread", []).append(f"species ({', '.join(labels)})")
    return None


def remark_on_matter(state: dict[str, Any], sample: Sample, materials: Materials) -> None:
    """Add a remark to a state whose densities or masses are not those of the materials."""
    masses = materials.masses(sample)
    radii = np.broadcast_to(materials.radii_of(sample), len(sample))
    densities = masses / (4.0 / 3.0 * np.pi * radii**3)
    for name, expected, unit in (("density", densities, "kg/m^3"), ("mass", masses, "kg")):
        stored = state.get(name)
        if stored is None or np.allclose(stored, expected, rtol=AGREES, atol=0.0):
            continue
        worst = int(np.argmax(np.abs(stored / expected - 1.0)))
        state.setdefault("remarks", []).append(
            f"its {name} is not that of the material, which is used: {expected[worst]:.4g} and not "
            f"{stored[worst]:.4g} {unit} (grain {worst})"
        )
        return
