"""Grains listed in the YAML, in a CSV or NetCDF file, or in a snapshot of another run."""

from functools import partial
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from dusttaichi.errors import DustError
from dusttaichi.physics.contact.constants import CLOSEST
from dusttaichi.physics.geometry import pairs_within
from dusttaichi.physics.near import are_apart
from dusttaichi.samples import extraction, files
from dusttaichi.samples.extraction import check_contacts
from dusttaichi.samples.flags import apply_image_flags
from dusttaichi.samples.formats.grains import materials_of, remark_on_matter
from dusttaichi.samples.formats.order import COLUMN_NAMES, has_position, is_column
from dusttaichi.samples.formats.styles import STYLES
from dusttaichi.samples.formats.text import Source
from dusttaichi.samples.images import Cell
from dusttaichi.samples.materials import Materials
from dusttaichi.samples.sample import Sample
from dusttaichi.samples.sample_registry import SampleBlock, register
from dusttaichi.samples.touching import MOST, contacts_by_distance, put_in_contact
from dusttaichi.samples.values import (
    MaterialName,
    Position,
    Radius,
    Spin,
    Velocity,
    unknown_materials,
)
from dusttaichi.scene.fields import AnyScene, Faults, Field, Number
from dusttaichi.scene.quantities import Quantity

Which = Annotated[int | Literal["largest"], Number(whole=True, ge=0, word="largest")]
Part = Literal["walls", "box", "time"]
FROM_RUN = ("snapshot", "fragment", "keep", "columns", "style")  # keys that only a file has


class ExplicitSample(SampleBlock):
    """Grains listed in the YAML file (`positions`) or in another file (`file`)."""

    refused: ClassVar[dict[str, str]] = dict.fromkeys(
        ("grains", "seed"),
        "all grains of the file are read; a sphere of some of them is {kind: cutout, of: {kind: "
        "explicit, file: ...}, grains: 500, seed: 1}",
    )

    kind: Literal["explicit"]
    positions: tuple[Position, ...] | None = Field(
        None, description="centre of every grain, [x, y, z]"
    )
    velocities: tuple[Velocity, ...] | None = Field(
        None, description="velocity of every grain, default at rest; only with positions"
    )
    spins: tuple[Spin, ...] | None = Field(
        None, description="angular velocity of every grain, default none; only with positions"
    )
    radii: tuple[Radius, ...] | None = Field(
        None, description="radius of every grain, default that of its material; only with positions"
    )
    materials: tuple[MaterialName, ...] | None = Field(
        None,
        description="material of every grain, a name from the scene's materials, or default; "
        "only with positions",
    )
    file: files.SampleFile | None = Field(
        None,
        description="list or CSV with x y z and optionally vx vy vz, wx wy wz, radius, material, "
        "NetCDF with the variables of a snapshot, directory or result.nc of another run, dump, "
        "data or restart file of LAMMPS, text of YADE, data of MercuryDPM, or XYZ, also packed "
        "(gz, bz2, xz); relative to the YAML file",
    )
    columns: tuple[str, ...] | None = Field(
        None,
        description="names of the columns of a text file in their order, instead of those in it: "
        "[r, x, y, z]; _ for one that is not read",
    )
    style: str | None = Field(
        None,
        description="atom style of a data file of LAMMPS that does not name it: sphere, full, ...",
    )
    snapshot: Annotated[int | Literal["last"], Number(whole=True, ge=0, word="last")] = Field(
        "last", description="snapshot of another run: a number from 0 on, or last"
    )
    fragment: Which | None = Field(
        None,
        description="a single fragment of the file, by its contacts or the distances: largest, or "
        "its number in order of decreasing mass, from 0 on; all grains by default",
    )
    keep: tuple[Part, ...] = Field(
        (),
        description="parts of another run beside grains and their contacts: walls (positions and "
        "contacts of walls), box (positions of walls and faces), time (which continues)",
    )
    units: Annotated[float, Quantity("length", gt=0, bare_unit=True, example="um")] = Field(
        "m",
        description="unit of x, y, z, radius in a text file without units; "
        "velocities and spins are m/s and rad/s",
    )
    touch_within: Annotated[float | Literal["auto"], Number(ge=0, le=MOST, word="auto")] = Field(
        "auto",
        description="gap or overlap, over the sum of two radii, within which grains touch: if some "
        "of these pairs are apart, all are moved into equilibrium contact; auto: the rounding of "
        "the numbers, in a file at least 1e-3 at rest; two positions are exact; 0: none",
    )

    def faults(self) -> Faults:
        if (self.positions is None) == (self.file is None):
            yield "", "exactly one of positions and file is needed"
        if self.positions is not None and not self.positions:
            yield "positions", "at least one grain is needed"
        for name in ("velocities", "spins", "radii", "materials"):
            values = getattr(self, name)
            if values is not None and self.positions is None:
                yield name, "it is allowed only together with positions"
            elif values is not None and len(values) != (count := len(self.positions or ())):
                yield name, f"as many as positions are needed, {count} and not {len(values)}"
        defaults = {name: type(self).model_fields[name].default for name in FROM_RUN}
        for name, default in {"units": 1.0, **defaults}.items():
            is_set = name in self.model_fields_set and getattr(self, name) != default
            if is_set and self.file is None:
                yield name, "it is allowed only together with file"
        yield from self._unknown_columns()

    def _unknown_columns(self) -> Faults:
        unknown = [name for name in self.columns or () if not is_column(name)]
        if unknown:
            yield "columns", f"{unknown[0]!r} is no name of a column; allowed: {COLUMN_NAMES}"
        elif self.columns is not None and not has_position(self.columns):
            yield "columns", "x, y and z are needed"
        if self.style is not None and self.style not in STYLES:
            yield "style", f"an atom style of LAMMPS is needed: {', '.join(STYLES)}"
        if self.style is not None and self.columns is not None:
            yield "style", "columns name the columns; one of both is needed"

    def conflicts(self, scene: AnyScene) -> Faults:
        yield from unknown_materials(self.materials, scene)
        # positions of walls and faces from the file replace a size
        if {"walls", "box"} & set(self.keep):
            boundary = scene.boundary
            key = "gap" if boundary.kind in ("plates", "tube") else "size"
            if boundary.kind == "open":
                yield "keep", "there are no walls and faces in this scene (boundary: open)"
            elif getattr(boundary, key) != "fit":
                yield "keep", f"walls and faces do not move, so boundary.{key} must be fit"

    def least_room(self, radius: float) -> tuple[tuple[float, float, float], int]:
        """Extent of the positions; zeros where grains have radii or materials of their own."""
        if self.positions is None or self.radii is not None or self.materials is not None:
            return (0.0, 0.0, 0.0), 0
        axes = zip(*self.positions, strict=True)
        x, y, z = (max(values) - min(values) + 2 * radius for values in axes)
        return (x, y, z), len(self.positions)


