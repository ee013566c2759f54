"""Many runs of one scene: replicas with other seeds, sweeps over values of its YAML.

Each run is a worker process of its own, which a thread of this process or of a Dask cluster waits
for. Nothing here imports Taichi but `task`, what that process does.
"""

from dusttaichi.studies.ensemble.gathering import gather_plan
from dusttaichi.studies.ensemble.runs import run_all
from dusttaichi.studies.ensemble.scenes import (
    Axis,
    Member,
    Plan,
    ensemble_plan,
    sweep_plan,
    with_common_settings,
    with_settings,
)

__all__ = [
    "Axis",
    "Member",
    "Plan",
    "ensemble_plan",
    "gather_plan",
    "run_all",
    "sweep_plan",
    "with_common_settings",
    "with_settings",
]
