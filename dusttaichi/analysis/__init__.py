"""What a result means: reads result files only, and never needs Taichi."""

from dusttaichi.analysis.compare import compare, to_csv
from dusttaichi.analysis.compression import (
    Curve,
    Deviation,
    Fit,
    compression_curve,
    compression_law,
    fit_compression,
    onset,
    rms_from_law,
)
from dusttaichi.analysis.ensemble import Band, bands, gather, save_ensemble
from dusttaichi.analysis.fractal import Fractal, fractal
from dusttaichi.analysis.isotropic import Isotropic, Ratio, isotropic
from dusttaichi.analysis.ledger import Ledger, ledger
from dusttaichi.analysis.losses import Losses, losses_against_filling_factor
from dusttaichi.analysis.profile import profile
from dusttaichi.analysis.run import Run, open_run
from dusttaichi.analysis.summary import summary, table
from dusttaichi.analysis.tensile import StrengthFit, Tensile, fit_strength, tensile

__all__ = [
    "Band",
    "Curve",
    "Deviation",
    "Fit",
    "Fractal",
    "Isotropic",
    "Ledger",
    "Losses",
    "Ratio",
    "Run",
    "StrengthFit",
    "Tensile",
    "bands",
    "compare",
    "compression_curve",
    "compression_law",
    "fit_compression",
    "fit_strength",
    "fractal",
    "isotropic",
    "gather",
    "ledger",
    "losses_against_filling_factor",
    "onset",
    "open_run",
    "profile",
    "rms_from_law",
    "save_ensemble",
    "summary",
    "table",
    "tensile",
    "to_csv",
]
