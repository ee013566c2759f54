"""One pass over the contacts between grains: pointers, loads, losses, a block at a time."""

import taichi as ti

from dusttaichi.grains.kernels.cell import make_cell
from dusttaichi.grains.kernels.contacts import BREAKING, ContactPass


@ti.data_oriented
class PairPass(ContactPass):
    """`block(b, tile, p, step, frame)` updates block b of pairs and the sums of its tile.

    p: the numbers of the contacts. step: the time step. frame: of a periodic cell (kernels.cell);
    anything in a scene without.

    What the contacts of a block remember is kept as pointers (kernels.pointers) or as deviations
    (kernels.deviations), which say

    - held(b): what was kept, with `was`, 1 where lanes touched a step ago;
    - ways(b, p, step, frame): the struct of where the grains are and how they move: d, dv, inv (one
      over the distance), nc, back (n_c half a step ago), w1, w2, turn1, turn2 (spins, times the
      step);
    - overlap(way, p); speed(way), speed_then(way, dt): u and u_then of ContactPass;
    - pose(at, held, way, p): the struct that ContactPass.springs takes, limits kept;
    - keep(b, on, way, pose): writes it;
    - tables(fields, layout): the SumTables; add_face_work(tile, value): to that of a periodic cell;
    - where forming and breaking are entered afterwards note_ends(b, tile, on); any_ends(tile);
      has_ends(b); settle(b, tile, p, step, frame).
    """

    def __init__(self, fields, layout, laws):
        super().__init__(fields, layout, laws, self.tables(fields, layout))
        self.pair_i, self.pair_j = fields["pair_i"], fields["pair_j"]
        self.periodic = bool(layout.periodic)
        _, self.across_faces, self.power = make_cell(fields, layout)

    @ti.func
    def gathered(self, b, frame):
        """Distance vector and its rate, spins of both grains, of a block."""
        i, j = self.pair_i[b], self.pair_j[b]
        d = self.gather(self.x, i).minus(self.gather(self.x, j))
        dv = self.gather(self.v, i).minus(self.gather(self.v, j))
        if ti.static(self.periodic):
            d, dv = self.across_faces(b, d, 0, frame), self.across_faces(b, dv, 1, frame)
        return d, dv, self.gather(self.w, i), self.gather(self.w, j)

    @ti.func
    def block(self, b, tile, p, step, frame):
        dt = self.one(step)
        way = self.ways(b, p, step, frame)
        u, held = self.speed(way), self.held(b)
        overlap, u_then = self.overlap(way, p), u
        if ti.static(self.has_asperities):
            u_then = self.speed_then(way, dt)
        # weight masks what lanes that did not touch a step ago would lose: deviations of zero are
        # those of pointers along the line of centres, which a grain that flies past turns
        at = ti.Struct(
            b=b, tile=tile, dt=dt, overlap=overlap, u=u, u_now=way.dv.dot(way.nc), u_then=u_then,
            was=held.was, weight=held.was,
        )  # fmt: skip
        on = self.touch(at, p)
        push = self.push(at, on, p)

        pose = self.pose(at, held, way, p)
        self.keep(b, on, way, pose)
        found = self.springs(pose, p)
        if ti.static(self.has_twisting):
            rate = way.w1.minus(way.w2).dot(way.back)
            angle = way.turn1.minus(way.turn2).dot(way.back)
            axial, stored = self.twist(at, on, angle, rate, p)
            self.add_twist(found, way.nc.times(axial), stored)
        if ti.static(not self.settles):
            self.end_springs(at, on, found, way)
        force = way.nc.times(push).plus(found.force.times(on.kept))
        self.put(self.load, b, 0, force)
        self.put(self.load, b, 3, found.torque1.times(on.kept))
        self.put(self.load, b, 6, force.times(-1.0))
        self.put(self.load, b, 9, found.torque2.times(on.kept))
        if ti.static(self.periodic):
            self.add_face_work(tile, dt * self.power(b, force, frame))
        if ti.static(self.stress):
            self.add_virial(tile, way.d, force, dt)
        if ti.static(self.settles):
            self.note_ends(b, tile, on)

    @ti.func
    def add_twist(self, found: ti.template(), torque, stored):
        """Adds to the springs that were found the torque of twisting and what it has stored."""
        found.torque1, found.torque2 = found.torque1.plus(torque), found.torque2.minus(torque)
        found.stored += stored

    @ti.func
    def end_springs(self, at: ti.template(), on: ti.template(), found: ti.template(), way):
        """What the springs of contacts that break have stored. A spring that breaks has worked for
        half a step less than its displacement says."""
        spun = found.torque1.dot(way.turn1) + found.torque2.dot(way.turn2)
        work = at.dt * found.force.dot(way.dv) + spun
        self.lose(at.tile, BREAKING, on.broken * (found.stored + 0.5 * work))
