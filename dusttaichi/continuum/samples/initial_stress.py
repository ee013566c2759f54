"""Initial stress of a bed under its own weight, which avoids oscillations."""

from dataclasses import replace

import numpy as np

from dusttaichi.continuum.physics import path, strength
from dusttaichi.continuum.samples.particle_arrays import Particles


def weight_above(particles: Particles, gravity: float) -> np.ndarray:
    """Weight of the bed above each particle over the area [Pa], (N,).

    The bed is the first body; it fills the room from bottom to top. From the mean density of
    horizontal slices one spacing thick: exact where the density is the same everywhere.
    """
    bed = particles.body == 0
    z, (low, high) = particles.position[:, 2], particles.room[2]
    count = max(1, round((high - low) / particles.spacing))
    edges = np.linspace(low, high, count + 1)
    slice_ = np.clip(np.searchsorted(edges, z[bed], "right") - 1, 0, count - 1)
    volume = np.bincount(slice_, particles.volume[bed], minlength=count)
    mass = np.bincount(slice_, particles.mass[bed], minlength=count)
    density = mass / np.where(volume > 0, volume, 1.0)
    above = np.append(np.cumsum((density * np.diff(edges))[::-1])[::-1], 0.0)
    return gravity * np.interp(z, edges, above)


def at_rest_under_gravity(particles: Particles, gravity: float, m) -> Particles:
    """The bed with the pressure and the deviator that carry the dust above, laterally confined.

    In uniaxial strain an elastic medium under the vertical stress q has the pressure
    p = q / (1 + 4 mu / 3 K) and the deviator S_zz = -(q - p), S_xx = S_yy = (q - p) / 2. Where
    3/2 |S_zz| is more than the shear strength Y, S_zz is -2 Y / 3 and p = q - 2 Y / 3; p is at most
    the compressive strength, beyond which the bed yields under its own weight. The densities do not
    change, and the reference density follows from p = K(rho0') (rho / rho0' - 1).

    m: MaterialNumbers. `room` of the sample must still be its extent, without faces.
    info["gravity_carried"]: smallest share of the weight that the strengths can carry.
    """
    weight = weight_above(particles, gravity)
    phi = particles.density / m.rho_s
    limit, shear = strength.compressive(phi, m), strength.shear(phi, m)
    pressure = weight / (1.0 + 4.0 / 3.0 * m.mu_over_K)
    pressure = np.minimum(np.maximum(pressure, weight - 2.0 / 3.0 * shear), limit)
    vertical = np.minimum(weight - pressure, 2.0 / 3.0 * shear)
    reference = path.reference_density(particles.density, pressure, m)
    deviator = np.zeros((len(particles), 6))
    deviator[:, 2] = -vertical
    deviator[:, 0] = deviator[:, 1] = vertical / 2.0
    loaded = particles.body == 0
    deviator[~loaded] = 0.0
    carried = np.min(
        (pressure + vertical)[loaded] / np.maximum(weight[loaded], 1e-300), initial=1.0
    )
    return replace(
        particles,
        reference=np.where(loaded, reference, particles.reference),
        deviator=deviator,
        info=particles.info | {"gravity_carried": float(min(carried, 1.0))},
    )
