"""The contact model of PHYSICS.md once more: plain NumPy, SI, no import from dusttaichi.

Slow and simple: every pair and every wall is looked at in every step, every formula is written as
the papers have it. `Reference` shares with the package only what defines its time step: leapfrog,
a contact forms at the first step that finds an overlap, the approach speed of the damping is that
of the last half step carried on by half a step.

The formulas are those of `reference_contact`, which tests read by this module, too.
"""

from dataclasses import dataclass, field

import numpy as np
import reference_forces
from reference_contact import (  # noqa: F401, some are for tests alone
    GAMMA,
    PULL_OFF,
    SILICATE,
    Numbers,
    contact_radius,
    dot,
    excess,
    length,
    mass_and_inertia,
    mix_constants,
    normal_energy,
    normal_force,
    numbers,
    pair_energies,
    rotate,
    slip_pointer,
    unit,
    wall_energies,
    xi_of,
    zeta_pair,
    zeta_wall,
)


@dataclass
class Contact:
    n1: np.ndarray
    n2: np.ndarray  # the foot on a wall
    phi: float = 0.0
    before: float = None  # approach speed of the last half step
    xi: np.ndarray = field(default_factory=lambda: np.zeros(3))  # in a tube
    zeta: np.ndarray = field(default_factory=lambda: np.zeros(3))


@dataclass
class Wall:
    normal: np.ndarray
    offset: float
    speed: float = 0.0
    strength: float = 1.0
    along: np.ndarray = field(default_factory=lambda: np.zeros(3))  # its velocity along itself

    def facing(self, x, time):
        """Unit normal at a point, and x.normal on the wall."""
        return self.normal, self.offset + self.speed * time


@dataclass
class Tube:
    """An upright cylinder about the z axis: contacts feel a sphere of the reduced radius R."""

    radius: float
    strength: float = 1.0
    speed: float = 0.0
    along: np.ndarray = field(default_factory=lambda: np.zeros(3))

    def facing(self, x, time):
        away = np.array([x[0], x[1], 0.0])
        return -unit(away), -self.radius


