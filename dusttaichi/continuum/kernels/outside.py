"""Forces from outside on particles of dust and elastic bodies: solved with a kick, work summed.

A kick lasts half of the last step and half of the next one; a force that depends on the velocity
acts at the mean of those before and after it.
"""

from math import pi

from dusttaichi.compute.engine import ti
from dusttaichi.continuum.kernels.store import DT, OLD, SUBSTEPS, TIME
from dusttaichi.physics.forces.model import Forces
from dusttaichi.results.roles import DUST, ELASTIC

ENERGIES = 3  # columns of `force_now`: acceleration, then potentials, then energies of half a step
SHORTEST = 1e-30  # least `dt` of a particle [s]: a kick of length 0 forms the stresses


@ti.data_oriented
class Outside:
    """Forces from outside on a particle; rigid: kernels.rigid.Rigid, which knows the axes."""

    def __init__(self, fields, lists, layout, rigid):
        self.f, self.lists, self.rigid, self.model = fields, lists, rigid, layout.forces
        self.laws = Forces(layout.forces, lists.forces, 0)
        self.first_power = ENERGIES + len(layout.forces.potentials)

    @ti.func
    def particle(self, i):
        """Struct of particle i with its velocity in memory; it has no spin."""
        mass = self.f.mass[i]
        radius = (0.75 / pi * mass / self.f.density[i]) ** (1.0 / 3.0)
        charge = ti.cast(0.0, ti.f64)
        if ti.static(self.model.charged):
            charge = self.f.charge[i]
        kick = 0.5 * (self.f.clock[OLD] + self.f.clock[DT])
        return ti.Struct(
            position=self.rigid.raise_to_space(self.f.x[i]),
            velocity=self.rigid.raise_to_space(self.f.v[i]),
            spin=ti.Vector.zero(ti.f64, 3),
            mass=mass,
            inertia=0.4 * mass * radius**2,
            radius=radius,
            charge=charge,
            script_force=ti.Vector.zero(ti.f64, 3),
            time=self.f.clock[TIME],
            dt=ti.max(kick, SHORTEST),
            number=self.f.number[i],
            step=ti.cast(self.f.clock[SUBSTEPS], ti.i64),
        )

    @ti.func
    def kick(self, i, change, duration):
        """Change of velocity of particle i in a kick, beside that by everything else; sums work."""
        at, zero = self.particle(i), ti.Vector.zero(ti.f64, 3)
        velocity_before, by_others = at.velocity, self.rigid.raise_to_space(change)
        linear, _ = self.laws.solve(at, 0.5 * by_others, zero, 0.5 * duration)
        mean = velocity_before + 0.5 * (by_others + duration * linear)
        for k in ti.static(range(len(self.model.powers))):
            power = self.laws.power(k, at, mean, zero)
            self.f.force_work[i][k] = self.f.force_work[i][k] + duration * power
        return duration * self.rigid.flat(linear)

    @ti.func
    def note(self, i):
        """Write the acceleration, energies and pending work of particle i to `force_now`."""
        for k in ti.static(range(self.first_power + len(self.model.powers))):
            self.lists.force_now[i, k] = 0.0
        role = self.f.role[i]
        if role == DUST or role == ELASTIC:
            half, zero = 0.5 * self.f.clock[OLD], ti.Vector.zero(ti.f64, 3)
            at = self.particle(i)
            velocity_before, change = (
                at.velocity,
                half / at.mass * self.rigid.raise_to_space(self.f.force[i]),
            )
            linear, _ = self.laws.solve(at, change, zero, half)
            mean = velocity_before + 0.5 * (change + half * linear)
            for k in ti.static(range(3)):
                self.lists.force_now[i, k] = linear[k]
            for k in ti.static(range(len(self.model.potentials))):
                self.lists.force_now[i, ENERGIES + k] = self.laws.potential(k, at)
            for k in ti.static(range(len(self.model.powers))):
                power = self.laws.power(k, at, mean, zero)
                self.lists.force_now[i, self.first_power + k] = half * power


def make_evaluate_forces(outside, StepNumbers):
    """Kernel `evaluate_forces(numbers)`: fills `force_now`."""

    @ti.kernel
    def evaluate_forces(numbers: StepNumbers):
        for i in range(numbers.count):
            outside.note(i)

    return evaluate_forces
