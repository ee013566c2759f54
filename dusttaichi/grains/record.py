"""Records of the result file (SI) from a simulation (internal units)."""

from dataclasses import dataclass

import numpy as np

from dusttaichi import geometry, units
from dusttaichi.grains.contacts import contact_state, wall_contact_state
from dusttaichi.grains.measure import grain_losses, grain_state
from dusttaichi.names import WALLS

MAX_BINS = 4000


@dataclass(frozen=True)
class Plates:
    """Geometry of a sample between plates, fixed at the start [um].

    centre (2,), reach (2,): of the initial footprint, half its width and depth; round: it is a
    cylinder. inner: radius of PD08's inner cylinder.
    """

    centre: np.ndarray
    reach: np.ndarray
    round: bool
    inner: float

    def outside(self, x):
        """Number of grains whose centre has left the initial footprint."""
        away = (x[:, :2] - self.centre) / self.reach
        far = np.sum(away**2, axis=1) > 1.0 if self.round else np.any(np.abs(away) > 1.0, axis=1)
        return int(np.count_nonzero(far))


def plates_of(boundary, sample, radius):
    """Plates for a sample (positions in m) and a grain radius [um]; None without plates."""
    if boundary.kind != "plates":
        return None
    x = sample.positions[:, :2] / units.LENGTH
    centre = 0.5 * (x.min(axis=0) + x.max(axis=0))
    round_ = sample.info.get("shape") == "cylinder"
    reach = np.hypot(*(x - centre).T).max() if round_ else np.abs(x - centre).max(axis=0)
    reach = np.maximum(reach, radius) + np.zeros(2)
    inner = boundary.inner_radius
    # the sample's own radius is that of its grains' surfaces: one radius less is its centres'
    inner = float(reach.min()) if inner == "auto" else inner / units.LENGTH
    return Plates(centre, reach * (1.0 + 1e-9), round_, inner)


def stress(sim, before, after, span):
    """Virial stress [kPa], (3, 3), positive in tension (T19 eq 23): the mean over `span` [us].

    before, after: sums (lengths, flux) at the ends of the span.
    """
    volume = 0.5 * (np.prod(before["lengths"]) + np.prod(after["lengths"]))
    return -(after["flux"] - before["flux"]) / (volume * span)


def series(sim, m, window, plates=None):
    """Variables that the grains add to a record of the time series.

    m: result of measure.energies. window: Window of sums, None at step 0: then walls act with the
    force of that moment, and there is no stress yet.
    """
    record = {
        "coordination_number": 2.0 * m["contacts"] / sim.grains,
        "contact_count": m["contacts"],
        "kinetic_translation": m["kinetic_translation"] * units.ENERGY,
        "kinetic_rotation": m["kinetic_rotation"] * units.ENERGY,
        "potential": m["potential"] * units.ENERGY,
        "loss": m["loss"] * units.ENERGY,
        "largest_overlap": m["largest_overlap"] * units.LENGTH,
        "largest_speed": m["largest_speed"] * units.SPEED,
    }
    if not sim.domain.there:
        record |= _momenta(sim)
    if sim.domain.there:
        record["shear_strain"] = sim.domain.shear_strain(sim.step)
    if sim.cell is not None:
        record["face_work"] = m["face_work"] * units.ENERGY
    record["stiffness_work"] = m["stiffness_work"] * units.ENERGY
    if sim.push.works:
        record["push_work"] = m["push_work"] * units.ENERGY
    if sim.gravity is not None:
        record["gravity_work"] = m["gravity_work"] * units.ENERGY
    if sim.sphere is not None:
        record |= _sphere(sim, m, window)
    if sim.layout.stress:
        mean = np.zeros((3, 3)) if window is None else stress(sim, *window)
        record["stress"] = mean * units.PRESSURE
    if sim.box is not None:
        force = sim.ledger_sums.wall_force if window is None else window.mean("impulse")
        record |= _walls(sim, m, force)
        if plates is not None:
            record |= _between_plates(sim, plates, force, sim.lengths()[2])
    return record


