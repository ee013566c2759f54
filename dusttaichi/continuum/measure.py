"""Present energies of a continuum [SI], from which ledger and records are made, and its heat."""

import numpy as np

from dusttaichi.continuum.kernels.store import FACES, OLD
from dusttaichi.continuum.outside import evaluate
from dusttaichi.continuum.physics.elasticity import path_energy
from dusttaichi.method import Measurement
from dusttaichi.physics.forces.outside_work import split_work
from dusttaichi.results.roles import DUST, ELASTIC


def energies(sim):
    """Energies [J], losses by channel, extremes: a dict of numbers and arrays.

    Velocities in memory are half a step behind: the work of the present forces in the half step up
    to the present belongs to the losses and to the work of faces as well.
    """
    role, mass = sim.of_particles("role"), sim.of_particles("mass")
    v = sim.velocities()
    gives = (role == DUST) | (role == ELASTIC)
    speed2 = np.sum(v * v, axis=1)
    free = sim.of_particles("group") < 0
    kinetic = 0.5 * np.sum(mass[free] * speed2[free])
    speed, spin = sim.body_speeds()
    masses = sim.rigid("mass")[FACES:, 0]
    kinetic += 0.5 * np.sum(masses * np.sum(speed[FACES:] ** 2, axis=1))
    kinetic += 0.5 * np.sum(spin * sim.angular_momenta())
    at = np.concatenate([sim.of_particles("x")[free], sim.rigid("centre")[FACES:, sim.axes]])
    gravity = -np.concatenate([mass[free], masses]) @ (at @ sim.numbers["gravity"])
    gravity += attraction_energy(sim)
    elastic = elastic_of_particles(sim, gives).sum(axis=0)
    work, loss = sim.of_particles("work").sum(axis=0), sim.of_particles("loss").sum(axis=0)
    loss = loss + sim.rigid("loss").sum(axis=0) - half_step(sim, v, speed, spin)
    return {
        "kinetic": float(kinetic),
        "gravity_energy": float(gravity),
        "elastic_energy": float(elastic.sum()),
        "loss": np.array([*(work - elastic), *loss, against_artificial(sim, v)]),
        "work": face_work(sim),
        "forces": evaluate(sim)[1],
        "speed": float(np.sqrt(speed2.max())),
        "largest": largest(sim, role == DUST),
        "momentum": (mass[free] @ v[free]) + masses @ speed[FACES:],
        "angular_momentum": mass[free] @ np.cross(sim.raised(sim.of_particles("x"))[free], v[free])
        + masses @ np.cross(sim.rigid("centre")[FACES:], speed[FACES:])
        + sim.angular_momenta()[FACES:].sum(axis=0),
    }


def largest(sim, dust):
    """(phi_2, largest filling factor, largest without pressure) of the dust of each material."""
    density, compacted = sim.of_particles("density")[dust], sim.of_particles("reference")[dust]
    number = sim.of_particles("material")[dust] if sim.layout.materials else np.zeros(len(density))
    out = []
    for k, (phi_2, solid) in enumerate(zip(sim.materials.phi_2, sim.materials.rho_s, strict=True)):
        is_largest = number == k
        ends = (values[is_largest].max(initial=0.0) / solid for values in (density, compacted))
        out.append((float(phi_2), *map(float, ends)))
    return out


def attraction_energy(sim):
    """Energy of the particles in the field of each other [J]; 0 without self-gravity."""
    if not sim.layout.self_gravity:
        return 0.0
    sim.kernels.potential(sim.step_numbers())
    return 0.5 * sim.lists["potential"].to_numpy(sim.n).sum()


def elastic_of_particles(sim, gives):
    """Elastic energy of pressure in compression and in tension, and of the deviator [J].

    By deformable particle, (n, 3), in internal order: the energy of the path
    (physics.continuum.elasticity) and S:S/4mu per volume. In damaged dust the undamaged share
    stores tension and deviator.
    """
    density, reference = (sim.of_particles(name)[gives] for name in ("density", "reference"))
    volume = sim.of_particles("mass")[gives] / density
    K, ratio = sim.of_particles("modulus")[gives], sim.of_particles("shear_ratio")[gives]
    p, S = sim.of_particles("pressure")[gives], sim.of_particles("deviator")[gives]
    d = sim.dimension
    trace = S[:, :: d + 1].sum(axis=1)
    squares = np.sum(S * S, axis=1) + trace * trace
    of_pressure, undamaged_fraction = (
        volume * path_energy(density, reference, K),
        undamaged(sim)[gives],
    )
    return np.stack(
        [
            np.where(p >= 0.0, of_pressure, 0.0),
            np.where(p < 0.0, undamaged_fraction * of_pressure, 0.0),
            undamaged_fraction * volume * squares / (4.0 * ratio * K),
        ],
        axis=1,
    )


def undamaged(sim):
    """Share of each particle that carries tension and deviator, (n,), in internal order."""
    if not sim.layout.damage:
        return np.ones(sim.n)
    return 1.0 - sim.of_particles("damage") ** 3


def heat(sim, stored):
    """Heat of each particle [J], (n,), in internal order.

    Work of its stresses that is not stored, and energy dissipated by both viscosities, with the
    half step up to the present. stored: elastic energy of each at step 0 [J], in the order of the
    sample.
    """
    everything = np.ones(sim.n, bool)
    out = sim.of_particles("work").sum(axis=1) - elastic_of_particles(sim, everything).sum(axis=1)
    out += stored[sim.of_particles("number")] + sim.of_particles("warmed")
    return out + 0.5 * sim.clock[OLD] * sim.of_particles("heating")


