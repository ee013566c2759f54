"""First pass: velocity gradient with corrected kernel gradients, and the response of the dust.

A_i = -sum_j V_j x_ij (x) grad W,  G_i = sum_j V_j (v_j - v_i) (x) grad W,  C = A^-1,  L = G C
(Randles & Libersky 1996): L is exact where the velocity is a linear function of place. Near a
rigid surface the sums include mirror images (images).
"""

from dusttaichi.compute.engine import ti
from dusttaichi.continuum.kernels import tensors
from dusttaichi.continuum.kernels.smoothing import KERNELS
from dusttaichi.continuum.kernels.store import COLUMN, DT, FACES, OLD
from dusttaichi.results.roles import DUST, ELASTIC

FEW = 0.05  # determinant of A below which a particle has too few neighbours to correct its gradient
DAMPED = 5.0  # viscosity of pairs that allows as long a step as one on grid noise
STILL = 1e-12  # [1/s], keeps the share of a body at rest from being 0/0
STRAIN = 1e-30  # keeps a rate of strain of zero from being divided by


@ti.data_oriented
class Rates:
    """Rates of the particles.

    fields, lists: see store.place; layout: store.Layout; blocks: blocks.Blocks; law: the response
    to a velocity gradient (response.Response); images: images.Images or None; planes:
    planes.Planes or None; contact: separation.Separation or None; hourglass: hourglass.Hourglass
    or None.
    """

    def __init__(self, fields, lists, layout, *, blocks, law, images, planes, contact, hourglass):
        self.f, self.lists, self.layout, self.blocks = fields, lists, layout, blocks
        self.slope = KERNELS[layout.kernel]
        self.law, self.images, self.planes, self.contact = law, images, planes, contact
        self.hourglass = hourglass
        self.n, self.lanes = layout.dimension, layout.lanes

    @ti.func
    def pass_over(self, block, numbers: ti.template(), material: ti.template()):
        """Update the particles of a block from the motion of their neighbours.

        Returns their fastest speed of signals [m/s], at least their own speed, so that a step
        cannot carry one past a neighbour.
        """
        fastest = 0.0
        self.blocks.find_neighbours(block, numbers)
        # of pairs and of images: no grid noise is found in these
        pairs, images = self.sums(), self.sums()
        self.add_pairs(block, pairs, numbers)
        if ti.static(self.layout.faces):
            if self.planes.near_any(block, numbers):
                self.add_images(block, images, numbers)
        for lane in range(self.lanes):
            i = block * self.lanes + lane
            if i < numbers.count:
                fastest = ti.max(fastest, self.f.v[i].norm())
                role = self.f.role[i]
                if role == DUST or role == ELASTIC:
                    A, of_pairs = self.of_lane(pairs.A, lane), self.of_lane(pairs.G, lane)
                    A += self.of_lane(images.A, lane)
                    for a, b in ti.static(ti.ndrange(self.n, self.n)):
                        if ti.static(a > b):
                            A[a, b] = A[b, a]
                    lanes = ti.Struct(
                        A=A, G=of_pairs + self.of_lane(images.G, lane), of_pairs=of_pairs,
                        foreign=pairs.foreign[lane], squares=pairs.squares[lane],
                    )  # fmt: skip
                    fastest = ti.max(fastest, self.update_stress(i, lanes, numbers, material))
        return fastest

    @ti.func
    def sums(self):
        """Sums of a block, 0: A, of which the upper half, G, foreign volume, squares of motion."""
        return ti.Struct(
            A=ti.Vector.zero(ti.f64, ti.static(self.n**2 * self.lanes)),
            G=ti.Vector.zero(ti.f64, ti.static(self.n**2 * self.lanes)),
            foreign=ti.Vector.zero(ti.f64, self.lanes),
            squares=ti.Vector.zero(ti.f64, self.lanes),
        )

    @ti.func
    def of_lane(self, sums: ti.template(), lane):
        """The matrix of a lane."""
        out = ti.Matrix.zero(ti.f64, self.n, self.n)
        for a, b in ti.static(ti.ndrange(self.n, self.n)):
            out[a, b] = sums[(self.n * a + b) * self.lanes + lane]
        return out

    @ti.func
    def add_pairs(self, block, sums: ti.template(), numbers: ti.template()):
        """Add up the pairs of a block."""
        lanes, first = self.blocks.place_lanes(block, numbers), block * self.lanes
        for k in range(self.blocks.begin(first), self.blocks.end(first)):
            j = self.lists.near[k]
            x, v, volume, side_j = self.f.x[j], self.f.v[j], self.f.volume[j], 0
            if ti.static(self.layout.separate or self.layout.viscous):
                side_j = self.f.side[j]
            for lane in range(self.lanes):
                d, u = self.blocks.apart(lane, lanes.motion, x, v)
                weight = volume * self.slope(d.norm_sqr(), numbers.inv_h, numbers.scale)
                if ti.static(self.layout.separate or self.layout.viscous):
                    foreign = ti.select(side_j != lanes.side[lane], weight, 0.0)
                    sums.foreign[lane] += foreign
                    weight -= lanes.opened[lane] * foreign
                sums.squares[lane] += weight * u.norm_sqr()
                self.add_pair(lane, d, u, weight, sums)

    @ti.func
    def add_pair(self, lane, d, u, weight, sums: ti.template()):
        """Add a pair to A and G of a lane."""
        n, lanes = ti.static(self.n, self.lanes)
        for b in ti.static(range(n)):
            wd = weight * d[b]
            for a in ti.static(range(n)):
                sums.G[(n * a + b) * lanes + lane] -= u[a] * wd
                if ti.static(a <= b):
                    sums.A[(n * a + b) * lanes + lane] -= d[a] * wd

    @ti.func
    def add_images(self, block, sums: ti.template(), numbers: ti.template()):
        """Add images behind faces to A and G of those particles whose contact is closed."""
        lanes, first = self.blocks.place_lanes(block, numbers), block * self.lanes
        for row in range(FACES):
            plane = self.planes.plane(row, numbers)
            nearest = self.planes.place_lanes(block, plane, lanes, numbers)
            if nearest < 2.0 * numbers.h:
                for k in range(self.blocks.begin(first), self.blocks.end(first)):
                    j = self.lists.near[k]
                    image = self.planes.image(j, plane, numbers)
                    if nearest + image.distance < 2.0 * numbers.h:
                        volume = self.f.volume[j]
                        for lane in range(self.blocks.width(numbers)):
                            d, u = self.blocks.apart(lane, lanes.motion, image.x, image.v)
                            weight = self.slope(d.norm_sqr(), numbers.inv_h, numbers.scale)
                            weight *= volume * lanes.face[lane]
                            weight *= self.planes.in_reach(
                                lane, d, image, plane.normal, lanes.face, numbers
                            )
                            self.add_pair(lane, d, u, weight, sums)

    @ti.func
    def update_stress(
        self, i, sums: ti.template(), numbers: ti.template(), material: ti.template()
    ):
        """Stress of particle i from the sums over its neighbours; returns its speed of signals.

        They are its own; of_pairs: G without images.
        """
        opened, near = self.blocks.is_open(i), sums.foreign
        if ti.static(self.layout.rigid):
            for e in range(self.lists.touch_first[i], self.lists.touch_first[i + 1]):
                row = self.lists.touch_row[e]
                touch = self.images.touch(i, row, numbers)
                if touch[0] < 2.0 * numbers.h:
                    near -= 1.0 - self.f.rigid[row, COLUMN.layer]
                    if ti.static(self.layout.bodies):
                        if row >= FACES and self.images.is_closed(i, row) == 1.0:
                            more_A, more_G = self.images.sum_rate_terms(i, e, touch, numbers)
                            sums.A += more_A
                            sums.G += more_G
        C = ti.Matrix.identity(ti.f64, self.n)
        if sums.A.determinant() >= FEW:
            C = sums.A.inverse()
        L = sums.G @ C
        m = self.law.material(i, material)
        stress, swollen = self.law.respond(i, L, self.f.clock[DT], numbers, m)
        # neighbours count with the volumes of the first pass, the particle with its new one
        flux, impedance = (swollen * stress) @ C, self.f.impedance[i]
        damping = numbers.grid * numbers.h * impedance
        self.f.load[i], self.f.damping[i] = tensors.rows(flux - damping * L), damping
        if ti.static(self.layout.rigid):
            self.f.flux[i], self.f.drag[i] = tensors.rows(flux), impedance * tensors.rows(L)
        self.dissipate(i, -damping * (sums.squares + tensors.double_dot(L, sums.of_pairs)))
        self.resist(i, L, near * (1.0 - opened) < 0.0, numbers)
        if ti.static(self.layout.hourglass):
            self.hourglass.follow(i, L, numbers)
        if ti.static(self.layout.artificial_stress):
            self.f.tension[i] = tensors.rows(tensors.scale_tension(stress, -numbers.tension))
        if ti.static(self.layout.separate):
            self.contact.follow(i, stress, numbers)
        D = 0.5 * (L + L.transpose())
        damped = ti.max(self.f.alpha[i], DAMPED * numbers.grid)
        strain = numbers.h * ti.sqrt(tensors.double_dot(D, D) + STRAIN)
        sound = impedance / self.f.density[i]
        return sound * ti.max(1.0, damped) + (1.0 + numbers.quadratic) * strain

    @ti.func
    def dissipate(self, i, power):
        """Note the power over volume that grid noise loses, and its part of the last kick.

        The work of a constant force is 3/4 of the power at its start and 1/4 of that at its end,
        since the power is quadratic in the velocities.
        """
        half = 0.5 * (self.f.clock[OLD] + self.f.clock[DT])
        power *= self.f.volume[i]
        self.f.noise_power[i] = power
        self.f.loss[i][1] = self.f.loss[i][1] + 0.25 * half * power

    @ti.func
    def resist(self, i, L: ti.template(), touches, numbers: ti.template()):
        """Coefficients of the viscosity by pairs of particle i.

        Coefficients of the bulk act only where it is compressed rather than sheared (Balsara 1995).
        """
        if ti.static(self.layout.viscous):
            W = 0.5 * (L - L.transpose())
            curl = ti.sqrt(2.0 * tensors.double_dot(W, W))
            volume = ti.abs(L.trace())
            fraction = volume / (volume + numbers.limiter * curl + STILL)
            self.f.alpha[i] = ti.select(touches, numbers.contact, fraction * numbers.bulk)
            self.f.beta[i] = fraction * numbers.quadratic
