"""Second pass: the forces between particles, the adjoint of the first (Bonet & Lok 1999).

m_i dv_i/dt = sum_j V_i V_j (Q_i + Q_j) grad W + viscosity + m_i g with Q = sigma C, so that the
work of the forces is the power of the stresses and no motion of a rigid body costs any.

Two viscosities. The one of Monaghan & Gingold (1983), by pairs: at contacts with what is rigid, and
in the bulk if asked. And one that acts on grid noise alone: with R = -1/2 sum_ij k_i V_i V_j F_ij
|v_ij - L_i x_ij|^2 the forces -dR/dv vanish for every velocity that is linear in place, dissipate
2 R >= 0, and keep momentum and angular momentum, since L_i is the very fit that makes R least.
"""

import taichi as ti

from dusttaichi.continuum.kernels import tensors
from dusttaichi.continuum.kernels.store import DUST, RIGID

CLOSE = 0.01  # of h^2, keeps a viscosity finite where particles meet


@ti.data_oriented
class Forces:
    """fields, lists: see store.place; layout: store.Layout; smoothing: a kernel's slope."""

    def __init__(self, fields, lists, layout, smoothing):
        self.f, self.lists, self.layout, self.slope = fields, lists, layout, smoothing
        self.n = layout.dimension

    @ti.func
    def pass_over(self, i, numbers: ti.template()):
        """The forces on particle i [N]: all of them, and the two viscosities on their own."""
        x, v, Q = self.f.x[i], self.f.v[i], tensors.matrix(self.f.flux[i], self.n)
        L = tensors.matrix(self.f.gradient[i], self.n)
        density, sound, alpha = self.f.density[i], self.f.sound[i], self.f.alpha[i]
        stiff = sound == 0.0
        stress = ti.Vector.zero(ti.f64, self.n)
        viscous = ti.Vector.zero(ti.f64, self.n)
        grid = ti.Vector.zero(ti.f64, self.n)
        for k in range(self.lists.first[i], self.lists.first[i + 1]):
            j = self.lists.entry[k]
            d, u = x - self.f.x[j], v - self.f.v[j]
            r2 = d.norm_sqr()
            weight = self.f.volume[j] * self.slope(r2, numbers.inv_h, numbers.scale)
            c_j, rho_j = self.f.sound[j], self.f.density[j]
            if ti.static(self.layout.separate):
                weight = ti.select(self.open(i, j, stiff, c_j == 0.0), 0.0, weight)
            Q_j, L_j = self.f.flux[j], self.f.gradient[j]
            along = ti.Vector.zero(ti.f64, self.n)
            noise = ti.Vector.zero(ti.f64, self.n)
            k_i, k_j = density * sound, rho_j * c_j
            for a in ti.static(range(self.n)):
                noise[a] = (k_i + k_j) * u[a]
                for b in ti.static(range(self.n)):
                    along[a] += (Q[a, b] + Q_j[self.n * a + b]) * d[b]
                    noise[a] -= (k_i * L[a, b] + k_j * L_j[self.n * a + b]) * d[b]
            stress += weight * along
            grid += weight * noise
            # what is rigid takes density and speed of sound from the dust that it touches
            rho_a, rho_b = ti.select(stiff, rho_j, density), ti.select(c_j == 0.0, density, rho_j)
            c = 0.5 * (ti.select(stiff, c_j, sound) + ti.select(c_j == 0.0, sound, c_j))
            closing = ti.min(u.dot(d), 0.0) * numbers.h / (r2 + CLOSE * numbers.h * numbers.h)
            mean = 0.5 * (rho_a + rho_b)
            push = ti.max(alpha, self.f.alpha[j]) * c * closing * rho_a * rho_b / mean
            viscous += (weight * push) * d
        volume = self.f.volume[i]
        viscous *= volume
        grid *= volume * numbers.grid * numbers.h
        self.f.viscous[i], self.f.grid_force[i] = viscous, grid
        role = self.f.role[i]
        falls = ti.select(role == DUST or role == RIGID, self.f.mass[i], 0.0)
        self.f.force[i] = volume * stress + viscous + grid + falls * numbers.gravity

    @ti.func
    def open(self, i, j, stiff, stiff_j):
        """Whether i and j belong to a contact that has opened."""
        return (stiff and self.f.gap[j] >= 0.0) or (stiff_j and self.f.gap[i] >= 0.0)
