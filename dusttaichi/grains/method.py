"""The method `grains` as a scene names it; Taichi is imported where something is built."""

import inspect
from pathlib import Path

from dusttaichi.grains.grain_scene import GrainsScene
from dusttaichi.grains.grain_variables import VARIABLES
from dusttaichi.method import Method, defer_import

PACKAGE = Path(__file__).parents[1]


def _code(scene):
    """Files of laws and of a kind of sample that are not of this package."""
    from dusttaichi.physics.contact.effect_registry import EFFECTS, law_name, law_of
    from dusttaichi.samples.sample_registry import GRAINS

    laws = [(effect, law_name(scene.interaction, effect)) for effect in EFFECTS]
    laws += [("effects", name) for name in scene.interaction.effects]
    used = [law_of(*effect_law) for effect_law in laws if effect_law[1] is not None]
    bodies = (getattr(scene.sample, name, None) for name in ("target", "projectile", "of"))
    makers = [GRAINS[block.kind].make for block in (scene.sample, *bodies) if block is not None]
    files = [_file_of(effect_law) for effect_law in (*used, *makers)]
    return sorted({path for path in files if path is not None and PACKAGE not in path.parents})


def _file_of(value):
    """Path of the source of a module, class, function or object; None of one that was typed in."""
    named = inspect.ismodule(value) or hasattr(value, "__qualname__")
    try:
        path = Path(inspect.getsourcefile(value if named else type(value)))
    except (TypeError, OSError):
        return None
    return path if path.is_file() else None


METHOD = Method(
    name="grains",
    scene=GrainsScene,
    make_sample=defer_import("dusttaichi.samples:make"),
    build=defer_import("dusttaichi.grains.build:make"),
    reopen=defer_import("dusttaichi.grains.build:reopen"),
    variables=tuple(VARIABLES.values()),
    code=_code,
    preview=defer_import("dusttaichi.grains.preview:preview"),
    internals=defer_import("dusttaichi.grains.preview:internals"),
    forces=defer_import("dusttaichi.grains.inventory:forces"),
    seconds=5e-8,
    device_seconds=(4e-5, 3e-10),
    observables=("dusttaichi.analysis.settings:OF_GRAINS",),
    read_snapshot="dusttaichi.analysis.frame:read_frame",
    trade_parameters="dusttaichi.grains.grain_variants:PARAMETERS",
    picture="dusttaichi.plots.grain_picture:PICTURE",
    exports={
        "vtk": "dusttaichi.export.vtk:write",
        "extxyz": "dusttaichi.export.extxyz:write",
        "lammps": "dusttaichi.export.lammps:write",
        "lammps-data": "dusttaichi.export.lammps_data:write",
        "lammps-restart": "dusttaichi.export.lammps_data:write_restart",
    },
)
