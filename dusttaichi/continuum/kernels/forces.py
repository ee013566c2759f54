"""Second pass: the forces between particles, the adjoint of the first (Bonet & Lok 1999).

m_i dv_i/dt = sum_j V_i V_j (Q_i + Q_j) grad W + viscosity + m_i g with Q = sigma C, so that the
power of the forces equals the stress power and rigid motion takes none.

Two viscosities. The one of Monaghan & Gingold (1983), by pairs, alpha (rho c) mu - beta rho mu^2
with means of rho c and rho: at contacts with rigid surfaces, and optionally in the bulk. The other
acts on grid noise alone: with R = -1/2 sum_ij k_i V_i V_j F_ij |v_ij - L_i x_ij|^2 the forces
-dR/dv vanish for every velocity that is linear in place, dissipate 2 R >= 0, and conserve momentum
and angular momentum, since L_i is the fit that minimises R.

Artificial stress (Gray et al. 2001): (R_i + R_j) f^n with R = -epsilon times the tensile part of
the stress and f the kernel over its value at the spacing, against the pairing of particles.
"""

from dusttaichi.compute.engine import ti
from dusttaichi.continuum.kernels import tensors
from dusttaichi.continuum.kernels.smoothing import CLOSE, KERNELS, SHAPES
from dusttaichi.continuum.kernels.store import near_begin
from dusttaichi.samples.continuum.particles import DUST, ELASTIC


@ti.data_oriented
class Forces:
    """Forces on the particles.

    fields, lists: see store.place; layout: store.Layout; images: images.Images or None; attraction:
    attraction.Attraction or None; hourglass: hourglass.Hourglass or None.
    """

    def __init__(self, fields, lists, layout, *, images, attraction, hourglass):
        self.f, self.lists, self.layout, self.images = fields, lists, layout, images
        self.attraction, self.hourglass = attraction, hourglass
        self.slope, self.shape = KERNELS[layout.kernel], SHAPES[layout.kernel]
        self.n = layout.dimension

    @ti.func
    def pass_over(self, i, numbers: ti.template()):
        """Compute the force on particle i, and its parts with a channel of the ledger."""
        x, v, k_i, alpha = self.f.x[i], self.f.v[i], self.f.impedance[i], self.f.alpha[i]
        beta, rho = self.f.beta[i], self.f.density[i]
        stress, viscous = ti.Vector.zero(ti.f64, self.n), ti.Vector.zero(ti.f64, self.n)
        pushing, grid = ti.Vector.zero(ti.f64, self.n), ti.Vector.zero(ti.f64, self.n)
        # sums of what depends on i by a factor only; power of the two viscosities
        places, motions = ti.Vector.zero(ti.f64, self.n), ti.Vector.zero(ti.f64, self.n)
        power = 0.0
        # The loop takes little from outside (h and scale come behind it): with more, LLVM goes over
        # four vectors at a time, and most of a list is left to be done one by one.
        side, opened = 0, 0.0
        if ti.static(self.layout.separate):
            side, opened = self.f.side[i], ti.select(self.f.gap[i] >= 0.0, 1.0, 0.0)
        begin = near_begin(self.lists, i)
        for k in range(begin, begin + self.lists.near_counts[i]):
            j = self.lists.near[k]
            d, u = x - self.f.x[j], v - self.f.v[j]
            r2 = d.norm_sqr()
            weight = self.f.volume[j] * self.slope(r2, numbers.inv_h, 1.0)
            k_j = self.f.impedance[j]
            # those of what i does to both, and j, whose contacts open each by itself
            own, other = weight, weight
            if ti.static(self.layout.separate):
                foreign = ti.select(self.f.side[j] != side, weight, 0.0)
                own -= opened * foreign
                other -= ti.select(self.f.gap[j] >= 0.0, foreign, 0.0)
            wd, wu = other * d, other * u
            if ti.static(self.layout.heat):
                power += numbers.grid * numbers.h * self.noise_power(i, j, own, other, d, u)
            places += own * d
            motions += own * u
            Q_j, kL_j = self.f.flux[j], self.f.drag[j]
            for a in ti.static(range(self.n)):
                grid[a] += k_j * wu[a]
                for b in ti.static(range(self.n)):
                    stress[a] += Q_j[self.n * a + b] * wd[b]
                    grid[a] -= kL_j[self.n * a + b] * wd[b]
            if ti.static(self.layout.viscous):
                mu = self.approach(d, u, numbers.inv_h)
                linear = 0.5 * ti.max(alpha, self.f.alpha[j]) * (k_i + k_j)
                square = 0.5 * ti.max(beta, self.f.beta[j]) * (rho + self.f.density[j])
                resisting = ti.max(own, other) * (linear - square * mu) * mu
                viscous += resisting * d
                if ti.static(self.layout.heat):
                    power += resisting * u.dot(d)
            if ti.static(self.layout.artificial_stress):
                shape = self.shape(ti.sqrt(r2) * numbers.inv_h) * numbers.at_spacing
                for a, b in ti.static(ti.ndrange(self.n, self.n)):
                    c = ti.static(self.n * a + b)
                    pull = self.f.tension[i][c] + self.f.tension[j][c]
                    pushing[a] += shape**numbers.exponent * pull * ti.max(own, other) * d[b]
        stress += tensors.matrix(self.f.flux[i], self.n) @ places
        grid += k_i * motions - tensors.matrix(self.f.drag[i], self.n) @ places
        volume = numbers.scale * self.f.volume[i]
        if ti.static(self.layout.artificial):
            self.f.pushing[i] = volume * pushing
        grid *= volume * numbers.grid * numbers.h
        self.add_up(i, volume * stress, volume * viscous, grid, volume * power, numbers)

    @ti.func
    def approach(self, d, u, inv_h):
        """Speed of approach h u.d/(r^2 + 0.01 h^2) of a pair that closes, else 0."""
        return ti.min(u.dot(d), 0.0) * inv_h / (d.norm_sqr() * inv_h * inv_h + CLOSE)

    @ti.func
    def noise_power(self, i, j, own, other, d, u):
        """Power of what acts on grid noise in a pair, over grid h: of i and of j."""
        of_i = self.f.impedance[i] * u - tensors.matrix(self.f.drag[i], self.n) @ d
        of_j = self.f.impedance[j] * u - tensors.matrix(self.f.drag[j], self.n) @ d
        return (own * of_i + other * of_j).dot(u)

    @ti.func
    def add_up(self, i, stress, viscous, grid, power, numbers: ti.template()):
        """Add all other forces on particle i to those of its neighbours [N], and its heat.

        Half of the power of the viscosities of all its pairs [W].
        """
        if ti.static(self.layout.rigid):
            of_stress, of_pairs, of_noise, of_images = self.images.push(i, numbers)
            stress += of_stress
            viscous += of_pairs
            grid += of_noise
            power += of_images
        if ti.static(self.layout.heat):
            self.f.heating[i] = -0.5 * power
        self.f.viscous[i], self.f.grid_force[i] = viscous, grid
        role = self.f.role[i]
        falls = ti.select(role == DUST or role == ELASTIC, self.f.mass[i], 0.0)
        force = stress + viscous + grid + falls * numbers.gravity
        if ti.static(self.layout.self_gravity):
            force += falls * self.attraction.pull(i, numbers)
        if ti.static(self.layout.hourglass):
            self.f.pushing[i] += self.hourglass.push(i, numbers)
        if ti.static(self.layout.artificial):
            force += self.f.pushing[i]
        self.f.force[i] = force
