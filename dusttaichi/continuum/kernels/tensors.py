"""Tensors of two or three dimensions in kernels; in memory they are rows one after another."""

import taichi as ti


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
def pulled(S: ti.template(), factor):
    """The part of a symmetric tensor with positive principal values, times a factor."""
    values, axes = ti.sym_eig(S)
    out = ti.Matrix.zero(ti.f64, S.n, S.n)
    for k in ti.static(range(S.n)):
        for a, b in ti.static(ti.ndrange(S.n, S.n)):
            out[a, b] += factor * ti.max(values[k], 0.0) * axes[a, k] * axes[b, k]
    return out


@ti.func
def turned(S: ti.template(), W: ti.template()):
    """R S R^T with the rotation R = (1 - W/2)^-1 (1 + W/2) of a spin W over a step (Hughes &
    Winget 1980): to second order the part W S - S W of Jaumann's rate, and no length changes."""
    n = ti.static(S.n)
    one = ti.Matrix.identity(ti.f64, n)
    R = (one - 0.5 * W).inverse() @ (one + 0.5 * W)
    return R @ S @ R.transpose()
