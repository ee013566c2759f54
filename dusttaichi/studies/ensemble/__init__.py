"""Many runs of one scene: replicas with other seeds, sweeps over values of its YAML.

Each run is a worker process, for which a thread of this process or of a Dask cluster waits. Only
its task (jobs.run) imports Taichi.
"""

from dusttaichi.names import exported
from dusttaichi.studies.ensemble.runs import gather_plan, run_all
from dusttaichi.studies.ensemble.scenes import (
    Axis,
    Member,
    Plan,
    ensemble_plan,
    sweep_plan,
    with_common_settings,
    with_settings,
)

__all__ = exported(globals())
