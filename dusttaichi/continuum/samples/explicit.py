"""Particles from a file: CSV, or the last snapshot of another run of the continuum."""

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from dusttaichi.continuum.samples.dust import whole
from dusttaichi.continuum.samples.particles import COMPONENTS, Particles
from dusttaichi.continuum.samples.registry import DustBody, Edges, Matter, register
from dusttaichi.errors import DustError
from dusttaichi.physics.geometry import AXES
from dusttaichi.samples.files import SampleFile, check_kind
from dusttaichi.scene.quantities import Quantity

COLUMNS = {"x", "y", "z", "vx", "vy", "vz", "mass", "density", "reference"} | set(COMPONENTS)


class ExplicitParticles(DustBody):
    """Particles from a file; `position`, `velocity`, `spin` are added to theirs."""

    kind: Literal["explicit"]
    file: SampleFile = Field(
        description="CSV with the header x,z,mass[,y,density,vx,vy,vz,reference,xx,yy,zz,xy,xz,yz] "
        "in SI, or the directory or result.nc of another run (the dust of its last snapshot); "
        "relative to the YAML file"
    )
    size: Edges | None = Field(
        None,
        description="[width, height], in three dimensions [Lx, Ly, Lz] of the box that the "
        "particles fill about their middle, for faces and periodic axes; default: the extent of "
        "their positions, and a spacing",
    )
    units: Annotated[float, Quantity("length", gt=0, bare_unit=True, example="um")] = Field(
        "m", description="unit of x, y, z in a CSV file"
    )


@register(ExplicitParticles)
def make(spec: ExplicitParticles, matter: Matter) -> Particles:
    """The particles of the file, with density, reference density and stress if present.

    Raises DustError for a file that cannot be read, missing columns, numbers that are not finite,
    masses or densities that are not positive, two particles at the same position, or another number
    of dimensions than the scene's.
    """
    matter = matter.of(spec.material)
    where = f"sample.file = '{spec.file}'"
    path = spec.file / "result.nc" if spec.file.is_dir() else spec.file
    check_kind(path, where)
    table = _csv(path, spec.units, where) if path.suffix == ".csv" else _snapshot(path, where)
    _check(table, matter, where)
    density = table.get("density")
    if density is None:
        density = np.full(len(table["mass"]), matter.solid * matter.filling_factor)
    particles = Particles(
        position=table["position"],
        velocity=table.get("velocity"),
        mass=table["mass"],
        density=density,
        reference=table.get("reference"),
        deviator=table.get("deviator"),
        material=np.full(len(density), matter.number, np.int8),
        spacing=matter.spacing,
        dimension=matter.dimension,
        bodies=(whole("particles", table["position"], table["mass"], rigid=False),),
        info={"source": str(spec.file), "mass": float(table["mass"].sum())},
    )
    for number, axis in enumerate(particles.axes):
        x = particles.position[:, axis]
        edge = np.ptp(x) + matter.spacing if spec.size is None else spec.size[number]
        if edge < np.ptp(x):
            raise DustError(
                f"sample.size: the particles are {np.ptp(x) * 1e3:.6g} mm apart along "
                f"{AXES[axis]}, more than {edge * 1e3:.6g} mm; use a larger size."
            )
        middle = 0.5 * (x.min() + x.max())
        particles.room[axis] = (middle - edge / 2, middle + edge / 2)
    return spec.placed(particles)


def _csv(path: Path, units: float, where: str) -> dict:
    try:
        with path.open(encoding="utf-8-sig") as file:
            names = [name.strip() for name in file.readline().split(",")]
            rows = np.loadtxt(file, delimiter=",", ndmin=2)
    except (OSError, ValueError) as error:
        raise DustError(f"{where}: it cannot be read as CSV: {error}.") from None
    unknown = [name for name in names if name not in COLUMNS]
    missing = [name for name in ("x", "z", "mass") if name not in names]
    if unknown or missing or rows.shape[1] != len(names):
        what = f"unknown: {', '.join(unknown)}" if unknown else f"missing: {', '.join(missing)}"
        if not unknown and not missing:
            what = f"{len(names)} names over {rows.shape[1]} columns"
        raise DustError(f"{where}: {what}; allowed columns: {', '.join(sorted(COLUMNS))}.")
    column = dict(zip(names, rows.T, strict=True))
    zero = np.zeros(len(rows))

    def stacked(*keys):
        return np.stack([column.get(key, zero) for key in keys], axis=1)

    table = {"position": stacked("x", "y", "z") * units, "velocity": stacked("vx", "vy", "vz")}
    table["deviator"] = stacked(*COMPONENTS)
    return table | {k: column[k] for k in ("mass", "density", "reference") if k in column}


def _snapshot(path: Path, where: str) -> dict:
    """The dust of the last snapshot of another run."""
    from dusttaichi.results.reading import open_tree  # takes half a second to import

    try:
        with open_tree(path) as tree:
            group = tree["snapshots"].to_dataset(inherit=False).variables
            # rigid bodies and walls are made by the new scene
            dust = np.isin(group["role"].values, (0, 2))
            names = {"position": "position", "velocity": "velocity", "density": "density"}
            names |= {"reference": "reference_density", "deviator": "deviator"}
            table = {name: group[key][-1].values[dust] for name, key in names.items()}
            table["mass"] = group["mass"].values[dust]
    except DustError as error:
        raise DustError(f"{where}: {error}") from None
    except (OSError, RuntimeError, ValueError, IndexError, KeyError) as error:
        raise DustError(
            f"{where}: it is not the result of a run of the continuum with snapshots: {error}."
        ) from None
    return table


def _check(table: dict, matter: Matter, where: str) -> None:
    if not len(table["mass"]):
        raise DustError(f"{where}: it has no particles; allowed: one or more.")
    for name, values in table.items():
        bad = ~np.isfinite(values)
        if name in ("mass", "density", "reference"):
            bad |= ~(values > 0)
        if bad.any():
            row = int(np.argwhere(bad)[0][0])
            wanted = "positive" if name in ("mass", "density", "reference") else "finite"
            text = f"{where}: {name} of particle {row} (from 0) is {values[row]}"
            raise DustError(f"{text}; allowed: {wanted} numbers.")
    if matter.dimension == 2 and np.ptp(table["position"][:, 1]) > 0:
        raise DustError(f"{where}: its y differ; with dimension: 2 the plane is x-z.")
    if matter.dimension == 2:
        table["position"][:, 1] = 0.0
    if len(np.unique(table["position"], axis=0)) < len(table["mass"]):
        raise DustError(f"{where}: two particles are at the same position; move them apart.")
