"""What a YAML file may say: one block a file, frozen, in SI once read."""

from dusttaichi.names import AXES, WALLS
from dusttaichi.scene.boundary import (
    BoxBoundary,
    Drive,
    OpenBoundary,
    PeriodicBoundary,
    PlatesBoundary,
    bounded_axes,
    filling_direction,
    own_drive,
    strains,
)
from dusttaichi.scene.grains import GrainsScene
from dusttaichi.scene.interaction import (
    Asperities,
    Effect,
    Interaction,
    NoDamping,
    Scaled,
    Viscoelastic,
    Viscous,
)
from dusttaichi.scene.loading import from_yaml, json_schema, load, schema_text
from dusttaichi.scene.material import NAMED, Material
from dusttaichi.scene.numerics import Numerics
from dusttaichi.scene.output import Interval, Output
from dusttaichi.scene.push import Push
from dusttaichi.scene.sample import CylinderSize, ExplicitSample, RbdSample
from dusttaichi.scene.scene import Scene
from dusttaichi.scene.stage import Stage, StagePlan
from dusttaichi.scene.stop import Stop

__all__ = [
    "AXES",
    "NAMED",
    "WALLS",
    "Asperities",
    "BoxBoundary",
    "CylinderSize",
    "Drive",
    "Effect",
    "ExplicitSample",
    "GrainsScene",
    "Interaction",
    "Interval",
    "Material",
    "NoDamping",
    "Numerics",
    "OpenBoundary",
    "Output",
    "PeriodicBoundary",
    "PlatesBoundary",
    "Push",
    "RbdSample",
    "Scaled",
    "Scene",
    "Stage",
    "StagePlan",
    "Stop",
    "Viscoelastic",
    "Viscous",
    "bounded_axes",
    "filling_direction",
    "from_yaml",
    "json_schema",
    "load",
    "own_drive",
    "schema_text",
    "strains",
]
