"""Numbers of each particle of a continuum in the sums that a device forms (kernels.sum_launches).

The host forms the same from copies of the fields (continuum.particle_sums).
"""

from dusttaichi.compute.device_blocks import THREADS, pad_to_blocks
from dusttaichi.compute.engine import ti
from dusttaichi.continuum.kernels.outside import ENERGIES
from dusttaichi.continuum.kernels.store import (
    BODIES,
    COLUMN,
    FACES,
    FREE,
    MATERIALS,
    OLD,
    Column,
    Columns,
)
from dusttaichi.continuum.kernels.tensor_rows import ROW_OF_COMPONENT
from dusttaichi.continuum.physics.kernels import laws_of
from dusttaichi.results.roles import DUST, ELASTIC

MOTION = Columns(
    [
        Column("kinetic", "kinetic energy of free particles", "J", 1),
        Column("momentum", "momentum of free particles", "kg m/s", 3),
        Column("moment", "mass of free particles times place", "kg m", 3),
        Column("angular_momentum", "angular momentum of free particles", "kg m^2/s", 3),
        Column("viscous", "power of the viscous forces", "W", 1),
        Column("grid_force", "power of the forces on grid noise", "W", 1),
        Column("noise_power", "power by pairs that grid noise loses", "W", 1),
        Column("pushing", "power of the forces of the method", "W", 1),
        Column("taken", "work against them so far", "J", 1),
    ]
)
STORED = Columns(
    [
        Column("elastic", "elastic energies, see dust_measure.elastic_of_particles", "J", 3),
        Column("work", "work of the stresses so far", "J", 3),
        Column("loss", "work of both viscosities so far", "J", 2),
        Column("heat", "heat of the dust", "J", 1),
        Column("attraction", "twice the energy of self-gravity", "J", 1),
        Column("mass", "mass of the dust", "kg", 1),
        Column("volume", "volume of the dust", "m^3", 1),
        Column("pressure", "volume of the dust times pressure", "J", 1),
        Column("deviator", "volume of the dust times deviator", "J", 6),
        Column("filling", "mass of the dust times filling factor", "kg", 1),
        Column("damaged", "mass of the damaged dust", "kg", 1),
    ]
)
BODY = Columns(
    [
        Column("momentum", "momentum", "kg m/s", 3),
        Column("moment", "mass times place", "kg m", 3),
        Column("mass", "mass", "kg", 1),
        Column("second", "mass times xx yy zz xy xz yz about the centre", "kg m^2", 6),
        Column("turning", "angular momentum about the centre", "kg m^2/s", 3),
    ]
)
SECOND = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # axes of the numbers of `second`
FIRST_PASS = 7  # numbers of BODY before those about the centre
MAXIMA = 2  # before those of materials: square of a speed, temperature
HEAT = 3  # constants of a particle, by its number in the sample: energy stored at the start [J],
# capacity [J/K], temperature at the start [K]
BODY_MOTION = 6  # velocity and spin of a face or rigid body
AT_ONCE = 16  # elastic bodies of a launch


def count_totals(layout):
    """(Sums, maxima) of a layout."""
    materials = MATERIALS if layout.materials else 1
    return MOTION.count + STORED.count + count_forces(layout), MAXIMA + 2 * materials


def count_forces(layout):
    """Potentials and powers of the forces from outside."""
    return len(layout.forces.potentials) + len(layout.forces.powers)


def place_sums(layout, room):
    """Scratch fields of the sums by name; room: capacity in particles."""
    blocks, totals = pad_to_blocks(room) // THREADS, sum(count_totals(layout))
    lists = {
        "totals": (ti.f64, (totals,)),
        "partials": (ti.f64, (blocks, totals)),
        "body_motion": (ti.f64, (FACES + BODIES, BODY_MOTION)),
        "solid": (ti.f64, (MATERIALS,)),
        "label": (ti.i32, (room,)),
        "body_sums": (ti.f64, (AT_ONCE, BODY.count)),
    }
    if layout.heat:
        lists["heat_constants"] = (ti.f64, (room, HEAT))
    return {name: ti.field(dtype, shape=shape) for name, (dtype, shape) in lists.items()}


