"""What a result means: reads result files only, and never needs Taichi."""

from dusttaichi.analysis.compare import compare, to_csv
from dusttaichi.analysis.compression import (
    Curve,
    Deviation,
    Fit,
    compression_curve,
    fit_compression,
    rms_from_law,
)
from dusttaichi.analysis.ensemble import Band, bands, gather, save_ensemble
from dusttaichi.analysis.ledger import Ledger, ledger
from dusttaichi.analysis.profile import profile
from dusttaichi.analysis.run import Run, open_run
from dusttaichi.analysis.summary import summary, table

__all__ = [
    "Band",
    "Curve",
    "Deviation",
    "Fit",
    "Ledger",
    "Run",
    "bands",
    "compare",
    "compression_curve",
    "fit_compression",
    "gather",
    "ledger",
    "open_run",
    "profile",
    "rms_from_law",
    "save_ensemble",
    "summary",
    "table",
    "to_csv",
]
