"""Records of the result file from a simulation, as it counts: the run converts them to SI."""

from dataclasses import dataclass

import numpy as np

from dusttaichi import units
from dusttaichi.grains.contacts import contact_state, wall_contact_state
from dusttaichi.grains.measure import grain_losses, grain_state, positions
from dusttaichi.physics import geometry
from dusttaichi.physics.geometry import WALLS

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


def stress(start, end, span):
    """Virial stress, (3, 3), positive in tension (T19 eq 23): the mean over `span`.

    start, end: sums (lengths, flux) at the ends of the span.
    """
    volume = 0.5 * (np.prod(start["lengths"]) + np.prod(end["lengths"]))
    return -(end["flux"] - start["flux"]) / (volume * span)


def series(sim, m, window, plates=None):
    """Variables that the grains add to a record of the time series.

    m: result of measure.energies. window: Window of sums, None at step 0: then walls act with the
    force of that moment, and there is no stress yet.
    """
    record = m | {
        "coordination_number": 2.0 * m["contacts"] / sim.grains,
        "contact_count": m["contacts"],
        "wall_contact_count": m["wall_contacts"],
        "sphere_contact_count": m["sphere_contacts"],
    }
    if sim.domain.there:
        record["shear_strain"] = sim.domain.shear_strain(sim.step)
    else:
        record |= _momenta(sim)
    if sim.sphere is not None:
        record |= _sphere(sim, m, window)
    record |= mean_loads(sim, window)
    if sim.box is not None and plates is not None:
        record |= _between_plates(sim, plates, record["wall_force"], sim.lengths()[2])
    return record


def mean_loads(sim, window):
    """Stress, forces of the walls and pressures on them over a Window; see `series`."""
    loads = {}
    if sim.layout.stress:
        loads["stress"] = np.zeros((3, 3)) if window is None else stress(*window)
    if sim.box is not None:
        force = sim.ledger_sums.wall_force if window is None else window.mean("impulse")
        areas = sim.domain.wall_areas(sim.step)
        loads |= {"pressure": _pressure(sim, force, areas), "wall_force": force}
    return loads


def bodies(sim, first):
    """Centres of mass, velocities and angular momenta of two bodies, (2, 3) each.

    Angular momenta are about the centres. The grains of the one are before number `first` of the
    sample, wherever they go.
    """
    x, v, w = grain_state(sim)
    mass, inertia = _inertia(sim)
    centres, velocities, spins = [], [], []
    for body in (slice(0, first), slice(first, None)):
        weights = mass[body] / mass[body].sum()
        centre, velocity = (np.sum(weights * a[body], axis=0) for a in (x, v))
        moving = mass[body] * (v[body] - velocity)
        turning = np.cross(x[body] - centre, moving) + inertia[body] * w[body]
        centres.append(centre)
        velocities.append(velocity)
        spins.append(turning.sum(axis=0))
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
    """Record of the rigid sphere: motion, mean load."""
    sphere_load = m["sphere_load"]
    load = np.concatenate(sphere_load) if window is None else window.mean("sphere_impulse")
    motion = _sphere_motion(sim.sphere, sphere_load)
    return motion | {"sphere_force": load[:3], "sphere_torque": load[3:]}


def _sphere_motion(sphere, load):
    x, v, w = sphere.now(load)
    return {"sphere_position": x, "sphere_velocity": v, "sphere_spin": w}


def _momenta(sim):
    """Momentum and angular momentum about the origin of all grains and the sphere, (3,)."""
    x, v, w = grain_state(sim)
    mass, inertia = _inertia(sim)
    momentum = mass * v
    angular = np.cross(x, momentum).sum(axis=0) + (inertia * w).sum(axis=0)
    momentum = momentum.sum(axis=0)
    if (sphere := sim.sphere) is not None:
        x, v, w = sphere.now()
        momentum = momentum + sphere.mass * v
        angular = angular + sphere.mass * np.cross(x, v) + sphere.inertia * w
    return {"momentum": momentum, "angular_momentum": angular}


def _pressure(sim, mean_force, areas):
    """Pressure on each wall, (6,); not a number where there is none."""
    inward = np.sum(mean_force * sim.box.normal, axis=1)
    return np.where(sim.box.present == 1, inward / areas, np.nan)


