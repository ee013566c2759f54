"""Tensor operations that NumPy and Taichi name differently."""

import numpy as np


def unit(matrix):
    """The unit matrix of the size of a square one."""
    return np.eye(matrix.shape[0])
