"""Schema of the YAML files: one block per file, frozen, in SI once read.

Names are imported on first use, so that a user of units does not wait for all blocks.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # for editors and type checkers; imported on first use, by __getattr__
    from dusttaichi.scene.boundary import (
        BoxBoundary,
        OpenBoundary,
        PeriodicBoundary,
        PlatesBoundary,
        TubeBoundary,
        bounded_axes,
        filling_direction,
        get_drive,
        has_strain,
    )
    from dusttaichi.scene.drive import Drive
    from dusttaichi.scene.interaction import (
        Asperities,
        Effect,
        Interaction,
        NoDamping,
        Scaled,
        Viscoelastic,
        Viscous,
    )
    from dusttaichi.scene.loading import (
        as_scene,
        from_yaml,
        json_schema,
        load,
        load_extensions,
        schema_text,
    )
    from dusttaichi.scene.material import NAMED, Material
    from dusttaichi.scene.numerics import Numerics
    from dusttaichi.scene.output import Interval, Output
    from dusttaichi.scene.push import Push
    from dusttaichi.scene.scene import Scene
    from dusttaichi.scene.stage import Stage, StagePlan
    from dusttaichi.scene.stop import Stop

_HOMES = {
    "boundary": "BoxBoundary OpenBoundary PeriodicBoundary PlatesBoundary "
    "TubeBoundary bounded_axes filling_direction get_drive has_strain",
    "drive": "Drive",
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

__all__ = [
    "Asperities",
    "BoxBoundary",
    "Drive",
    "Effect",
    "Interaction",
    "Interval",
    "Material",
    "NAMED",
    "NoDamping",
    "Numerics",
    "OpenBoundary",
    "Output",
    "PeriodicBoundary",
    "PlatesBoundary",
    "TubeBoundary",
    "Push",
    "Scaled",
    "Scene",
    "Stage",
    "StagePlan",
    "Stop",
    "Viscoelastic",
    "Viscous",
    "as_scene",
    "bounded_axes",
    "filling_direction",
    "from_yaml",
    "get_drive",
    "has_strain",
    "json_schema",
    "load",
    "load_extensions",
    "schema_text",
]


if not TYPE_CHECKING:  # for which a misspelt name is then an error

    def __getattr__(name: str) -> Any:
        if name not in _HOME:
            raise AttributeError(f"module {__name__} has no attribute {name}")
        value = getattr(importlib.import_module(f"{__name__}.{_HOME[name]}"), name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    return [*globals(), *__all__]