def _between_plates(sim, plates, mean_force, height):
    """Shadow of the grains, filling factor from it (S12 section 3.2), and that of PD08."""
    x = positions(sim)
    area = geometry.union_area(x[:, :2], sim.radii)
    bottom = sim.box.planes(sim.time)[WALLS.index("bottom")]
    inside = geometry.cylinder_volume(
        x, sim.radii, plates.centre, plates.inner, low=bottom, high=bottom + height
    )
    return {
        "projected_area": area,
        "filling_factor": sim.volume / (area * height),
        "inner_filling_factor": inside / (np.pi * plates.inner**2 * height),
        "outside_count": plates.outside(x),
        "pressure": _pressure(sim, mean_force, area),
    }


def slab_volumes(z, radius, edges):
    """Volume of spheres (centres z, radius or (N,)) between successive `edges`, exact by caps."""
    if not len(z):
        return np.zeros(len(edges) - 1)
    slabs = len(edges) - 1
    # slabs that a sphere reaches: a few, however many there are
    first = np.maximum(np.searchsorted(edges, z - radius, side="right") - 1, 0)
    last = np.minimum(np.searchsorted(edges, z + radius, side="left"), slabs)
    slab = first[:, None] + np.arange(max(int((last - first).max()), 1))
    radius = np.reshape(radius, (-1, 1))
    # volume of a unit of sphere below a plane at height t of its centre, t in [-r, r]
    ends = edges[np.minimum(first[:, None] + np.arange(slab.shape[1] + 1), slabs)]
    t = np.clip(ends - z[:, None], -radius, radius)
    below = np.pi * (radius**2 * t - t**3 / 3.0 + 2.0 / 3.0 * radius**3)
    volume, inside = np.diff(below, axis=1), slab < slabs
    if slabs == 1:
        return volume.sum(axis=0)
    return np.bincount(slab[inside], volume[inside], slabs)


def bin_edges(clock, radius):
    """Edges of the profile bins above the bottom wall [um]: one grain diameter each (S12 Fig 5)."""
    bins = min(MAX_BINS, max(1, int(np.ceil(clock.height_at(clock.first) / (2.0 * radius) - 1e-9))))
    return 2.0 * radius * np.arange(bins + 1)


def profile(sim, clock, edges, time):
    """Filling factor in horizontal slices; not a number above the top wall. time: recorded."""
    bottom = sim.domain.room(sim.step)[WALLS.index("bottom")]
    height = clock.height_at(sim.step)
    x = positions(sim)
    inside = np.minimum(edges, height)
    volume = slab_volumes(x[:, 2] - bottom, sim.radii, inside) if len(x) else 0.0
    area = clock.area_at(sim.step)
    space = np.diff(inside) * area
    with np.errstate(invalid="ignore", divide="ignore"):
        phi = np.where(space > 1e-9 * area, volume / space, np.nan)
    return {
        "profile_time": time,
        "step": sim.step,
        "height": height,
        "box_filling_factor": clock.filling_factor_at(sim.step),
        "filling_factor": phi,
    }


def snapshot(sim, contacts, time):
    """Records of /snapshots and of the groups of contacts as (group, record) pairs.

    time: recorded.
    """
    x, v, w = grain_state(sim)
    record = {
        "snapshot_time": time,
        "step": sim.step,
        "position": x,
        "velocity": v,
        "spin": w,
    }
    if sim.layout.orientation:
        record["orientation"] = np.empty((sim.grains, 4))
        record["orientation"][sim.order] = sim.state["orientation"]
    if sim.layout.grain_loss:
        record["grain_loss"] = grain_losses(sim)
    out = [("snapshots", record)]
    if sim.box is not None or sim.cell is not None:
        record["box"] = sim.domain.room(sim.step)
        record["tilt"] = sim.domain.tilt(sim.step)
    if sim.sphere is not None:
        load = sim.sphere.load()
        record |= _sphere_motion(sim.sphere, load) | {"sphere_force": load[0]}
    if not contacts:
        return out
    records = {"contact": contact_state(sim)}
    if sim.box is not None:
        records["wall_contact"] = wall_contact_state(sim)
    if sim.sphere is not None:
        records["sphere_contact"] = sim.sphere.contacts()
    for name, columns in records.items():
        rows = record[f"{name}_count"] = len(columns["overlap"])
        out.append((f"{name}s", columns | {"step": np.full(rows, sim.step)}))
    return out
