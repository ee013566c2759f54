"""What a YAML file may say: one block a file, frozen, in SI once read."""

from dusttaichi.scene.boundary import WALLS, BoxBoundary, OpenBoundary, compresses
from dusttaichi.scene.interaction import (
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
from dusttaichi.scene.sample import CylinderSize, ExplicitSample, RbdSample
from dusttaichi.scene.scene import Scene
from dusttaichi.scene.stop import Stop

__all__ = [
    "NAMED",
    "WALLS",
    "BoxBoundary",
    "CylinderSize",
    "Effect",
    "ExplicitSample",
    "Interaction",
    "Interval",
    "Material",
    "NoDamping",
    "Numerics",
    "OpenBoundary",
    "Output",
    "RbdSample",
    "Scaled",
    "Scene",
    "Stop",
    "Viscoelastic",
    "Viscous",
    "compresses",
    "from_yaml",
    "json_schema",
    "load",
    "schema_text",
]
