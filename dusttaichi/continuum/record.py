"""What a continuum writes: records of the series and snapshots, all in SI."""

import numpy as np

from dusttaichi.continuum.kernels.store import CENTRE, FACES
from dusttaichi.samples.continuum.particles import RIGID, WALL

IN_SPACE = [0, 4, 8, 1, 2, 5]  # xx yy zz xy xz yz of nine rows


def components(S, dimension):
    """Deviators (n, 6), xx yy zz xy xz yz, of those in memory (n, dimension^2)."""
    if dimension == 3:
        return S[:, IN_SPACE]
    out = np.zeros((len(S), 6))
    out[:, 0], out[:, 2], out[:, 4] = S[:, 0], S[:, 3], S[:, 1]
    out[:, 1] = -(S[:, 0] + S[:, 3])
    return out


def series(sim, parts, window, areas):
    """What the continuum adds to a record; areas: of the walls [m^2], (6,)."""
    role = sim.of_particles("role")
    dust = (role != RIGID) & (role != WALL)
    mass, density = sim.of_particles("mass")[dust], sim.of_particles("density")[dust]
    p = sim.of_particles("pressure")[dust]
    volume = mass / density
    share = volume / volume.sum()
    S = share @ components(sim.of_particles("deviator")[dust], sim.dimension)
    pressure = float(share @ p)
    solid = sim.material.rho_s
    keys = ("kinetic", "gravity_energy", "elastic_energy", "loss", "work", "momentum")
    out = {key: parts[key] for key in keys}
    force = np.zeros((FACES + sim.bodies, 3))
    if window is not None:
        force = window.mean("impulse")
    speed, spin = sim.body_speeds()
    wall = -force[:FACES]
    inward = np.array([1, -1, 1, -1, 1, -1]) * wall[np.arange(6), np.arange(6) // 2]
    return out | {
        "substeps": sim.substeps,
        "body_position": sim.rigid(CENTRE)[FACES:],
        "body_velocity": speed[FACES:],
        "body_spin": spin[FACES:],
        "body_force": force[FACES:],
        "wall_force": wall,
        "pressure": np.divide(inward, areas, out=np.full(6, np.nan), where=areas > 0.0),
        "pressure_mean": pressure,
        "stress_mean": S - pressure * np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]),
        "filling_factor_mean": float(mass @ density / mass.sum() / solid),
        "largest_filling_factor": parts["density"] / solid,
        "largest_speed": parts["speed"],
    }


def snapshot(sim):
    """The particles of now, in the order of the sample."""
    now = {
        "position": sim.raised(sim.of_particles("x")),
        "velocity": sim.velocities(),
        "density": sim.of_particles("density"),
        "reference_density": sim.of_particles("reference"),
        "pressure": sim.of_particles("pressure"),
        "deviator": components(sim.of_particles("deviator"), sim.dimension),
    }
    return {name: sim.in_order(values) for name, values in now.items()}
