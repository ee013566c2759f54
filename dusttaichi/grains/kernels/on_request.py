"""What is followed on request alone: orientations of grains, losses of each contact."""

import taichi as ti

from dusttaichi.grains.kernels.contacts import step01


@ti.data_oriented
class Orientations:
    """Rotations of the grains since the start, as unit quaternions w, x, y, z."""

    def __init__(self, fields, layout):
        self.q, self.w, self.real = fields["orientation"], fields["w"], layout.geometry

    @ti.func
    def carry_on(self, g, dt):
        """Turn grain g about its spin of the half step for a step: exact for a steady spin."""
        turn = ti.cast(dt, self.real) * self.w[g]
        angle = turn.norm()
        # sin(angle/2)/angle, also where nothing turns
        s = ti.select(angle > 1e-12, ti.sin(0.5 * angle) / ti.max(angle, 1e-30), 0.5)
        a, b = ti.cos(0.5 * angle), s * turn
        old = self.q[g]
        c, d = old[0], ti.Vector([old[1], old[2], old[3]])
        turned = a * d + c * b + b.cross(d)
        now = ti.Vector([a * c - b.dot(d), turned[0], turned[1], turned[2]])
        self.q[g] = now / now.norm()


@ti.data_oriented
class ContactLosses:
    """Energy that each contact has lost since it formed, by channel: columns of its state.

    loss: the sums of the ledger by tile, lane by lane; what a block adds to them is what its
    contacts lose. In double precision alone.
    """

    def __init__(self, fields, layout, loss):
        self.state, self.loss = fields["state"], loss
        self.first, self.channels = layout.lost, len(layout.channels)
        self.pointer = layout.first

    @ti.func
    def before(self, b, tile):
        """To be called before the loads of block b are computed."""
        for c in ti.static(range(self.channels)):
            self.state[b, self.first + c] = self.state[b, self.first + c] - self.loss[tile, c]

    @ti.func
    def after(self, b, tile):
        """To be called when they are; contacts that do not touch any more have lost nothing."""
        square = 0.0 * self.state[b, self.pointer]
        for a in ti.static(range(3)):
            square += self.state[b, self.pointer + a] * self.state[b, self.pointer + a]
        touching = step01(square - 0.5)
        for c in ti.static(range(self.channels)):
            lost = self.state[b, self.first + c] + self.loss[tile, c]
            self.state[b, self.first + c] = touching * lost
