"""Grains near each wall, in order, with the history of their contacts."""

import taichi as ti

from dusttaichi.grains.kernels.store import (
    CHUNK,
    FIRST_WALL,
    GRAINS,
    OVERFLOW,
    WALL_BLOCKS,
    WALL_ROOM,
)
from dusttaichi.grains.kernels.walls import Walls

FAR = 1e9  # distance that keeps an empty lane out of touch [um]


def make_wall_relist(fields, scratch, layout, write_constants=None):
    """Kernel `relist_walls(box, time, reach, present)`; reach is the distance of centre and wall
    within which a grain is listed.

    write_constants: `make_write_constants` of kernels.polydisperse, where grains have radii and
    materials of their own; reach then is that of their surfaces.
    """
    W = layout.width
    x, counts = fields["x"], fields["counts"]
    state, load = fields["state"], fields["load"]
    wall_grain, wall_gap, wall_of = fields["wall_grain"], fields["wall_gap"], fields["wall_of"]
    wall_slot = fields["wall_slot"]
    impulse, impulse_total = fields["impulse"], fields["impulse_total"]
    wall_chunk, wall_first = scratch["wall_chunk"], scratch["wall_first"]
    size = layout.state_size
    radius = fields.get("radius")
    _, write_wall_constants, write_empty = write_constants or (None, None, None)

    @ti.func
    def is_near(g, n, box: ti.template(), time, reach, present):
        unit_normal = ti.Vector([box.normal[n, 0], box.normal[n, 1], box.normal[n, 2]])
        distance = x[g].dot(unit_normal) - box.offset[n] - box.speed[n] * time
        if ti.static(layout.polydisperse):
            distance -= radius[g]
        return present[n] == 1 and distance < reach

    @ti.func
    def fold_impulses(blocks):
        for c in range(blocks):
            for a in ti.static(range(3)):
                total = ti.cast(0.0, ti.f64)
                for k in ti.static(range(W)):
                    total += impulse[c, a][k]
                impulse_total[wall_of[c]][a] = impulse_total[wall_of[c]][a] + total
                impulse[c, a] = impulse[c, a] * 0.0

    @ti.func
    def lay_out(chunks):
        """Where each wall's blocks begin; exclusive sums of the chunk counts."""
        block = 0
        for n in range(6):
            wall_first[n] = block
            lanes = 0
            for chunk in range(chunks):
                here = wall_chunk[n, chunk]
                wall_chunk[n, chunk] = lanes
                lanes += here
            blocks = (lanes + W - 1) // W
            if block + blocks > counts[WALL_ROOM]:
                counts[OVERFLOW] = 2
                blocks, lanes = 0, 0
            for c in range(block, block + blocks):
                wall_of[c] = n
            for c in range(block * W + lanes, (block + blocks) * W):
                clear_lane(c)
            block += blocks
        wall_first[6] = block
        counts[WALL_BLOCKS] = block

    @ti.func
    def clear_lane(c):
        b, k = c // W, c % W
        wall_grain[b][k] = counts[GRAINS]
        wall_gap[b][k] = FAR
        if ti.static(layout.polydisperse):
            write_empty(counts[FIRST_WALL] + b, k)
        for n in ti.static(range(size)):
            state[counts[FIRST_WALL] + b, n][k] = 0.0

    @ti.func
    def write_contact(g, n, c):
        first = counts[FIRST_WALL]
        b, k = c // W, c % W
        wall_grain[b][k] = g
        wall_gap[b][k] = 0.0
        if ti.static(layout.polydisperse):
            write_wall_constants(first + b, k, g)
        old = wall_slot[g][n]
        for m in ti.static(range(size)):
            value = ti.cast(0.0, layout.geometry)
            if old >= 0:
                value = load[first + old // W, m][old % W]
            state[first + b, m][k] = value

    @ti.kernel
    def relist_walls(box: Walls, time: ti.f64, reach: ti.f64, present: ti.types.vector(6, ti.i32)):
        grains, first = counts[GRAINS], counts[FIRST_WALL]
        chunks = (grains + CHUNK - 1) // CHUNK
        for _ in range(1):
            fold_impulses(counts[WALL_BLOCKS])
        for b in range(first, first + counts[WALL_BLOCKS]):
            for m in ti.static(range(size)):
                load[b, m] = state[b, m]
        for q in range(6 * chunks):
            n, chunk = q // chunks, q % chunks
            near = 0
            for g in range(chunk * CHUNK, ti.min((chunk + 1) * CHUNK, grains)):
                near += ti.cast(is_near(g, n, box, time, reach, present), ti.i32)
            wall_chunk[n, chunk] = near
        for _ in range(1):
            lay_out(chunks)
        for q in range(6 * chunks):
            n, chunk = q // chunks, q % chunks
            c = wall_first[n] * W + wall_chunk[n, chunk]
            for g in range(chunk * CHUNK, ti.min((chunk + 1) * CHUNK, grains)):
                if is_near(g, n, box, time, reach, present) and counts[OVERFLOW] == 0:
                    write_contact(g, n, c)
                    wall_slot[g][n] = c
                    c += 1
                else:
                    wall_slot[g][n] = -1

    return relist_walls
