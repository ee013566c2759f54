"""Constants, forces and energies of contacts by the formulas of the papers: plain NumPy, SI.

Energies also take complex positions and pointers, so that a complex step gives their gradient
without the cancellation of a difference quotient. Nothing is imported from dusttaichi.
"""

from dataclasses import dataclass

import numpy as np

SILICATE = dict(r=0.6e-6, rho=2650.0, gamma=0.02, E=54e9, nu=0.17, xi_crit=2e-9)  # S12 Table 1
PULL_OFF = (9 / 16) ** (1 / 3)  # delta_c / delta0


@dataclass
class Numbers:
    """Numbers of one kind of contact; arm: R of the rolling displacement."""

    r: float
    R: float
    F_c: float
    delta0: float
    k_r: float
    k_s: float
    k_t: float
    xi_crit: float
    zeta_crit: float
    phi_crit: float
    kappa: object  # function of s = sqrt(a/a0)
    r2: float = None  # of the second grain, where it is another one

    @property
    def arms(self):
        return self.r, self.r if self.r2 is None else self.r2


GAMMA = {
    "geometric": lambda a, b: np.sqrt(a * b),
    "arithmetic": lambda a, b: (a + b) / 2,
    "work_of_adhesion": lambda a, b: a + b - 2 / (1 / a + 1 / b),
}


def mix_constants(
    first,
    second,
    wall=False,
    effects=("rolling", "sliding", "twisting"),
    m_r=1.0,
    m_s=1.0,
    m_t=1.0,
    damping="none",
    mixing="geometric",
    R=None,
):
    """Numbers of a contact of unlike grains, or of grain `one` and a wall of the other's stuff.

    R: reduced radius at a curved wall.
    """
    a, b = {**SILICATE, **first}, {**SILICATE, **second}
    r1, r2 = a["r"], a["r"] if wall else b["r"]
    R_pair = r1 * r2 / (r1 + r2)
    R = R or (r1 if wall else R_pair)
    gamma = GAMMA[mixing](a["gamma"], b["gamma"])
    E_star = 1 / ((1 - a["nu"] ** 2) / a["E"] + (1 - b["nu"] ** 2) / b["E"])
    G = [m["E"] / (2 * (1 + m["nu"])) for m in (a, b)]
    G_star = 1 / ((2 - a["nu"]) / G[0] + (2 - b["nu"]) / G[1])
    nu = (a["nu"] + b["nu"]) / 2
    a0 = (9 * np.pi * gamma * R**2 / E_star) ** (1 / 3)
    a0_pair = (9 * np.pi * gamma * R_pair**2 / E_star) ** (1 / 3)
    m1, m2 = (m["rho"] * 4 / 3 * np.pi * r**3 for m, r in ((a, r1), (b, r2)))
    m0 = m1 if wall else 2 * m1 * m2 / (m1 + m2)
    t_c = 0.95 * (2 * R_pair) ** (7 / 6) * ((a["rho"] + b["rho"]) / 2) ** 0.5
    t_c /= gamma ** (1 / 6) * E_star ** (1 / 3)
    kappa = {
        "none": lambda s: 0.0,
        "viscous": lambda s: 1e-9,
        "scaled": lambda s: 0.01 * m0 / t_c,
        "viscoelastic": lambda s: 2 * 12.5e-12 / nu**2 * E_star * a0 * s**2,
    }[damping]
    return Numbers(
        r=r1,
        R=R,
        F_c=3 * np.pi * gamma * R,
        delta0=a0**2 / (3 * R),
        k_r=("rolling" in effects) * m_r * 12 * np.pi * gamma,
        k_s=("sliding" in effects) * m_s * 8 * a0 * G_star,
        k_t=("twisting" in effects) * m_t * 16 / 3 / (1 / G[0] + 1 / G[1]) * a0_pair**3,
        xi_crit=(a["xi_crit"] + b["xi_crit"]) / 2,
        zeta_crit=(2 - nu) * a0 / (16 * np.pi),
        phi_crit=1 / (16 * np.pi),
        kappa=kappa,
        r2=None if wall else r2,
    )


