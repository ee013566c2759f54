"""Tensors of two or three dimensions in kernels; in memory they are rows one after another."""

from dusttaichi.compute.engine import ti

TINY = 1e-30  # [Pa], keeps a stress of zero from being divided by
ROUND = 1e-6  # deviator over mean, below which a stress is isotropic


@ti.func
def rows(tensor: ti.template()):
    """The vector that memory holds, of a matrix."""
    n = ti.static(tensor.n)
    return ti.Vector([tensor[k // n, k % n] for k in ti.static(range(n * n))])


@ti.func
def matrix(values: ti.template(), n: ti.template()):
    """The n x n matrix of what memory holds."""
    return ti.Matrix(
        [[values[n * a + b] for b in ti.static(range(n))] for a in ti.static(range(n))]
    )


@ti.func
def double_dot(a: ti.template(), b: ti.template()):
    """a : b, the sum over both indices."""
    out = 0.0
    for i, j in ti.static(ti.ndrange(a.n, a.m)):
        out += a[i, j] * b[i, j]
    return out


@ti.func
def scale_tension(S: ti.template(), factor):
    """The part of a symmetric tensor with positive principal values, times a factor.

    The plane uses S = m + r (n n - t t); in space one that has hardly a deviator, whose principal
    axes are unknown, is taken for its mean.
    """
    n = ti.static(S.n)
    identity, mean = ti.Matrix.identity(ti.f64, n), S.trace() / n
    deviator = S - mean * identity
    size = ti.sqrt(double_dot(deviator, deviator))
    out = factor * ti.max(mean, 0.0) * identity
    if ti.static(n == 2):
        r = size * ti.sqrt(0.5)
        high, low = ti.max(mean + r, 0.0), ti.max(mean - r, 0.0)
        turn = 0.5 * (high - low) / ti.max(r, TINY)
        out = factor * (0.5 * (high + low) * identity + turn * deviator)
    elif size > ROUND * ti.abs(mean):
        values, axes = ti.sym_eig(S)
        out = 0.0 * out
        for k in ti.static(range(n)):
            for a, b in ti.static(ti.ndrange(n, n)):
                out[a, b] += factor * ti.max(values[k], 0.0) * axes[a, k] * axes[b, k]
    return out


@ti.func
def rotate(S: ti.template(), W: ti.template()):
    """R S R^T with the rotation R = (1 - W/2)^-1 (1 + W/2) of a spin W over a step.

    After Hughes & Winget 1980: to second order the part W S - S W of Jaumann's rate, and no length
    changes.
    """
    R = rotation(W)
    return R @ S @ R.transpose()


@ti.func
def rotation(W: ti.template()):
    """The rotation (1 - W/2)^-1 (1 + W/2) of a spin W over a step."""
    identity = ti.Matrix.identity(ti.f64, ti.static(W.n))
    return (identity - 0.5 * W).inverse() @ (identity + 0.5 * W)


@ti.func
def largest(S: ti.template()):
    """Largest principal value of a deviator; in the plane the one out of it is -trace.

    In space 2 sqrt(J2/3) cos(a/3), cos a = (J3/2) (3/J2)^(3/2).
    """
    n = ti.static(S.n)
    out = 0.0
    if ti.static(n == 2):
        apart = 0.5 * (S[0, 0] - S[1, 1])
        out = 0.5 * S.trace() + ti.sqrt(apart * apart + S[0, 1] * S[0, 1])
        out = ti.max(out, -S.trace())
    else:
        size = ti.sqrt(0.5 * double_dot(S, S) / 3.0) + TINY
        cosine = 0.5 * S.determinant() / size**3
        out = 2.0 * size * ti.cos(ti.acos(ti.max(-1.0, ti.min(1.0, cosine))) / 3.0)
    return out
