"""Many runs of one scene: replicas with other seeds, sweeps over values of its YAML.

Each run is a process of its own, started by a pool of threads, by dask.distributed on this
machine, or by a Dask cluster. Nothing here imports Taichi but `child`, the process of one run.
"""

from dusttaichi.studies.ensemble.command import command
from dusttaichi.studies.ensemble.gathering import gather_plan
from dusttaichi.studies.ensemble.runs import run_all
from dusttaichi.studies.ensemble.scenes import (
    Axis,
    Member,
    Plan,
    ensemble_plan,
    sweep_plan,
    with_settings,
)

__all__ = [
    "Axis",
    "Member",
    "Plan",
    "command",
    "ensemble_plan",
    "gather_plan",
    "run_all",
    "sweep_plan",
    "with_settings",
]
