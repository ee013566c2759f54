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
from dusttaichi.continuum.kernels.store import FACES
from dusttaichi.results.roles import DUST, ELASTIC

# rows of the sums over neighbours, a vector for each particle, and behind them the power of the
# viscosity by pairs
FORCE, VISCOUS, PUSHING, PLACES, MOTIONS, POWER = range(6)
NOISE = PUSHING  # of images behind faces, which have no artificial stress


@ti.data_oriented
class Forces:
    """Forces on the particles.

    fields, lists: see store.place; layout: store.Layout; blocks: blocks.Blocks; images:
    images.Images or None; planes: planes.Planes or None; attraction: attraction.Attraction or
    None; hourglass: hourglass.Hourglass or None.
    """

    def __init__(self, fields, lists, layout, *, blocks, images, planes, attraction, hourglass):
        self.f, self.lists, self.layout, self.blocks = fields, lists, layout, blocks
        self.images, self.planes = images, planes
        self.attraction, self.hourglass = attraction, hourglass
        self.slope, self.shape = KERNELS[layout.kernel], SHAPES[layout.kernel]
        self.n, self.lanes = layout.dimension, layout.lanes

    @ti.func
    def pass_over(self, block, numbers: ti.template()):
        """Compute the forces on a block of particles, and their parts with a channel each."""
        n = ti.static(self.n)
        sums = ti.Vector.zero(ti.f64, ti.static((POWER * n + 1) * self.lanes))
        self.add_pairs(block, sums, numbers)
        images = ti.Vector.zero(ti.f64, ti.static((POWER * n + 1) * self.lanes))
        if ti.static(self.layout.faces):
            if self.planes.near_any(block, numbers):
                self.add_images(block, images, numbers)
        for lane in range(self.lanes):
            i = block * self.lanes + lane
            if i < numbers.count:
                at = self.of_lane(sums, PLACES, lane)
                force = self.of_lane(sums, FORCE, lane) + tensors.matrix(self.f.load[i], n) @ at
                force += self.f.damping[i] * self.of_lane(sums, MOTIONS, lane)
                volume = numbers.scale * self.f.volume[i]
                if ti.static(self.layout.artificial):
                    self.f.pushing[i] = volume * self.of_lane(sums, PUSHING, lane)
                viscous = volume * self.of_lane(sums, VISCOUS, lane)
                power = volume * sums[POWER * n * self.lanes + lane]
                force = volume * force + self.of_lane(images, FORCE, lane)
                viscous += self.of_lane(images, VISCOUS, lane)
                power += images[POWER * n * self.lanes + lane]
                self.add_up(i, force, viscous, self.of_lane(images, NOISE, lane), power, numbers)

    @ti.func
    def of_lane(self, sums: ti.template(), row: ti.template(), lane):
        """The vector of a lane in a row of the sums."""
        out = ti.Vector.zero(ti.f64, self.n)
        for a in ti.static(range(self.n)):
            out[a] = sums[(self.n * row + a) * self.lanes + lane]
        return out

    @ti.func
    def add_pairs(self, block, sums: ti.template(), numbers: ti.template()):
        """Add up the forces of all neighbours of a block over scale and own volume."""
        n, lanes = ti.static(self.n, self.lanes)
        block_lanes = self.blocks.place_lanes(block, numbers)
        first, inv_h = block * lanes, numbers.inv_h  # loaded once, not for each lane
        for k in range(self.blocks.begin(first), self.blocks.end(first)):
            j = self.lists.near[k]
            x, v, volume = self.f.x[j], self.f.v[j], self.f.volume[j]
            load, damping = self.f.load[j], self.f.damping[j]
            side_j, open_j = 0, 0.0
            if ti.static(self.layout.separate):
                side_j, open_j = self.f.side[j], self.blocks.is_open(j)
            for lane in range(self.blocks.width(numbers)):
                d, u = self.blocks.apart(lane, block_lanes.motion, x, v)
                weight = volume * self.slope(d.norm_sqr(), inv_h, 1.0)
                # those of what i does to both, and j, whose contacts open each by itself
                mine, weight_other = weight, weight
                if ti.static(self.layout.separate):
                    foreign = ti.select(side_j != block_lanes.side[lane], weight, 0.0)
                    mine -= block_lanes.opened[lane] * foreign
                    weight_other -= open_j * foreign
                wd, wu = weight_other * d, weight_other * u
                for a in ti.static(range(n)):
                    # sums of what depends on i by a factor only
                    sums[(PLACES * n + a) * lanes + lane] += mine * d[a]
                    sums[(MOTIONS * n + a) * lanes + lane] += mine * u[a]
                    force = damping * wu[a]
                    for b in ti.static(range(n)):
                        force += load[n * a + b] * wd[b]
                    sums[(FORCE * n + a) * lanes + lane] += force
                if ti.static(self.layout.viscous):
                    pair = ti.Struct(d=d, u=u, weight=ti.max(mine, weight_other))
                    self.resist(j, lane, block_lanes.resisting, pair, sums, numbers)
                if ti.static(self.layout.artificial_stress):
                    i = self.blocks.particle(block, lane, numbers)
                    self.pull(i, j, lane, ti.max(mine, weight_other), d, sums, numbers)

    @ti.func
    def add_images(self, block, out: ti.template(), numbers: ti.template()):
        """Forces of the images behind faces on a block, and what its particles do to the faces.

        They are T_ik, of the stress of the particle itself (`mine`), and T_ki, of that of the
        neighbour (`its`; see images). Adds to FORCE, VISCOUS, NOISE and POWER of `out`.
        """
        n, lanes = ti.static(self.n, self.lanes)
        block_lanes, first = self.blocks.place_lanes(block, numbers), block * lanes
        for row in range(FACES):
            plane = self.planes.plane(row, numbers)
            nearest = self.planes.place_lanes(block, plane, block_lanes, numbers)
            sums = ti.Struct(
                mine=ti.Vector.zero(ti.f64, ti.static((POWER * n + 1) * lanes)),
                its=ti.Vector.zero(ti.f64, ti.static((POWER * n + 1) * lanes)),
            )
            if nearest < 2.0 * numbers.h:
                for k in range(self.blocks.begin(first), self.blocks.end(first)):
                    j = self.lists.near[k]
                    image = self.planes.image(j, plane, numbers)
                    if nearest + image.distance < 2.0 * numbers.h:
                        self.add_image(block, j, image, plane, block_lanes, sums, numbers)
            for lane in range(lanes):
                i = block * lanes + lane
                if i < numbers.count:
                    self.end_images(i, lane, self.planes.touch(i, row), sums, out, numbers)

    @ti.func
    def add_image(
        self,
        block,
        j,
        image,
        plane,
        block_lanes: ti.template(),
        sums: ti.template(),
        numbers: ti.template(),
    ):
        """Add the image of particle j behind a plane to the sums of a block."""
        n, lanes = ti.static(self.n, self.lanes)
        volume, noise = self.f.volume[j], numbers.grid * numbers.h
        flux, drag = self.f.flux[j], noise * self.f.drag[j]
        impedance, closed_j = noise * self.f.impedance[j], self.images.is_closed(j, plane.row)
        for lane in range(lanes):
            d, u = self.blocks.apart(lane, block_lanes.motion, image.x, image.v)
            weight = volume * self.slope(d.norm_sqr(), numbers.inv_h, 1.0)
            weight *= self.planes.in_reach(lane, d, image, plane.normal, block_lanes.face, numbers)
            of_i, of_j = weight * block_lanes.face[lane], weight * closed_j
            mirrored = 2.0 * plane.normal.dot(d) * plane.normal - d
            for a in ti.static(range(n)):
                # sums of what depends on i by a factor only
                sums.mine[(PLACES * n + a) * lanes + lane] += of_i * d[a]
                sums.mine[(MOTIONS * n + a) * lanes + lane] += of_i * u[a]
                stress, shear = 0.0, impedance * u[a]
                for b in ti.static(range(n)):
                    stress += flux[n * a + b] * mirrored[b]
                    shear -= drag[n * a + b] * mirrored[b]
                sums.its[(FORCE * n + a) * lanes + lane] += of_j * stress
                sums.its[(NOISE * n + a) * lanes + lane] += of_j * shear
                if ti.static(self.layout.heat):
                    sums.its[POWER * n * lanes + lane] += 2.0 * of_j * shear * u[a]
            if ti.static(self.layout.viscous):
                pair = ti.Struct(d=d, u=u, weight=of_i)
                self.resist(j, lane, block_lanes.resisting, pair, sums.mine, numbers)
                pair = ti.Struct(d=mirrored, u=u, weight=of_j)
                self.resist(j, lane, block_lanes.resisting, pair, sums.its, numbers)
            if ti.static(self.layout.heat):
                i = self.blocks.particle(block, lane, numbers)
                shear = self.f.impedance[i] * u - tensors.matrix(self.f.drag[i], n) @ d
                sums.mine[POWER * n * lanes + lane] += 2.0 * noise * of_i * shear.dot(u)

    @ti.func
    def end_images(
        self, i, lane, e, sums: ti.template(), out: ti.template(), numbers: ti.template()
    ):
        """Add up the forces of images on a lane, and write what touch e does to its face."""
        n, lanes = ti.static(self.n, self.lanes)
        if e >= 0:
            volume, grid = numbers.scale * self.f.volume[i], numbers.grid * numbers.h
            at = self.of_lane(sums.mine, PLACES, lane)
            motion = self.of_lane(sums.mine, MOTIONS, lane)
            stress = volume * tensors.matrix(self.f.flux[i], n) @ at
            noise = self.f.impedance[i] * motion - tensors.matrix(self.f.drag[i], n) @ at
            noise *= volume * grid
            # two of them act on each pair: half of the viscosity each
            viscous = 0.5 * volume * self.of_lane(sums.mine, VISCOUS, lane)
            self.planes.load(e, stress, viscous, noise)
            stress += volume * self.of_lane(sums.its, FORCE, lane)
            noise += volume * self.of_lane(sums.its, NOISE, lane)
            viscous += 0.5 * volume * self.of_lane(sums.its, VISCOUS, lane)
            for a in ti.static(range(n)):
                out[(FORCE * n + a) * lanes + lane] += stress[a]
                out[(NOISE * n + a) * lanes + lane] += noise[a]
                out[(VISCOUS * n + a) * lanes + lane] += viscous[a]
            at_power = ti.static(POWER * n * lanes)
            power = sums.mine[at_power + lane] + sums.its[at_power + lane]
            out[at_power + lane] += 0.5 * volume * power

    @ti.func
    def resist(
        self,
        j,
        lane,
        coefficients: ti.template(),
        pair,
        sums: ti.template(),
        numbers: ti.template(),
    ):
        """Add the viscosity of a pair; coefficients: alpha, beta, impedance, density by lane."""
        n, lanes = ti.static(self.n, self.lanes)
        mu = self.approach(pair.d, pair.u, numbers.inv_h)
        linear = 0.5 * ti.max(coefficients[lane], self.f.alpha[j])
        linear *= coefficients[2 * lanes + lane] + self.f.impedance[j]
        square = 0.5 * ti.max(coefficients[lanes + lane], self.f.beta[j])
        square *= coefficients[3 * lanes + lane] + self.f.density[j]
        resisting = pair.weight * (linear - square * mu) * mu
        for a in ti.static(range(n)):
            sums[(VISCOUS * n + a) * lanes + lane] += resisting * pair.d[a]
        if ti.static(self.layout.heat):
            sums[POWER * n * lanes + lane] += resisting * pair.u.dot(pair.d)

    @ti.func
    def pull(self, i, j, lane, weight, d, sums: ti.template(), numbers: ti.template()):
        """Add the artificial stress of a pair."""
        n = ti.static(self.n)
        shape = self.shape(ti.sqrt(d.norm_sqr()) * numbers.inv_h) * numbers.at_spacing
        for a, b in ti.static(ti.ndrange(n, n)):
            tension = self.f.tension[i][n * a + b] + self.f.tension[j][n * a + b]
            force = shape**numbers.exponent * tension * weight * d[b]
            sums[(PUSHING * n + a) * self.lanes + lane] += force

    @ti.func
    def approach(self, d, u, inv_h):
        """Speed of approach h u.d/(r^2 + 0.01 h^2) of a pair that closes, else 0."""
        return ti.min(u.dot(d), 0.0) * inv_h / (d.norm_sqr() * inv_h * inv_h + CLOSE)

    @ti.func
    def add_up(self, i, force, viscous, grid, power, numbers: ti.template()):
        """Add all other forces on particle i to those of its neighbours [N], and its heat.

        That is what grid noise loses, and half of the power of the viscosity of all its pairs [W].
        grid: force of the images behind faces on grid noise.
        """
        if ti.static(self.layout.bodies):
            of_stress, of_pairs, of_noise, of_images = self.images.push(i, numbers)
            grid += of_noise
            force += of_stress
            viscous += of_pairs
            power += of_images
        force += grid
        if ti.static(self.layout.heat):
            self.f.heating[i] = self.f.noise_power[i] - 0.5 * power
        self.f.viscous[i], self.f.grid_force[i] = viscous, grid
        role = self.f.role[i]
        falls = ti.select(role == DUST or role == ELASTIC, self.f.mass[i], 0.0)
        force += viscous + falls * numbers.gravity
        if ti.static(self.layout.self_gravity):
            force += falls * self.attraction.pull(i, numbers)
        if ti.static(self.layout.hourglass):
            self.f.pushing[i] += self.hourglass.push(i, numbers)
        if ti.static(self.layout.artificial):
            force += self.f.pushing[i]
        self.f.force[i] = force
