"""Taichi kernels of the continuum: smoothing, rates and response, forces, motion, lists."""