@register(ExplicitSample)
def make(spec: ExplicitSample, materials: Materials) -> Sample:
    """The grains of spec.

    A file is text (samples.formats), NetCDF, or a run directory (its result.nc); of several
    snapshots one is read, with the stored history of its contacts, and the parts in `keep`. info:
    cell, period [m] and tilt [m] of that of a periodic run.
    Raises DustError for a file that is missing or lacks columns, arrays of the wrong shape,
    numbers that are not finite, no grains, a material that the scene does not have, or two centres
    closer than 0.9 diameters.
    """
    if spec.file is None:
        source, origin = "positions", "sample.positions"
        state: dict[str, Any] = {
            "position": spec.positions,
            "velocity": spec.velocities,
            "spin": spec.spins,
        }
        state |= {"radius": spec.radii, "material": spec.materials}
    else:
        source = str(spec.file)
        origin = f"sample.file = {source!r}"
        source_of_file = Source(origin, [], spec.units, spec.snapshot, spec.columns, spec.style)
        state = files.read(Path(spec.file), source_of_file)
    sample = _build_sample(state, materials, origin)
    if spec.file is not None:
        remark_on_matter(state, sample, materials)
        radius, check = materials.radii_of(sample), partial(check_apart, origin=origin)
        sample = apply_image_flags(sample, state, spec, radius, check)
        sample = _reuse_run(spec, sample, state, materials, origin)
    unit = None if spec.file is None else spec.units
    sample = put_in_contact(sample, materials, spec.touch_within, unit)
    sample.info.update(kind="explicit", source=source, grains=len(sample))
    return sample


def _build_sample(state: dict[str, Any], materials: Materials, origin: str) -> Sample:
    """Build a sample of the grains and pair contacts of a state; raises DustError as `make`."""
    positions = _read_vectors(state.get("position"), origin, "position", None)
    if len(positions) == 0:
        raise DustError(f"{origin}: it has no grains; allowed: one grain or more.")
    velocities = _read_vectors(state.get("velocity"), origin, "velocity", len(positions))
    spins = _read_vectors(state.get("spin"), origin, "spin", len(positions))
    material_names = materials_of(state, materials, origin)
    numbers = materials.numbers(material_names, len(positions), origin)
    unequal = materials.polydisperse(materials.radii(state.get("radius"), numbers, origin), numbers)
    radii = materials.radius if unequal["radii"] is None else unequal["radii"]
    try:
        check_apart(positions, radii, origin)
    except DustError as error:  # maybe since a guess is wrong
        guesses = "; ".join(state.get("remarks", ()))
        raise DustError(f"{error} {guesses and f'How it is read: {guesses}.'}".strip()) from None
    contacts = state.get("contacts")
    if contacts is not None:
        check_contacts(contacts, positions, radii, _get_cell(state).nearest, origin)
    return Sample(positions, velocities, spins, contacts, **unequal)


