"""The time step: leapfrog, one screen. Each line of `advance` is a phase.

Between two calls the state is x and pointers at time n, the loads of time n, and v, w at n - 1/2.
A step kicks v, w to n + 1/2 and drifts x to n + 1, then turns the pointers with the spins of
n + 1/2 and computes the loads of n + 1. Positions, velocities, spins, pointers and twist are all
second order in dt (S12 sect. 4).
"""

import taichi as ti

from dusttaichi.kernels.contacts import make_pair_pass
from dusttaichi.kernels.grains import make_grain_pass
from dusttaichi.kernels.params import ContactParams
from dusttaichi.kernels.store import TILE_BLOCKS, capacity
from dusttaichi.kernels.walls import Walls, make_wall_pass
from dusttaichi.kernels.workers import STRIDE, barrier, muster

Motion = ti.types.struct(
    dt=ti.f64,
    kick=ti.f64,  # dt / m
    turn=ti.f64,  # dt / I
    reach2=ti.f64,  # square of the way a grain may go before a new search
    wall_due=ti.i64,  # step at which a wall has gone that way
)


def make_advance(fields, layout, effects, grains, walls):
    """Compile-time choice of the step; returns the kernel `advance`.

    `advance(steps, first, pending, workers, ...)` makes up to `steps` steps from step number
    `first`; with `pending` the first one has drifted already and lacks its contacts (a search came
    between). It ends early when a search is due. sync[DONE] and sync[DUE] tell.
    """
    phases = make_phases(fields, layout, effects, grains, walls)
    move_grains, pass_pairs, pass_walls = phases
    sync = fields["sync"]

    @ti.kernel
    def advance(steps: ti.i32, first: ti.i64, pending: ti.i32, workers: ti.i32,
                motion: Motion, pair: ContactParams, wall: ContactParams, box: Walls):  # fmt: skip
        for k in range(8):
            sync[k] = 0
        for q in range(workers * STRIDE):
            if q % STRIDE == 0:
                me, crew = muster(sync, workers)
                done, met, drifted = 0, 0, pending
                while done < steps and crew > 0:
                    if drifted == 0:
                        move_grains(me, crew, motion)
                        met += crew
                        barrier(sync, met)
                        if sync[DUE] == 1 or first + done + 1 >= motion.wall_due:
                            break
                    drifted = 0
                    pass_pairs(me, crew, motion.dt, pair)
                    if ti.static(walls):
                        pass_walls(me, crew, first + done + 1, motion.dt, wall, box)
                    met += crew
                    barrier(sync, met)
                    done += 1
                if me == 0:
                    sync[DONE] = done

    return advance


DONE, DUE = 6, 7  # places in the `sync` field


def make_phases(fields, layout, effects, grains, walls):
    """The phases of a step for one worker of a crew: grains, pairs, walls."""
    move = make_grain_pass(fields, layout)
    pair_block = make_pair_pass(fields, layout, effects)
    counts, sync = fields["counts"], fields["sync"]
    width = layout.width
    first_wall_block = capacity(grains, layout, walls)[0]

    @ti.func
    def move_grains(me, crew, motion):
        due = 0
        for g in range(grains * me // crew, grains * (me + 1) // crew):
            due = ti.max(due, move(g, motion.kick, motion.turn, motion.dt, motion.reach2))
        if due == 1:
            sync[DUE] = 1

    @ti.func
    def pass_pairs(me, crew, dt, pair):
        tiles = (counts[0] + width * TILE_BLOCKS - 1) // (width * TILE_BLOCKS)
        for tile in range(tiles * me // crew, tiles * (me + 1) // crew):
            for b in range(tile * TILE_BLOCKS, (tile + 1) * TILE_BLOCKS):
                pair_block(b, tile, pair, dt)

    if not walls:
        return move_grains, pass_pairs, None

    wall_block = make_wall_pass(fields, layout, effects)
    wall_of = fields["wall_of"]

    @ti.func
    def pass_walls(me, crew, step, dt, wall, box):
        blocks = counts[1]
        tiles = (blocks + TILE_BLOCKS - 1) // TILE_BLOCKS
        # from the other end: the worker with the smaller share of pairs gets the odd tile
        for tile in range(tiles * me // crew, tiles * (me + 1) // crew):
            for c in range(tile * TILE_BLOCKS, ti.min((tile + 1) * TILE_BLOCKS, blocks)):
                k = wall_of[c]
                unit_normal = ti.Vector([box.normal[k, 0], box.normal[k, 1], box.normal[k, 2]])
                offset = box.offset[k] + box.speed[k] * (dt * step)
                wall_block(c, tile, first_wall_block, unit_normal, offset, box.speed[k],
                           box.strength[k], wall, dt)  # fmt: skip

    return move_grains, pass_pairs, pass_walls