def bodies(sim, first):
    """Centres of mass, velocities and angular momenta of two bodies, (2, 3) each, SI.

    Angular momenta are about the centres. The grains of the one are before number `first` of the
    sample, wherever they go.
    """
    x, v, w = grain_state(sim)
    mass, inertia = _inertia(sim)
    centres, velocities, spins = [], [], []
    for own in (slice(0, first), slice(first, None)):
        share = mass[own] / mass[own].sum()
        centre, velocity = (np.sum(share * a[own], axis=0) for a in (x, v))
        moving = mass[own] * (v[own] - velocity)
        turning = np.cross(x[own] - centre, moving) + inertia[own] * w[own]
        centres.append(centre * units.LENGTH)
        velocities.append(velocity * units.SPEED)
        spins.append(turning.sum(axis=0) * units.MASS * units.SPEED * units.LENGTH)
    return {
        "body_position": np.array(centres),
        "body_velocity": np.array(velocities),
        "body_angular_momentum": np.array(spins),
    }


def _inertia(sim):
    """Masses [pg] and moments of inertia [pg um^2] of the grains, (N, 1), in the sample's order."""
    return (
        np.broadcast_to(a[sim.state.rank] if np.ndim(a) else a, (sim.grains, 1))
        for a in (sim.mass, sim.inertia)
    )


def _sphere(sim, m, window):
    """Record of the rigid sphere: motion, mean load, energies, contacts."""
    sphere = sim.sphere
    now = m["sphere_load"]
    load = np.concatenate(now) if window is None else window.mean("sphere_impulse")
    return _sphere_motion(sphere, now) | {
        "sphere_force": load[:3] * units.FORCE,
        "sphere_torque": load[3:] * units.TORQUE,
        "sphere_kinetic": m["sphere_kinetic"] * units.ENERGY,
        "sphere_contact_count": m["sphere_contacts"],
        "potential_sphere": m["potential_sphere"] * units.ENERGY,
        "loss_sphere": m["loss_sphere"] * units.ENERGY,
        "sphere_work": m["sphere_work"] * units.ENERGY,
    }


def _sphere_motion(sphere, load):
    x, v, w = sphere.now(load)
    return {
        "sphere_position": x * units.LENGTH,
        "sphere_velocity": v * units.SPEED,
        "sphere_spin": w * units.SPIN,
    }


def _momenta(sim):
    """Momentum and angular momentum about the origin of all grains and the sphere (3,), SI."""
    x, v, w = grain_state(sim)
    mass, inertia = _inertia(sim)
    momentum = mass * v
    angular = np.cross(x, momentum).sum(axis=0) + (inertia * w).sum(axis=0)
    momentum = momentum.sum(axis=0)
    if (sphere := sim.sphere) is not None:
        x, v, w = sphere.now()
        momentum = momentum + sphere.mass * v
        angular = angular + sphere.mass * np.cross(x, v) + sphere.inertia * w
    unit = units.MASS * units.SPEED
    return {
        "momentum": momentum * unit,
        "angular_momentum": angular * unit * units.LENGTH,
    }


def _walls(sim, m, mean_force):
    return {
        "pressure": _pressure(sim, mean_force, sim.domain.wall_areas(sim.step)),
        "wall_force": mean_force * units.FORCE,
        "wall_contact_count": m["wall_contacts"],
        "potential_wall": m["potential_wall"] * units.ENERGY,
        "loss_wall": m["loss_wall"] * units.ENERGY,
        "wall_work": m["wall_work"] * units.ENERGY,
    }


def _pressure(sim, mean_force, areas):
    """Pressure on each wall [Pa], (6,); not a number where there is none."""
    inward = np.sum(mean_force * sim.box.normal, axis=1)
    return np.where(sim.box.present == 1, inward / areas * units.PRESSURE, np.nan)


def _between_plates(sim, plates, mean_force, height):
    """Shadow of the grains, filling factor from it (S12 section 3.2), and that of PD08."""
    x, _, _ = grain_state(sim)
    area = geometry.union_area(x[:, :2], sim.radii)
    bottom = sim.box.planes(sim.time)[WALLS.index("bottom")]
    inside = geometry.cylinder_volume(
        x, sim.radii, plates.centre, plates.inner, low=bottom, high=bottom + height
    )
    return {
        "projected_area": area * units.LENGTH**2,
        "filling_factor": sim.volume / (area * height),
        "inner_filling_factor": inside / (np.pi * plates.inner**2 * height),
        "outside_count": plates.outside(x),
        "pressure": _pressure(sim, mean_force, area),
    }


