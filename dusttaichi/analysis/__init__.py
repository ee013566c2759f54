"""Analysis of results: it reads result files only and never needs Taichi."""

from dusttaichi.analysis.arrival import Arrival, SoundSpeed, fit_sound_speed, measure_arrival
from dusttaichi.analysis.compression import (
    Curve,
    choose_compression_law,
    find_onset,
    measure_compression_curve,
)
from dusttaichi.analysis.compression_fit import Deviation, Fit, fit_compression, measure_deviation
from dusttaichi.analysis.cycles import Unloading, measure_unloadings
from dusttaichi.analysis.ensemble import gather, save_ensemble
from dusttaichi.analysis.ensemble_tables import Band, bands
from dusttaichi.analysis.fractal import Fractal, measure_fractal
from dusttaichi.analysis.fragments import (
    Compaction,
    FragmentDimension,
    Fragments,
    MassSpectrum,
    compute_mass_spectrum,
    find_fragments,
    fit_fragment_dimension,
    measure_compaction,
    measure_growth_efficiency,
)
from dusttaichi.analysis.frame import Frame, count_frames, read_frame, read_grain_masses
from dusttaichi.analysis.friction import Friction, fit_friction
from dusttaichi.analysis.isotropic import Isotropic, Ratio, measure_isotropic_compression
from dusttaichi.analysis.ledger import Ledger, Losses, compute_ledger, measure_losses
from dusttaichi.analysis.load_control import measure_load_control
from dusttaichi.analysis.loads import (
    ControlledLoad,
    Shearing,
    StrengthTest,
    Triaxial,
    is_triaxial,
    measure_controlled_loads,
    measure_shear_tests,
    measure_triaxial_tests,
)
from dusttaichi.analysis.observables import find_pareto_front
from dusttaichi.analysis.penetration import Column, Penetration, measure_column, measure_penetration
from dusttaichi.analysis.pores import Pores, measure_pores
from dusttaichi.analysis.profile import read_profiles
from dusttaichi.analysis.restitution import (
    Restitution,
    compute_orbital_momentum,
    measure_restitution,
    measure_wall_restitution,
)
from dusttaichi.analysis.run import Run, open_run
from dusttaichi.analysis.stored import (
    find_study,
    open_collisions,
    open_ensemble,
    open_restitution_map,
    open_study,
    open_trade,
)
from dusttaichi.analysis.structure import Structure, measure_structure
from dusttaichi.analysis.summary import compare, summarise, tabulate, to_csv
from dusttaichi.analysis.tensile import StrengthFit, Tensile, fit_strength, measure_tensile_strength

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
    "bands",
    "choose_compression_law",
    "compare",
    "compute_ledger",
    "compute_mass_spectrum",
    "compute_orbital_momentum",
    "count_frames",
    "find_fragments",
    "find_onset",
    "find_pareto_front",
    "find_study",
    "fit_compression",
    "fit_fragment_dimension",
    "fit_friction",
    "fit_sound_speed",
    "fit_strength",
    "gather",
    "is_triaxial",
    "measure_arrival",
    "measure_column",
    "measure_compaction",
    "measure_compression_curve",
    "measure_controlled_loads",
    "measure_deviation",
    "measure_fractal",
    "measure_growth_efficiency",
    "measure_isotropic_compression",
    "measure_load_control",
    "measure_losses",
    "measure_penetration",
    "measure_pores",
    "measure_restitution",
    "measure_shear_tests",
    "measure_structure",
    "measure_tensile_strength",
    "measure_triaxial_tests",
    "measure_unloadings",
    "measure_wall_restitution",
    "open_collisions",
    "open_ensemble",
    "open_restitution_map",
    "open_run",
    "open_study",
    "open_trade",
    "read_frame",
    "read_grain_masses",
    "read_profiles",
    "save_ensemble",
    "summarise",
    "tabulate",
    "to_csv",
]
