"""A block of dust: a rectangle in two dimensions, a cuboid in three, its surface at z = 0."""

from typing import Literal

import numpy as np
from pydantic import Field

from dusttaichi.continuum.samples import body_registry, lattice
from dusttaichi.continuum.samples.dust import cost_of_scatter, dust
from dusttaichi.continuum.samples.particle_arrays import Particles
from dusttaichi.samples.values import Seed
from dusttaichi.scene.making import Cost


class BlockSample(body_registry.DustBody):
    """A block of dust; its upper surface is at z = 0 and its middle at x = y = 0."""

    kind: Literal["block"]
    size: body_registry.Edges = Field(
        description="[width, height], in three dimensions [Lx, Ly, Lz]"
    )
    lattice: body_registry.Lattice = Field(
        "auto",
        description="positions of the particles: triangular (2D), hexagonal (3D), glass; auto: the "
        "lattice of the dimension",
    )
    seed: Seed = Field(1, description="seed of the glass")
    filling_factor: body_registry.Filling | None = Field(
        None, description="filling factor, or a block with layers and scatter; default: material's"
    )

    def cost(self, scene) -> Cost | None:
        return cost_of_scatter(self.filling_factor, float(np.prod(self.size)), scene)


@body_registry.register(BlockSample)
def make(spec: BlockSample, matter: body_registry.Matter) -> Particles:
    """The block of spec, which fills its `room`.

    Its mass is exact: every particle has the same volume. Raises DustError for too many particles
    for the memory, or a block smaller than one.
    """
    matter = matter.select(spec.material)
    size = np.array(spec.size)
    volume = float(np.prod(size))
    lattice.check_count(volume, matter.spacing, matter.dimension, "sample.size")
    points = lattice.fill(size, matter.spacing, spec.lattice, spec.seed)
    points[:, -1] -= size[-1] / 2
    particles = dust(points, volume, matter, spec.filling_factor, "block")
    particles.fill_room(size)
    particles.room[2] = (-size[-1], 0.0)
    particles.info["size"] = size.tolist()
    return spec.place_particles(particles)
