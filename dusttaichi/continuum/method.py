"""The method `continuum` as a scene names it; Taichi is imported where something is built."""

from dusttaichi.continuum.variables import VARIABLES
from dusttaichi.method import Method
from dusttaichi.scene.continuum import ContinuumScene


def _make_sample(scene):
    from dusttaichi.samples import continuum

    return continuum.make(scene)


def _build(scene, sample):
    from dusttaichi.continuum.moving_dust import make

    return make(scene, sample)


def _reopen(scene, state):
    from dusttaichi.continuum.moving_dust import reopen

    return reopen(scene, state)


METHOD = Method(
    name="continuum",
    scene=ContinuumScene,
    make_sample=_make_sample,
    build=_build,
    reopen=_reopen,
    variables=VARIABLES,
)
