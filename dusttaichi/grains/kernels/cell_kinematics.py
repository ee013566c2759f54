"""The periodic cell in the passes: its current edges, and their effect on a pair."""

from dusttaichi.compute.device_blocks import BlockSums, on_device, pad_to_blocks
from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import CHUNK, count_blocks
from dusttaichi.grains.kernels.store import GRAINS

START, RATE, GROWTH, CENTRE, TILT = range(5)  # rows of the `cell` field; RATE and GROWTH by time


def make_cell(fields, layout):
    """Functions of a scene with periodic axes; without such axes the frame is an unused zero.

    An edge is L(t) = L_start exp(g t) + c t, centred about a fixed point. A pair keeps the number
    of edges between its grains (`shift`) from one search to the next, so that nothing is rounded or
    wrapped in a step. Fourth column: the edge along z of a tilted cell along x.
    """
    axes = layout.periodic
    if not axes:

        @ti.func
        def no_frame(step, dt):
            return 0.0

        return no_frame, None, None
    shift, tilted, law = fields["shift"], layout.tilted, layout.law

    @ti.func
    def across(b, lane, d, row: ti.template(), frame):
        """The vector d of a pair less that row of the frame along each edge between its grains."""
        out = d
        for k in ti.static(range(len(axes))):
            a = ti.static(axes[k])
            out[a] -= shift[b, k, lane] * frame[row, a]
            if ti.static(tilted and a == 2):
                out[0] -= shift[b, k, lane] * frame[row, 3]
        return out

    @ti.func
    def power(k: ti.template(), edges, force, frame):
        """Power of the faces across axis k on a pair with this force and that many edges between.

        In the precision of the laws.
        """
        a = ti.static(axes[k])
        out = edges * force[a] * ti.cast(frame[2, a], law)
        if ti.static(tilted and a == 2):
            out += edges * force[0] * ti.cast(frame[2, 3], law)
        return out

    return make_frame(fields, layout), across, power


def make_frame(fields, layout):
    """Returns `frame(step, dt)`, the edges of a periodic cell and their motion."""
    axes, cell, tilted = layout.periodic, fields["cell"], layout.tilted

    @ti.func
    def frame(step, dt):
        """Rows: the edges at `step`, their speeds half a step before (where v is), and now."""
        out = ti.Matrix.zero(ti.f64, 3, 3 + tilted)
        for axis in ti.static(axes):
            start, rate, growth = cell[START, axis], cell[RATE, axis], cell[GROWTH, axis]
            edges_now = start * ti.exp(growth * (dt * step))
            edges_before = start * ti.exp(growth * (dt * (ti.cast(step, ti.f64) - 0.5)))
            out[0, axis] = edges_now + rate * (dt * step)
            out[1, axis] = growth * edges_before + rate
            out[2, axis] = growth * edges_now + rate
        if ti.static(tilted):
            lean_rate = cell[TILT, 1]
            out[0, 3] = cell[TILT, 0] + lean_rate * (dt * step)
            out[1, 3] = lean_rate
            out[2, 3] = lean_rate
        return out

    return frame


def make_wrap(fields, layout):
    """Kernel `wrap(low, edges, speeds, tilt, mass)`: grains that have left the cell come in again.

    On the other side, with the speed that the edge has (T19 eqs 12-15). tilt: displacement along x
    of the image above, and its velocity; the faces across x of a tilted cell tilt so.
    """
    x, v, wraps, wrap_work = fields["x"], fields["v"], fields["wraps"], fields["wrap_work"]
    masses = fields.get("mass")
    counts = fields["counts"]
    vector, pair = ti.types.vector(3, ti.f64), ti.types.vector(2, ti.f64)
    # a grain that crosses a face across z of a tilted cell is displaced along x
    axes = sorted(layout.periodic, reverse=layout.tilted)

    @ti.func
    def wrap_grain(grain, low, edges, speeds, tilt):
        """Moves the grain; returns the change of v^2 (of m v^2 where masses differ)."""
        position, velocity, count = x[grain], v[grain], wraps[grain]
        square_before, crossed = velocity.dot(velocity), 0.0
        for axis in ti.static(axes):
            face = low[axis]
            if ti.static(layout.tilted and axis == 0):
                face += tilt[0] * ((position[2] - low[2]) / edges[2] - 0.5)
            n = ti.floor((position[axis] - face) / edges[axis])
            crossed += ti.abs(n)
            position[axis] -= n * edges[axis]
            velocity[axis] -= n * speeds[axis]
            if ti.static(layout.tilted and axis == 2):
                position[0] -= ti.cast(n * tilt[0], layout.geometry)
                velocity[0] -= ti.cast(n * tilt[1], layout.geometry)
            count[axis] += ti.cast(n, ti.i32)
        x[grain], v[grain], wraps[grain] = position, velocity, count
        change = 0.0 * square_before
        if crossed > 0.0:  # the two squares may be rounded differently
            change = velocity.dot(velocity) - square_before
        if ti.static(layout.polydisperse):
            change *= masses[grain]
        return change

    wrap_by_threads = make_wrap_by_threads(fields, wrap_grain)

    @ti.kernel
    def wrap(low: vector, edges: vector, speeds: vector, tilt: pair, mass: ti.f64):
        if ti.static(on_device()):
            wrap_by_threads(low, edges, speeds, tilt, mass)
        else:
            grains = counts[GRAINS]
            for chunk in range(count_blocks(grains, CHUNK)):
                total = ti.cast(0.0, ti.f64)
                for g in range(chunk * CHUNK, ti.min((chunk + 1) * CHUNK, grains)):
                    total += wrap_grain(g, low, edges, speeds, tilt)
                wrap_work[chunk] = wrap_work[chunk] + 0.5 * mass * total

    return wrap


def make_wrap_by_threads(fields, wrap_grain):
    """Function `wrap_by_threads(low, edges, speeds, tilt, mass)`: `wrap_grain` of all grains.

    And the sums of its changes on a device, with a thread for each grain and a block for a chunk.
    """
    counts, wrap_work = fields["counts"], fields["wrap_work"]
    threads, sums = pad_to_blocks(fields["wraps"].shape[0], CHUNK), BlockSums(1, CHUNK)

    @ti.func
    def wrap_by_threads(
        low: ti.template(),
        edges: ti.template(),
        speeds: ti.template(),
        tilt: ti.template(),
        mass: ti.template(),
    ):
        ti.loop_config(block_dim=CHUNK)
        for grain in range(threads):
            thread = grain % CHUNK
            if grain - thread < counts[GRAINS]:  # the same for all threads of a block
                crossing_energy = ti.Vector.zero(ti.f64, 1)
                if grain < counts[GRAINS]:
                    crossing_energy[0] = wrap_grain(grain, low, edges, speeds, tilt)
                total = sums.total(crossing_energy, thread)
                if thread == 0:
                    wrap_work[grain // CHUNK] = wrap_work[grain // CHUNK] + 0.5 * mass * total

    return wrap_by_threads
