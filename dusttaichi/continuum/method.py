"""The method `continuum` as a scene names it; Taichi is imported where something is built."""

from dusttaichi.continuum.continuum_variables import VARIABLES
from dusttaichi.continuum.scene.continuum_scene import ContinuumScene
from dusttaichi.method import Method, defer_import

METHOD = Method(
    name="continuum",
    scene=ContinuumScene,
    make_sample=defer_import("dusttaichi.continuum.samples:make"),
    build=defer_import("dusttaichi.continuum.dust_build:make"),
    reopen=defer_import("dusttaichi.continuum.dust_build:reopen"),
    variables=VARIABLES,
    preview=defer_import("dusttaichi.continuum.dust_preview:preview"),
    seconds=1.5e-6,  # of a time step in two dimensions; steps of a run have several
    device_seconds=(2e-3, 1e-8),
    observables=("dusttaichi.continuum.analysis.continuum_numbers:FAMILIES",),
    figures=("dusttaichi.continuum.plots:FIGURES",),
    read_snapshot="dusttaichi.continuum.analysis:read_particles",
    trade_parameters="dusttaichi.continuum.dust_variants:PARAMETERS",
    picture="dusttaichi.continuum.plots.dust:PICTURE",
    exports={"vtk": "dusttaichi.export.vtk:write_particles"},
)
