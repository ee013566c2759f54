"""Samples: initial positions of the grains. One kind per file, with its block and generator."""

import numpy as np

from dusttaichi.samples import (  # noqa: F401, each registers its kind
    bcca,
    chain,
    collision,
    cutout,
    explicit,
    lattice,
    pair,
    pca,
    random_packing,
    rbd,
    space_filling,
)
from dusttaichi.samples.description import (
    coordination,
    cut_contacts,
    describe,
    describe_in_cell,
    format_counts,
)
from dusttaichi.samples.extraction import drop_missing_walls
from dusttaichi.samples.images import Cell, find_cell
from dusttaichi.samples.materials import Materials
from dusttaichi.samples.push import apply_pushes, find_pushed_grains
from dusttaichi.samples.sample import (
    ROUNDING,
    Sample,
    bulk_filling_factor,
    filling_factor,
    fractal_dimension,
    radius_of_gyration,
    smallest_gap,
    touching_pairs,
)
from dusttaichi.samples.sample_registry import (
    AnySample,
    SampleBlock,
    make_sample,
    reads_samples,
    register,
)
from dusttaichi.samples.touching import AT_REST
from dusttaichi.scene import quantities
from dusttaichi.scene.fields import AnyScene

__all__ = [
    "AnySample", "Cell", "Materials", "Sample", "SampleBlock", "bulk_filling_factor", "find_cell",
    "coordination", "format_counts",
    "describe", "describe_in_cell", "filling_factor", "fractal_dimension",
    "find_pushed_grains", "make", "apply_pushes", "radius_of_gyration", "reads_samples", "register",
    "smallest_gap",
    "touching_pairs",
]  # fmt: skip


def make(scene: AnyScene) -> Sample:
    """Sample of a scene with its pushes, in SI; its info has its origin and its measures.

    Raises
    ------
    DustError
        A file cannot be used, grains overlap too much, a cut has no grains, or the sample would be
        too large; with the path in the YAML.
    """
    materials = Materials(scene)
    sample = make_sample(scene.sample, materials, body=False)
    block = getattr(scene.sample, "of", scene.sample)  # of a cutout
    is_built_in = type(block).__module__.startswith(f"{__name__}.")
    if block.kind == "explicit" or not is_built_in:
        sample = _remark_on_gaps(sample, scene)
    if scene.sample.kind == "explicit":
        sample = _remark_on_faces(sample, materials)
    return apply_pushes(scene, drop_missing_walls(scene, sample))


def _remark_on_faces(sample: Sample, materials: Materials) -> Sample:
    """The sample, with a remark if the faces of the cell of its file cut contacts."""
    cell_of_scene, file = find_cell(sample.info, materials), sample.info.get("cell")
    if file is None or np.any(
        materials.periodic & np.isinf(cell_of_scene.period)
    ):  # a cell to be fitted
        return sample
    period = np.array([np.inf if edge is None else edge for edge in file["period"]])
    cell_of_file = Cell(period, file["tilt"])
    cut, total = cut_contacts(
        sample, materials.radii_of(sample), cell_of_file, cell_of_scene, 1.0 + AT_REST
    )
    if not cut:
        return sample
    text = (
        f"sample: {cut:,} of its {total:,} contacts {'is' if cut == 1 else 'are'} across faces of "
        "its cell, which this scene does not have, and lost. To keep them: sample.keep: [box] "
        "with a periodic boundary, or sample.fragment: largest, put together across the faces"
    )
    return sample.with_remarks(text)


def _remark_on_gaps(sample: Sample, scene: AnyScene) -> Sample:
    """The sample, with a remark if no two grains touch: a unit or a radius may be wrong.

    Grains of the YAML that move relative to each other are apart on purpose.
    """
    touching = sample.info.get("touching", {}).get("contacts", 0)  # across faces too
    if len(sample) < 2 or touching or sample.info.get("coordination") != 0.0:
        return sample
    if getattr(scene.sample, "file", None) is None and np.ptp(sample.velocities, axis=0).any():
        return sample
    radius = scene.material.radius if sample.radii is None else sample.radii
    gap = smallest_gap(sample.positions, radius)
    if gap <= ROUNDING * np.min(radius):
        return sample
    text = (
        f"sample: no two of its {len(sample):,} grains touch (the nearest leave "
        f"{quantities.format(gap, 'length', digits=3)} between them); are lengths and radii in "
        "the units you meant?"
    )
    return sample.with_remarks(text)
