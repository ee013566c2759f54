"""A sphere or a cylinder cut from another sample, such as a disc from dust that was compressed.

Grains whose centres are inside remain, by default those of the largest connected fragment, with
their velocities, spins and contacts: their number over the volume of the cut is on average that of
the sample. A cylinder may lie, so that two plates press it across its axis. A sphere of a number of
grains is at rest, a body for collisions; in a periodic cell it can be about any grain.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any, Literal, cast

import numpy as np
from numpy.typing import NDArray

from dusttaichi.errors import DustError
from dusttaichi.physics.geometry import (
    AXES,
    LYING,
    AxisName,
    heaviest_first,
    label_components,
    nearest_image,
    pairs_within,
)
from dusttaichi.samples import extraction
from dusttaichi.samples.extraction import FARTHEST
from dusttaichi.samples.materials import Materials
from dusttaichi.samples.sample import Sample
from dusttaichi.samples.sample_registry import (
    AnyBody,
    SampleBlock,
    make_sample,
    reads_samples,
    register,
)
from dusttaichi.samples.values import Seed, exactly_one
from dusttaichi.scene.fields import AnyScene, Count, Faults, Field
from dusttaichi.scene.quantities import Quantity

FILLED = 0.01  # share of an edge of the cut that may be missing in the sample
SHAPES = {"x": LYING, "y": LYING, "z": "cylinder", None: "sphere"}


@reads_samples
class CutoutSample(SampleBlock):
    """A sphere or a cylinder cut from another sample."""

    kind: Literal["cutout"]
    of: AnyBody = Field(description="the sample to cut from: one of another kind")
    diameter: Annotated[float, Quantity("length", gt=0, example="30 um")] | None = Field(
        None, description="diameter of the sphere or the cylinder; this, or grains"
    )
    grains: Count | None = Field(
        None, description="number of grains of a sphere at rest, the nearest to its centre"
    )
    seed: Seed | None = Field(
        None,
        description="seed of the grain of a periodic cell about which the sphere of these grains "
        "is; without it the cut is about the middle of the sample",
    )
    length: Annotated[float, Quantity("length", gt=0, example="15 um")] | None = Field(
        None, description="length of a cylinder along its axis; without it a sphere is cut"
    )
    axis: AxisName | None = Field(
        None, description="axis of the cylinder, default y: it lies between bottom and top plate"
    )
    fragments: Literal["largest", "all"] = Field(
        "largest", description="whether grains that the cut disconnects are left out"
    )

    @property
    def cylinder_axis(self) -> str | None:
        """x, y or z; None for a sphere."""
        return None if self.length is None else self.axis or "y"

    def faults(self) -> Faults:
        yield from exactly_one(self, ("diameter", "grains"), "diameter: 20 um")
        if self.seed is not None and self.grains is None:
            yield "seed", "it is allowed only together with grains"
        if self.length is not None and self.grains is not None:
            yield "length", "it is allowed only together with diameter"
        if self.axis is not None and self.length is None:
            yield "axis", "a sphere has none; give the length of a cylinder as well"

    @property
    def body_blocks(self) -> Mapping[str, SampleBlock]:
        return {"of": self.of}

    def conflicts(self, scene: AnyScene) -> Faults:
        yield from super().conflicts(scene)
        if getattr(self.of, "keep", ()):
            yield "of.keep", "the walls and the time of a sample that is cut are not reused"


@register(CutoutSample)
def make(spec: CutoutSample, materials: Materials) -> Sample:
    """The grains of spec.of whose centres are inside, the centre of the cut at the origin.

    The cut is made about the middle of the bounding box, or about a grain that spec.seed draws.
    Contacts across the faces of a periodic cell are left out. info: diameter and length [m], axis;
    cut_from: number of grains of spec.of; left_out: those inside that the cut has disconnected; a
    remark where spec.of is smaller than the cut. Raises DustError where no grain is inside, for too
    few grains, or without the periodic cell that spec.seed needs.
    """
    body = make_sample(spec.of, materials)
    radii = np.broadcast_to(materials.radii_of(body), len(body))
    if spec.grains is None:
        sample, extent = _cut_size(spec, body, radii)
    else:
        sample, extent = _cut_grains(spec, body, radii), None
    count, radii = len(sample), np.broadcast_to(materials.radii_of(sample), len(sample))
    sample = _drop_image_contacts(sample, radii)
    if spec.fragments == "largest":
        sample = _select_largest_fragment(sample, radii, materials)
    info: dict[str, Any] = {"kind": "cutout", "shape": SHAPES[spec.cylinder_axis]}
    if spec.diameter is not None:
        info["diameter"] = spec.diameter
    if spec.length is not None:
        info |= {"length": spec.length, "axis": spec.cylinder_axis}
    info |= {"grains": len(sample), "cut_from": len(body), "left_out": count - len(sample)}
    remarks = list(body.info.get("reading", ()))
    if remarks:
        info["reading"] = list(remarks)
    if extent is not None:
        remarks += _remark_on_extent(spec, extent)
    if remarks:
        info["remarks"] = remarks
    if "stiffness_scaling" in body.info:
        info["stiffness_scaling"] = body.info["stiffness_scaling"]
    info["of"] = {name: value for name, value in body.info.items() if name != "remarks"}
    return replace(sample, info=info)


def _cut_size(
    spec: CutoutSample, body: Sample, radii: NDArray[np.float64]
) -> tuple[Sample, NDArray[np.float64]]:
    """Cut the grains inside: the sample, and the extent (3,) [m] of the body."""
    low = (body.positions - radii[:, None]).min(axis=0)
    high = (body.positions + radii[:, None]).max(axis=0)
    sample = replace(body, positions=body.positions - 0.5 * (low + high), wall_contacts=None)
    inside = np.flatnonzero(_select_inside(spec, sample.positions))
    if not len(inside):
        raise DustError(
            f"sample.diameter = {1e6 * cast(float, spec.diameter):g} µm: no grain is inside; "
            "allowed: a larger diameter or length, or a sample that is less empty."
        )
    return extraction.select_grains(sample, inside), high - low


def _cut_grains(spec: CutoutSample, body: Sample, radii: NDArray[np.float64]) -> Sample:
    """Cut a sphere of that many grains: about the middle, or a random grain of a periodic cell."""
    cell = body.info.get("cell") or {"period": body.info.get("period", [None] * 3)}
    period = np.array([np.inf if edge is None else edge for edge in cell["period"]], float)
    if spec.seed is None:
        period = np.full(3, np.inf)
    elif not np.isfinite(period).any():
        raise DustError(
            "sample.seed: sample.of has no periodic cell; without `seed` the sphere is about the "
            "middle of the sample."
        )
    cell_options: dict[str, Any] = {
        "period": period,
        "nearest": lambda d: nearest_image(d, period, cell.get("tilt", 0.0)),
    }
    return extraction.extract_sphere(
        body, cast(int, spec.grains), spec.seed, **cell_options, diameter=2.0 * radii.max()
    )


def _remark_on_extent(spec: CutoutSample, extent: NDArray[np.float64] | None) -> list[str]:
    """Remark on a sample, of that extent (3,) [m], that does not fill the cut."""
    if extent is None:
        return []
    cut_extent = np.full(3, cast(float, spec.diameter))
    if spec.length is not None:
        cut_extent[AXES.index(cast(AxisName, spec.cylinder_axis))] = spec.length
    short = extent < cut_extent * (1.0 - FILLED)
    if not short.any():
        return []
    axis = int(np.argmin(extent / cut_extent))
    return [
        f"sample.of: along {AXES[axis]} it extends over {1e6 * extent[axis]:.4g} µm, and the cut "
        f"over {1e6 * cut_extent[axis]:.4g} µm; the cut is not full"
    ]


def _select_inside(spec: CutoutSample, positions: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Mask (N,) of the centres inside of the cut about the origin."""
    distances, within = positions, np.full(len(positions), True)
    if spec.length is not None:
        number = AXES.index(cast(AxisName, spec.cylinder_axis))
        within = np.abs(positions[:, number]) <= 0.5 * spec.length
        distances = np.delete(positions, number, axis=1)
    values: NDArray[np.bool_] = within & (
        np.linalg.norm(distances, axis=1) <= 0.5 * cast(float, spec.diameter)
    )
    return values


def _drop_image_contacts(sample: Sample, radii: NDArray[np.float64]) -> Sample:
    """Drop the contacts of grains that touched across the faces of a cell."""
    if sample.contacts is None:
        return sample
    i, j = sample.contacts["i"], sample.contacts["j"]
    apart = np.linalg.norm(sample.positions[i] - sample.positions[j], axis=1)
    near = apart <= FARTHEST * (radii[i] + radii[j])
    return replace(sample, contacts={name: a[near] for name, a in sample.contacts.items()})


def _select_largest_fragment(
    sample: Sample, radii: NDArray[np.float64], materials: Materials
) -> Sample:
    """Select the grains of the heaviest fragment, the first of several.

    Contacts are those of the file, and all overlaps.
    """
    pairs = np.column_stack(pairs_within(sample.positions, radii)[:2])
    if sample.stored_pairs is not None:
        pairs = np.concatenate([pairs, sample.stored_pairs])
    _, label = label_components(pairs, len(sample))
    masses = np.broadcast_to(materials.masses(sample), len(sample))
    return extraction.select_grains(
        sample, np.flatnonzero(label == heaviest_first(label, masses)[0])
    )
