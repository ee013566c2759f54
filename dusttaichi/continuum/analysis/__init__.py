"""Analysis of continuum runs: intrusion, filling factors, fragments, beside the laboratory."""

from dusttaichi.continuum.analysis import laboratory
from dusttaichi.continuum.analysis.dust_fragments import (
    Bounce,
    Pieces,
    Rebound,
    bounce,
    collide,
    pieces,
)
from dusttaichi.continuum.analysis.filling import (
    AxisProfile,
    CumulatedVolume,
    Map,
    axis_profile,
    cumulated_volume,
    histogram,
    section,
)
from dusttaichi.continuum.analysis.intrusion import (
    Intrusion,
    Stop,
    at_zero_spacing,
    intrusion,
    momentum_per_area,
)
from dusttaichi.continuum.analysis.particle_snapshot import ParticleFrame, has_dust, read_particles

__all__ = [
    "AxisProfile", "Bounce", "CumulatedVolume", "Intrusion", "Map", "ParticleFrame", "Pieces",
    "Rebound", "Stop", "at_zero_spacing", "axis_profile", "bounce", "collide", "cumulated_volume",
    "histogram", "intrusion", "laboratory", "momentum_per_area", "pieces",
    "has_dust", "read_particles", "section",
]  # fmt: skip
