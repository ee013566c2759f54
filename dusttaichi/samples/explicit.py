"""Grains given one by one: in the YAML, in a CSV or NetCDF file, or by another run's last frame."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import scipy
from pydantic import Field, ValidationInfo, field_validator, model_validator

from dusttaichi.errors import DustError
from dusttaichi.geometry import nearest_image, pairs_within
from dusttaichi.physics.contact.constants import CLOSEST
from dusttaichi.samples import files, taken
from dusttaichi.samples.contacts import check_contacts
from dusttaichi.samples.materials import Materials
from dusttaichi.samples.registry import SampleBlock, register
from dusttaichi.samples.sample import Sample
from dusttaichi.samples.values import (
    MaterialName,
    Position,
    Radius,
    Spin,
    Velocity,
    unknown_materials,
)
from dusttaichi.scene.fields import Number, problems
from dusttaichi.scene.quantities import Quantity

Which = Annotated[int | Literal["largest"], Number(whole=True, ge=0, word="largest")]
Kept = Literal["walls", "box", "time"]
FROM_RUN = ("snapshot", "fragment", "keep")  # keys that only a file has


class ExplicitSample(SampleBlock):
    """Grains given one by one, in the YAML file (`positions`) or in another file (`file`)."""

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
    file: Path | None = Field(
        None,
        description="CSV with the header x,y,z[,vx,vy,vz,wx,wy,wz][,radius,material], NetCDF with "
        "the variables of a snapshot, the directory or result.nc of another run, a dump, data or "
        "restart file of LAMMPS, text of YADE, or XYZ; relative to the YAML file",
    )
    snapshot: Annotated[int | Literal["last"], Number(whole=True, ge=0, word="last")] = Field(
        "last", description="which snapshot of another run: a number from 0 on, or last"
    )
    fragment: Which | None = Field(
        None,
        description="one fragment of another run alone: largest, or its number in the order of "
        "falling mass, from 0 on; all grains by default",
    )
    keep: tuple[Kept, ...] = Field(
        (),
        description="what of another run comes along beside grains and their contacts: walls (the "
        "contacts with walls and their springs, and where walls stand), box (where walls and faces "
        "of the cell stand), time (that of the run goes on)",
    )
    units: Annotated[float, Quantity("length", gt=0, bare_unit=True, example="um")] = Field(
        "m",
        description="unit of x, y, z, radius in a text file that does not name its own; "
        "velocities and spins are m/s and rad/s",
    )

    @field_validator("file", mode="after")
    @classmethod
    def _find(cls, value: Path | None, info: ValidationInfo) -> Path | None:
        if value is None:
            return None
        context = info.context or {}
        if context.get("folder"):
            value = Path(context["folder"]) / value
        return files.found(value, context.get("check_files"))

    @model_validator(mode="after")
    def _check(self) -> ExplicitSample:
        found = []
        if (self.positions is None) == (self.file is None):
            found.append(("", "exactly one of positions and file is needed"))
        if self.positions is not None and not self.positions:
            found.append(("positions", "at least one grain is needed"))
        for name in ("velocities", "spins", "radii", "materials"):
            values = getattr(self, name)
            if values is None:
                continue
            if self.positions is None:
                found.append((name, "it is allowed only together with positions"))
            elif len(values) != len(self.positions):
                found.append(
                    (
                        name,
                        f"as many as positions are needed, {len(self.positions)} and not "
                        f"{len(values)}",
                    )
                )
        if self.file is None:
            default = type(self).model_fields
            found += [
                (name, "it is allowed only together with file")
                for name in ("units", *FROM_RUN)
                if name in self.model_fields_set
                and getattr(self, name) != (1.0 if name == "units" else default[name].default)
            ]
        if found:
            raise problems(found)
        return self

    def conflicts(self, scene) -> list[tuple[str, str]]:
        return unknown_materials(self.materials, scene) + self._kept_room(scene)

    def _kept_room(self, scene) -> list[tuple[str, str]]:
        """A room that is kept is not given again."""
        if not {"walls", "box"} & set(self.keep):
            return []
        boundary = scene.boundary
        if boundary.kind == "open":
            return [("keep", "there is nothing around the grains of this scene (boundary: open)")]
        key = "gap" if boundary.kind == "plates" else "size"
        if getattr(boundary, key) == "fit":
            return []
        return [("keep", f"walls and faces stay where they are, so boundary.{key} must be fit")]

    def least_room(self, radius: float) -> tuple[tuple[float, float, float], int]:
        """Nothing where grains have radii or materials of their own: the sample knows them."""
        if self.positions is None or self.radii is not None or self.materials is not None:
            return (0.0, 0.0, 0.0), 0
        axes = zip(*self.positions, strict=True)
        return tuple(max(x) - min(x) + 2 * radius for x in axes), len(self.positions)


@register(ExplicitSample)
def make(spec: ExplicitSample, materials: Materials) -> Sample:
    """The grains that spec lists.

    A file is CSV, NetCDF, or a run directory (its result.nc); of several snapshots one is taken,
    with the state of its pair contacts where it was written, and what `keep` asks for.
    Raises DustError for a file that is missing or lacks columns, arrays of the wrong shape,
    numbers that are not finite, no grains, a material that the scene does not have, or two centres
    closer than 0.9 diameters.
    """
    if spec.file is None:
        source, where = "positions", "sample.positions"
        state = {"position": spec.positions, "velocity": spec.velocities, "spin": spec.spins}
        state |= {
            "radius": spec.radii,
            "material": spec.materials,
        }
    else:
        source = str(spec.file)
        where = f"sample.file = {source!r}"
        state = files.read(Path(spec.file), where, spec.units, spec.snapshot)
    sample = _grains(state, materials, where)
    if spec.file is not None:
        sample = _of_run(spec, sample, state, materials, where)
    sample.info.update(kind="explicit", source=source, grains=len(sample))
    return sample


def _grains(state: dict, materials: Materials, where: str) -> Sample:
    """The grains and pair contacts of a state; raises DustError as `make`."""
    positions = _vectors(state.get("position"), where, "position", None)
    if len(positions) == 0:
        raise DustError(f"{where}: it has no grains; allowed: one grain or more.")
    velocities = _vectors(state.get("velocity"), where, "velocity", len(positions))
    spins = _vectors(state.get("spin"), where, "spin", len(positions))
    numbers = materials.numbers(state.get("material"), len(positions), where)
    own = materials.polydisperse(materials.radii(state.get("radius"), numbers, where), numbers)
    radii = materials.radius if own["radii"] is None else own["radii"]
    check_apart(positions, radii, where)
    contacts = state.get("contacts")
    if contacts is not None:
        check_contacts(contacts, positions, radii, _nearest(state), where)
    return Sample(positions, velocities, spins, contacts, **own)


def _of_run(spec, sample: Sample, state: dict, materials: Materials, where: str) -> Sample:
    """The sample with what else `spec` takes of the file."""
    walls = state.get("wall_contacts")
    if spec.fragment is not None:
        masses = materials.masses(sample)
        before = len(sample)
        sample, walls, count = taken.fragment(
            sample, walls, spec.fragment, nearest=_nearest(state), masses=masses, where=where
        )
        sample.info.update(fragments=count, grains_of_all=before)
    if state.get("stiffness_scaling", 1.0) != 1.0:
        sample.info.update(stiffness_scaling=state["stiffness_scaling"])
    return taken.along(sample, state, walls, spec, where)


def _nearest(state: dict):
    """Function of distance vectors (N, 3) [m]: those to the nearest image of the file's cell."""
    period = state.get("period", np.full(3, np.inf))
    return lambda d: nearest_image(d, period, state.get("tilt", 0.0))


