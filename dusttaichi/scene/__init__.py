"""Schema of the YAML files: one block per file, frozen, in SI once read.

Names are imported on first use, so that a user of units does not wait for all blocks.
"""

import importlib

_HOMES = {
    "boundary": "BoxBoundary Drive OpenBoundary PeriodicBoundary PlatesBoundary bounded_axes "
    "filling_direction get_drive has_strain",
    "interaction": "Asperities Effect Interaction NoDamping Scaled Viscoelastic Viscous",
    "loading": "as_scene from_yaml json_schema load load_extensions schema_text",
    "material": "NAMED Material",
    "numerics": "Numerics",
    "output": "Interval Output",
    "push": "Push",
    "scene": "Scene",
    "stage": "Stage StagePlan",
    "stop": "Stop",
}
_HOME = {name: module for module, names in _HOMES.items() for name in names.split()}

__all__ = sorted(_HOME)


def __getattr__(name: str):
    if name not in _HOME:
        raise AttributeError(f"module {__name__} has no attribute {name}")
    value = getattr(importlib.import_module(f"{__name__}.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*globals(), *__all__]
