"""One pass over the grains: gather the loads of their contacts in a fixed order, kick, drift."""

from math import factorial

from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import CHUNK
from dusttaichi.grains.kernels.cell_kinematics import CENTRE, GROWTH, RATE, START, TILT
from dusttaichi.grains.kernels.outside_kick import OutsideKick
from dusttaichi.grains.kernels.store import GRAINS, OPPOSITE

# of the series of cos(h) and sin(h)/h in h^2
COS = [(-1) ** n / factorial(2 * n) for n in range(1, 5)]
SIN = [(-1) ** n / factorial(2 * n + 1) for n in range(1, 5)]


@ti.data_oriented
class Orientations:
    """Rotations of the grains since the start, as unit quaternions w, x, y, z."""

    def __init__(self, fields, layout):
        self.q, self.dtype = fields["orientation"], layout.geometry

    @ti.func
    def carry_on(self, grain, spin, dt):
        """Turn a grain about its spin of the half step for a step.

        A steady spin is exact to rounding, up to a tenth of a radian a step. Sine and cosine of
        half the angle are series: library functions would take as long as the rest of the step of a
        grain.
        """
        half = (0.5 * ti.cast(dt, self.dtype)) * spin
        h2 = half.dot(half)
        cosine = 1.0 + h2 * (COS[0] + h2 * (COS[1] + h2 * (COS[2] + h2 * COS[3])))
        axis_sine = half * (1.0 + h2 * (SIN[0] + h2 * (SIN[1] + h2 * (SIN[2] + h2 * SIN[3]))))
        previous = self.q[grain]
        previous_scalar, previous_vector = (
            previous[0],
            ti.Vector([previous[1], previous[2], previous[3]]),
        )
        turned = (
            cosine * previous_vector
            + previous_scalar * axis_sine
            + axis_sine.cross(previous_vector)
        )
        current = ti.Vector(
            [
                cosine * previous_scalar - axis_sine.dot(previous_vector),
                turned[0],
                turned[1],
                turned[2],
            ]
        )
        # of a length that differs from 1 by rounding alone
        self.q[grain] = current * (1.5 - 0.5 * current.dot(current))


@ti.data_oriented
class GrainLoads:
    """Loads on a grain: those of its contacts, and the push from outside."""

    def __init__(self, fields, layout):
        self.layout, self.width = layout, layout.width  # a power of two
        self.shift = layout.width.bit_length() - 1
        self.entry_start, self.entry = fields["entry_start"], fields["entry"]
        self.load = fields["load"]
        self.push_force, self.free = fields.get("push_force"), fields.get("free")

    @ti.func
    def total(self, grain):
        """Force and torque of the contacts of a grain, summed in the order of its list.

        One loop passes the contacts of all kinds: each loop costs a wrong prediction of its end. It
        ends by a number that it reads: a loop over a known number of contacts, which LLVM unrolls
        and vectorises, takes a third longer. The force on the second body of a contact has rows of
        its own (layout.opposite); a device, on which memory is slower than a product, has a sign
        instead.
        """
        sums = ti.Vector.zero(self.layout.geometry, 6)
        at = self.entry_start[grain]
        listed = self.entry[at]
        while listed >= 0:
            self.add_contact(sums, listed)
            at += 1
            listed = self.entry[at]
        return ti.Vector([sums[0], sums[1], sums[2]]), ti.Vector([sums[3], sums[4], sums[5]])

    @ti.func
    def add_contact(self, sums: ti.template(), listed):
        row, lane = listed >> self.shift, listed & (self.width - 1)
        block, is_second = (row >> 1) & self.layout.mask, row & 1  # kernels.list_entries
        for component in ti.static(range(3)):
            if ti.static(self.layout.opposite):
                force = self.load[block, OPPOSITE * is_second + component, lane]
                sums[component] += ti.cast(force, self.layout.geometry)
            else:
                force = ti.cast(self.load[block, component, lane], self.layout.geometry)
                sums[component] += (1 - 2 * is_second) * force
            torque = self.load[block, 3 + 3 * is_second + component, lane]
            sums[3 + component] += ti.cast(torque, self.layout.geometry)

    @ti.func
    def add_push(self, grain, force, torque):
        """Force and torque on a grain with the push from outside, zero of a carried grain."""
        pushed_force, pushed_torque = force, torque
        if ti.static(self.layout.forced):
            pushed_force += self.push_force[grain]
        if ti.static(self.layout.carried):
            pushed_force, pushed_torque = (
                self.free[grain] * pushed_force,
                self.free[grain] * pushed_torque,
            )
        return pushed_force, pushed_torque


