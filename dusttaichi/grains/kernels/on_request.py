"""What is followed on request alone: orientations of grains, losses of each contact."""

from math import factorial

import taichi as ti

from dusttaichi.grains.kernels.contacts import step01

# of the series of cos(h) and sin(h)/h in h^2
COS = [(-1) ** n / factorial(2 * n) for n in range(1, 5)]
SIN = [(-1) ** n / factorial(2 * n + 1) for n in range(1, 5)]


@ti.data_oriented
class Orientations:
    """Rotations of the grains since the start, as unit quaternions w, x, y, z."""

    def __init__(self, fields, layout):
        self.q, self.real = fields["orientation"], layout.geometry

    @ti.func
    def carry_on(self, g, spin, dt):
        """Turn grain g about its spin of the half step for a step: a steady spin to rounding, up to
        a tenth of a radian a step.

        Sine and cosine of half the angle are summed up: those of a library would take as long as
        all else that a step does with a grain.
        """
        half = (0.5 * ti.cast(dt, self.real)) * spin
        h2 = half.dot(half)
        a = 1.0 + h2 * (COS[0] + h2 * (COS[1] + h2 * (COS[2] + h2 * COS[3])))
        b = half * (1.0 + h2 * (SIN[0] + h2 * (SIN[1] + h2 * (SIN[2] + h2 * SIN[3]))))
        old = self.q[g]
        c, d = old[0], ti.Vector([old[1], old[2], old[3]])
        turned = a * d + c * b + b.cross(d)
        now = ti.Vector([a * c - b.dot(d), turned[0], turned[1], turned[2]])
        # of a length that rounding alone takes from 1
        self.q[g] = now * (1.5 - 0.5 * now.dot(now))


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
