"""The method `grains` as the run knows it."""

from dusttaichi.method import Method
from dusttaichi.results.variables import VARIABLES
from dusttaichi.scene.grains import GrainsScene


def _make_sample(scene):
    from dusttaichi import samples

    return samples.make(scene)


METHOD = Method(
    name="grains",
    scene=GrainsScene,
    make_sample=_make_sample,
    build=None,
    reopen=None,
    variables=tuple(VARIABLES.values()),
)