@ti.data_oriented
class GrainPass:
    """Kick and drift of the grains by the loads of their contacts, a push and outside forces."""

    def __init__(self, fields, layout):
        self.layout, self.loads = layout, GrainLoads(fields, layout)
        self.x, self.v, self.w = fields["x"], fields["v"], fields["w"]
        self.x_search, self.dtype = fields["x_search"], layout.geometry
        self.free, self.impulse = fields.get("free"), fields.get("carried_impulse")
        self.masses, self.inertias = fields.get("mass"), fields.get("inertia")
        self.outside = OutsideKick(fields, layout)
        self.turned = Orientations(fields, layout) if layout.orientation else None

    @ti.func
    def move(self, grain, kick, turn, dt, reach2, step):
        """Move a grain from a step to the next: (1 if a new search is due, position, velocity).

        Callers use these and do not read the fields: reading numbers that have just been written,
        in another width, makes a core wait for a third of a step. kick, turn: dt/m and dt/I; where
        grains have masses of their own (layout.polydisperse) m and I are units of them.

        A search is due once a grain has moved further than half the skin from where it was at the
        last one (reach2 its square), or is no longer a number.
        """
        force, torque = self.loads.total(grain)
        if ti.static(self.layout.carried):
            self.impulse[grain] = self.impulse[grain] + (dt * (1.0 - self.free[grain])) * force
        force, torque = self.loads.add_push(grain, force, torque)
        grain_kick, grain_turn = ti.cast(kick, self.dtype), ti.cast(turn, self.dtype)
        if ti.static(self.layout.polydisperse):
            grain_kick = ti.cast(kick / self.masses[grain], self.dtype)
            grain_turn = ti.cast(turn / self.inertias[grain], self.dtype)
        # no += on fields: it is atomic in Taichi, and slow
        velocity = self.v[grain] + grain_kick * force
        spin = self.w[grain] + grain_turn * torque
        if ti.static(bool(self.layout.forces)):
            at, weight = self.outside.of_grain(grain, step), self.outside.weight_of(grain)
            half_kick = ti.cast(0.5 * grain_kick * force, ti.f64)
            half_turn = ti.cast(0.5 * grain_turn * torque, ti.f64)
            velocity, spin = self.outside.accelerate(
                grain, at, weight, velocity, spin, half_kick, half_turn, dt
            )
        position = self.x[grain] + ti.cast(dt, self.dtype) * velocity
        self.v[grain], self.w[grain] = velocity, spin
        if ti.static(self.layout.orientation):
            self.turned.carry_on(grain, spin, dt)
        self.x[grain] = position
        way = position - self.x_search[grain]
        return ti.select(way.dot(way) <= reach2, 0, 1), position, velocity


@ti.data_oriented
class CellRates:
    """L'/L along each axis of the cell and the rate of its shear, in the middle of a step."""

    def __init__(self, fields, layout):
        self.cell, self.layout = fields.get("cell"), layout

    @ti.func
    def at_step(self, step, dt):
        """(3 rates of growth, rate of shear) in the step that ends at this one."""
        rate, sheared = self.growth(step, dt), 0.0
        if ti.static(self.layout.tilted):
            sheared = self.shear(step, dt, rate)
        return ti.Vector([rate[0], rate[1], rate[2], sheared], ti.f64)

    @ti.func
    def growth(self, step, dt):
        out = ti.Vector.zero(ti.f64, 3)
        time = dt * (ti.cast(step, ti.f64) - 0.5)
        for a in ti.static(self.layout.periodic):
            grown = self.cell[START, a] * ti.exp(self.cell[GROWTH, a] * time)
            change = self.cell[GROWTH, a] * grown + self.cell[RATE, a]
            out[a] = change / (grown + self.cell[RATE, a] * time)
        return out

    @ti.func
    def shear(self, step, dt, rate):
        cell = ti.static(self.cell)
        time = dt * (ti.cast(step, ti.f64) - 0.5)
        height = cell[START, 2] * ti.exp(cell[GROWTH, 2] * time) + cell[RATE, 2] * time
        return (cell[TILT, 1] - rate[0] * (cell[TILT, 0] + cell[TILT, 1] * time)) / height


@ti.data_oriented
class KineticFlux:
    """Kinetic part of the stress: v v dt of the grains, summed by chunks of them.

    Velocities are those of the half step. Where grains have masses of their own
    (layout.polydisperse) it is m v v dt. In a periodic cell v is measured from the even flow of its
    edges, L'/L (x - centre) along each periodic axis, and of a shear of the cell: that is the same
    for all images of a grain.
    """

    def __init__(self, fields, layout):
        self.layout, self.rates = layout, CellRates(fields, layout)
        self.flux, self.masses = fields["flux"], fields.get("mass")
        self.counts, self.cell = fields["counts"], fields.get("cell")

    @ti.func
    def of_grain(self, grain, position, velocity, dt, rate):
        """Six components of v v of a grain after its step. rate: of CellRates."""
        u, middle = velocity, position - 0.5 * dt * velocity
        for a in ti.static(self.layout.periodic):
            u[a] -= ti.cast(rate[a] * (middle[a] - self.cell[CENTRE, a]), self.layout.geometry)
            if ti.static(self.layout.tilted and a == 2):
                u[0] -= ti.cast(rate[3] * (middle[2] - self.cell[CENTRE, 2]), self.layout.geometry)
        if ti.static(self.layout.polydisperse):
            u *= ti.sqrt(self.masses[grain])
        return ti.Vector([u.x * u.x, u.x * u.y, u.x * u.z, u.y * u.y, u.y * u.z, u.z * u.z])

    @ti.func
    def move_chunk(self, chunk, grains: ti.template(), step, numbers):
        """Move the grains of a chunk (a GrainPass) and add v v dt; 1 if a search is due."""
        is_due, rate = 0, self.rates.at_step(step, numbers.dt)
        sums = ti.Vector.zero(ti.f64, 6)
        for grain in range(chunk * CHUNK, ti.min((chunk + 1) * CHUNK, self.counts[GRAINS])):
            n = numbers
            far, position, u = grains.move(grain, n.kick, n.turn, n.dt, n.reach2, step - 1)
            is_due = ti.max(is_due, far)
            sums += self.of_grain(grain, position, u, numbers.dt, rate)
        for k in ti.static(range(6)):
            self.flux[chunk, k] = self.flux[chunk, k] + numbers.dt * sums[k]
        return is_due
