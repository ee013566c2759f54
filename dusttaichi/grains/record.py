"""Records of the result file (SI) from a simulation (internal units)."""

from dataclasses import dataclass

import numpy as np

from dusttaichi import geometry, units
from dusttaichi.names import WALLS
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

    `start`: the measurement at step 0. The kinetic energy is m v(n-1/2).v(n+1/2)/2 here: its sum
    with the potential of linear springs leapfrog keeps exactly, however long the step, so that
    what is left over is what the step does not resolve.
    """
    losses = m["loss"].sum() + m["loss_wall"].sum()
    work = m["wall_work"] + m["face_work"] + m["push_work"]
    own = total_energy(m) - m["kinetic_kick"] - total_energy(start) + start["kinetic_kick"]
    residual = own - work + losses
    through = reference_energy(
        work,
        start["kinetic_translation"] + start["kinetic_rotation"],
        start["potential"].sum() + start["potential_wall"].sum(),
        losses,
    )
    return residual, residual / through if through > 0.0 else 0.0


def turnover(sim, m, start):
    """Residual of the ledger, and the energy that it is measured by [fJ].

    That is what has gone through the system, but no less than what its contacts of now bind where
    they are at rest (1.2 F_c delta0 each): where the first grains of a loose sample touch, or swing
    about in contacts that stood near pull-off, the start says little of the energies that change
    hands. Of unlike grains, what they bind now.
    """
    losses = np.abs(m["loss"] + m["loss_wall"]).sum()  # those that make energy must not cancel
    begun = start["potential"].sum() + start["potential_wall"].sum()
    through = reference_energy(
        m["wall_work"] + m["face_work"] + m["push_work"],
        start["kinetic_translation"] + start["kinetic_rotation"],
        begun,
        losses,
    )
    bound = -(m["potential"][0] + m["potential_wall"][0])
    if sim.bodies is None:
        bound = 0.3 * (sim.pair.U4 * m["contacts"] + sim.wall.U4 * m["wall_contacts"])
    return ledger(m, start)[0], through + max(0.0, bound - abs(begun))


@dataclass(frozen=True)
class Plates:
    """What is measured of a sample between plates, fixed at the start [um].

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


def wall_areas(sim):
    """Area of each wall now [um^2], (6,): of the room, or of the sample where it is open."""
    planes = sim.box.planes(sim.time)
    a, b, c = np.where(np.isnan(sim.lengths()), planes[1::2] - planes[0::2], sim.lengths())
    return np.array([b * c, b * c, a * c, a * c, a * b, a * b])


def stress(sim, before, span, start, lengths):
    """Virial stress [kPa], (3, 3), positive in tension (T19 eq 23): the mean over `span` [us].

    before: momentum flux at the start of the span, when the room had the lengths `start`.
    """
    volume = 0.5 * (np.prod(start) + np.prod(lengths))
    return -(sim.momentum_flux() - before) / (volume * span)


def series(sim, clock, m, start, mean_force, mean_stress, wall_clock, stage=None, plates=None):
    """One record of the time series. mean_force [nN], (6, 3): of the walls on the grains.

    mean_stress [kPa], (3, 3), or None where it is not measured.
    """
    residual, through = turnover(sim, m, start)
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
        "energy_residual_relative": residual / through if through > 0.0 else 0.0,
        "largest_overlap": m["largest_overlap"] * units.LENGTH,
        "largest_speed": m["largest_speed"] * units.SPEED,
        "wall_clock": wall_clock,
    }
    if stage is not None:
        record["stage"] = stage
    lengths = sim.lengths()
    if lengths[2] == lengths[2]:
        record["height"] = lengths[2] * units.LENGTH
    if clock.bounded:
        record["filling_factor"] = clock.filling_factor_at(sim.step)
    if sim.cell is not None:
        record["box_length"] = lengths * units.LENGTH
        record["face_work"] = m["face_work"] * units.ENERGY
    if sim.push.works:
        record["push_work"] = m["push_work"] * units.ENERGY
    if mean_stress is not None:
        record["stress"] = mean_stress * units.PRESSURE
    if sim.box is not None:
        record |= _walls(sim, m, mean_force)
    if plates is not None:
        record |= _between_plates(sim, plates, mean_force, lengths[2])
    return record


