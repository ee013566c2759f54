"""Porous dust as a continuum (Güttler et al. 2009, G09): the laws of a material on plain numbers.

The formulas stand once, in files that import no Taichi: scenes, samples and analysis call them with
floats or NumPy arrays. `kernels` makes Taichi functions of the very same source.
"""

from dusttaichi.continuum.physics.dust_laws import register

__all__ = ["register"]
