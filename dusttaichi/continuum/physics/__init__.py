"""Porous dust as a continuum (Güttler et al. 2009, G09): the laws of a material on plain numbers.

Each formula is written once, in files that import no Taichi: scenes, samples and analysis call them
with floats or NumPy arrays, and `kernels` compiles the same source to Taichi functions.
"""

from dusttaichi.continuum.physics.dust_laws import register

__all__ = ["register"]
