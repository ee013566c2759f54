"""Analysis of results: it reads result files only and never needs Taichi."""

from dusttaichi.analysis.arrival import Arrival, SoundSpeed, arrival, sound_speed
from dusttaichi.analysis.compression import Curve, compression_curve, compression_law, onset
from dusttaichi.analysis.compression_fit import Deviation, Fit, fit_compression, rms_from_law
from dusttaichi.analysis.cycles import Unloading, unloadings
from dusttaichi.analysis.ensemble import gather, save_ensemble
from dusttaichi.analysis.ensemble_tables import Band, bands
from dusttaichi.analysis.fractal import Fractal, fractal
from dusttaichi.analysis.fragments import (
    Compaction,
    FragmentDimension,
    Fragments,
    MassSpectrum,
    compaction,
    fragment_dimension,
    fragments,
    growth_efficiency,
    mass_spectrum,
)
from dusttaichi.analysis.frame import Frame, frame_count, grain_masses, read_frame
from dusttaichi.analysis.isotropic import Isotropic, Ratio, isotropic
from dusttaichi.analysis.ledger import Ledger, Losses, ledger, losses_against_filling_factor
from dusttaichi.analysis.load_control import load_controls
from dusttaichi.analysis.loads import (
    ControlledLoad,
    Friction,
    Shearing,
    StrengthTest,
    Triaxial,
    controlled_loads,
    friction,
    is_triaxial,
    shearings,
    triaxials,
)
from dusttaichi.analysis.observables import front
from dusttaichi.analysis.pores import Pores, pores
from dusttaichi.analysis.profile import profile
from dusttaichi.analysis.restitution import (
    Restitution,
    orbital_momentum,
    restitution,
    wall_restitution,
)
from dusttaichi.analysis.run import Run, open_run
from dusttaichi.analysis.sphere import Column, Penetration, column, penetration
from dusttaichi.analysis.stored import (
    is_collisions,
    is_ensemble,
    is_restitution_map,
    is_trade,
    open_collisions,
    open_ensemble,
    open_restitution_map,
    open_trade,
)
from dusttaichi.analysis.structure import Structure, structure
from dusttaichi.analysis.summary import compare, summary, table, to_csv
from dusttaichi.analysis.tensile import StrengthFit, Tensile, fit_strength, tensile

__all__ = [
    "Arrival",
    "Band",
    "Column",
    "Compaction",
    "ControlledLoad",
    "Curve",
    "Deviation",
    "Fit",
    "Fractal",
    "FragmentDimension",
    "Fragments",
    "Frame",
    "Friction",
    "Isotropic",
    "Ledger",
    "Losses",
    "MassSpectrum",
    "Penetration",
    "Pores",
    "Ratio",
    "Restitution",
    "Run",
    "Shearing",
    "SoundSpeed",
    "StrengthFit",
    "StrengthTest",
    "Structure",
    "Tensile",
    "Triaxial",
    "Unloading",
    "arrival",
    "bands",
    "column",
    "compaction",
    "compare",
    "compression_curve",
    "compression_law",
    "controlled_loads",
    "fit_compression",
    "fit_strength",
    "fractal",
    "fragment_dimension",
    "fragments",
    "frame_count",
    "friction",
    "front",
    "gather",
    "grain_masses",
    "growth_efficiency",
    "is_collisions",
    "is_ensemble",
    "is_restitution_map",
    "is_trade",
    "is_triaxial",
    "isotropic",
    "ledger",
    "load_controls",
    "losses_against_filling_factor",
    "mass_spectrum",
    "onset",
    "open_collisions",
    "open_ensemble",
    "open_restitution_map",
    "open_run",
    "open_trade",
    "orbital_momentum",
    "penetration",
    "pores",
    "profile",
    "read_frame",
    "restitution",
    "rms_from_law",
    "save_ensemble",
    "shearings",
    "sound_speed",
    "structure",
    "summary",
    "table",
    "tensile",
    "to_csv",
    "triaxials",
    "unloadings",
    "wall_restitution",
]
