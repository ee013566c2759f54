"""One pass over the grains: gather the loads of their contacts in a fixed order, kick, drift."""

from math import factorial
from types import SimpleNamespace

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


def make_gather(fields, layout):
    """Returns `total(grain)`: force and torque on a grain, summed in the order of its list.

    One loop passes the contacts of all kinds: each loop costs a wrong prediction of its end. It
    ends by a number that it reads: a loop over a known number of contacts, which LLVM unrolls and
    vectorises, takes a third longer. The force on the second body of a contact has rows of its own
    (layout.opposite); a device, on which memory is slower than a product, has a sign instead.
    """
    width = layout.width  # a power of two
    shift = width.bit_length() - 1
    entry_start, entry, load = fields["entry_start"], fields["entry"], fields["load"]

    @ti.func
    def add(sums: ti.template(), listed):
        row, lane = listed >> shift, listed & (width - 1)
        block, is_second = (row >> 1) & layout.mask, row & 1  # kernels.list_entries
        for component in ti.static(range(3)):
            if ti.static(layout.opposite):
                force = load[block, OPPOSITE * is_second + component, lane]
                sums[component] += ti.cast(force, layout.geometry)
            else:
                force = ti.cast(load[block, component, lane], layout.geometry)
                sums[component] += (1 - 2 * is_second) * force
            torque = load[block, 3 + 3 * is_second + component, lane]
            sums[3 + component] += ti.cast(torque, layout.geometry)

    @ti.func
    def total(grain):
        sums = ti.Vector.zero(layout.geometry, 6)
        at = entry_start[grain]
        listed = entry[at]
        while listed >= 0:
            add(sums, listed)
            at += 1
            listed = entry[at]
        return ti.Vector([sums[0], sums[1], sums[2]]), ti.Vector([sums[3], sums[4], sums[5]])

    return total


def make_push(fields, layout):
    """Returns `add_push(grain, force, torque)`: with the external push, zero if carried."""
    push_force, free = fields.get("push_force"), fields.get("free")

    @ti.func
    def add_push(grain, force, torque):
        pushed_force, pushed_torque = force, torque
        if ti.static(layout.forced):
            pushed_force += push_force[grain]
        if ti.static(layout.carried):
            pushed_force, pushed_torque = free[grain] * pushed_force, free[grain] * pushed_torque
        return pushed_force, pushed_torque

    return add_push


def make_grain_pass(fields, layout):
    """Returns `move(grain, dt/m, dt/I, dt, reach2, step)`: kick and drift from a step to the next.

    It returns (1 if a new search is due, position, velocity). Callers use these and do not read the
    fields: reading numbers that have just been written, in another width, makes a core wait for a
    third of a step. Where grains have masses of their own (layout.polydisperse) m and I are units
    of them.

    A search is due once a grain has moved further than half the skin from where it was at the last
    one (reach2 its square), or is no longer a number.
    """
    x, v, w, x_search = fields["x"], fields["v"], fields["w"], fields["x_search"]
    total, add_push = make_gather(fields, layout), make_push(fields, layout)
    free, impulse = fields.get("free"), fields.get("carried_impulse")
    mass, inertia = fields.get("mass"), fields.get("inertia")
    dtype, forces = layout.geometry, OutsideKick(fields, layout)
    turned = Orientations(fields, layout) if layout.orientation else None

    @ti.func
    def move(grain, kick, turn, dt, reach2, step):
        force, torque = total(grain)
        if ti.static(layout.carried):
            impulse[grain] = impulse[grain] + (dt * (1.0 - free[grain])) * force
        force, torque = add_push(grain, force, torque)
        own_kick, own_turn = ti.cast(kick, dtype), ti.cast(turn, dtype)
        if ti.static(layout.polydisperse):
            own_kick = ti.cast(kick / mass[grain], dtype)
            own_turn = ti.cast(turn / inertia[grain], dtype)
        # no += on fields: it is atomic in Taichi, and slow
        velocity, spin = v[grain] + own_kick * force, w[grain] + own_turn * torque
        if ti.static(bool(layout.forces)):
            at, weight = forces.of_grain(grain, step), forces.weight_of(grain)
            half_kick = ti.cast(0.5 * own_kick * force, ti.f64)
            half_turn = ti.cast(0.5 * own_turn * torque, ti.f64)
            velocity, spin = forces.accelerate(
                grain, at, weight, velocity, spin, half_kick, half_turn, dt
            )
        position = x[grain] + ti.cast(dt, dtype) * velocity
        v[grain], w[grain] = velocity, spin
        if ti.static(layout.orientation):
            turned.carry_on(grain, spin, dt)
        x[grain] = position
        way = position - x_search[grain]
        return ti.select(way.dot(way) <= reach2, 0, 1), position, velocity

    return move


