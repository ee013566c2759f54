"""Guards of the continuum: what they stop, what they say; numerical fracture, which they find."""

from types import SimpleNamespace

import numpy as np
import pytest
from continuum import dust

from dusttaichi.continuum import validity
from dusttaichi.continuum.kernels.store import FACES
from dusttaichi.domain.walls import NORMALS, Box
from dusttaichi.errors import GuardStop
from dusttaichi.units import SI


def test_guards_stop_what_has_no_meaning():
    x, area = dust.disc(3 * dust.SPACING)
    motion = dust.moving(dust.scene(viscosity={"grid": 0.005}), dust.particles(x, area))
    motion.validate(motion.measure())
    density = motion.sim.of_particles("density")
    motion.sim.put("density", density * 6.6)  # 0.99, elastic
    motion.validate(motion.measure())
    motion.sim.put("density", density * 6.7)
    with pytest.raises(GuardStop, match="filling factor 1.005, more than its solid"):
        motion.validate(motion.measure())
    motion.sim.put("density", density)
    motion.sim.put("v", np.full((len(x), 2), np.nan))
    with pytest.raises(GuardStop, match="not a number"):
        motion.validate(motion.measure())
    with pytest.raises(GuardStop, match="not a number"):
        motion.sim.put("x", np.full((len(x), 2), np.nan))
        motion.sim.search.update()


def test_a_body_that_passes_through_a_face_is_named():
    present = np.array([0, 0, 0, 0, 1, 0])
    offset = np.array([0.0, 0.0, 0.0, 0.0, -3e-3, 0.0])  # a bottom at -3 mm
    box = Box(NORMALS, offset, np.zeros(6), present.astype(float), present)
    centres = np.zeros((FACES + 2, 3))
    sim = SimpleNamespace(time=5e-6, step=3, units=SI, rigid=lambda column: centres)
    centres[FACES:] = [[0.0, 0.0, -3.2e-3], [9.0, 0.0, -2.9e-3]]  # the face itself, the bead
    validity.check_inside(sim, box, {1: "bead"})
    validity.check_inside(sim, None, {1: "bead"})
    centres[FACES + 1, 2] = -3.25e-3
    with pytest.raises(GuardStop, match=r"bead has passed through the bottom.* 0.25 mm outside"):
        validity.check_inside(sim, box, {1: "bead"})


def test_what_is_too_fast_is_stopped():
    """A disc at 1 km/s, which a step of the speed of sound would carry through the wall, and a wall
    that is pushed into dust as fast as no step can follow."""
    x, area = dust.disc(3 * dust.SPACING)
    x[:, 1] += 3.0 * dust.SPACING - x[:, 1].min()
    room = np.array([[np.nan] * 2, [np.nan] * 2, [0.0, np.nan]])
    sample = dust.particles(x, area, [0.0, -1000.0], room=room)
    motion = dust.moving(dust.scene(boundary={"kind": "faces", "bottom": "rigid"}), sample)
    with pytest.raises(GuardStop, match="filling factor"):
        for _ in range(20):
            motion.advance(1)
            motion.validate(motion.measure())
    motion = dust.moving(dust.scene(boundary={"kind": "faces", "bottom": "rigid"}), sample)
    speeds = np.zeros((6, 3))
    speeds[4, 2] = 1e7
    motion.sim.move_faces(speeds)
    with pytest.raises(GuardStop, match="steps of the method"):
        motion.advance(20)


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
