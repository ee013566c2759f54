"""Particles from a list or NetCDF, or the last snapshot of another run of the continuum."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from dusttaichi.continuum.samples.body_registry import DustBody, Edges, Matter, register
from dusttaichi.continuum.samples.contents import CONTENTS
from dusttaichi.continuum.samples.dust import whole
from dusttaichi.continuum.samples.particle_arrays import Particles
from dusttaichi.continuum.samples.particle_checks import check_particles, remarks_on_volumes
from dusttaichi.errors import DustError
from dusttaichi.physics.geometry import AXES
from dusttaichi.results.roles import DUST, FIXED
from dusttaichi.samples.files import SampleFile, read, remarks_on_reading
from dusttaichi.samples.formats.order import is_column
from dusttaichi.samples.formats.text import Source
from dusttaichi.scene.fields import Faults
from dusttaichi.scene.quantities import Quantity

DENSITIES_DIFFER = 1e-4  # relative: beyond rounding, density and filling factor


class ExplicitParticles(DustBody):
    """Particles from a file; `position`, `velocity`, `spin` are added to theirs."""

    kind: Literal["explicit"]
    file: SampleFile = Field(
        description="list or CSV with x z mass (in three dimensions x y z mass) and optionally "
        "velocities, density or phi, reference and the deviator xx yy zz xy xz yz, NetCDF with "
        "such variables, or the directory or result.nc of another run (the dust of its last "
        "snapshot), also packed (gz, bz2, xz); relative to the YAML file"
    )
    columns: tuple[str, ...] | None = Field(
        None,
        description="names of the columns of a text file in their order, instead of those in it: "
        "[x, z, mass]; _ for one that is not read",
    )
    size: Edges | None = Field(
        None,
        description="[width, height], in three dimensions [Lx, Ly, Lz] of the box that the "
        "particles fill about their middle, for faces and periodic axes; default: the extent of "
        "their positions, and a spacing",
    )
    units: Annotated[float, Quantity("length", gt=0, bare_unit=True, example="um")] = Field(
        "m", description="unit of x, y, z in a file without units; all else is in SI"
    )

    def faults(self) -> Faults:
        yield from super().faults()
        unknown = [name for name in self.columns or () if not is_column(name)]
        if unknown:
            allowed = f"allowed: {CONTENTS[3].columns}, _ for a column that is not read"
            yield "columns", f"{unknown[0]!r} is no name of a column; {allowed}"


@register(ExplicitParticles)
def make(spec: ExplicitParticles, matter: Matter) -> Particles:
    """The particles of the file, with density, reference density and stress if present.

    Raises DustError for a file that cannot be read, missing columns, numbers that are not finite,
    masses, densities and distances that dust on this spacing cannot have, or another number of
    dimensions than the scene's.
    """
    matter = matter.select(spec.material)
    path = f"sample.file = '{spec.file}'"
    contents = CONTENTS[matter.dimension]
    source = Source(path, [], spec.units, columns=spec.columns, contents=contents)
    state = read(spec.file, source)
    arrays = _dust_of(state, matter, source)
    check_particles(arrays, matter, path, of_run=state.get("of_run", False))
    if not state.get("of_run"):
        source.remarks.extend(remarks_on_volumes(arrays, matter))
    particles = Particles(
        **arrays,
        material=np.full(len(arrays["mass"]), matter.number, np.int8),
        spacing=matter.spacing,
        dimension=matter.dimension,
        bodies=(whole("particles", arrays["position"], arrays["mass"], rigid=False),),
        info={"source": str(spec.file), "mass": float(arrays["mass"].sum())},
    )
    if remarks := remarks_on_reading(state, spec.file):
        particles.info["remarks"] = remarks
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
    return spec.place_particles(particles)


def _dust_of(state: dict, matter: Matter, source: Source) -> dict:
    """Arrays of the particles of dust in a state; rigid bodies and walls are the scene's.

    Raises DustError for a file without masses or without dust, and for densities that differ.
    """
    if "mass" not in state:
        unread = f"; not read: {', '.join(state['unread'])}" if state["unread"] else ""
        raise source.fault(f"it lacks mass; allowed: {source.contents.columns}{unread}.")
    names = ("position", "velocity", "mass", "density", "reference", "deviator", "filling_factor")
    arrays = {name: state[name] for name in names if name in state}
    if "role" in state:
        dust = np.isin(state["role"], (DUST, FIXED))
        if not dust.any():
            raise source.fault(
                "none of its particles are dust (role 0 or 2); allowed: one or more."
            )
        arrays = {name: values[dust] for name, values in arrays.items()}
    filling_factor = arrays.pop("filling_factor", matter.filling_factor)
    density = np.broadcast_to(matter.solid * filling_factor, arrays["mass"].shape)
    if "density" not in arrays:
        return arrays | {"density": density.copy()}
    if "filling_factor" in state and not np.allclose(
        arrays["density"], density, rtol=DENSITIES_DIFFER, atol=0.0
    ):
        raise source.fault(
            "its densities are not its filling factors times the density of the solid "
            f"({matter.solid:g} kg/m^3); allowed: one of them, or sample.columns with _ for the "
            "other."
        )
    return arrays
