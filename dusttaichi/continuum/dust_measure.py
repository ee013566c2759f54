"""Energies and extremes of the particles of a continuum, each from a DustState. SI inside.

(n, ...) arrays are in internal order.
"""

import numpy as np

from dusttaichi.continuum.physics.damage import undamaged_fraction
from dusttaichi.continuum.physics.deviator import shear_energy
from dusttaichi.continuum.physics.elasticity import path_energy

AT_ONCE = 2**16  # particles whose temporary arrays there are at once


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
    out = np.empty((state.count, 3))
    for first in range(0, state.count, AT_ONCE):
        end = min(first + AT_ONCE, state.count)
        out[first:end] = _elastic_of(state, first, end)
    return out[gives]


def _elastic_of(state, first, end):
    """`elastic_of_particles` of those from `first` to before `end`."""
    names = "mass", "density", "reference", "modulus", "shear_ratio", "pressure", "deviator"
    mass, density, reference, K, ratio, pressure, deviator = (
        state.of_particles(name, first, end) for name in names
    )
    volume = mass / density
    trace = deviator[:, :: state.dimension + 1].sum(axis=1)
    squares = np.sum(deviator * deviator, axis=1) + trace * trace
    of_pressure = volume * path_energy(density, reference, K)
    carried = compute_intact_fraction(state, first, end)
    return np.stack(
        [
            np.where(pressure >= 0.0, of_pressure, 0.0),
            np.where(pressure < 0.0, carried * of_pressure, 0.0),
            shear_energy(carried * volume, squares, ratio * K),
        ],
        axis=1,
    )


def compute_intact_fraction(state, first=0, end=None):
    """Share that carries tension and deviator, of all particles or of those up to `end`, (n,)."""
    if not state.layout.damage:
        return np.ones((state.count if end is None else end) - first)
    return undamaged_fraction(state.of_particles("damage", first, end))
