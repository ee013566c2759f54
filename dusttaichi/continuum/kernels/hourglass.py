"""Stiffness of elastic bodies against hourglass modes: motion of particles that no strain explains.

Each particle integrates the part of its displacement that is not linear in position,

    d eta_i/dt = sum_j V_j F_ij (v_ij - L_i x_ij) / sum_j V_j F_ij + W eta_i,

with grad W = F x, over the particles of its body; pairs of them resist the difference along their
line, kappa M V_i V_j F_ij (eta_ij . x_ij) x_ij/(r^2 + 0.01 h^2) with M = K + 4 mu/3. The forces are
central and equal and opposite: both momenta are conserved. Zhang et al. (2024, arXiv:2409.11474)
have such a force in place of artificial stress.
"""

from dusttaichi.compute.engine import ti
from dusttaichi.continuum.kernels import tensors
from dusttaichi.continuum.kernels.smoothing import CLOSE
from dusttaichi.continuum.kernels.store import DT
from dusttaichi.results.roles import ELASTIC


@ti.data_oriented
class Hourglass:
    """fields, lists: see store.place; blocks: blocks.Blocks; slope: of the smoothing kernel."""

    def __init__(self, fields, lists, blocks, slope):
        self.f, self.lists, self.blocks, self.slope = fields, lists, blocks, slope
        self.n = blocks.n

    @ti.func
    def follow(self, i, L: ti.template(), numbers: ti.template()):
        """Advance the displacement of particle i by a step; L: its velocity gradient [1/s]."""
        if self.f.role[i] == ELASTIC:
            x, v, side, dt = self.f.x[i], self.f.v[i], self.f.side[i], self.f.clock[DT]
            total, mean_position = 0.0, ti.Vector.zero(ti.f64, self.n)
            motions = ti.Vector.zero(ti.f64, self.n)
            for k in range(self.blocks.begin(i), self.blocks.end(i)):
                j = self.lists.near[k]
                d, u = x - self.f.x[j], v - self.f.v[j]
                weight = self.f.volume[j] * self.slope(d.norm_sqr(), numbers.inv_h, 1.0)
                weight = ti.select(self.f.side[j] == side and j != i, weight, 0.0)
                total += weight
                mean_position += weight * d
                motions += weight * u
            if total < 0.0:
                turned = tensors.rotation((0.5 * dt) * (L - L.transpose())) @ self.f.hourglass[i]
                self.f.hourglass[i] = turned + (dt / total) * (motions - L @ mean_position)

    @ti.func
    def push(self, i, numbers: ti.template()):
        """Force on particle i [N]."""
        out = ti.Vector.zero(ti.f64, self.n)
        if self.f.role[i] == ELASTIC:
            x, eta, side = self.f.x[i], self.f.hourglass[i], self.f.side[i]
            for k in range(self.blocks.begin(i), self.blocks.end(i)):
                j = self.lists.near[k]
                d = x - self.f.x[j]
                r2 = d.norm_sqr()
                weight = self.f.volume[j] * self.slope(r2, numbers.inv_h, 1.0)
                weight = ti.select(self.f.side[j] == side, weight, 0.0)
                along = (eta - self.f.hourglass[j]).dot(d)
                out += weight * along / (r2 * numbers.inv_h * numbers.inv_h + CLOSE) * d
            modulus = self.f.modulus[i] * (1.0 + 4.0 / 3.0 * self.f.shear_ratio[i])
            stiffness = numbers.hourglass * modulus * numbers.inv_h * numbers.inv_h
            out *= stiffness * numbers.scale * self.f.volume[i]
        return out
