"""Numerical fracture: particles of a body that pair while nothing has yielded."""

import numpy as np
import pytest
from continuum import dust

from dusttaichi.errors import GuardStop


@pytest.fixture
def disc():
    """A disc of dust, and its places with every sixth particle next to a neighbour."""
    x, area = dust.disc(5 * dust.SPACING)
    motion = dust.moving(dust.scene(viscosity={"grid": 0.005}), dust.particles(x, area))
    at = motion.sim.of_particles("x")
    paired = at.copy()
    paired[::6] += 0.8 * (at[np.argsort(np.linalg.norm(at[:, None] - at, axis=2), axis=1)[::6, 1]] -
                          at[::6])  # fmt: skip
    motion.sim.step = 1
    return motion, paired


def test_dust_that_has_not_yielded_and_pairs_is_named(disc):
    motion, paired = disc
    motion._pairing.check()
    motion.sim.put("x", paired)
    motion._pairing.check()  # looks at a step once
    motion.sim.step = 2
    with pytest.raises(GuardStop, match=r"step 2\).*the dust has broken by the method.* yielded"):
        motion._pairing.check()
    assert motion.state().numbers["looked"] == 2


@pytest.mark.parametrize("how", ["compacted", "sheared", "denser"])
def test_dust_that_has_yielded_or_is_compressed_is_not(disc, how):
    """Compaction and flow bring particles together, and evenly compressed dust is as near as its
    density says."""
    motion, paired = disc
    sim = motion.sim
    if how == "denser":
        sim.put("x", 0.4 * sim.of_particles("x"))
        sim.put("density", sim.of_particles("density") / 0.16)
    else:
        sim.put("x", paired)
    if how == "compacted":
        sim.put("reference", 1.2 * sim.of_particles("reference"))
    if how == "sheared":
        work = sim.of_particles("work")
        work[:, 2] = 1.0  # J of shear that is not stored
        sim.put("work", work)
    motion._pairing.check()
