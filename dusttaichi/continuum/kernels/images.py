"""Contact of dust with faces and rigid bodies: mirror images behind their surfaces.

A rigid surface bounds what each particle i near it sees by the images j' of its neighbours j and of
itself. For a pair (i, j) the mirror is a plane, its normal n the mean of both normals, from which
they are as far on average as from the surface,

    x_i - x_j' = x_ij - n (n.x_ij) + n (d_i + d_j),

the same for (j, i'), and exact where the surface is flat. Relative to the rigid motion v_R the
image moves the opposite way (no slip: the velocity continues as an odd function across the
surface):

    v_i - v_j' = w_i + w_j + Omega x (x_i - x_j'),  w = v - v_R(x).

L is thus exact for every velocity that is linear in the distance, and for the motion of the body
itself. The forces are the adjoint: the power of the stress of i, V_i Q_i : V_j' (v_j' - v_i) (x)
grad W, has the force T = V_i V_j' Q_i grad W on i and on j, and -T on the body, at x_j' and at x_j.
So the power of the forces equals the stress power, and momentum and angular momentum are conserved.

An open contact has no images, for each particle separately: those of its own sums. Images behind
faces are those of planes (planes), and computed there.
"""

from dusttaichi.compute.engine import ti
from dusttaichi.continuum.kernels import tensors
from dusttaichi.continuum.kernels.smoothing import CLOSE
from dusttaichi.continuum.kernels.store import COLUMN, FACES, PARTS


