"""The periodic cell in the passes: the edges of the moment, and what they do to a pair."""

import taichi as ti

from dusttaichi.compute.scan import CHUNK, whole
from dusttaichi.grains.kernels.store import FIRST_WALL, GRAINS

START, RATE, GROWTH, CENTRE = range(4)  # rows of the `cell` field; RATE and GROWTH by time


def make_cell(fields, layout):
    """Functions of a scene with periodic axes; without, the frame is a zero that nothing looks at.

    An edge is L(t) = L_start exp(g t) + c t, centred about a point that rests. A pair keeps the
    number of edges between its grains (`shift`) from one search to the next, so that nothing is
    rounded or wrapped in a step.
    """
    axes = layout.periodic
    if not axes:

        @ti.func
        def no_frame(step, dt):
            return 0.0

        return no_frame, None, None
    cell, shift, law = fields["cell"], fields["shift"], layout.law

    @ti.func
    def frame(step, dt):
        """Rows: the edges at `step`, their speeds half a step before (where v is), and now."""
        out = ti.Matrix.zero(ti.f64, 3, 3)
        for a in ti.static(axes):
            start, rate, growth = cell[START, a], cell[RATE, a], cell[GROWTH, a]
            now = start * ti.exp(growth * (dt * step))
            before = start * ti.exp(growth * (dt * (ti.cast(step, ti.f64) - 0.5)))
            out[0, a] = now + rate * (dt * step)
            out[1, a] = growth * before + rate
            out[2, a] = growth * now + rate
        return out

    @ti.func
    def across(b, d, row, frame):
        """The vector d of a block of pairs less that row of the frame along each edge between."""
        out = d
        for k in ti.static(range(len(axes))):
            a = ti.static(axes[k])
            part = shift[b, k] * frame[row, a]
            if ti.static(a == 0):
                out.x -= part
            elif ti.static(a == 1):
                out.y -= part
            else:
                out.z -= part
        return out

    @ti.func
    def power(b, f, frame):
        """Power of the faces on a block of pairs with forces f, in the precision of the laws."""
        out = 0.0 * f.x
        for k in ti.static(range(len(axes))):
            a = ti.static(axes[k])
            force = f.x
            if ti.static(a == 1):
                force = f.y
            elif ti.static(a == 2):
                force = f.z
            out += ti.cast(shift[b, k], law) * force * ti.cast(frame[2, a], law)
        return out

    return frame, across, power


def make_wrap(fields, layout, walls):
    """Kernel `wrap(low, edges, speeds, mass)`: grains that have left the cell come in again on the
    other side, with the speed that the edge has (T19 eqs 12-15); the foot points of their wall
    contacts go with them, where they are kept.
    """
    x, v, wraps, wrap_work = fields["x"], fields["v"], fields["wraps"], fields["wrap_work"]
    masses, wall_slot, state = fields.get("mass"), fields.get("wall_slot"), fields["state"]
    counts = fields["counts"]
    W, FOOT = layout.width, layout.second
    vector = ti.types.vector(3, ti.f64)

    @ti.func
    def move_feet(g, a: ti.template(), way):
        for n in ti.static(range(6)):
            c = wall_slot[g][n]
            if c >= 0:
                b, k = counts[FIRST_WALL] + c // W, c % W
                state[b, FOOT + a][k] = state[b, FOOT + a][k] - way

    @ti.func
    def wrap_grain(g, low, edges, speeds):
        """Moves the grain; returns the change of v^2 (of m v^2 where masses differ)."""
        place, velocity, count = x[g], v[g], wraps[g]
        before, crossed = velocity.dot(velocity), 0.0
        for a in ti.static(layout.periodic):
            n = ti.floor((place[a] - low[a]) / edges[a])
            crossed += ti.abs(n)
            place[a] -= n * edges[a]
            if ti.static(walls and not layout.deviations):
                if n != 0.0:
                    move_feet(g, a, n * edges[a])
            velocity[a] -= n * speeds[a]
            count[a] += ti.cast(n, ti.i32)
        x[g], v[g], wraps[g] = place, velocity, count
        change = 0.0 * before
        if crossed > 0.0:  # the two squares may be rounded differently
            change = velocity.dot(velocity) - before
        if ti.static(layout.polydisperse):
            change *= masses[g]
        return change

    @ti.kernel
    def wrap(low: vector, edges: vector, speeds: vector, mass: ti.f64):
        grains = counts[GRAINS]
        for chunk in range(whole(grains, CHUNK)):
            total = ti.cast(0.0, ti.f64)
            for g in range(chunk * CHUNK, ti.min((chunk + 1) * CHUNK, grains)):
                total += wrap_grain(g, low, edges, speeds)
            wrap_work[chunk] = wrap_work[chunk] + 0.5 * mass * total

    return wrap