def numbers(wall=False, material=None, **keys):
    """Numbers of a pair of equal grains, or of a grain and its wall; keys: those of `mixed`."""
    stuff = material or {}
    return mix_constants(stuff, stuff, wall, **keys)


def mass_and_inertia(material=None):
    mat = {**SILICATE, **(material or {})}
    mass = mat["rho"] * 4 / 3 * np.pi * mat["r"] ** 3
    return mass, 0.4 * mass * mat["r"] ** 2


def contact_radius(delta, p):
    """s = sqrt(a/a0) of the stable branch; Newton from above, which converges without fail."""
    d = delta / p.delta0
    s = 1.0 + np.abs(d) ** 0.25
    for _ in range(100):
        previous = s
        s = s - (3 * s**4 - 2 * s - d) / (12 * s**3 - 2)
        if abs(s - previous) < 1e-15 * abs(s):
            break
    return s


def normal_force(s, p):
    return 4 * p.F_c * (s**6 - s**3)


def normal_energy(s, p):
    return 4 * p.F_c * p.delta0 * (6 / 5 * s**10 - 2 * s**7 + s**4 / 2)


def dot(a, b):
    return np.sum(a * b)  # np.vdot would conjugate


def length(a):
    return np.sqrt(dot(a, a))


def unit(a):
    return a / length(a)


def rotate(n, angle):
    """n turned by the vector `angle` (Rodrigues)."""
    t = np.sqrt(np.dot(angle, angle))
    if t == 0:
        return n
    k = angle / t
    return n * np.cos(t) + np.cross(k, n) * np.sin(t) + k * np.dot(k, n) * (1 - np.cos(t))


def xi_of(n1, n2, p):
    return p.R * (n1 + n2)


def zeta_pair(n1, n2, nc, p):
    r1, r2 = p.arms
    arm = r1 * n1 - r2 * n2
    return arm - dot(arm, nc) * nc


def zeta_wall(x, n1, foot, nw, p):
    arm = x + p.r * n1 - foot
    return arm - dot(arm, nw) * nw


def pair_energies(x1, x2, n1, n2, phi, p):
    """Normal, rolling, sliding and twisting potential of a pair [J]."""
    d = x1 - x2
    nc = unit(d)
    s = contact_radius(sum(p.arms) - length(d), p)
    xi, zeta = xi_of(n1, n2, p), zeta_pair(n1, n2, nc, p)
    return np.array(
        [
            normal_energy(s, p),
            p.k_r * dot(xi, xi) / 2,
            p.k_s * dot(zeta, zeta) / 2,
            p.k_t * phi**2 / 2,
        ]
    )


def wall_energies(x, n1, foot, phi, nw, offset, p, strength=1.0):
    """Normal, rolling, sliding and twisting potential of a grain and the wall x.nw = offset [J]."""
    s = contact_radius(p.r - (dot(x, nw) - offset), p)
    xi, zeta = xi_of(n1, nw, p), zeta_wall(x, n1, foot, nw, p)
    return np.array(
        [
            normal_energy(s, p),
            strength * p.k_r * dot(xi, xi) / 2,
            strength * p.k_s * dot(zeta, zeta) / 2,
            strength * p.k_t * phi**2 / 2,
        ]
    )


def excess(x, critical):
    """How far a displacement is past its limit, and its direction (0 where it is not past it)."""
    size = np.sqrt(np.dot(x, x))
    return (0.0, np.zeros(3)) if size <= critical else (size - critical, x / size)


def slip_pointer(n, way, along):
    """Pointer n after the point that it marks has slipped on its grain.

    A displacement past its limit goes back to it, for its two pointers give up equal parts of the
    angle of the excess. A pointer marks a point of a rigid sphere, so that it can only be turned,
    and of all turns that take `way` from its component along a direction the smallest is that in
    the plane of the two: n goes along the great circle through `along` to where its component is
    smaller by `way`.
    """
    if way == 0.0:
        return n
    angle_before = np.arccos(np.dot(n, along))
    angle_after = np.arccos(np.dot(n, along) - way)
    axis = unit(np.cross(along, n))
    return rotate(n, (angle_after - angle_before) * axis)
