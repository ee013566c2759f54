"""Guards of the continuum: what they stop, what they say; numerical fracture, which they find."""

from types import SimpleNamespace

import numpy as np
import pytest
from continuum import dust

from dusttaichi.continuum import dust_validity
from dusttaichi.continuum.kernels.store import FACES
from dusttaichi.domain.walls import NORMALS, Box
from dusttaichi.errors import GuardStop
from dusttaichi.method import Start
from dusttaichi.running import ledger
from dusttaichi.units import SI


def test_guards_stop_what_has_no_meaning():
    x, area = dust.disc(3 * dust.SPACING)
    engine = dust.moving(dust.scene(viscosity={"grid": 0.005}), dust.particles(x, area))
    engine.validate(engine.measure())
    start = Start.from_measurement(engine.measure())
    density = engine.dust_state.of_particles("density")
    engine.dust_state["density"] = density * 6.6  # 0.99, elastic
    engine.validate(engine.measure())
    engine.dust_state["density"] = density * 6.7
    with pytest.raises(GuardStop, match="filling factor 1.005, more than its solid"):
        engine.validate(engine.measure())
    engine.dust_state["density"] = density
    engine.dust_state["v"] = np.full((len(x), 2), np.nan)
    with pytest.raises(
        GuardStop, match="energy is not a number.* numerics.viscosity.grid or a low"
    ):
        ledger.check(engine, engine.measure(), start)
    with pytest.raises(GuardStop, match="not a number"):
        engine.dust_state["x"] = np.full((len(x), 2), np.nan)
        engine.search.update()


def test_a_body_that_passes_through_a_face_is_named():
    present = np.array([0, 0, 0, 0, 1, 0])
    offset = np.array([0.0, 0.0, 0.0, 0.0, -3e-3, 0.0])  # a bottom at -3 mm
    box = Box(NORMALS, offset, np.zeros(6), present.astype(float), present)
    centres = np.zeros((FACES + 2, 3))
    environment = SimpleNamespace(time=5e-6, step=3, units=SI, box=box)
    state = SimpleNamespace(of_bodies=lambda column: centres)
    centres[FACES:] = [[0.0, 0.0, -3.2e-3], [9.0, 0.0, -2.9e-3]]  # the face itself, the bead
    dust_validity.check_inside(state, environment, {1: "bead"})
    dust_validity.check_inside(state, SimpleNamespace(box=None), {1: "bead"})
    centres[FACES + 1, 2] = -3.25e-3
    with pytest.raises(GuardStop, match=r"bead has passed through the bottom.* 0.25 mm outside"):
        dust_validity.check_inside(state, environment, {1: "bead"})


def test_what_is_too_fast_is_stopped():
    """A disc at 1 km/s, which a step of the speed of sound would carry through the wall, and a wall
    that is pushed into dust as fast as no step can follow."""
    x, area = dust.disc(3 * dust.SPACING)
    x[:, 1] += 3.0 * dust.SPACING - x[:, 1].min()
    room = np.array([[np.nan] * 2, [np.nan] * 2, [0.0, np.nan]])
    sample = dust.particles(x, area, [0.0, -1000.0], room=room)
    engine = dust.moving(dust.scene(boundary={"kind": "faces", "bottom": "rigid"}), sample)
    with pytest.raises(GuardStop, match="filling factor"):
        for _ in range(20):
            engine.advance(1)
            engine.validate(engine.measure())
    engine = dust.moving(dust.scene(boundary={"kind": "faces", "bottom": "rigid"}), sample)
    speeds = np.zeros((6, 3))
    speeds[4, 2] = 1e7
    engine.stepper.move_faces(speeds)
    with pytest.raises(GuardStop, match="steps of the method"):
        engine.advance(20)


@pytest.fixture
def disc():
    """A disc of dust, and its places with every sixth particle next to a neighbour."""
    x, area = dust.disc(5 * dust.SPACING)
    engine = dust.moving(dust.scene(viscosity={"grid": 0.005}), dust.particles(x, area))
    at = engine.dust_state.of_particles("x")
    paired = at.copy()
    paired[::6] += 0.8 * (at[np.argsort(np.linalg.norm(at[:, None] - at, axis=2), axis=1)[::6, 1]] -
                          at[::6])  # fmt: skip
    engine.environment.step = 1
    return engine, paired


def test_dust_that_has_not_yielded_and_pairs_is_named(disc):
    engine, paired = disc
    engine.pairing.check()
    engine.dust_state["x"] = paired
    engine.pairing.check()  # looks at a step once
    engine.environment.step = 2
    with pytest.raises(GuardStop, match=r"step 2\).*the dust has broken by the method.* yielded"):
        engine.pairing.check()
    assert engine.state().numbers["looked"] == 2


@pytest.mark.parametrize("how", ["compacted", "sheared", "denser"])
def test_dust_that_has_yielded_or_is_compressed_is_not(disc, how):
    """Compaction and flow bring particles together, and evenly compressed dust is as near as its
    density says."""
    engine, paired = disc
    if how == "denser":
        engine.dust_state["x"] = 0.4 * engine.dust_state.of_particles("x")
        engine.dust_state["density"] = engine.dust_state.of_particles("density") / 0.16
    else:
        engine.dust_state["x"] = paired
    if how == "compacted":
        engine.dust_state["reference"] = 1.2 * engine.dust_state.of_particles("reference")
    if how == "sheared":
        work = engine.dust_state.of_particles("work")
        work[:, 2] = 1.0  # J of shear that is not stored
        engine.dust_state["work"] = work
    engine.pairing.check()
