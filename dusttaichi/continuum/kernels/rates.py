"""First pass: velocity gradient with corrected kernel gradients, and the response of the dust.

A_i = -sum_j V_j x_ij (x) grad W,  G_i = sum_j V_j (v_j - v_i) (x) grad W,  C = A^-1,  L = G C
(Randles & Libersky 1996): L is exact where the velocity is a linear function of place. Near a
rigid surface the sums include mirror images (images).
"""

from dusttaichi.compute.engine import ti
from dusttaichi.continuum.kernels import tensors
from dusttaichi.continuum.kernels.smoothing import KERNELS
from dusttaichi.continuum.kernels.store import DT, LAYER, VECTOR, near_begin
from dusttaichi.samples.continuum.particles import DUST, ELASTIC

FEW = 0.05  # determinant of A below which a particle has too few neighbours to correct its gradient
DAMPED = 5.0  # viscosity of pairs that allows as long a step as one on grid noise
STILL = 1e-12  # [1/s], keeps the share of a body at rest from being 0/0
STRAIN = 1e-30  # keeps a rate of strain of zero from being divided by


@ti.data_oriented
class Rates:
    """Rates of the particles.

    fields, lists: see store.place; layout: store.Layout; law: the response to a velocity gradient
    (response.Response); images: images.Images or None; contact: separation.Separation or None;
    hourglass: hourglass.Hourglass or None.
    """

    def __init__(self, fields, lists, layout, *, law, images, contact, hourglass):
        self.f, self.lists, self.layout = fields, lists, layout
        self.slope = KERNELS[layout.kernel]
        self.law, self.images, self.contact = law, images, contact
        self.hourglass = hourglass
        self.n = layout.dimension

    @ti.func
    def pass_over(self, i, numbers: ti.template(), material: ti.template()):
        """Update particle i from the motion of its neighbours; returns its speed of signals [m/s].

        At least its own speed, so that a step cannot carry it past a neighbour.
        """
        speed = self.f.v[i].norm()
        self.find_neighbours(i, 4.0 * numbers.h * numbers.h)
        role = self.f.role[i]
        if role == DUST or role == ELASTIC:
            speed = ti.max(speed, self.update_stress(i, numbers, material))
        return speed

    @ti.func
    def find_neighbours(self, i, reach2):
        """Select the listed neighbours of particle i within reach of the kernel.

        They are padded to whole vectors of the processor with the particle itself, which adds
        nothing.
        """
        x, begin = self.f.x[i], near_begin(self.lists, i)
        found = begin
        for k in range(self.lists.first[i], self.lists.first[i + 1]):
            j = self.lists.entry[k]
            # one out of reach is overwritten by the next: no unpredictable branch
            self.lists.near[found] = j
            found += ti.cast((x - self.f.x[j]).norm_sqr() < reach2, ti.i32)
        for k in ti.static(range(VECTOR - 1)):
            self.lists.near[found + k] = i
        self.lists.near_counts[i] = (found - begin + VECTOR - 1) // VECTOR * VECTOR

    @ti.func
    def update_stress(self, i, numbers: ti.template(), material: ti.template()):
        x, v = self.f.x[i], self.f.v[i]
        A = ti.Matrix.zero(ti.f64, self.n, self.n)
        G = ti.Matrix.zero(ti.f64, self.n, self.n)
        near, side, opened = 0.0, 0, 0.0
        if ti.static(self.layout.separate or self.layout.viscous):
            side, opened = self.f.side[i], self.opened(i)
        begin = near_begin(self.lists, i)
        for k in range(begin, begin + self.lists.near_counts[i]):
            j = self.lists.near[k]
            d, u = x - self.f.x[j], v - self.f.v[j]
            weight = self.f.volume[j] * self.slope(d.norm_sqr(), numbers.inv_h, numbers.scale)
            if ti.static(self.layout.separate or self.layout.viscous):
                # sums and selections alone: an `and` would be a branch, which prevents vectors
                foreign = ti.select(self.f.side[j] != side, weight, 0.0)
                near += foreign
                weight -= opened * foreign
            for b in ti.static(range(self.n)):
                wd = weight * d[b]
                for a in ti.static(range(self.n)):
                    G[a, b] -= u[a] * wd
                    if ti.static(a <= b):
                        A[a, b] -= d[a] * wd
        for a, b in ti.static(ti.ndrange(self.n, self.n)):
            if ti.static(a > b):
                A[a, b] = A[b, a]
        if ti.static(self.layout.rigid):
            for e in range(self.lists.touch_first[i], self.lists.touch_first[i + 1]):
                row = self.lists.touch_row[e]
                touch = self.images.touch(i, row, numbers)
                if touch[0] < 2.0 * numbers.h:
                    near -= 1.0 - self.f.rigid[row, LAYER]
                    if self.images.closed(i, row) == 1.0:
                        more_A, more_G = self.images.strained(i, row, touch, numbers)
                        A += more_A
                        G += more_G
        C = ti.Matrix.identity(ti.f64, self.n)
        if A.determinant() >= FEW:
            C = A.inverse()
        L = G @ C
        m = self.law.material(i, material)
        stress, swollen = self.law.respond(i, L, self.f.clock[DT], numbers, m)
        # neighbours count with the volumes of the first pass, the particle with its new one
        self.f.flux[i] = tensors.rows((swollen * stress) @ C)
        impedance = self.f.impedance[i]
        self.f.drag[i] = impedance * tensors.rows(L)
        self.resist(i, L, near * (1.0 - opened) < 0.0, numbers)
        if ti.static(self.layout.hourglass):
            self.hourglass.follow(i, L, numbers)
        if ti.static(self.layout.artificial_stress):
            self.f.tension[i] = tensors.rows(tensors.pulled(stress, -numbers.tension))
        if ti.static(self.layout.separate):
            self.contact.follow(i, stress, numbers)
        D = 0.5 * (L + L.transpose())
        damped = ti.max(self.f.alpha[i], DAMPED * numbers.grid)
        strain = numbers.h * ti.sqrt(tensors.double_dot(D, D) + STRAIN)
        sound = impedance / self.f.density[i]
        return sound * ti.max(1.0, damped) + (1.0 + numbers.quadratic) * strain

    @ti.func
    def resist(self, i, L: ti.template(), touches, numbers: ti.template()):
        """Coefficients of the viscosity by pairs of particle i.

        Coefficients of the bulk act only where it is compressed rather than sheared (Balsara 1995).
        """
        if ti.static(self.layout.viscous):
            W = 0.5 * (L - L.transpose())
            curl = ti.sqrt(2.0 * tensors.double_dot(W, W))
            volume = ti.abs(L.trace())
            share = volume / (volume + numbers.limiter * curl + STILL)
            self.f.alpha[i] = ti.select(touches, numbers.contact, share * numbers.bulk)
            self.f.beta[i] = share * numbers.quadratic

    @ti.func
    def opened(self, i):
        """1 where the contact of particle i is open."""
        out = 0.0
        if ti.static(self.layout.separate):
            out = ti.select(self.f.gap[i] >= 0.0, 1.0, 0.0)
        return out