def against_artificial(sim, v):
    """Work since the start [J] against artificial stress and the stiffness against hourglass modes.

    It includes the half step up to the present, and is 0 where there is neither. Much of it is
    returned.
    """
    if "taken" not in sim.tables:
        return 0.0
    half, mean = 0.5 * sim.clock[OLD], 0.5 * (sim.raised(sim.of_particles("v")) + v)
    last = half * np.sum(sim.raised(sim.of_particles("pushing")) * mean)
    return float(sim.of_particles("taken").sum() - last)


def half_step(sim, v, speed, spin):
    """Work of both viscosities in the half step up to the present [J], (2,).

    v: present velocities; speed, spin: of faces and rigid bodies.
    """
    half = 0.5 * sim.clock[OLD]
    mean = 0.5 * (sim.raised(sim.of_particles("v")) + v)
    speed, spin = 0.5 * (sim.rigid("speed") + speed), 0.5 * (sim.rigid("spin") + spin)
    drags = sim.rigid("drags")
    by_pairs = np.array([0.0, half * sim.of_particles("noise_power").sum()])
    return -by_pairs + np.array(
        [
            half * np.sum(sim.raised(sim.of_particles(name)) * mean)
            + half * np.sum(drags[:, column : column + 3] * speed)
            + half * np.sum(drags[:, column + 3 : column + 6] * spin)
            for name, column in (("viscous", 0), ("grid_force", 6))
        ]
    )


def face_work(sim):
    """Work of moving faces on the dust since the start [J]."""
    half = 0.5 * sim.clock[OLD]
    last = half * np.sum(sim.rigid("force")[:FACES] * sim.rigid("speed")[:FACES])
    return float(sim.rigid("work")[:FACES].sum() - last)


def measurement(sim, start, forces):
    """The present Measurement [J].

    start, forces: `loss` and `forces` of the energies at step 0, which count as 0.
    """
    m = energies(sim)
    works, lost = split_work(sim.layout.forces, m.pop("forces") - forces)
    m["force_work"] = float(sum(works.values()))
    losses = np.append(m["loss"] - start, list(lost.values()))
    potential = m["gravity_energy"] + m["elastic_energy"]
    return Measurement.from_energies(
        m["kinetic"],
        potential,
        losses,
        work=m["work"] + m["force_work"],
        parts=m | {"loss": losses},
    )


def elastic_momenta(sim, sample):
    """Present momenta of the elastic bodies of a sample [kg m/s], (bodies, 3)."""
    members = _of_elastic(sim, sample)
    if not members:
        return np.zeros((0, 3))
    mass, v = sim.of_particles("mass"), sim.velocities()
    return np.array([mass[body] @ v[body] for body in members])


def elastic_bodies(sim, sample):
    """Present centre [m], velocity [m/s] and spin [rad/s] of the elastic bodies of a sample.

    (bodies, 3) each, as a tuple.
    """
    numbers = _of_elastic(sim, sample)
    values = np.zeros((3, len(numbers), 3))
    if not numbers:
        return tuple(values)
    x, v, mass = sim.raised(sim.of_particles("x")), sim.velocities(), sim.of_particles("mass")
    for row, number in enumerate(numbers):
        m = mass[number]
        centre, velocity = m @ x[number] / m.sum(), m @ v[number] / m.sum()
        r = x[number] - centre
        inertia = m @ np.sum(r * r, axis=1) * np.eye(3) - r.T @ (m[:, None] * r)
        turning = m @ np.cross(r, v[number] - velocity)
        values[:, row] = centre, velocity, np.linalg.pinv(inertia) @ turning
    return tuple(values)


def _of_elastic(sim, sample):
    """Numbers of the particles of each elastic body of a sample, in internal order: a list."""
    numbers = [k for k, body in enumerate(sample.bodies) if body.elastic]
    label = sample.body[sim.of_particles("number")] if numbers else None
    return [np.flatnonzero(label == k) for k in numbers]


class Warming:
    """Heat of the dust of a Simulation `sim`, counted from its step 0."""

    def __init__(self, scene, sample, sim):
        self.sim = sim
        everything = np.ones(sim.n, bool)
        self._stored = sim.in_order(elastic_of_particles(sim, everything).sum(axis=1))
        capacity, start = (
            np.array([getattr(material, name) for material in scene.all_materials])
            for name in ("heat_capacity", "temperature")
        )
        self._dust = sample.role == DUST
        self._capacity = sample.mass * capacity[sample.material]
        self._start = start[sample.material]

    def snapshot(self):
        """Temperatures [K] in the order of the sample; not a number of what is not dust."""
        rise = self.sim.in_order(heat(self.sim, self._stored)) / self._capacity
        return {"temperature": np.where(self._dust, self._start + rise, np.nan)}

    def series(self):
        """Heat of the dust [J], its temperature [K]: mean over the heat capacity, largest."""
        dust, capacity = self._dust, self._capacity[self._dust]
        energy = self.sim.in_order(heat(self.sim, self._stored))[dust]
        temperature = self._start[dust] + energy / capacity
        return {
            "heat": float(energy.sum()),
            "temperature_mean": float(np.average(temperature, weights=capacity)),
            "largest_temperature": float(temperature.max()),
        }
