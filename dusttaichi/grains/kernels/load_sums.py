"""Sums for the loads on walls and faces, formed on a device in one launch."""

from dusttaichi.compute.device_blocks import THREADS, BlockSums
from dusttaichi.compute.engine import ti
from dusttaichi.compute.taichi_internals.launching import Launch
from dusttaichi.grains.kernels.store import PAIRS, capacity
from dusttaichi.grains.kernels.wall_search import WallSums

# slices of the field `load_sums`: of the columns of tables; from ON_WALLS on of walls, a row each:
# force (3), impulse (layout.impulses)
COLUMNS = {"flux": slice(0, 6), "virial": slice(6, 15), "wall_virial": slice(15, 24)}
COLUMNS["across"] = slice(24, 33)
ON_WALLS = 33
FACES = 9  # sums over pairs: force along x, y, z, each times the edges between along x, y, z


def place_load_sums(grains, layout, walls):
    """The field of the sums; where there is a cell, those of each tile of pairs."""
    length = ON_WALLS + layout.surfaces * (3 + layout.impulses)
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


def make_load_sums(fields, sums, layout, walls):
    """Launch `load_sums()`, which fills that field."""
    out, every, single_sum = sums["load_sums"], fields | sums, BlockSums(1)
    tables = [
        (every[name], columns_of_table.start, columns_of_table.stop)
        for name, columns_of_table in COLUMNS.items()
        if name in every
    ]
    columns = max((end for _, _, end in tables), default=0)
    across, tile, of_tile = sums.get("across"), layout.tile, BlockSums(FACES, layout.tile)
    pairs = across.shape[0] * tile if layout.periodic else 0
    across_faces = make_across_faces(fields, layout)
    wall_sums, impulse_total = WallSums(fields) if walls else None, fields.get("impulse_total")

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
            ti.loop_config(block_dim=tile)
            for pair in range(pairs):
                sum_of_tile = of_tile.total(across_faces(pair), pair % tile)
                if pair % tile < FACES:
                    across[pair // tile, pair % tile] = sum_of_tile
        if ti.static(columns > 0):
            ti.loop_config(block_dim=THREADS)
            for thread_number in range(columns * THREADS):
                sum_of_column = single_sum.total(
                    column_sum(thread_number // THREADS, thread_number % THREADS),
                    thread_number % THREADS,
                )
                if thread_number % THREADS == 0:
                    out[thread_number // THREADS] = sum_of_column
        if ti.static(walls):
            ti.loop_config(block_dim=THREADS)
            for thread_number in range(ti.static(impulse_total.shape[0]) * THREADS):
                wall, thread = thread_number // THREADS, thread_number % THREADS
                total = wall_sums.of_wall(wall, thread)
                for component in ti.static(range(layout.impulses)):
                    if thread == 3 + component:
                        total += impulse_total[wall][component]
                if thread < 3 + layout.impulses:
                    out[ON_WALLS + (3 + layout.impulses) * wall + thread] = total

    return Launch(load_sums)
