"""Records of the result file (SI) from a simulation (internal units)."""

import numpy as np

from dusttaichi import units
from dusttaichi.results import reference_energy

MAX_BINS = 4000


def total_energy(m):
    """Kinetic and potential energy of a measurement [fJ]."""
    return (
        m["kinetic_translation"]
        + m["kinetic_rotation"]
        + m["potential"].sum()
        + m["potential_wall"].sum()
    )


def ledger(m, start):
    """Residual [fJ] and its share of the energy that has gone through the system.

    `start`: the measurement at step 0.
    """
    losses = m["loss"].sum() + m["loss_wall"].sum()
    residual = total_energy(m) - total_energy(start) - m["wall_work"] + losses
    through = reference_energy(
        m["wall_work"],
        start["kinetic_translation"] + start["kinetic_rotation"],
        start["potential"].sum() + start["potential_wall"].sum(),
        losses,
    )
    return residual, residual / through if through > 0.0 else 0.0


def wall_areas(box, step_time):
    """Area of each wall now [um^2], (6,)."""
    low, high = box.planes(step_time)[0::2], box.planes(step_time)[1::2]
    a, b, c = high - low
    return np.array([b * c, b * c, a * c, a * c, a * b, a * b])


def series(sim, clock, m, start, mean_force, wall_clock):
    """One record of the time series. mean_force [nN], (6, 3): of the walls on the grains."""
    residual, relative = ledger(m, start)
    record = {
        "time": sim.time * units.TIME,
        "step": sim.step,
        "coordination_number": 2.0 * m["contacts"] / sim.grains,
        "contact_count": m["contacts"],
        "kinetic_translation": m["kinetic_translation"] * units.ENERGY,
        "kinetic_rotation": m["kinetic_rotation"] * units.ENERGY,
        "potential": m["potential"] * units.ENERGY,
        "loss": m["loss"] * units.ENERGY,
        "energy_residual": residual * units.ENERGY,
        "energy_residual_relative": relative,
        "largest_overlap": m["largest_overlap"] * units.LENGTH,
        "largest_speed": m["largest_speed"] * units.SPEED,
        "wall_clock": wall_clock,
    }
    if sim.box is not None:
        inward = np.sum(mean_force * sim.box.normal, axis=1)
        record |= {
            "pressure": inward / wall_areas(sim.box, sim.time) * units.PRESSURE,
            "wall_force": mean_force * units.FORCE,
            "wall_contact_count": m["wall_contacts"],
            "potential_wall": m["potential_wall"] * units.ENERGY,
            "loss_wall": m["loss_wall"] * units.ENERGY,
            "wall_work": m["wall_work"] * units.ENERGY,
        }
    if clock.area:
        record |= {
            "height": clock.height_at(sim.step) * units.LENGTH,
            "filling_factor": clock.filling_factor_at(sim.step),
        }
    return record


def slab_volumes(z, radius, edges):
    """Volume of spheres (centres z, one radius) between successive `edges`: exact, by caps."""
    # volume of a unit of sphere below a plane at height t of its centre, t in [-r, r]
    t = np.clip(edges[None, :] - z[:, None], -radius, radius)
    below = np.pi * (radius**2 * t - t**3 / 3.0 + 2.0 / 3.0 * radius**3)
    return np.diff(below, axis=1).sum(axis=0)


def bin_edges(clock, radius):
    """Edges of the profile bins above the bottom wall [um]: one grain diameter each (S12 Fig 5)."""
    bins = min(MAX_BINS, max(1, int(np.ceil(clock.height / (2.0 * radius) - 1e-9))))
    return 2.0 * radius * np.arange(bins + 1)


def profile(sim, clock, edges):
    """Filling factor in horizontal slices; not a number above the top wall."""
    bottom = sim.box.planes(sim.time)[4]
    height = clock.height_at(sim.step)
    x, _, _ = sim.grain_state()
    inside = np.minimum(edges, height)
    volume = slab_volumes(x[:, 2] - bottom, sim.radius, inside) if len(x) else 0.0
    room = np.diff(inside) * clock.area
    with np.errstate(invalid="ignore", divide="ignore"):
        phi = np.where(room > 1e-9 * clock.area, volume / room, np.nan)
    return {
        "profile_time": sim.time * units.TIME,
        "step": sim.step,
        "height": height * units.LENGTH,
        "box_filling_factor": clock.filling_factor_at(sim.step),
        "filling_factor": phi,
    }


def snapshot(sim, contacts):
    """Records of /snapshots, /contacts and /wall_contacts, as (group, record) pairs."""
    x, v, w = sim.grain_state()
    record = {
        "snapshot_time": sim.time * units.TIME,
        "step": sim.step,
        "position": x * units.LENGTH,
        "velocity": v * units.SPEED,
        "spin": w * units.SPIN,
    }
    out = [("snapshots", record)]
    if sim.box is not None:
        planes = np.where(sim.box.present == 1, sim.box.planes(sim.time), np.nan)
        record["box"] = planes * units.LENGTH
    if not contacts:
        return out
    pairs = sim.contact_state()
    record["contact_count"] = len(pairs["grain_i"])
    pairs["overlap"] = pairs["overlap"] * units.LENGTH
    out.append(("contacts", pairs))
    if sim.box is not None:
        walls = sim.wall_contact_state()
        record["wall_contact_count"] = len(walls["grain"])
        walls["overlap"] = walls["overlap"] * units.LENGTH
        walls["foot"] = walls["foot"] * units.LENGTH
        out.append(("wall_contacts", walls))
    return out
