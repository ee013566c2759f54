"""Many runs of one scene: replicas with other seeds, sweeps over values of its YAML.

Each run is a worker process, for which a thread of this process or of a Dask cluster waits. Only
its task (jobs.run) imports Taichi.
"""

from dusttaichi.names import exported
from dusttaichi.studies.ensemble.scenes import (
    Axis,
    Member,
    Plan,
    ensemble_plan,
    sweep_plan,
    with_common_settings,
    with_settings,
)

_RUNS = ("gather_plan", "run_all")  # they import all of the analysis, `dust run --set` does not
__all__ = [*exported(globals()), *_RUNS]


def __getattr__(name: str):
    if name not in _RUNS:
        raise AttributeError(f"module {__name__} has no attribute {name}")
    from dusttaichi.studies.ensemble import runs

    return getattr(runs, name)
