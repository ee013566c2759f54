"""What a result means: reads result files only, and never needs Taichi."""

from dusttaichi.analysis.arrival import Arrival, SoundSpeed, arrival, sound_speed
from dusttaichi.analysis.compare import compare, to_csv
from dusttaichi.analysis.compression import (
    Curve,
    Deviation,
    Fit,
    compression_curve,
    fit_compression,
    rms_from_law,
)
from dusttaichi.analysis.fragments import (
    Compaction,
    Fragments,
    MassSpectrum,
    compaction,
    fragments,
    growth_efficiency,
    mass_spectrum,
)
from dusttaichi.analysis.frame import Frame, frame_count, grain_masses, read_frame
from dusttaichi.analysis.ledger import Ledger, ledger
from dusttaichi.analysis.profile import profile
from dusttaichi.analysis.restitution import Restitution, restitution, wall_restitution
from dusttaichi.analysis.run import Run, open_run
from dusttaichi.analysis.summary import summary, table

__all__ = [
    "Arrival",
    "Compaction",
    "Curve",
    "Deviation",
    "Fit",
    "Fragments",
    "Frame",
    "Ledger",
    "MassSpectrum",
    "Restitution",
    "Run",
    "SoundSpeed",
    "arrival",
    "compaction",
    "compare",
    "compression_curve",
    "fit_compression",
    "fragments",
    "frame_count",
    "grain_masses",
    "growth_efficiency",
    "ledger",
    "mass_spectrum",
    "open_run",
    "profile",
    "read_frame",
    "restitution",
    "rms_from_law",
    "sound_speed",
    "summary",
    "table",
    "to_csv",
    "wall_restitution",
]
