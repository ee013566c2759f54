"""Sums that the loads on walls and faces are measured by, formed on a device in one launch."""

from itertools import accumulate

from dusttaichi.compute.blocks import THREADS, BlockSums
from dusttaichi.compute.engine import ti
from dusttaichi.compute.launching import Launch
from dusttaichi.grains.kernels.store import PAIRS, capacity
from dusttaichi.grains.kernels.wall_search import force_sums, impulse_sums

FACES = 9  # sums over pairs: force along x, y, z, each times the edges between along x, y, z


def places(layout, walls):
    """Name -> slice of the field `load_sums`."""
    stress, cell = layout.stress, bool(layout.periodic)
    lengths = {"flux": 6 * stress, "virial": 9 * stress, "wall_virial": 9 * (stress and walls)}
    lengths |= {"across": FACES * cell, "wall_force": 18 * walls, "impulse": 18 * walls}
    ends = accumulate(lengths.values())
    return {
        name: slice(end - n, end) for (name, n), end in zip(lengths.items(), ends, strict=True) if n
    }


def place_load_sums(grains, layout, walls):
    """The field of the sums; where there is a cell, those of each tile of pairs."""
    found = places(layout, walls)
    length = max((part.stop for part in found.values()), default=1)
    out = {"load_sums": ti.field(ti.f64, shape=length)}
    if layout.periodic:
        tiles = capacity(grains, layout, walls)[0] // layout.tile
        out["across"] = ti.field(ti.f64, shape=(tiles, FACES))
    return out


def make_across_faces(fields, layout):
    """Function `across_faces(b)`: of pair b, its force times the edges between its grains."""
    load, shift = fields["load"], fields.get("shift")
    counts = fields["counts"]

    @ti.func
    def across_faces(b):
        out = ti.Vector.zero(ti.f64, FACES)
        if b < counts[PAIRS]:
            for k in ti.static(range(len(layout.periodic))):
                for a in ti.static(range(3)):
                    force = ti.cast(load[b, a, 0], ti.f64)
                    out[3 * a + layout.periodic[k]] = force * shift[b, k, 0]
        return out

    return across_faces


def make_wall_loads(fields, layout, found, out):
    """Function `wall_loads(wall, thread)`, for all threads of a block: force and impulse of a wall.

    found: `places` of the sums in `out`."""
    total, impulses = fields["impulse_total"], impulse_sums(fields)
    forces = force_sums(fields, layout)
    first_force, first_impulse = found["wall_force"].start, found["impulse"].start

    @ti.func
    def wall_loads(wall, thread):
        force, impulse = forces.of_wall(wall, thread), impulses.of_wall(wall, thread)
        for a in ti.static(range(3)):
            if thread == a:
                out[first_force + 3 * wall + a] = force
                out[first_impulse + 3 * wall + a] = total[wall][a] + impulse

    return wall_loads


def make_load_sums(fields, sums, layout, walls):
    """Launch `load_sums()`, which fills that field."""
    found, out = places(layout, walls), sums["load_sums"]
    tables = [
        (sums[name] if name == "across" else fields[name], part.start, part.stop)
        for name, part in found.items()
        if not name.startswith(("wall_force", "impulse"))
    ]
    columns, one = max((end for _, _, end in tables), default=0), BlockSums(1)
    across, of_tile = sums.get("across"), BlockSums(FACES)
    pairs = across.shape[0] * THREADS if layout.periodic else 0
    across_faces = make_across_faces(fields, layout)
    wall_loads = make_wall_loads(fields, layout, found, out) if walls else None

    @ti.func
    def column_sum(column, thread):
        """Sum of the rows of a column that belong to a thread."""
        out = ti.Vector.zero(ti.f64, 1)
        for table, begin, end in ti.static(tables):
            if column >= begin and column < end:
                for n in range((table.shape[0] - thread + THREADS - 1) // THREADS):
                    out[0] += table[n * THREADS + thread, column - begin]
        return out

    @ti.kernel
    def load_sums():
        if ti.static(pairs > 0):
            ti.loop_config(block_dim=THREADS)
            for b in range(pairs):
                of_all = of_tile.total(across_faces(b), b % THREADS)
                if b % THREADS < FACES:
                    across[b // THREADS, b % THREADS] = of_all
        if ti.static(columns > 0):
            ti.loop_config(block_dim=THREADS)
            for t in range(columns * THREADS):
                of_all = one.total(column_sum(t // THREADS, t % THREADS), t % THREADS)
                if t % THREADS == 0:
                    out[t // THREADS] = of_all
        if ti.static(walls):
            ti.loop_config(block_dim=THREADS)
            for t in range(6 * THREADS):
                wall_loads(t // THREADS, t % THREADS)

    return Launch(load_sums)
