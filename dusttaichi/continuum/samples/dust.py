"""Dust on points: exact masses, and a filling factor that may have layers and scatter."""

import numpy as np
import scipy

from dusttaichi.continuum.samples import lattice
from dusttaichi.continuum.samples.body_registry import Matter, Variation, lift_to_space
from dusttaichi.continuum.samples.particle_arrays import Body, Particles
from dusttaichi.errors import DustError
from dusttaichi.scene.making import Cost

REACH = 2.5  # cutoff of the weights of the scatter, in its lengths
SECONDS = 3e-7  # of two particles within it


def dust(points: np.ndarray, volume: float, matter: Matter, filling, name: str) -> Particles:
    """A body of dust at rest on points (N, 2 or 3), with equal shares of `volume`.

    volume: of the body, exact [m^2, or m^3]. filling: a filling factor, a Variation or None for
    that of the material. Raises DustError for a filling factor that the material does not allow.
    """
    position = lift_to_space(points)
    phi = filling_factors(position, matter, filling, name)
    density = matter.solid * phi
    mass = density * volume / len(points)
    body = whole(name, position, mass, rigid=False)
    return Particles(
        position=position,
        mass=mass,
        density=density,
        material=np.full(len(points), matter.number, np.int8),
        spacing=matter.spacing,
        dimension=matter.dimension,
        bodies=(body,),
        info={
            "name": name,
            "mass": float(mass.sum()),
            "volume": float(volume),
            "filling_factor": float(mass.sum() / volume / matter.solid),
        },
    )


def cost_of_scatter(filling, volume: float, scene) -> Cost | None:
    """Cost of a filling factor with a correlation length, in a volume [m^2, or m^3]."""
    if not (isinstance(filling, Variation) and filling.sigma and filling.length):
        return None
    particle_volume = lattice.volume_of(scene.numerics.spacing, scene.dimension)
    within = lattice.sphere_volume(2.0 * REACH * filling.length, scene.dimension)
    pairs = 0.5 * volume * min(within, volume) / particle_volume**2
    return Cost("N times the particles within filling_factor.length", SECONDS * pairs)


def whole(name: str, position, mass, *, rigid: bool, shape: str = "") -> Body:
    """The Body of particles at rest; its moments of inertia are those of points."""
    centre = mass @ position / mass.sum()
    apart = position - centre
    square = (apart**2).sum(axis=1)
    inertia = mass @ square * np.eye(3) - apart.T @ (mass[:, None] * apart)
    still = np.zeros(3)
    size = float(2 * np.sqrt(square.max()))
    return Body(name, rigid, float(mass.sum()), centre, still, still.copy(), inertia, size, shape)


def filling_factors(position, matter: Matter, filling, path: str) -> np.ndarray:
    """Filling factors (N,) of particles, layers counted from the highest particle down.

    Raises DustError where the material does not allow one.
    """
    if filling is None or not isinstance(filling, Variation):
        phi = np.full(len(position), matter.filling_factor if filling is None else filling)
    else:
        mean = matter.filling_factor if filling.mean is None else filling.mean
        phi = np.full(len(position), mean)
        depth = position[:, 2].max() + matter.spacing / 2 - position[:, 2]
        top = 0.0
        for layer in filling.layers:
            phi[(depth >= top) & (depth < top + layer.thickness)] = layer.filling_factor
            top += layer.thickness
        if filling.sigma > 0:
            phi += filling.sigma * _noise(position, filling.length, filling.seed)
    bad_rows = np.flatnonzero(~((phi > matter.least) & (phi < matter.most)))
    if len(bad_rows):
        row = bad_rows[0]
        raise DustError(
            f"{path}: the filling factor of particle {row} is {phi[row]:.4g}; allowed with "
            f"this material: above {matter.least:g} and below {matter.most:g}. Use another mean "
            "or a smaller sigma."
        )
    return phi


def _noise(position, length: float, seed: int) -> np.ndarray:
    """Gaussian numbers (N,) of mean 0 and variance 1, correlated over a length [m]."""
    rng = np.random.Generator(np.random.PCG64(seed))
    noise = rng.standard_normal(len(position))
    if length > 0 and len(position) > 2:
        tree = scipy.spatial.cKDTree(position)
        pairs = tree.query_pairs(REACH * length, output_type="ndarray")
        i, j = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))].T
        weight = np.exp(-((position[i] - position[j]) ** 2).sum(axis=1) / length**2)
        smooth = noise.copy()
        np.add.at(smooth, i, weight * noise[j])
        np.add.at(smooth, j, weight * noise[i])
        noise = smooth
    if len(noise) < 2:
        return noise
    return (noise - noise.mean()) / noise.std()