def slab_volumes(z, radius, edges):
    """Volume of spheres (centres z, radius or (N,)) between successive `edges`, exact by caps."""
    radius = radius[:, None] if np.ndim(radius) else radius
    # volume of a unit of sphere below a plane at height t of its centre, t in [-r, r]
    t = np.clip(edges[None, :] - z[:, None], -radius, radius)
    below = np.pi * (radius**2 * t - t**3 / 3.0 + 2.0 / 3.0 * radius**3)
    return np.diff(below, axis=1).sum(axis=0)


def bin_edges(clock, radius):
    """Edges of the profile bins above the bottom wall [um]: one grain diameter each (S12 Fig 5)."""
    bins = min(MAX_BINS, max(1, int(np.ceil(clock.height_at(clock.first) / (2.0 * radius) - 1e-9))))
    return 2.0 * radius * np.arange(bins + 1)


def profile(sim, clock, edges, time):
    """Filling factor in horizontal slices; not a number above the top wall. time [s]: recorded."""
    bottom = sim.domain.room(sim.step)[WALLS.index("bottom")]
    height = clock.height_at(sim.step)
    x, _, _ = grain_state(sim)
    inside = np.minimum(edges, height)
    volume = slab_volumes(x[:, 2] - bottom, sim.radii, inside) if len(x) else 0.0
    area = clock.area_at(sim.step)
    space = np.diff(inside) * area
    with np.errstate(invalid="ignore", divide="ignore"):
        phi = np.where(space > 1e-9 * area, volume / space, np.nan)
    return {
        "profile_time": time,
        "step": sim.step,
        "height": height * units.LENGTH,
        "box_filling_factor": clock.filling_factor_at(sim.step),
        "filling_factor": phi,
    }


def snapshot(sim, contacts, time):
    """Records of /snapshots and of the groups of contacts as (group, record) pairs.

    time [s]: recorded.
    """
    x, v, w = grain_state(sim)
    record = {
        "snapshot_time": time,
        "step": sim.step,
        "position": x * units.LENGTH,
        "velocity": v * units.SPEED,
        "spin": w * units.SPIN,
    }
    record["stiffness_scaling"] = sim.stiffness
    if sim.layout.orientation:
        record["orientation"] = np.empty((sim.grains, 4))
        record["orientation"][sim.order] = sim.state["orientation"]
    if sim.layout.grain_loss:
        record["grain_loss"] = grain_losses(sim) * units.ENERGY
    out = [("snapshots", record)]
    if sim.box is not None or sim.cell is not None:
        record["box"] = sim.domain.room(sim.step) * units.LENGTH
        record["tilt"] = sim.domain.tilt(sim.step) * units.LENGTH
    if sim.sphere is not None:
        load = sim.sphere.load()
        record |= _sphere_motion(sim.sphere, load) | {"sphere_force": load[0] * units.FORCE}
    if not contacts:
        return out
    pairs = contact_state(sim)
    record["contact_count"] = len(pairs["grain_i"])
    out.append(("contacts", _in_si(pairs, sim, len(pairs["grain_i"]))))
    if sim.box is not None:
        walls = wall_contact_state(sim)
        record["wall_contact_count"] = len(walls["grain"])
        out.append(("wall_contacts", _in_si(walls, sim, len(walls["grain"]))))
    if sim.sphere is not None:
        own = sim.sphere.contacts()
        record["sphere_contact_count"] = len(own["grain"])
        out.append(("sphere_contacts", _in_si(own, sim, len(own["grain"]))))
    return out


UNITS = {
    "overlap": units.LENGTH,
    "foot": units.LENGTH,
    "normal_force": units.FORCE,
    "force": units.FORCE,
    "torque": units.TORQUE,
    "torque_i": units.TORQUE,
    "torque_j": units.TORQUE,
    "sliding_force": units.FORCE,
    "rolling_moment": units.TORQUE,
    "twisting_moment": units.TORQUE,
    "loss": units.ENERGY,
}
"""Factors from internal units to SI, of the columns of contacts."""


def _in_si(contacts, sim, rows):
    """The columns of contacts in SI, with the step of their snapshot."""
    history = sim.layout.model.history.values()
    scales = {h.result: units.internal(h.unit) for h in history if h.result} | UNITS
    found = {name: scales[name] * a if name in scales else a for name, a in contacts.items()}
    return found | {"step": np.full(rows, sim.step)}
