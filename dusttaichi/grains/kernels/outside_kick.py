"""Forces from outside on grains and sphere: solved with the kick of a step, and their work summed.

The field `forces` begins with the numbers that `EQUAL` names, then has those of equal grains and of
the sphere (BODY), then the numbers of the laws. A force that depends on the velocity acts at that
of the positions, which is half a step behind the one that the kick begins with (`Forces.solve`).
"""

from types import SimpleNamespace

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


def make_forces(fields, layout):
    """Functions for the forces on grains and sphere; None in a scene without any.

    `of_grain(g, step)`: struct of a grain with its velocity and spin in memory, `of_sphere(step)`;
    `weight_of(g)`: 1, or 0 of a grain that is carried, `weight_of_sphere()`;
    `solve(at, weight, kick, turn, half)`: accelerations (physics.forces.model) times the weight;
    `accelerate(g, at, weight, velocity, spin, kick, turn, dt)`: velocity and spin after a step, of
    those that all other loads lead to by twice kick and turn; the work is added to its sums.
    """
    model = layout.forces
    if not model:
        return None
    table, sums = fields["forces"], fields.get("force_work")
    x, v, w, counts = fields["x"], fields["v"], fields["w"], fields["counts"]
    dtype = layout.geometry
    masses, inertias, radii = (fields.get(name) for name in ("mass", "inertia", "radius"))
    charges, scripted = fields.get("charge"), fields.get("script_force")
    free, body, forces = fields.get("free"), fields.get("sphere_body"), Forces(model, table, LAWS)

    @ti.func
    def struct_of(body, step, mass, inertia, radius):
        charge, script = ti.cast(0.0, ti.f64), ti.Vector.zero(ti.f64, 3)
        if ti.static(model.charged):
            charge = charges[body]
        if ti.static(model.scripted):
            script = scripted[body]
        return ti.Struct(
            position=ti.cast(x[body], ti.f64),
            velocity=ti.cast(v[body], ti.f64),
            spin=ti.cast(w[body], ti.f64),
            mass=mass,
            inertia=inertia,
            radius=radius,
            charge=charge,
            script_force=script,
            time=table[START] + table[STEP] * ti.cast(step, ti.f64),
            dt=table[STEP],
            number=body,
            step=step,
        )

    @ti.func
    def of_grain(g, step):
        mass, inertia, radius = table[GRAIN], table[GRAIN + 1], table[GRAIN + 2]
        if ti.static(layout.polydisperse):
            mass, inertia, radius = masses[g], inertias[g], radii[g]
        return struct_of(g, step, mass, inertia, radius)

    @ti.func
    def of_sphere(step):
        row = counts[GRAINS] + SPHERE
        return struct_of(
            row, step, table[SPHERE_BODY], table[SPHERE_BODY + 1], table[SPHERE_BODY + 2]
        )

    @ti.func
    def weight_of(g):
        weight = ti.cast(1.0, ti.f64)
        if ti.static(layout.carried):
            weight = free[g]
        return weight

    @ti.func
    def weight_of_sphere():
        return ti.select(body[0] > 0.0, ti.cast(1.0, ti.f64), 0.0)

    @ti.func
    def solve(at: ti.template(), weight, kick, turn, half):
        linear, angular = forces.solve(at, kick, turn, half)
        if ti.static(layout.carried or layout.sphere):
            linear, angular = weight * linear, weight * angular
        return linear, angular

    @ti.func
    def accelerate(g, at: ti.template(), weight, velocity, spin, kick, turn, dt):
        linear, angular = solve(at, weight, kick, turn, 0.5 * dt)
        faster = velocity + ti.cast(dt, dtype) * ti.cast(linear, dtype)
        turned = spin + ti.cast(dt, dtype) * ti.cast(angular, dtype)
        if ti.static(bool(model.powers)):
            mean, turning, span = 0.5 * (v[g] + faster), 0.5 * (w[g] + turned), weight * dt
            for k in ti.static(range(len(model.powers))):
                sums[g, k] = sums[g, k] + span * forces.power(k, at, mean, turning)
        return faster, turned

    weights = {"weight_of": weight_of, "weight_of_sphere": weight_of_sphere}
    particles = {"of_grain": of_grain, "of_sphere": of_sphere}
    return SimpleNamespace(laws=forces, solve=solve, accelerate=accelerate, **particles, **weights)