def _walls(sim, m, mean_force):
    inward = np.sum(mean_force * sim.box.normal, axis=1)
    return {
        "pressure": inward / wall_areas(sim) * units.PRESSURE,
        "wall_force": mean_force * units.FORCE,
        "wall_contact_count": m["wall_contacts"],
        "potential_wall": m["potential_wall"] * units.ENERGY,
        "loss_wall": m["loss_wall"] * units.ENERGY,
        "wall_work": m["wall_work"] * units.ENERGY,
    }


def _between_plates(sim, plates, mean_force, height):
    """Shadow of the grains, filling factor from it (S12 section 3.2), and that of PD08."""
    x, _, _ = sim.grain_state()
    area = geometry.union_area(x[:, :2], sim.radii)
    inward = np.sum(mean_force * sim.box.normal, axis=1)
    bottom = sim.box.planes(sim.time)[WALLS.index("bottom")]
    inside = geometry.cylinder_volume(
        x, sim.radii, plates.centre, plates.inner, low=bottom, high=bottom + height
    )
    return {
        "projected_area": area * units.LENGTH**2,
        "filling_factor": sim.volume / (area * height),
        "inner_filling_factor": inside / (np.pi * plates.inner**2 * height),
        "outside_count": plates.outside(x),
        "pressure": inward / area * units.PRESSURE,
    }


def slab_volumes(z, radius, edges):
    """Volume of spheres (centres z, one radius or (N,)) between successive `edges`: exact, by
    caps."""
    radius = radius[:, None] if np.ndim(radius) else radius
    # volume of a unit of sphere below a plane at height t of its centre, t in [-r, r]
    t = np.clip(edges[None, :] - z[:, None], -radius, radius)
    below = np.pi * (radius**2 * t - t**3 / 3.0 + 2.0 / 3.0 * radius**3)
    return np.diff(below, axis=1).sum(axis=0)


def bin_edges(clock, radius):
    """Edges of the profile bins above the bottom wall [um]: one grain diameter each (S12 Fig 5)."""
    bins = min(MAX_BINS, max(1, int(np.ceil(clock.height_at(clock.first) / (2.0 * radius) - 1e-9))))
    return 2.0 * radius * np.arange(bins + 1)


def profile(sim, clock, edges):
    """Filling factor in horizontal slices; not a number above the top wall."""
    bottom = room(sim)[WALLS.index("bottom")]
    height = clock.height_at(sim.step)
    x, _, _ = sim.grain_state()
    inside = np.minimum(edges, height)
    volume = slab_volumes(x[:, 2] - bottom, sim.radii, inside) if len(x) else 0.0
    area = clock.area_at(sim.step)
    space = np.diff(inside) * area
    with np.errstate(invalid="ignore", divide="ignore"):
        phi = np.where(space > 1e-9 * area, volume / space, np.nan)
    return {
        "profile_time": sim.time * units.TIME,
        "step": sim.step,
        "height": height * units.LENGTH,
        "box_filling_factor": clock.filling_factor_at(sim.step),
        "filling_factor": phi,
    }


def room(sim):
    """Coordinates of walls and faces now [um], (6,); not a number where there is neither."""
    planes = np.full(6, np.nan)
    if sim.box is not None:
        planes = np.where(sim.box.present == 1, sim.box.planes(sim.time), np.nan)
    if sim.cell is not None:
        low = sim.cell.low(sim.time)
        for n in sim.cell.axes:
            planes[2 * n : 2 * n + 2] = low[n], low[n] + sim.cell.edges(sim.time)[n]
    return planes


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
    if sim.box is not None or sim.cell is not None:
        record["box"] = room(sim) * units.LENGTH
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
