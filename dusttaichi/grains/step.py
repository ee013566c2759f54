"""The time step: leapfrog, one screen. Each line of `advance` is a phase.

Between two calls the state is x and pointers at time n, the loads of time n, and v, w at n - 1/2.
A step kicks v, w to n + 1/2 and drifts x to n + 1, then turns the pointers with the spins of
n + 1/2 and computes the loads of n + 1. Positions, velocities, spins, pointers and twist are all
second order in dt (S12 sect. 4).
"""

from types import SimpleNamespace

import taichi as ti

from dusttaichi.grains.kernels.cell import make_cell
from dusttaichi.grains.kernels.grains import make_flux, make_grain_pass
from dusttaichi.grains.kernels.pairs import PairPass
from dusttaichi.grains.kernels.params import params_type
from dusttaichi.grains.kernels.polydisperse import make_numbers
from dusttaichi.grains.kernels.store import CHUNK, FIRST_WALL, GRAINS, PAIRS, WALL_BLOCKS
from dusttaichi.grains.kernels.walls import WallPass, Walls
from dusttaichi.grains.kernels.workers import STRIDE, barrier, muster

Motion = ti.types.struct(
    dt=ti.f64,
    kick=ti.f64,  # dt / m
    turn=ti.f64,  # dt / I
    reach2=ti.f64,  # square of the way a grain may go before a new search
    wall_due=ti.i64,  # step at which a wall has gone that way
)


DONE, DUE = 6, 7  # places in the `sync` field


def make_advance(fields, layout, laws, walls, drive):
    """Compile-time choice of the step; returns `advance`.

    `advance(steps, first, pending, workers, motion, pair, wall, box)` makes up to `steps` steps
    from step number `first`; with `pending` the first one has drifted already and lacks its
    contacts (a search came between). It ends early when a search is due. sync[DONE] tells.
    drive: "workers" (CPU: many steps in one kernel call) or "launches" (GPU: a kernel a phase).
    """
    phases = make_phases(fields, layout, laws, walls)
    make = {"workers": make_workers, "launches": make_launches}[drive]
    return make(fields, layout, phases, walls)


def make_workers(fields, layout, phases, walls):
    """`advance` as one kernel: workers that pass their share of every phase (kernels.workers)."""
    sync = fields["sync"]
    ContactParams = phases.ContactParams

    @ti.kernel
    def advance(
        steps: ti.i32,
        first: ti.i64,
        pending: ti.i32,
        workers: ti.i32,
        motion: Motion,
        pair: ContactParams,
        wall: ContactParams,
        box: Walls,
    ):
        for k in range(8):
            sync[k] = 0
        for q in range(workers * STRIDE):
            if q % STRIDE == 0:
                me, crew = muster(sync, workers)
                done, met, drifted = 0, 0, pending
                while done < steps and crew > 0:
                    if drifted == 0:
                        phases.move_grains(me, crew, motion)
                        met += crew
                        barrier(sync, met)
                        if sync[DUE] == 1 or first + done + 1 >= motion.wall_due:
                            break
                    drifted = 0
                    phases.pass_pairs(me, crew, first + done + 1, motion.dt, pair)
                    if ti.static(walls):
                        phases.pass_walls(me, crew, first + done + 1, motion.dt, wall, box)
                    met += crew
                    barrier(sync, met)
                    done += 1
                if me == 0:
                    sync[DONE] = done

    return advance


def make_launches(fields, layout, phases, walls):
    """`advance` as a loop in Python over kernels with one parallel loop a phase."""
    sync, counts = fields["sync"], fields["counts"]
    ContactParams = phases.ContactParams

    @ti.kernel
    def drift(motion: Motion):
        sync[DUE] = 0
        for part in range(phases.parts()):
            if phases.move_part(part, motion) == 1:
                sync[DUE] = 1

    @ti.kernel
    def touch(step: ti.i64, dt: ti.f64, pair: ContactParams, wall: ContactParams, box: Walls):
        for tile in range(phases.tiles(counts[PAIRS], layout.width * layout.tile)):
            phases.pair_tile(tile, dt, pair, phases.frame(step, dt))
        if ti.static(walls):
            for tile in range(phases.tiles(counts[WALL_BLOCKS], layout.tile)):
                phases.wall_tile(tile, step, dt, wall, box)

    def advance(steps, first, pending, workers, motion, pair, wall, box):
        done = 0
        while done < steps:
            if not pending:
                drift(motion)
                if sync[DUE] == 1 or first + done + 1 >= motion.wall_due:
                    break
            pending = 0
            touch(first + done + 1, motion.dt, pair, wall, box)
            done += 1
        sync[DONE] = done

    return advance


def make_phases(fields, layout, laws, walls):
    """The phases of a step: for one grain or tile, and for one worker of a crew."""
    move = make_grain_pass(fields, layout)
    pairs = PairPass(fields, layout, laws)
    counts, sync = fields["counts"], fields["sync"]
    W, T = layout.width, layout.tile
    frame = make_cell(fields, layout)[0]
    add_flux = make_flux(fields, layout) if layout.stress else None
    of_pairs, of_walls = make_numbers(fields, layout, laws)
    # a stress is summed by chunks of grains, so that its bits do not depend on the workers
    size_of_part = CHUNK if layout.stress else 1

    @ti.func
    def parts():
        return (counts[GRAINS] + size_of_part - 1) // size_of_part

    @ti.func
    def tiles(contacts, size):
        return (contacts + size - 1) // size

    @ti.func
    def pair_tile(tile, dt, pair, frame):
        for b in range(tile * T, ti.min((tile + 1) * T, tiles(counts[PAIRS], W))):
            pairs.block(b, tile, of_pairs(b, pair), dt, frame)

    @ti.func
    def move_part(part, motion):
        due = 0
        if ti.static(layout.stress):
            due = add_flux(part, move, motion)
        else:
            due = move(part, motion.kick, motion.turn, motion.dt, motion.reach2)
        return due

    @ti.func
    def move_grains(me, crew, motion):
        due, n = 0, parts()
        for part in range(n * me // crew, n * (me + 1) // crew):
            due = ti.max(due, move_part(part, motion))
        if due == 1:
            sync[DUE] = 1

    @ti.func
    def pass_pairs(me, crew, step, dt, pair):
        n = tiles(counts[PAIRS], W * T)
        here = frame(step, dt)
        for tile in range(n * me // crew, n * (me + 1) // crew):
            pair_tile(tile, dt, pair, here)

    phases = SimpleNamespace(
        ContactParams=params_type(laws, layout.geometry, layout.law),
        parts=parts,
        move_part=move_part,
        tiles=tiles,
        frame=frame,
        pair_tile=pair_tile,
        move_grains=move_grains,
        pass_pairs=pass_pairs,
    )
    if not walls:
        return phases

    touching = WallPass(fields, layout, laws)

    @ti.func
    def wall_tile(tile, step, dt, wall, box):
        for c in range(tile * T, ti.min((tile + 1) * T, counts[WALL_BLOCKS])):
            plane = touching.plane(c, box, dt * step)
            touching.block(c, tile, plane, of_walls(counts[FIRST_WALL] + c, wall), dt)

    @ti.func
    def pass_walls(me, crew, step, dt, wall, box):
        n = tiles(counts[WALL_BLOCKS], T)
        for tile in range(n * me // crew, n * (me + 1) // crew):
            wall_tile(tile, step, dt, wall, box)

    phases.wall_tile, phases.pass_walls = wall_tile, pass_walls
    return phases
