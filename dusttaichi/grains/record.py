"""Records of the result file in internal units: the run converts them to SI."""

from dataclasses import dataclass

import numpy as np

from dusttaichi import units
from dusttaichi.grains.features import count_first_body, has_profiles
from dusttaichi.physics import geometry
from dusttaichi.physics.geometry import WALLS
from dusttaichi.results.variables import CHOSEN

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


def stress(previous, current, span):
    """Virial stress, (3, 3), positive in tension (T19 eq 23): the mean over `span`.

    before, after: sums (lengths, flux) at the ends of the span.
    """
    volume = 0.5 * (np.prod(previous["lengths"]) + np.prod(current["lengths"]))
    return -(current["flux"] - previous["flux"]) / (volume * span)


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


class GrainRecorder:
    """Makes the records of a series, of profiles and of snapshots.

    motion: Motion. contacts: Contacts. sphere: MovingSphere, or None. kernel_sums: KernelSums.
    ledger: Ledger. scene, sample: that it was started from. variables: of the result, of which
    loads of contacts are taken apart. plates: Plates, or None. edges: of the bins of profiles [um],
    or None.
    """

    def __init__(self, motion, contacts, sphere, kernel_sums, ledger, *, scene, sample, variables):
        self._motion, self._contacts, self._sphere = motion, contacts, sphere
        self._kernel_sums, self._ledger = kernel_sums, ledger
        self._bodies, self._environment = motion.bodies, motion.environment
        domain, radius = self._environment.domain, self._bodies.radius
        self.plates = plates_of(scene.boundary, sample, radius)
        self.edges = bin_edges(domain.clock(), radius) if has_profiles(scene, domain) else None
        self._first = count_first_body(scene, sample)  # wherever its grains go
        self._names = {group: set() for group in CHOSEN}  # of the variables of frames
        for variable in variables:
            self._names.get(variable.group, set()).add(variable.name)

    # -- series ----------------------------------------------------------------------------------

    def make_series(self, m, window):
        """Variables that the grains add to a record of the time series.

        m: result of Ledger.measure_energies. window: Window of sums, None at step 0: then walls act
        with the force of that moment, and there is no stress yet.
        """
        domain, step = self._environment.domain, self._environment.step
        record = m | {
            "coordination_number": 2.0 * m["contacts"] / self._bodies.count,
            "contact_count": m["contacts"],
            "wall_contact_count": m["wall_contacts"],
            "sphere_contact_count": m["sphere_contacts"],
        }
        if domain.there:
            record["shear_strain"] = domain.shear_strain(step)
        else:
            record |= self._sum_momenta()
        if self._sphere is not None:
            record |= self._record_sphere(m["sphere_load"], window)
        record |= self.average_loads(window)
        if domain.box is not None and self.plates is not None:
            record |= self._measure_between_plates(record["wall_force"])
        return record if self._first is None else record | self._measure_bodies()

    def average_loads(self, window):
        """Stress, forces of the walls and pressures on them over a Window; see `make_series`."""
        record = {}
        if self._motion.state.layout.stress:
            record["stress"] = np.zeros((3, 3)) if window is None else stress(*window)
        if self._environment.box is not None:
            force = self._ledger.sums.wall_force if window is None else window.mean("impulse")
            areas = self._environment.domain.wall_areas(self._environment.step)
            record |= {"pressure": self._pressure(force, areas), "wall_force": force}
            if self._environment.domain.surfaces is not None:
                record |= self._average_surfaces(window)
        return record

    def _average_surfaces(self, window):
        """Means of the loads of the surfaces, and of a tube over its area."""
        if window is None:
            loads = self._kernel_sums.surface_loads()
        else:
            loads = window.mean("surface_impulse")
        domain, step = self._environment.domain, self._environment.step
        surfaces = domain.surfaces
        along = np.sum(loads[:, :3] * surfaces.directions, axis=1)
        areas = [domain.surface_area(n, step) for n in range(len(surfaces))]
        record = {
            "surface_force": loads[:, :3],
            "surface_pressing": loads[:, 3],
            "surface_load": along,
            "surface_pressure": along / np.array(areas),
            "surface_displacement": surfaces.displacements(self._environment.time),
        }
        if not domain.is_round:
            return record
        height, radius = (
            self._environment.lengths()[2],
            domain.surfaces.tube_radius(self._environment.time),
        )
        area, tube = 2.0 * np.pi * radius * height, loads[domain.surfaces.tube]
        return record | {"tube_pressure": tube[3] / area, "tube_friction": tube[2] / area}

    def _pressure(self, mean_force, areas):
        """Pressure on each wall, (6,); not a number where there is none."""
        box = self._environment.box
        inward = np.sum(mean_force * box.normal, axis=1)
        return np.where(box.present == 1, inward / areas, np.nan)

    def _measure_bodies(self):
        """Centres of mass, velocities and angular momenta of two bodies, (2, 3) each.

        Angular momenta are about the centres.
        """
        x, v, w = self._motion.measure()
        mass, inertia = self._motion.masses_and_inertias()
        centres, velocities, spins = [], [], []
        for grains in (slice(0, self._first), slice(self._first, None)):
            weight = mass[grains] / mass[grains].sum()
            centre, velocity = (np.sum(weight * a[grains], axis=0) for a in (x, v))
            momenta = mass[grains] * (v[grains] - velocity)
            spin = np.cross(x[grains] - centre, momenta) + inertia[grains] * w[grains]
            centres.append(centre)
            velocities.append(velocity)
            spins.append(spin.sum(axis=0))
        return {
            "body_position": np.array(centres),
            "body_velocity": np.array(velocities),
            "body_angular_momentum": np.array(spins),
        }

    def _record_sphere(self, load, window):
        """Record of the rigid sphere: motion, mean load; load: now."""
        mean = np.concatenate(load) if window is None else window.mean("sphere_impulse")
        motion = self._record_sphere_motion(load)
        return motion | {"sphere_force": mean[:3], "sphere_torque": mean[3:]}

    def _record_sphere_motion(self, load):
        x, v, w = self._sphere.measure_motion(load)
        return {"sphere_position": x, "sphere_velocity": v, "sphere_spin": w}

    def _sum_momenta(self):
        """Momentum and angular momentum about the origin of all grains and the sphere, (3,)."""
        x, v, w = self._motion.measure()
        mass, inertia = self._motion.masses_and_inertias()
        momentum = mass * v
        angular = np.cross(x, momentum).sum(axis=0) + (inertia * w).sum(axis=0)
        momentum = momentum.sum(axis=0)
        if (sphere := self._sphere) is not None:
            x, v, w = sphere.measure_motion()
            momentum = momentum + sphere.mass * v
            angular = angular + sphere.mass * np.cross(x, v) + sphere.inertia * w
        return {"momentum": momentum, "angular_momentum": angular}

    def _measure_between_plates(self, mean_force):
        """Shadow of the grains, filling factor from it (S12 section 3.2), and that of PD08."""
        x, radii, plates = self._motion.measure_positions(), self._bodies.radii, self.plates
        height = self._environment.lengths()[2]
        area = geometry.union_area(x[:, :2], radii)
        bottom = self._environment.box.planes(self._environment.time)[WALLS.index("bottom")]
        inside = geometry.cylinder_volume(
            x, radii, plates.centre, plates.inner, low=bottom, high=bottom + height
        )
        return {
            "projected_area": area,
            "filling_factor": self._bodies.volume / (area * height),
            "inner_filling_factor": inside / (np.pi * plates.inner**2 * height),
            "outside_count": plates.outside(x),
            "pressure": self._pressure(mean_force, area),
        }

    # -- profiles and snapshots ------------------------------------------------------------------

    def make_profile(self, clock, time):
        """Filling factor in horizontal slices; not a number above the top wall. time: recorded."""
        step = self._environment.step
        bottom = self._environment.domain.room(step)[WALLS.index("bottom")]
        height, x = clock.height_at(step), self._motion.measure_positions()
        edges = np.minimum(self.edges, height)
        volume = slab_volumes(x[:, 2] - bottom, self._bodies.radii, edges) if len(x) else 0.0
        area = clock.area_at(step)
        space = np.diff(edges) * area
        with np.errstate(invalid="ignore", divide="ignore"):
            phi = np.where(space > 1e-9 * area, volume / space, np.nan)
        return {
            "profile_time": time,
            "step": step,
            "height": height,
            "box_filling_factor": clock.filling_factor_at(step),
            "filling_factor": phi,
        }

    def make_snapshot(self, with_contacts, time):
        """Records of /snapshots and of the groups of contacts as (group, record) pairs.

        time: recorded.
        """
        state, environment = self._motion.state, self._environment
        x, v, w = self._motion.measure()
        record = {
            "snapshot_time": time,
            "step": environment.step,
            "position": x,
            "velocity": v,
            "spin": w,
        }
        if state.layout.orientation:
            record["orientation"] = np.empty((self._bodies.count, 4))
            record["orientation"][state.order] = state["orientation"]
        if state.layout.grain_loss:
            record["grain_loss"] = self._kernel_sums.grain_losses()
        groups = [("snapshots", record)]
        if environment.domain.there:
            record["box"] = environment.domain.room(environment.step)
            record["tilt"] = environment.domain.tilt(environment.step)
        if self._sphere is not None:
            load = self._sphere.load()
            record |= self._record_sphere_motion(load) | {"sphere_force": load[0]}
        if not with_contacts:
            return groups
        for name, contacts in self._measure_contacts():
            rows = record[f"{name}_count"] = len(contacts["overlap"])
            groups.append((f"{name}s", contacts | {"step": np.full(rows, environment.step)}))
        return groups

    def _measure_contacts(self):
        """(name, contacts now) of each kind of contact that there is."""
        yield "contact", self._contacts.measure_pairs(self._names["contacts"])
        if self._environment.box is not None:
            yield "wall_contact", self._contacts.measure_walls(self._names["wall_contacts"])
        if self._sphere is not None:
            radius, names = self._sphere.radius, self._names["sphere_contacts"]
            yield "sphere_contact", self._contacts.measure_sphere(radius, names)
