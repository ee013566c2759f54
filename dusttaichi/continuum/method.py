"""The method `continuum` as a scene names it; Taichi is imported where something is built."""

from dusttaichi.continuum.variables import VARIABLES
from dusttaichi.method import Method, deferred
from dusttaichi.scene.continuum import ContinuumScene


def _parts(scene):
    """Dimension, images or none, contact, what else is compiled in."""
    numerics = scene.numerics
    images = bool(scene.boundary.periodic_axes or getattr(scene.boundary, "mirrors", ()))
    more = {
        "images": images,
        "separate": numerics.contact == "separate",
        "artificial stress": numerics.artificial_stress is not None,
        "hourglass": scene.resists_hourglass,
        "self-gravity": bool(scene.gravity and scene.gravity.self_gravity),
    }
    return (f"{scene.dimension}D", *(name for name, there in more.items() if there))


METHOD = Method(
    name="continuum",
    scene=ContinuumScene,
    make_sample=deferred("dusttaichi.samples.continuum:make"),
    build=deferred("dusttaichi.continuum.moving_dust:make"),
    reopen=deferred("dusttaichi.continuum.moving_dust:reopen"),
    variables=VARIABLES,
    preview=deferred("dusttaichi.continuum.preview:preview"),
    parts=_parts,
    observables=("dusttaichi.analysis.continuum.numbers:FAMILIES",),
    figures=("dusttaichi.plots.continuum:FIGURES",),
    read_snapshot="dusttaichi.analysis.continuum:read_particles",
    trade_parameters="dusttaichi.studies.trade.continuum:PARAMETERS",
    picture="dusttaichi.plots.continuum.dust:PICTURE",
    exports={"vtk": "dusttaichi.export.vtk:write_particles"},
)
