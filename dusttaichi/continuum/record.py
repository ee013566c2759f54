"""Records of a continuum: series and snapshots, all in SI."""

import numpy as np

from dusttaichi.continuum.kernels.store import FACES
from dusttaichi.continuum.measure import undamaged
from dusttaichi.continuum.physics.damage import carried_pressure
from dusttaichi.results.roles import DUST

IN_SPACE = [0, 4, 8, 1, 2, 5]  # xx yy zz xy xz yz of nine rows


def components(S, dimension):
    """Deviators (n, 6), xx yy zz xy xz yz, of those in memory (n, dimension^2)."""
    if dimension == 3:
        return S[:, IN_SPACE]
    out = np.zeros((len(S), 6))
    out[:, 0], out[:, 2], out[:, 4] = S[:, 0], S[:, 3], S[:, 1]
    out[:, 1] = -(S[:, 0] + S[:, 3])
    return out


def series(sim, parts, window, areas, elastic):
    """Variables of the continuum in a record.

    areas: of the walls [m^2], (6,); elastic: result of measure.elastic_bodies.
    """
    role = sim.of_particles("role")
    dust = role == DUST
    mass, density = sim.of_particles("mass")[dust], sim.of_particles("density")[dust]
    undamaged_fraction = undamaged(sim)[dust]
    p = carried_pressure(sim.of_particles("pressure")[dust], undamaged_fraction)
    volume = mass / density
    volume_fraction = volume / volume.sum() if len(volume) else volume
    S = volume_fraction @ components(
        undamaged_fraction[:, None] * sim.of_particles("deviator")[dust], sim.dimension
    )
    pressure = float(volume_fraction @ p)
    solid = sim.material_of(dust).rho_s
    force = np.zeros((FACES + sim.bodies + len(elastic[0]), 3))
    if window is not None:
        force = window.mean("impulse")
    speed, spin = sim.body_speeds()
    wall = -force[:FACES]
    inward = np.array([1, -1, 1, -1, 1, -1]) * wall[np.arange(6), np.arange(6) // 2]
    return parts | {
        "substeps": sim.substeps,
        "body_position": np.concatenate([sim.rigid("centre")[FACES:], elastic[0]]),
        "body_velocity": np.concatenate([speed[FACES:], elastic[1]]),
        "body_spin": np.concatenate([spin[FACES:], elastic[2]]),
        "body_force": force[FACES:],
        "wall_force": wall,
        "pressure": np.divide(inward, areas, out=np.full(6, np.nan), where=areas > 0.0),
        "pressure_mean": pressure,
        "stress_mean": S - pressure * np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]),
        "filling_factor_mean": float(mass @ (density / solid) / mass.sum()) if len(mass) else 0.0,
        "largest_filling_factor": max(phi for _, phi, _ in parts["largest"]),
        "damage_mean": float(mass @ (1.0 - undamaged_fraction) / mass.sum()) if len(mass) else 0.0,
        "largest_speed": parts["speed"],
    }


def snapshot(sim):
    """The present particles, in the order of the sample."""
    undamaged_fraction = undamaged(sim)
    current = {
        "position": sim.raised(sim.of_particles("x")),
        "velocity": sim.velocities(),
        "density": sim.of_particles("density"),
        "reference_density": sim.of_particles("reference"),
        "pressure": carried_pressure(sim.of_particles("pressure"), undamaged_fraction),
        "deviator": components(
            undamaged_fraction[:, None] * sim.of_particles("deviator"), sim.dimension
        ),
    }
    if sim.layout.damage:
        current["damage"] = 1.0 - undamaged_fraction
    return {name: sim.in_order(values) for name, values in current.items()}
