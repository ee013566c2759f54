"""The method `continuum` as a scene names it; Taichi is imported where something is built."""

from dusttaichi.continuum.scene import ContinuumScene
from dusttaichi.continuum.variables import VARIABLES
from dusttaichi.method import Method, deferred

METHOD = Method(
    name="continuum",
    scene=ContinuumScene,
    make_sample=deferred("dusttaichi.samples.continuum:make"),
    build=deferred("dusttaichi.continuum.moving_dust:make"),
    reopen=deferred("dusttaichi.continuum.moving_dust:reopen"),
    variables=VARIABLES,
    preview=deferred("dusttaichi.continuum.preview:preview"),
    seconds=1e-6,
    observables=("dusttaichi.analysis.continuum.numbers:FAMILIES",),
    figures=("dusttaichi.plots.continuum:FIGURES",),
    read_snapshot="dusttaichi.analysis.continuum:read_particles",
    trade_parameters="dusttaichi.continuum.trade:PARAMETERS",
    picture="dusttaichi.plots.continuum.dust:PICTURE",
    exports={"vtk": "dusttaichi.export.vtk:write_particles"},
)