def _vectors(values, where: str, name: str, n: int | None) -> np.ndarray:
    """(N, 3) float64; zeros where nothing is given."""
    if values is None:
        return np.zeros((n or 0, 3))
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.empty(0)
        for grain, row in enumerate(values):
            if np.shape(row) != (3,):
                raise DustError(
                    f"{where}: {name} of grain {grain} (from 0) is {row!r}; allowed: three numbers."
                ) from None
    if array.size == 0:
        array = array.reshape(-1, 3)
    if array.ndim != 2 or array.shape[1] != 3 or (n is not None and len(array) != n):
        needed = "grains, 3" if n is None else f"{n}, 3"
        raise DustError(f"{where}: {name} has the shape {array.shape}; allowed: ({needed}).")
    bad = np.flatnonzero(~np.isfinite(array).all(axis=1))
    if len(bad):
        raise DustError(
            f"{where}: {name} of grain {bad[0]} (from 0) is {array[bad[0]].tolist()}; "
            "allowed: finite numbers."
        )
    return array


def check_apart(positions: np.ndarray, radius, where: str) -> None:
    """DustError, naming where they come from, for two centres closer than CLOSEST diameters.

    radius: of all grains, or (N,), where a diameter is the sum of two radii.
    """
    if len(positions) < 2:
        return
    if np.ndim(radius):
        i, j, distance = pairs_within(positions, radius, CLOSEST)
        if len(i):
            k = int(np.argmin(distance / (radius[i] + radius[j])))
            both = radius[i[k]] + radius[j[k]]
            raise DustError(
                f"{where}: grains {i[k]} and {j[k]} (from 0) are {distance[k] * 1e6:g} µm apart; "
                f"allowed: at least {CLOSEST} of the sum of their radii, {CLOSEST * both * 1e6:g} "
                "µm, between centres. Are the lengths in the unit you meant?"
            )
        return
    distance, neighbour = scipy.spatial.cKDTree(positions).query(positions, k=2)
    i = int(np.argmin(distance[:, 1]))
    gap = distance[i, 1]
    if gap < CLOSEST * 2 * radius:
        # The nearest other grain; where centres coincide it may be listed first.
        j = int(neighbour[i, 1] if neighbour[i, 1] != i else neighbour[i, 0])
        raise DustError(
            f"{where}: grains {min(i, j)} and {max(i, j)} (from 0) are {gap * 1e6:g} µm apart, "
            f"{gap / (2 * radius):.3g} diameters; allowed: at least {CLOSEST} diameters, "
            f"{CLOSEST * 2e6 * radius:g} µm, between centres (radius {radius * 1e6:g} µm). "
            "Are the lengths in the unit you meant?"
        )
