"""Blocks of a scene of the continuum, frozen, in SI once read."""

from dusttaichi.continuum.scene.material import ContinuumMaterial, DustLaw

__all__ = ["ContinuumMaterial", "DustLaw"]
