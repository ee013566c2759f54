"""Energies and extremes of the particles of a continuum, each from a DustState. SI inside.

(n, ...) arrays are in internal order.
"""

import numpy as np

from dusttaichi.continuum.physics.damage import undamaged_fraction
from dusttaichi.continuum.physics.deviator import shear_energy
from dusttaichi.continuum.physics.elasticity import path_energy


def largest(state, dust):
    """(phi_2, largest filling factor, largest without pressure) of the dust of each material."""
    density, compacted = state.of_particles("density")[dust], state.of_particles("reference")[dust]
    number = np.zeros(len(density))
    if state.layout.materials:
        number = state.of_particles("material")[dust]
    out, materials = [], state.materials
    for k, (phi_2, solid) in enumerate(zip(materials.phi_2, materials.rho_s, strict=True)):
        is_largest = number == k
        ends = (values[is_largest].max(initial=0.0) / solid for values in (density, compacted))
        out.append((float(phi_2), *map(float, ends)))
    return out


def elastic_of_particles(state, gives=slice(None)):
    """Elastic energy of pressure in compression and in tension, and of the deviator [J].

    By deformable particle, (n, 3): the energy of the path (physics.continuum.elasticity) and
    S:S/4mu per volume. In damaged dust the undamaged share stores tension and deviator.
    """
    density, reference = (state.of_particles(name)[gives] for name in ("density", "reference"))
    volume = state.of_particles("mass")[gives] / density
    K, ratio = state.of_particles("modulus")[gives], state.of_particles("shear_ratio")[gives]
    pressure, deviator = (
        state.of_particles("pressure")[gives],
        state.of_particles("deviator")[gives],
    )
    dimension = state.dimension
    trace = deviator[:, :: dimension + 1].sum(axis=1)
    squares = np.sum(deviator * deviator, axis=1) + trace * trace
    of_pressure, carried = (
        volume * path_energy(density, reference, K),
        compute_intact_fraction(state)[gives],
    )
    return np.stack(
        [
            np.where(pressure >= 0.0, of_pressure, 0.0),
            np.where(pressure < 0.0, carried * of_pressure, 0.0),
            shear_energy(carried * volume, squares, ratio * K),
        ],
        axis=1,
    )


def compute_intact_fraction(state):
    """Share of each particle that carries tension and deviator, (n,)."""
    if not state.layout.damage:
        return np.ones(state.count)
    return undamaged_fraction(state.of_particles("damage"))
