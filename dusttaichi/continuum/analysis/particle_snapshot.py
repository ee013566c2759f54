"""One snapshot of a run of the continuum: its particles."""

from dataclasses import dataclass

import numpy as np

from dusttaichi.analysis.frame import resolve_snapshot
from dusttaichi.errors import DustError
from dusttaichi.results.roles import DUST, ELASTIC, FIXED, RIGID

TRIANGULAR, HEXAGONAL = 3**0.5 / 2, 2**-0.5  # volume of a particle in (nearest distance)^d


@dataclass(frozen=True)
class ParticleFrame:
    """One snapshot in SI: N particles; in two dimensions the plane is x-z.

    number: of the snapshot, from 0. time [s], step. position [m], velocity [m/s]: (N, 3). density
    [kg/m^3], mass [kg, kg/m in two dimensions], pressure [Pa], role, body: (N,). deviator (N, 6)
    [Pa]: xx, yy, zz, xy, xz, yz. spacing [m], dimension, solid [kg/m^3]: density of the
    solid, (N,) with several materials.
    """

    number: int
    time: float
    step: int
    position: np.ndarray
    velocity: np.ndarray
    density: np.ndarray
    mass: np.ndarray
    pressure: np.ndarray
    deviator: np.ndarray
    role: np.ndarray
    body: np.ndarray
    spacing: float
    dimension: int
    solid: float | np.ndarray

    @property
    def is_dust(self):
        """True for particles of dust, fixed or not, (N,) bool."""
        return np.isin(self.role, (DUST, FIXED))

    @property
    def flies(self):
        """True for particles that move freely: loose dust and elastic ones, (N,) bool."""
        return np.isin(self.role, (DUST, ELASTIC))

    @property
    def is_bead(self):
        """True for particles of rigid or elastic bodies, (N,) bool."""
        return np.isin(self.role, (RIGID, ELASTIC))

    @property
    def filling_factor(self):
        """Filling factors (N,); not a number of what is not dust."""
        return np.where(self.is_dust, self.density / self.solid, np.nan)

    @property
    def volume(self):
        """Volumes of the particles (N,) [m^3, m^2 in two dimensions]."""
        return self.mass / self.density

    @property
    def top(self):
        """Height of the surface of the dust [m]."""
        return float(self.position[self.is_dust, 2].max() + 0.5 * self.spacing)

    @property
    def floor(self):
        """Height that the dust lies on [m]."""
        return float(self.position[self.is_dust][:, 2].min() - 0.5 * self.spacing)

    def filling_below(self, axis, reach, edges):
        """Filling factor (slices,) in an upright cylinder about `axis` (2,) [m], `reach` [m] wide.

        The slices are between `edges` (slices + 1,), heights that fall. Mean of the particles whose
        centre is in a slice.
        """
        x = self.position[self.is_dust]
        inside = np.hypot(*(x[:, :2] - axis).T) <= reach
        volume, phi = (a[self.is_dust][inside] for a in (self.volume, self.filling_factor))
        solid, all_ = (
            np.histogram(x[inside, 2], edges[::-1], weights=weights)[0]
            for weights in (volume * phi, volume)
        )
        return (solid / np.where(all_ > 0.0, all_, np.nan))[::-1]

    @property
    def size(self):
        """Distance (N,) [m] to the nearest particles in a close packing of such volumes."""
        packing_factor = TRIANGULAR if self.dimension == 2 else HEXAGONAL
        return (self.volume / packing_factor) ** (1.0 / self.dimension)


def has_dust(run):
    """True where a Run of the continuum with snapshots has dust, and not elastic bodies alone."""
    return bool(np.isin(run.snapshots.role, (DUST, FIXED)).any())


def read_particles(run, snapshot=-1):
    """The ParticleFrame number `snapshot` of a Run of the continuum, from the end if negative.

    Raises DustError where there is none of this number, or the run is not one of the continuum.
    """
    number = resolve_snapshot(run, snapshot)
    group = run.tree["snapshots"].to_dataset(inherit=False)
    if "particle" not in group.dims:
        raise DustError(f"{run.path} is not a run of the continuum: its snapshots have grains.")
    data = group.isel(snapshot=number).load()
    return ParticleFrame(
        number=number,
        time=float(data.snapshot_time),
        step=int(data.step),
        **{
            name: data[name].values
            for name in ("position", "velocity", "density", "mass", "pressure", "deviator")
        },
        role=data.role.values.astype(int),
        body=data.body.values.astype(int),
        spacing=float(run.attrs["spacing"]),
        dimension=int(run.attrs["dimension"]),
        solid=data.solid_density.values
        if "solid_density" in data
        else float(run.attrs["solid_density"]),
    )