def _reuse_run(
    spec: ExplicitSample, sample: Sample, state: dict[str, Any], materials: Materials, origin: str
) -> Sample:
    """Add the other parts to the sample that `spec` selects in the file."""
    walls = state.get("wall_contacts")
    if spec.fragment is not None:
        all_grains, cell = len(sample), _get_cell(state)
        pairs = sample.stored_pairs
        if pairs is None:
            pairs = contacts_by_distance(sample, materials, spec.touch_within, spec.units, cell)
            if not len(pairs):
                raise DustError(
                    f"sample.fragment = {spec.fragment}: no two grains of {origin} touch, so there "
                    "are no fragments. Are lengths and radii in the units you meant?"
                )
        options: dict[str, Any] = {
            "nearest": cell.nearest,
            "masses": materials.masses(sample),
            "origin": origin,
        }
        sample, walls, count = extraction.extract_fragment(
            sample, walls, spec.fragment, pairs=pairs, **options
        )
        sample.info.update(fragments=count, grains_of_all=all_grains)
    elif np.isfinite(state.get("period", np.inf)).any():  # a fragment is joined across its faces
        edges = [float(edge) if np.isfinite(edge) else None for edge in state["period"]]
        sample.info["cell"] = {"period": edges, "tilt": state.get("tilt", 0.0)}
    if (scaling := state.get("stiffness_scaling", 1.0)) != 1.0:
        sample.info["stiffness_scaling"] = scaling
    return extraction.keep_environment(sample, state, walls, spec, origin)


def _get_cell(state: dict[str, Any]) -> Cell:
    """The periodic cell of a file."""
    return Cell(state.get("period", np.full(3, np.inf)), state.get("tilt", 0.0))


def _read_vectors(values: Any, origin: str, name: str, n: int | None) -> np.ndarray:
    """Read vectors: (N, 3) float64; zeros without values."""
    if values is None:
        return np.zeros((n or 0, 3))
    array = np.array(values, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3 or (n is not None and len(array) != n):
        shape_text = "grains, 3" if n is None else f"{n}, 3"
        raise DustError(f"{origin}: {name} has the shape {array.shape}; allowed: ({shape_text}).")
    rows_not_finite = np.flatnonzero(~np.isfinite(array).all(axis=1))
    if len(rows_not_finite):
        raise DustError(
            f"{origin}: {name} of grain {rows_not_finite[0]} (from 0) is "
            f"{array[rows_not_finite[0]].tolist()}; "
            "allowed: finite numbers."
        )
    return array


def check_apart(positions: np.ndarray, radius: float | NDArray[np.float64], origin: str) -> None:
    """Raise DustError, with the source, for two centres closer than CLOSEST diameters.

    radius: of all grains, or (N,), where a diameter is the sum of two radii.
    """
    if len(positions) < 2:
        return
    radii = np.broadcast_to(radius, len(positions))
    if np.ndim(radius):
        i, j, distance = pairs_within(positions, radii, CLOSEST)
    elif are_apart(positions, CLOSEST * 2.0 * float(radius)):
        return
    else:  # the nearest neighbours suffice, also for very many grains at one place
        near, neighbour = scipy.spatial.cKDTree(positions).query(positions, k=2)
        row = np.argmin(near[:, 1])
        # where centres coincide the other grain may be listed first
        pair = sorted((row, neighbour[row, 1] if neighbour[row, 1] != row else neighbour[row, 0]))
        (i, j), distance = np.array(pair)[:, None], near[[row], 1]
    both = radii[i] + radii[j]
    relative_distance = distance / both
    if np.min(relative_distance, initial=np.inf) < CLOSEST:
        closest = int(np.argmin(relative_distance))
        raise DustError(
            f"{origin}: grains {i[closest]} and {j[closest]} (from 0) are "
            f"{distance[closest] * 1e6:g} µm apart, {relative_distance[closest]:.3g} diameters; "
            f"allowed: at least {CLOSEST} diameters (mean of both), "
            f"{CLOSEST * both[closest] * 1e6:g} µm, between centres. Are the lengths in the unit "
            "you meant?"
        )
