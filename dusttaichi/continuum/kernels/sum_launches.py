"""Sums over the particles of a continuum, formed on a device: the host reads totals alone.

Each block of threads adds up what its particles have (kernels.particle_sums), and a block for each
total adds up those of the blocks, both in a fixed order (compute.device_blocks).
"""

from types import SimpleNamespace

from dusttaichi.compute.device_blocks import THREADS, BlockMaxima, BlockSums
from dusttaichi.compute.engine import ti
from dusttaichi.compute.scan import count_blocks
from dusttaichi.compute.taichi_internals.launching import Launch
from dusttaichi.continuum.kernels.particle_sums import (
    AT_ONCE,
    BODY,
    FIRST_PASS,
    MOTION,
    SECOND,
    STORED,
    ParticleNumbers,
    count_totals,
)


def make_partial(numbers_of, block_sums, partials, first):
    """Launch `(count)`: sums of a vector of each particle over each block of threads.

    numbers_of(i): Taichi function that returns it. block_sums: BlockSums or BlockMaxima. first:
    column of `partials` for its first number.
    """
    length, threads = block_sums.count, partials.shape[0] * THREADS

    @ti.kernel
    def sum_block(count: ti.i32):
        ti.loop_config(block_dim=THREADS)
        for i in range(threads):
            values, thread = ti.Vector.zero(ti.f64, length), i % THREADS
            if i < count:
                values = numbers_of(i)
            total = block_sums.total(values, thread)
            if thread < length:
                partials[i // THREADS, first + thread] = total

    return Launch(sum_block)


def make_total(sums, partials, totals):
    """Launch `(count)`: `totals` of the columns of `partials`; maxima from column `sums` on."""
    single, largest_of_all, columns = BlockSums(1), BlockMaxima(1), totals.shape[0]

    @ti.kernel
    def sum_blocks(count: ti.i32):
        ti.loop_config(block_dim=THREADS)
        for t in range(columns * THREADS):
            column, thread, blocks = t // THREADS, t % THREADS, count_blocks(count, THREADS)
            added, largest = ti.Vector.zero(ti.f64, 1), ti.Vector.zero(ti.f64, 1)
            for n in range(count_blocks(blocks, THREADS)):
                if n * THREADS + thread < blocks:
                    value = partials[n * THREADS + thread, column]
                    added[0] += value
                    largest[0] = ti.max(largest[0], value)
            total, most = single.total(added, thread), largest_of_all.total(largest, thread)
            if thread == 0:
                totals[column] = ti.select(column < sums, total, most)

    return Launch(sum_blocks)


def make_particle_sums(numbers, lists):
    """Launches `(count)` that fill `totals`, sums before maxima (count_totals): a list.

    numbers: ParticleNumbers.
    """
    sums, maxima = count_totals(numbers.layout)
    # a loop each: the memory that threads share holds no more
    parts = [
        (numbers.motion, BlockSums(MOTION.count), 0),
        (numbers.stored, BlockSums(STORED.count), MOTION.count),
        (numbers.largest, BlockMaxima(maxima), sums),
    ]
    if numbers.forces:
        first = MOTION.count + STORED.count
        parts.append((numbers.outside, BlockSums(numbers.forces), first))
    launches = [make_partial(of, block, lists.partials, first) for of, block, first in parts]
    return [*launches, make_total(sums, lists.partials, lists.totals)]


def make_body_sums(numbers, fields, lists):
    """Launch `(count, first)`: BODY of AT_ONCE elastic bodies, from `first` on, in `body_sums`.

    `label` has the number of the body of each particle of the sample. numbers: ParticleNumbers.
    """
    out = lists.body_sums
    first_sums, second_sums = BlockSums(FIRST_PASS), BlockSums(BODY.count - FIRST_PASS)

    @ti.func
    def about_origin(i):
        values, mass = ti.Vector.zero(ti.f64, FIRST_PASS), fields.mass[i]
        v, x = numbers.velocity(i), numbers.place(i)
        for a in ti.static(range(3)):
            values[BODY.momentum + a], values[BODY.moment + a] = mass * v[a], mass * x[a]
        values[BODY.mass] = mass
        return values

    @ti.func
    def about_centre(i, body):
        values = ti.Vector.zero(ti.f64, ti.static(BODY.count - FIRST_PASS))
        mass, total = fields.mass[i], out[body, BODY.mass]
        r, v = numbers.place(i), numbers.velocity(i)
        for a in ti.static(range(3)):
            r[a] -= out[body, BODY.moment + a] / total
            v[a] -= out[body, BODY.momentum + a] / total
        turning = r.cross(v)
        for k in ti.static(range(len(SECOND))):
            values[k] = mass * r[SECOND[k][0]] * r[SECOND[k][1]]
        for a in ti.static(range(3)):
            values[BODY.turning - FIRST_PASS + a] = mass * turning[a]
        return values

    @ti.kernel
    def sum_bodies(count: ti.i32, first: ti.i32):
        ti.loop_config(block_dim=THREADS)
        for t in range(ti.static(AT_ONCE * THREADS)):
            body, thread = t // THREADS, t % THREADS
            values = ti.Vector.zero(ti.f64, FIRST_PASS)
            for n in range(count_blocks(count, THREADS)):
                i = n * THREADS + thread
                if i < count:
                    if lists.label[fields.number[i]] == first + body:
                        values += about_origin(i)
            total = first_sums.total(values, thread)
            if thread < FIRST_PASS:
                out[body, thread] = total
            ti.simt.block.sync()
            further = ti.Vector.zero(ti.f64, ti.static(BODY.count - FIRST_PASS))
            for n in range(count_blocks(count, THREADS)):
                i = n * THREADS + thread
                if i < count:
                    if lists.label[fields.number[i]] == first + body:
                        further += about_centre(i, body)
            total = second_sums.total(further, thread)
            if thread < BODY.count - FIRST_PASS:
                out[body, FIRST_PASS + thread] = total

    return Launch(sum_bodies)


def make_sums(fields, lists, layout, rigid):
    """The launches of `make_particle_sums` and `make_body_sums`, by name."""
    numbers = ParticleNumbers(fields, lists, layout, rigid)
    particles = make_particle_sums(numbers, lists)
    return SimpleNamespace(particles=particles, bodies=make_body_sums(numbers, fields, lists))
