"""Kinds of samples for `sample.kind`: built-in and registered ones.

A kind is a YAML block and a function that makes the sample:

    class Cube(SampleBlock):
        kind: Literal["cube"]
        edge: Annotated[float, Quantity("length", gt=0)] = Field(description="edge of the cube")

    @register(Cube)
    def make(spec, materials):
        return Sample.at_rest(...)

After that `sample: {kind: cube, edge: 20 um}` is valid YAML in this process. Each built-in kind
registers itself in the same way.
"""

from collections.abc import Callable
from typing import Annotated, ClassVar, TypeVar

from dusttaichi.samples.description import describe_in_cell
from dusttaichi.samples.images import OPEN, find_cell
from dusttaichi.samples.materials import Materials
from dusttaichi.samples.sample import Sample
from dusttaichi.scene.kinds import AnyOf, KindBlock, Kinds

Spec = TypeVar("Spec", bound="SampleBlock")
Make = Callable[[Spec, Materials], Sample]


class SampleBlock(KindBlock):
    """The YAML block of a kind of sample.

    Its field `kind` is a Literal with the kind's name.
    """

    flies: ClassVar[bool] = False
    """True for colliding bodies, where the outcome depends on the kinetic energy."""

    def least_room(self, radius: float) -> tuple[tuple[float, float, float], int]:
        """Smallest box for the sample, and its number of grains.

        Numbers that are not known beforehand are 0.

        Parameters
        ----------
        radius
            Radius of the scene's material [m].

        Returns
        -------
        edges
            (x, y, z) [m].
        grains
            Number of grains.
        """
        return (0.0, 0.0, 0.0), getattr(self, "grains", None) or 0


GRAINS = Kinds(__package__, "kind of sample")
reads_samples = GRAINS.add_reader


def register(block: type[Spec]) -> Callable[[Make[Spec]], Make[Spec]]:
    """Register the function below as the generator of samples of this block (decorator).

    The function is called with the block, its quantities in SI, and the scene's Materials (radius
    and equilibrium distance of its grains, further materials); it returns a Sample, or raises
    DustError. See also Kinds.register.
    """
    return GRAINS.register(block)


AnySample = Annotated[SampleBlock, AnyOf(GRAINS)]
AnyBody = Annotated[SampleBlock, AnyOf(GRAINS, bodies=True)]


def make_sample(spec: SampleBlock, materials: Materials, *, body: bool = True) -> Sample:
    """Make the sample of a block, with its kind and its measures as info.

    body: it is one of a larger sample, so that the cell of the scene is not around it.
    """
    sample: Sample = GRAINS[spec.kind].make(spec, materials)
    sample.info.setdefault("kind", spec.kind)
    sample.info.setdefault("grains", len(sample))
    cell = OPEN if body else find_cell(sample.info, materials)
    return describe_in_cell(sample, materials.radii_of(sample), cell)