@ti.data_oriented
class Images:
    """Images of particles beyond surfaces.

    fields, lists: see store.place; blocks: blocks.Blocks; layout: store.Layout; slope: that of the
    smoothing kernel; rigid: kernels.rigid.Rigid.
    """

    def __init__(self, fields, lists, blocks, layout, *, slope, rigid):
        self.f, self.lists, self.blocks, self.layout = fields, lists, blocks, layout
        self.slope, self.rigid, self.n = slope, rigid, layout.dimension

    @ti.func
    def apart(self, arm_i, arm_j, touch_i, touch_j, numbers: ti.template()):
        """(x_i - x_j', n) of a pair as (3,) each, and True where the image is in reach.

        It is not where the surface turns away by more than a right angle between them. arm: from
        the centre; touch: distance and normal, (4,).
        """
        n_i = ti.Vector([touch_i[1], touch_i[2], touch_i[3]])
        n_j = ti.Vector([touch_j[1], touch_j[2], touch_j[3]])
        between, n, away = arm_i - arm_j, n_i, touch_i[0] + touch_j[0]
        near = away < 2.0 * numbers.h and n_i.dot(n_j) > 0.0
        if near:
            n = (n_i + n_j).normalized()
            between += (away - n.dot(between)) * n
            near = between.norm_sqr() < 4.0 * numbers.h * numbers.h
        return between, n, near

    @ti.func
    def touch(self, i, row, numbers: ti.template()):
        """Distance and normal of particle i from the surface `row`, (4,)."""
        arm = self.rigid.arm(row, self.f.x[i], numbers)
        return self.rigid.surface(row, arm, numbers.h)

    @ti.func
    def clearance(self, i, numbers: ti.template()):
        """Distance of particle i from the nearest surface, or 2 h where all are out of reach."""
        least = 2.0 * numbers.h
        for e in range(self.lists.touch_first[i], self.lists.touch_first[i + 1]):
            row = self.lists.touch_row[e]
            if row >= FACES:
                least = ti.min(least, self.touch(i, row, numbers)[0])
        return least

    @ti.func
    def relative_motion(self, i, row, numbers: ti.template()):
        """Velocity of particle i relative to the body at its position."""
        return self.f.v[i] - self.rigid.motion(row, self.rigid.arm(row, self.f.x[i], numbers))

    @ti.func
    def sum_rate_terms(self, i, e, touch: ti.template(), numbers: ti.template()):
        """Terms of A and G of the first pass (rates) from images behind the surface of touch e."""
        self.clear(e)
        n = ti.static(self.n)
        row = self.lists.touch_row[e]
        arm = self.rigid.arm(row, self.f.x[i], numbers)
        w_i = self.f.v[i] - self.rigid.motion(row, arm)
        spin = self.rigid.vector(row, COLUMN.spin)
        begin, end = self.blocks.begin(i), self.blocks.end(i)
        for m in range(begin, end + 1):
            j, fraction, between, _, near = self.image(i, m, row, arm, touch, numbers)
            if near:
                arm_j = arm - self.rigid.raise_to_space(self.f.x[i] - self.f.x[j])
                weight = fraction * self.f.volume[j]
                weight *= self.slope(between.norm_sqr(), numbers.inv_h, numbers.scale)
                u = w_i + self.f.v[j] - self.rigid.motion(row, arm_j)
                u += self.rigid.flat(spin.cross(between))
                d = self.rigid.flat(between)
                for a, b in ti.static(ti.ndrange(n, n)):
                    self.add(e, n * a + b, -weight * d[a] * d[b])
                    self.add(e, n * n + n * a + b, -weight * u[a] * d[b])
        A, G = ti.Matrix.zero(ti.f64, n, n), ti.Matrix.zero(ti.f64, n, n)
        for a, b in ti.static(ti.ndrange(n, n)):
            A[a, b] = self.lists.touch[e, n * a + b]
            G[a, b] = self.lists.touch[e, n * n + n * a + b]
        return A, G

    @ti.func
    def image(self, i, m, row, arm, touch: ti.template(), numbers: ti.template()):
        """The image behind a surface of entry m of the list of particle i; of i itself behind all.

        (j, share, x_i - x_j', n, near): particle, the share of the surface, normal of the mirror,
        and True where particle and image are in reach, and not only in that of another one of the
        block.
        """
        j, near = i, m == self.blocks.end(i)
        if not near:
            j = self.lists.near[m]
            # most neighbours are too far from all surfaces
            if touch[0] + self.f.clearance[j] < 2.0 * numbers.h:
                far = (self.f.x[i] - self.f.x[j]).norm_sqr()
                near = j != i and far < 4.0 * numbers.h * numbers.h
        fraction, between, normal = 0.0, ti.Vector.zero(ti.f64, 3), ti.Vector.zero(ti.f64, 3)
        if near:
            arm_j = arm - self.rigid.raise_to_space(self.f.x[i] - self.f.x[j])
            touch_j = self.rigid.surface(row, arm_j, numbers.h)
            between, normal, near = self.apart(arm, arm_j, touch, touch_j, numbers)
            if near:
                fraction = self.rigid.share(row, 0.5 * (touch[0] + touch_j[0]))
        return j, fraction, between, normal, near

    @ti.func
    def push(self, i, numbers: ti.template()):
        """(stress, viscous, grid, power): forces of all images on particle i [N] and power [W].

        The power is that of both viscosities. Forces on the surfaces are written to `touch`, with
        their torques about the centres.
        """
        stress, power = ti.Vector.zero(ti.f64, self.n), 0.0
        viscous, grid = stress, stress
        for e in range(self.lists.touch_first[i], self.lists.touch_first[i + 1]):
            row = self.lists.touch_row[e]
            if row >= FACES:
                arm = self.rigid.arm(row, self.f.x[i], numbers)
                touch = self.rigid.surface(row, arm, numbers.h)
                self.clear(e)
                if touch[0] < 2.0 * numbers.h:
                    begin, end = self.blocks.begin(i), self.blocks.end(i)
                    for m in range(begin, end + 1):
                        j, fraction, between, n, near = self.image(i, m, row, arm, touch, numbers)
                        if near:
                            base = fraction * self.f.volume[i] * self.f.volume[j]
                            pair = self.pair(i, j, e, base, arm, between, n, numbers)
                            stress += pair[0]
                            viscous += pair[1]
                            grid += pair[2]
                            power += pair[3]
        return stress, viscous, grid, power

    @ti.func
    def pair(self, i, j, e, base, arm, between, n, numbers: ti.template()):
        """Forces on i of its images with j (stress, viscous, grid): T_ij + T_ji each.

        And the power of both viscosities. base: product of both volumes; between, n: x_i - x_j' and
        the normal of the mirror, (3,) both. The load on the surface is added to that of touch e.
        """
        row = self.lists.touch_row[e]
        arm_j = arm - self.rigid.raise_to_space(self.f.x[i] - self.f.x[j])
        stress, power = ti.Vector.zero(ti.f64, self.n), 0.0
        viscous, grid = stress, stress
        r2 = between.norm_sqr()
        weight = base * self.slope(r2, numbers.inv_h, numbers.scale)
        spin = self.rigid.vector(row, COLUMN.spin)
        w = self.f.v[i] - self.rigid.motion(row, arm)
        w += self.f.v[j] - self.rigid.motion(row, arm_j)
        mirrored = 2.0 * n.dot(between) * n - between
        d, d_j = self.rigid.flat(between), self.rigid.flat(mirrored)
        u = w + self.rigid.flat(spin.cross(between))
        u_j = w + self.rigid.flat(spin.cross(mirrored))
        weight_i, weight_j = weight * self.is_closed(i, row), weight * self.is_closed(j, row)
        closing = numbers.inv_h / (r2 * numbers.inv_h * numbers.inv_h + CLOSE)
        mu, mu_j = ti.min(u.dot(d), 0.0) * closing, ti.min(u_j.dot(d_j), 0.0) * closing
        middle = 2.0 * arm - self.rigid.raise_to_space(self.f.x[i] - self.f.x[j]) - between
        stress += weight_i * (tensors.matrix(self.f.flux[i], self.n) @ d)
        viscous += weight_i * self.resistance(i, j, mu) * d
        grid += weight_i * self.noise(i, u, d, numbers)
        if ti.static(self.layout.heat):
            power += (viscous + grid).dot(u)
        # twice on the body, at the place of j and at that of its image: the mean of both arms
        for component, force in ti.static(enumerate((stress, viscous, grid))):
            self.note(e, component, self.rigid.raise_to_space(force), middle)
        stress += weight_j * (tensors.matrix(self.f.flux[j], self.n) @ d_j)
        of_pairs = weight_j * self.resistance(i, j, mu_j) * d_j
        of_noise = weight_j * self.noise(j, u_j, d_j, numbers)
        if ti.static(self.layout.heat):
            power += (of_pairs + of_noise).dot(u_j)
        viscous += of_pairs
        grid += of_noise
        return stress, viscous, grid, power

    @ti.func
    def is_closed(self, i, row):
        """1 where the contact of particle i with a surface is closed; dust never leaves a layer."""
        out = 1.0
        if ti.static(self.layout.separate):
            out = ti.select(self.f.gap[i] >= 0.0, self.f.rigid[row, COLUMN.layer], 1.0)
        return out

    @ti.func
    def noise(self, i, u, d, numbers: ti.template()):
        """Force on grid noise per weight (forces), the share of particle i."""
        shear = self.f.impedance[i] * u - tensors.matrix(self.f.drag[i], self.n) @ d
        return numbers.grid * numbers.h * shear

    @ti.func
    def resistance(self, i, j, mu):
        """Half of alpha rho c mu - beta rho mu^2 of a pair (forces) [Pa].

        Two of these act on each pair. mu: speed of approach, negative.
        """
        out = 0.0
        if ti.static(self.layout.viscous):
            alpha = ti.max(self.f.alpha[i], self.f.alpha[j])
            beta = ti.max(self.f.beta[i], self.f.beta[j])
            linear = alpha * (self.f.impedance[i] + self.f.impedance[j])
            out = 0.25 * (linear - beta * (self.f.density[i] + self.f.density[j]) * mu) * mu
        return out

    @ti.func
    def note(self, e, component: ti.template(), force, middle):
        """Add the reaction to a force T of a pair to what touch e does to its surface."""
        torque = middle.cross(force)
        for a in ti.static(range(3)):
            self.add(e, 6 * component + a, -2.0 * force[a])
            self.add(e, 6 * component + 3 + a, -torque[a])

    @ti.func
    def clear(self, e):
        """Set the numbers of touch e to 0."""
        for c in ti.static(range(PARTS)):
            self.lists.touch[e, c] = 0.0

    @ti.func
    def add(self, e, c, value):
        """Add to a number of touch e, of which no other thread knows: `+=` would be an atomic one.

        A loop that stores to memory has no vectors. Few of its neighbours have an image in reach,
        and vectors of all of them take twice as long.
        """
        self.lists.touch[e, c] = self.lists.touch[e, c] + value