@ti.data_oriented
class ParticleNumbers:
    """Numbers of a particle in the sums; rigid: kernels.rigid.Rigid."""

    def __init__(self, fields, lists, layout, rigid):
        self.f, self.lists, self.layout, self.rigid = fields, lists, layout, rigid
        self.laws, self.n = laws_of(layout.laws), layout.dimension
        self.row_of_component = tuple(ROW_OF_COMPONENT[self.n].items())
        self.sums, self.maxima = count_totals(layout)
        self.materials, self.forces = (self.maxima - MAXIMA) // 2, count_forces(layout)
        self.powers = len(layout.forces.powers)

    @ti.func
    def place(self, i):
        return self.rigid.raise_to_space(self.f.x[i])

    @ti.func
    def of_body(self, row, begin: ti.template()):
        """Three numbers of the present motion of a face or rigid body."""
        return ti.Vector([self.lists.body_motion[row, begin + a] for a in ti.static(range(3))])

    @ti.func
    def velocity(self, i):
        """Present velocity, half a step after that in memory."""
        half, out = 0.5 * self.f.clock[OLD], self.rigid.raise_to_space(self.f.v[i])
        group = self.f.group[i]
        if group == FREE:
            kick = half / self.f.mass[i] * self.f.force[i]
            if ti.static(bool(self.layout.forces)):
                linear = ti.Vector([self.lists.force_now[i, a] for a in ti.static(range(3))])
                kick += half * self.rigid.flat(linear)
            out += self.rigid.raise_to_space(kick)
        if ti.static(self.layout.bodies):
            if group >= FACES:
                arm = self.place(i) - self.rigid.vector(group, COLUMN.centre)
                spin = self.of_body(group, 3)
                speed = self.of_body(group, 0)
                out = speed + spin.cross(arm)
        return out

    @ti.func
    def motion(self, i):
        """Numbers of MOTION."""
        out, mass = ti.Vector.zero(ti.f64, MOTION.count), self.f.mass[i]
        v = self.velocity(i)
        if self.f.group[i] < 0:
            x = self.place(i)
            turning = x.cross(v)
            out[MOTION.kinetic] = 0.5 * mass * v.dot(v)
            for a in ti.static(range(3)):
                out[MOTION.momentum + a] = mass * v[a]
                out[MOTION.moment + a] = mass * x[a]
                out[MOTION.angular_momentum + a] = mass * turning[a]
        mean = self.rigid.flat(0.5 * (self.rigid.raise_to_space(self.f.v[i]) + v))
        out[MOTION.viscous] = self.f.viscous[i].dot(mean)
        out[MOTION.grid_force] = self.f.grid_force[i].dot(mean)
        out[MOTION.noise_power] = self.f.noise_power[i]
        if ti.static(self.layout.artificial):
            out[MOTION.pushing] = self.f.pushing[i].dot(mean)
            out[MOTION.taken] = self.f.taken[i]
        return out

    @ti.func
    def undamaged(self, i):
        """Share of a particle that carries tension and deviator."""
        out = ti.cast(1.0, ti.f64)
        if ti.static(self.layout.damage):
            out = self.laws.undamaged_fraction(self.f.damage[i])
        return out

    @ti.func
    def deviator(self, i):
        """xx yy zz xy xz yz of the deviator of a particle."""
        S, out = self.f.deviator[i], ti.Vector.zero(ti.f64, 6)
        for component, row in ti.static(self.row_of_component):
            out[component] = S[row]
        if ti.static(self.n == 2):
            out[1] = -(out[0] + out[2])
        return out

    @ti.func
    def elastic(self, i, volume):
        """Elastic energy of pressure in compression, in tension, and of the deviator."""
        out, undamaged = ti.Vector.zero(ti.f64, 3), self.undamaged(i)
        K, S = self.f.modulus[i], self.f.deviator[i]
        trace = ti.cast(0.0, ti.f64)
        for a in ti.static(range(self.n)):
            trace += S[a * (self.n + 1)]
        by_pressure = volume * self.laws.path_energy(self.f.density[i], self.f.reference[i], K)
        if self.f.pressure[i] >= 0.0:
            out[0] = by_pressure
        else:
            out[1] = undamaged * by_pressure
        squares = S.dot(S) + trace * trace
        out[2] = self.laws.shear_energy(undamaged * volume, squares, self.f.shear_ratio[i] * K)
        return out

    @ti.func
    def stored(self, i):
        """Numbers of STORED."""
        out, mass, role = ti.Vector.zero(ti.f64, STORED.count), self.f.mass[i], self.f.role[i]
        elastic, work = ti.Vector.zero(ti.f64, 3), self.f.work[i]
        if role == DUST or role == ELASTIC:
            elastic = self.elastic(i, mass / self.f.density[i])
        for k in ti.static(range(3)):
            out[STORED.elastic + k], out[STORED.work + k] = elastic[k], work[k]
        for k in ti.static(range(2)):
            out[STORED.loss + k] = self.f.loss[i][k]
        if ti.static(self.layout.self_gravity):
            out[STORED.attraction] = self.lists.potential[i]
        if role == DUST:
            density, undamaged = self.f.density[i], self.undamaged(i)
            volume, S, material = mass / density, self.deviator(i), 0
            if ti.static(self.layout.materials):
                material = self.f.material[i]
            out[STORED.mass], out[STORED.volume] = mass, volume
            carried = self.laws.carried_pressure(self.f.pressure[i], undamaged)
            out[STORED.pressure] = volume * carried
            for k in ti.static(range(6)):
                out[STORED.deviator + k] = volume * undamaged * S[k]
            out[STORED.filling] = mass * (density / self.lists.solid[material])
            out[STORED.damaged] = mass * (1.0 - undamaged)
            if ti.static(self.layout.heat):
                out[STORED.heat] = self.heat(i, elastic.sum())
        return out

    @ti.func
    def heat(self, i, elastic):
        """Heat of a particle with that elastic energy."""
        stored, work = self.lists.heat_constants[self.f.number[i], 0], self.f.work[i].sum()
        recent = 0.5 * self.f.clock[OLD] * self.f.heating[i]
        return self.laws.heat(work, elastic, stored, self.f.warmed[i], recent)

    @ti.func
    def largest(self, i):
        """Numbers of which the largest is sought, none of them negative."""
        out, v = ti.Vector.zero(ti.f64, self.maxima), self.velocity(i)
        out[0] = v.dot(v)
        if self.f.role[i] == DUST:
            if ti.static(self.layout.heat):
                number = self.f.number[i]
                elastic = self.elastic(i, self.f.mass[i] / self.f.density[i])
                capacity = self.lists.heat_constants[number, 1]
                start = self.lists.heat_constants[number, 2]
                out[1] = self.laws.temperature(start, self.heat(i, elastic.sum()), capacity)
            material = 0
            if ti.static(self.layout.materials):
                material = self.f.material[i]
            for k in ti.static(range(self.materials)):
                if material == k:
                    out[MAXIMA + 2 * k] = self.f.density[i]
                    out[MAXIMA + 2 * k + 1] = self.f.reference[i]
        return out

    @ti.func
    def outside(self, i):
        """Energies and work of the forces from outside."""
        out = ti.Vector.zero(ti.f64, ti.static(max(1, self.forces)))
        for k in ti.static(range(self.forces)):
            out[k] = self.lists.force_now[i, ENERGIES + k]
        for k in ti.static(range(self.powers)):
            out[ti.static(self.forces - self.powers) + k] += self.f.force_work[i][k]
        return out
