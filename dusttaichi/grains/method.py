"""The method `grains` as a scene names it; Taichi is imported where something is built."""

from dusttaichi.grains.variables import VARIABLES
from dusttaichi.method import Method
from dusttaichi.scene.grains import GrainsScene


def _make_sample(scene):
    from dusttaichi import samples

    return samples.make(scene)


def _build(scene, sample):
    from dusttaichi.grains.moving_grains import make

    return make(scene, sample)


def _reopen(scene, state):
    from dusttaichi.grains.moving_grains import reopen

    return reopen(scene, state)


METHOD = Method(
    name="grains",
    scene=GrainsScene,
    make_sample=_make_sample,
    build=_build,
    reopen=_reopen,
    variables=tuple(VARIABLES.values()),
)
