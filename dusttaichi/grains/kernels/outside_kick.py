"""Forces from outside on grains and sphere: solved with the kick of a step, and their work summed.

The field `forces` begins with the numbers that `EQUAL` names, then has those of equal grains and of
the sphere (BODY), then the numbers of the laws. A force that depends on the velocity acts at that
of the positions, which is half a step behind the one that the kick begins with (`Forces.solve`).
"""

from dusttaichi.compute.engine import ti
from dusttaichi.grains.kernels.store import GRAINS, SPHERE
from dusttaichi.physics.forces.model import Forces

START, STEP = range(2)  # time of step 0, length of a step
GRAIN, SPHERE_BODY = (
    2,
    5,
)  # first of mass, moment of inertia and radius of equal grains, and of the sphere
LAWS = 8  # first number of the laws
# columns of `force_now`: accelerations and angular ones of the present, then potential energies,
# then energies of half a step by the powers that are summed
ACCELERATION, TURNING, ENERGIES = 0, 3, 6


def place_forces(particles, layout):
    """Scratch of the measurements, for that many particles."""
    model = layout.forces
    columns = ENERGIES + len(model.potentials) + len(model.powers)
    return {"force_now": ti.field(ti.f64, shape=(particles, columns))}


@ti.data_oriented
class OutsideKick:
    """Forces from outside on grains and sphere.

    Arguments: at, struct of a particle (scene.forces); weight: 0 of one that is carried or driven.
    """

    def __init__(self, fields, layout):
        self.layout, self.model, self.table = layout, layout.forces, fields.get("forces")
        self.laws = Forces(self.model, self.table, LAWS)
        self.x, self.v, self.w, self.counts = (fields[name] for name in ("x", "v", "w", "counts"))
        self.masses, self.inertias = fields.get("mass"), fields.get("inertia")
        self.radii, self.charges = fields.get("radius"), fields.get("charge")
        self.scripted, self.work = fields.get("script_force"), fields.get("force_work")
        self.free, self.sphere_body = fields.get("free"), fields.get("sphere_body")

    @ti.func
    def struct_of(self, body, step, mass, inertia, radius):
        charge, script = ti.cast(0.0, ti.f64), ti.Vector.zero(ti.f64, 3)
        if ti.static(self.model.charged):
            charge = self.charges[body]
        if ti.static(self.model.scripted):
            script = self.scripted[body]
        return ti.Struct(
            position=ti.cast(self.x[body], ti.f64),
            velocity=ti.cast(self.v[body], ti.f64),
            spin=ti.cast(self.w[body], ti.f64),
            mass=mass,
            inertia=inertia,
            radius=radius,
            charge=charge,
            script_force=script,
            time=self.table[START] + self.table[STEP] * ti.cast(step, ti.f64),
            dt=self.table[STEP],
            number=body,
            step=step,
        )

    @ti.func
    def of_grain(self, grain, step):
        """Struct of a grain with its velocity and spin in memory."""
        mass, inertia, radius = self.table[GRAIN], self.table[GRAIN + 1], self.table[GRAIN + 2]
        if ti.static(self.layout.polydisperse):
            mass, inertia, radius = self.masses[grain], self.inertias[grain], self.radii[grain]
        return self.struct_of(grain, step, mass, inertia, radius)

    @ti.func
    def of_sphere(self, step):
        """Struct of the sphere."""
        mass, inertia = self.table[SPHERE_BODY], self.table[SPHERE_BODY + 1]
        row, radius = self.counts[GRAINS] + SPHERE, self.table[SPHERE_BODY + 2]
        return self.struct_of(row, step, mass, inertia, radius)

    @ti.func
    def weight_of(self, grain):
        weight = ti.cast(1.0, ti.f64)
        if ti.static(self.layout.carried):
            weight = self.free[grain]
        return weight

    @ti.func
    def weight_of_sphere(self):
        return ti.select(self.sphere_body[0] > 0.0, ti.cast(1.0, ti.f64), 0.0)

    @ti.func
    def solve(self, at: ti.template(), weight, kick, turn, half):
        """Accelerations (physics.forces.model) times the weight."""
        linear, angular = self.laws.solve(at, kick, turn, half)
        if ti.static(self.layout.carried or self.layout.sphere):
            linear, angular = weight * linear, weight * angular
        return linear, angular

    @ti.func
    def accelerate(self, particle, at: ti.template(), weight, velocity, spin, kick, turn, dt):
        """Velocity and spin after a step; the work is added to the sums of the particle.

        velocity, spin: those that all other loads lead to by twice kick and turn.
        """
        dtype = self.layout.geometry
        linear, angular = self.solve(at, weight, kick, turn, 0.5 * dt)
        faster = velocity + ti.cast(dt, dtype) * ti.cast(linear, dtype)
        turned = spin + ti.cast(dt, dtype) * ti.cast(angular, dtype)
        if ti.static(bool(self.model.powers)):
            span = weight * dt
            mean, turning = 0.5 * (self.v[particle] + faster), 0.5 * (self.w[particle] + turned)
            for k in ti.static(range(len(self.model.powers))):
                power = self.laws.power(k, at, mean, turning)
                self.work[particle, k] = self.work[particle, k] + span * power
        return faster, turned