class Reference:
    """Grains, open or with walls. x, v, w: (N, 3), SI.

    pair, wall: Numbers, or functions of the grain(s) for grains that are not alike; masses (N,)
    [kg] and radii (N,) [m] of such grains. outside: forces of reference_forces.
    """

    def __init__(
        self,
        x,
        v,
        w,
        dt,
        pair,
        wall=None,
        walls=(),
        material=None,
        masses=None,
        radii=None,
        outside=(),
    ):
        self.x, self.v, self.w = np.array(x, float), np.array(v, float), np.array(w, float)
        self.dt, self.walls = dt, list(walls)
        self.pair = pair if callable(pair) else lambda i, j: pair
        self.wall = wall if callable(wall) else lambda i: wall
        self.mass, self.inertia = mass_and_inertia(material)
        self.radius = {**SILICATE, **(material or {})}["r"]
        if masses is not None:
            self.mass, self.inertia = masses[:, None], (0.4 * masses * radii**2)[:, None]
            self.radius = radii[:, None]
        self.contacts, self.step, self.outside = {}, 0, outside
        self.force, self.torque = self._loads(0.0)
        self.linear, self.angular = self._accelerations(0.0)
        # velocities at n - 1/2 between steps
        self.v -= dt / 2 * self.linear
        self.w -= dt / 2 * self.angular

    def advance(self, steps):
        for _ in range(steps):
            self.v += self.dt * self.linear
            self.w += self.dt * self.angular
            self.x += self.dt * self.v
            self.step += 1
            self.force, self.torque = self._loads(self.dt)
            self.linear, self.angular = self._accelerations(self.dt / 2)

    def velocities(self):
        return self.v + self.dt / 2 * self.linear

    def spins(self):
        return self.w + self.dt / 2 * self.angular

    def _accelerations(self, half):
        """Of all loads; half: by how much velocities and spins are behind the positions."""
        linear, angular = self.force / self.mass, self.torque / self.inertia
        if not self.outside:
            return linear, angular
        time = self.step * self.dt
        body = reference_forces.Body(self.x, self.v, self.w, self.mass, self.radius, time)
        kicks = half * linear, half * angular
        added, turning = reference_forces.solve(self.outside, body, *kicks, half)
        return linear + added, angular + turning

    def energies(self):
        """Potential of the four springs, pairs and walls, (2, 4) [J]."""
        out = np.zeros((2, 4))
        for (i, j), c in self.contacts.items():
            if j >= 0:
                p = self.pair(i, j)
                out[0] += pair_energies(self.x[i], self.x[j], c.n1, c.n2, c.phi, p)
            else:
                wall, normal, offset = self._plane(j, self.x[i])
                if isinstance(wall, Tube):
                    p, moved = self.wall(i), (c.xi, c.zeta)
                    s = contact_radius(p.r + offset - np.dot(self.x[i], normal), p)
                    k = (p.k_r, p.k_s)
                    springs = [k * dot(a, a) / 2 for k, a in zip(k, moved, strict=True)]
                    out[1] += [normal_energy(s, p), *springs, p.k_t * c.phi**2 / 2]
                    continue
                out[1] += wall_energies(
                    self.x[i], c.n1, c.n2, c.phi, normal, offset, self.wall(i), wall.strength
                )
        return out

    def _plane(self, j, x):
        wall = self.walls[-1 - j]
        return wall, *wall.facing(x, self.step * self.dt)

    def _loads(self, dt):
        out = np.zeros((2, len(self.x), 3))
        for i in range(len(self.x)):
            for j in range(i + 1, len(self.x)):
                self._pair(i, j, dt, *out)
            for k in range(len(self.walls)):
                self._wall(i, -1 - k, dt, *out)
        return out

    def _find_contact(self, key, delta, p, n1, n2):
        """The contact if there is one now, after forming and breaking; was it there before?"""
        if key in self.contacts:
            if delta <= -PULL_OFF * p.delta0:
                del self.contacts[key]
                return None
            return self.contacts[key]
        if delta > 0:
            self.contacts[key] = Contact(n1, n2)
        return None

    def _normal(self, key, delta, u, p):
        """Spring and damping along the normal."""
        c = self.contacts[key]
        s = contact_radius(delta, p)
        ahead = u if c.before is None else u + (u - c.before) / 2
        c.before = u
        return normal_force(s, p) - p.kappa(s) * ahead

    def _pair(self, i, j, dt, force, torque):
        p, d, dv = self.pair(i, j), self.x[i] - self.x[j], self.v[i] - self.v[j]
        nc, (r1, r2) = unit(d), p.arms
        c = self._find_contact((i, j), r1 + r2 - length(d), p, -nc, nc)
        if (i, j) not in self.contacts:
            return
        # the speed of half a step ago belongs to the normal of half a step ago
        u = np.dot(dv, unit(d - dv * dt / 2))
        F = self._normal((i, j), r1 + r2 - length(d), u, p) * nc
        M1, M2 = np.zeros(3), np.zeros(3)
        if c is not None:
            self._turn_pair(c, i, j, d, dv, nc, dt)
            n1, n2 = c.n1, c.n2
            xi, zeta = xi_of(n1, n2, p), zeta_pair(n1, n2, nc, p)
            F = F - p.k_s * zeta * np.dot(r2 * n2 - r1 * n1, nc) / length(d)
            twist = p.k_t * c.phi * nc
            M1 = -p.R * p.k_r * np.cross(n1, xi) - r1 * p.k_s * np.cross(n1, zeta) - twist
            M2 = -p.R * p.k_r * np.cross(n2, xi) + r2 * p.k_s * np.cross(n2, zeta) + twist
        force[i] += F
        force[j] -= F
        torque[i] += M1
        torque[j] += M2

    def _turn_pair(self, c, i, j, d, dv, nc, dt):
        """Pointers and twist carried on by a step, then put back to the limits."""
        p = self.pair(i, j)
        r1, r2 = p.arms
        c.n1, c.n2 = rotate(c.n1, self.w[i] * dt), rotate(c.n2, self.w[j] * dt)
        c.phi += dt * np.dot(self.w[i] - self.w[j], unit(d - dv * dt / 2))
        c.phi = np.clip(c.phi, -p.phi_crit, p.phi_crit)
        roll, e_roll = excess(xi_of(c.n1, c.n2, p), p.xi_crit if p.k_r else np.inf)
        slide, e_slide = excess(zeta_pair(c.n1, c.n2, nc, p), p.zeta_crit if p.k_s else np.inf)
        # xi = R (n1 + n2), 1/R = 1/r1 + 1/r2; zeta: the part across n_c of r1 n1 - r2 n2
        c.n1 = slip_pointer(slip_pointer(c.n1, roll / r1, e_roll), slide / (r1 + r2), e_slide)
        c.n2 = slip_pointer(slip_pointer(c.n2, roll / r2, e_roll), -slide / (r1 + r2), e_slide)

    def _wall(self, i, j, dt, force, torque):
        p, x = self.wall(i), self.x[i]
        wall, nw, offset = self._plane(j, x)
        delta = p.r - (np.dot(x, nw) - offset)
        c = self._find_contact((i, j), delta, p, -nw, x - p.r * nw)
        if (i, j) not in self.contacts:
            return
        # the speed of half a step ago belongs to the normal of half a step ago
        middle, _ = wall.facing(x - self.v[i] * dt / 2, 0.0)
        F = self._normal((i, j), delta, np.dot(self.v[i], middle) - wall.speed, p) * nw
        M = np.zeros(3)
        if c is not None:
            c.n2 = c.n2 + wall.along * dt
            if isinstance(wall, Tube):
                self._turn_tube(c, i, nw, dt)
                xi, zeta = c.xi, c.zeta
            else:
                self._turn_wall(c, i, nw, dt)
                xi, zeta = xi_of(c.n1, nw, p), zeta_wall(x, c.n1, c.n2, nw, p)
            F = F - wall.strength * p.k_s * zeta
            M = -p.R * p.k_r * np.cross(c.n1, xi) - p.r * p.k_s * np.cross(c.n1, zeta)
            M = wall.strength * (M - p.k_t * c.phi * nw)
        force[i] += F
        torque[i] += M

    def _turn_tube(self, c, i, nw, dt):
        """Displacements of a contact with a wall that bends, across its normal."""
        p, w = self.wall(i), self.w[i]
        turned = rotate(c.n1, w * dt) - c.n1

        def limit(a, critical):
            a = a - np.dot(a, nw) * nw
            over, way = excess(a, critical)
            return a - over * way

        c.xi = limit(c.xi + p.R * turned, p.xi_crit if p.k_r else np.inf)
        c.zeta = limit(c.zeta + p.r * turned + self.v[i] * dt, p.zeta_crit if p.k_s else np.inf)
        c.phi = np.clip(c.phi + dt * np.dot(w, nw), -p.phi_crit, p.phi_crit)
        # 1/r2 = 1/R - 1/r, so that 1/(r + r2) = (1 - R/r)/r
        c.n1 = unit(c.xi / p.r + c.zeta * (1 - p.R / p.r) / p.r - nw)
        c.n2 = self.x[i] + p.r * c.n1 - c.zeta

    def _turn_wall(self, c, i, nw, dt):
        p = self.wall(i)
        c.n1 = rotate(c.n1, self.w[i] * dt)
        c.phi = np.clip(c.phi + dt * np.dot(self.w[i], nw), -p.phi_crit, p.phi_crit)
        slide, e_slide = excess(
            zeta_wall(self.x[i], c.n1, c.n2, nw, p), p.zeta_crit if p.k_s else np.inf
        )
        roll, e_roll = excess(xi_of(c.n1, nw, p), p.xi_crit if p.k_r else np.inf)
        n1 = slip_pointer(c.n1, roll / p.r, e_roll)
        step = p.r * (n1 - c.n1)
        # the foot slips with the grain, and what rolls past its limit does not slide
        c.n2 = c.n2 + slide * e_slide + step - np.dot(step, nw) * nw
        c.n1 = n1
