"""The deviator S of the stress: Jaumann rate, second invariant, return to the yield surface.

    dS/dt = 2 mu (D - (1/3) tr D 1) + W S - S W,  D = (L + L^T)/2, W = (L - L^T)/2

with L_ab = dv_a/dx_b. G09 eq 4 with eq 5 prints the rotation with the opposite sign, which turns a
stress against the rotation of its body. Tensors are 3 x 3, in plane strain 2 x 2, where the stress
out of the plane is S_yy = -(S_xx + S_zz): matrices of NumPy on the host, of Taichi in kernels.
"""

from numpy import minimum, sqrt

TINY = 1e-30
"""Pa^2: keeps a division by an invariant that is 0 finite."""


def rotate(S, L, dt):
    """S [Pa] after the rotation of a step: two stages, so that invariants change by (W dt)^4."""
    W = 0.5 * dt * (L - L.transpose())
    half = S + 0.5 * (W @ S - S @ W)
    return S + W @ half - half @ W


def second_invariant(S):
    """J2 [Pa^2] = S:S/2, with the component out of the plane where S is 2 x 2."""
    return 0.5 * ((S * S).sum() + S.trace() ** 2)


def shear_energy(volume, squares, mu):
    """Elastic energy [J] of a deviator in a volume; squares: S:S [Pa^2]."""
    return volume * squares / (4.0 * mu)


def radial(J2, Y):
    """Factor on S that brings sqrt(3 J2) back to Y [Pa]; 1 where it is below.

    Its square is that of Benz & Asphaug (1994), which returns too far: inside of the yield surface
    by as much as the step had it outside, so that the strength depends on the time step.
    """
    return minimum(1.0, Y / sqrt(3.0 * J2 + TINY))