def make_rates(fields, layout):
    """Returns `rates(step, dt)`: L'/L along each axis of the cell and the rate of its shear.

    They are rates in the middle of the step.
    """
    cell = fields.get("cell")

    @ti.func
    def flow(step, dt):
        """L'/L along each axis, in the middle of the step."""
        out = ti.Vector.zero(ti.f64, 3)
        time = dt * (ti.cast(step, ti.f64) - 0.5)
        for a in ti.static(layout.periodic):
            grown = cell[START, a] * ti.exp(cell[GROWTH, a] * time)
            change = cell[GROWTH, a] * grown + cell[RATE, a]
            out[a] = change / (grown + cell[RATE, a] * time)
        return out

    @ti.func
    def shear(step, dt, rate):
        """Rate of the shear of a tilted cell, in the middle of the step."""
        time = dt * (ti.cast(step, ti.f64) - 0.5)
        height = cell[START, 2] * ti.exp(cell[GROWTH, 2] * time) + cell[RATE, 2] * time
        return (cell[TILT, 1] - rate[0] * (cell[TILT, 0] + cell[TILT, 1] * time)) / height

    @ti.func
    def rates(step, dt):
        rate, sheared = flow(step, dt), 0.0
        if ti.static(layout.tilted):
            sheared = shear(step, dt, rate)
        return ti.Vector([rate[0], rate[1], rate[2], sheared], ti.f64)

    return rates


def make_flux(fields, layout):
    """Functions for the kinetic part of the stress: `add`, `of_grain` and `rates`.

    `add(chunk, move, step, numbers)` moves the grains of a chunk and sums v v dt, 1 if a search is
    due; `of_grain(grain, position, velocity, dt, rate)` is v v of a grain after its step; for
    `rates` see make_rates.

    Velocities are those of the half step. Where grains have masses of their own
    (layout.polydisperse) it is m v v dt. In a periodic cell v is measured from the even flow of its
    edges, L'/L (x - centre) along each periodic axis, and of a shear of the cell: that is the same
    for all images of a grain.
    """
    flux, mass, rates = fields["flux"], fields.get("mass"), make_rates(fields, layout)
    counts, cell = fields["counts"], fields.get("cell")

    @ti.func
    def of_grain(grain, position, velocity, dt, rate):
        u, middle = velocity, position - 0.5 * dt * velocity
        for a in ti.static(layout.periodic):
            u[a] -= ti.cast(rate[a] * (middle[a] - cell[CENTRE, a]), layout.geometry)
            if ti.static(layout.tilted and a == 2):
                u[0] -= ti.cast(rate[3] * (middle[2] - cell[CENTRE, 2]), layout.geometry)
        if ti.static(layout.polydisperse):
            u *= ti.sqrt(mass[grain])
        return ti.Vector([u.x * u.x, u.x * u.y, u.x * u.z, u.y * u.y, u.y * u.z, u.z * u.z])

    @ti.func
    def add(chunk, move: ti.template(), step, numbers):
        is_due, rate = 0, rates(step, numbers.dt)
        sums = ti.Vector.zero(ti.f64, 6)
        for grain in range(chunk * CHUNK, ti.min((chunk + 1) * CHUNK, counts[GRAINS])):
            n = numbers
            far, position, u = move(grain, n.kick, n.turn, n.dt, n.reach2, step - 1)
            is_due = ti.max(is_due, far)
            sums += of_grain(grain, position, u, numbers.dt, rate)
        for k in ti.static(range(6)):
            flux[chunk, k] = flux[chunk, k] + numbers.dt * sums[k]
        return is_due

    return SimpleNamespace(add=add, rates=rates, of_grain=of_grain)
