"""Elastic bodies: rings of rubber that bounce, a bead that hardly differs from a rigid one."""

import numpy as np
import pytest
from continuum import dust
from scipy.spatial import cKDTree

from dusttaichi.errors import DustError, GuardStop

RING = {
    "kind": "elastic",
    "diameter": "8 mm",
    "hole": "6 mm",
    "density": "1 g/cm^3",
    "bulk_modulus": "1 MPa",
    "shear_ratio": 0.22,
}
SPEED, SPACING = 1.866, 0.25e-3  # 0.059 of the speed of sound, as everybody has them


def bodies(engine):
    return engine.series(engine.measure(), None)


# restitution at the finest spacing of docs/continuum.md; a coarse ring is within 5 % of it
OTHERWISE = {"hourglass": 0.0, "contact": "separate", "viscosity": {"grid": 1.0}}
RINGS = {
    "spacing alone": ({}, 0.796),
    "artificial stress": ({"artificial_stress": "on"} | OTHERWISE, 0.695),
}


def rings(**numerics):
    """Simulation of the rings of Gray et al. (2001), coarser: configs/continuum/rings.yaml has
    their numbers."""
    speeds = {-1: [f"{SPEED} m/s", "0 m/s"], 1: [f"-{SPEED} m/s", "0 m/s"]}
    bodies = [
        RING | {"position": [f"{4.3 * side} mm", "0 mm"], "velocity": speeds[side]}
        for side in (-1, 1)
    ]
    sample = {"kind": "several", "bodies": bodies}
    return dust.moving(dust.scene(sample=sample, spacing=f"{SPACING} m", **numerics))


@pytest.mark.parametrize(
    "shape", ["spacing alone", pytest.param("artificial stress", marks=pytest.mark.long)]
)
def test_rubber_rings_bounce_in_one_piece(shape):
    """By default, and with artificial stress, where finer rings lose more: 0.695 is that of
    0.167 mm. None counts as broken on the way, or even nearly."""
    numerics, restitution = RINGS[shape]
    engine = rings(**numerics)
    start, body_velocity_before = engine.measure(), bodies(engine)["body_velocity"][:, 0]
    for _ in range(10):
        engine.advance(int(5e-4 / engine.dt))
        bodies(engine)
        assert min(engine.pairing.distances(body).min() for body in engine.pairing.bodies) > 0.7
    end, end_bodies = engine.measure(), bodies(engine)
    open_by = end.energy - start.energy + end.lost - start.lost
    assert abs(open_by) < 0.01 * start.kinetic
    velocity_after = end_bodies["body_velocity"][:, 0]
    np.testing.assert_allclose(-velocity_after / body_velocity_before, restitution, rtol=0.05)
    # what the method has stored has come back, but for some
    assert abs(end.losses[5]) < 0.05 * start.kinetic
    np.testing.assert_allclose(velocity_after.sum(), 0.0, atol=1e-9 * SPEED)
    # apart from each other; no particle has left its ring, and none have met
    x = engine.dust_state.in_order(engine.dust_state.of_particles("x"))
    first, second = x[engine.sample.body == 0], x[engine.sample.body == 1]
    assert second[:, 0].min() - first[:, 0].max() > 2.0 * SPACING
    nearest = cKDTree(first).query(first, k=2)[0][:, 1]
    assert 0.5 * SPACING < nearest.min() and nearest.max() < 1.5 * SPACING


def test_rings_whose_particles_pair_are_stopped():
    """Without stiffness against hourglass modes they break within a millisecond or two."""
    engine = rings(hourglass=0.0)
    with pytest.raises(GuardStop, match=r"ring has broken by the method.*of its particles have pa"):
        for _ in range(40):
            engine.advance(int(5e-5 / engine.dt))
            bodies(engine)
    assert engine.time < 2e3


def spin(x, v):
    return x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0]


def zigzag(stiffness):
    """(largest distance from the start [spacings], residual, momentum, angular momentum) of the
    rows of a block that move to the left and to the right in turn, which strains nothing."""
    block = {key: RING[key] for key in ("kind", "density", "bulk_modulus", "shear_ratio")}
    block["size"] = ["2 mm", "2 mm"]
    scene = dust.scene(sample=block, hourglass=stiffness, viscosity={"grid": 0.0})
    engine = dust.moving(scene)
    x, m = engine.dust_state.of_particles("x"), engine.dust_state.of_particles("mass")
    v = np.zeros_like(x)
    v[:, 0] = 0.1 * np.where(np.round(x[:, 1] / (0.05e-3 * np.sqrt(3.0)) - 0.5) % 2, 1.0, -1.0)
    v -= m @ v / m.sum()
    engine.dust_state["v"] = v
    start, number = engine.measure(), engine.dust_state.of_particles("number")
    engine.advance(int(80e-6 / engine.dt))  # the sound passes 20 smoothing lengths
    # a search may have sorted them again
    back = np.argsort(number)[engine.dust_state.of_particles("number")]
    moved = engine.dust_state.of_particles("x") - x[back]
    inside = np.abs(x[back] - x.mean(axis=0)).max(axis=1) < 0.6e-3
    velocities, scale = engine.motion.velocities()[:, [0, 2]], 0.1 * m.sum()
    turning = m @ (spin(engine.dust_state.of_particles("x"), velocities) - spin(x[back], v[back]))
    momenta = np.abs(m @ velocities).max() / scale, abs(turning) / (scale * 1e-3)
    end = engine.measure()
    open_by = (end.energy - start.energy + end.lost - start.lost) / start.kinetic
    return np.abs(moved[inside]).max() / 0.1e-3, open_by, *momenta


def test_stiffness_against_hourglass_modes_brings_particles_back():
    """Without it rows of particles that slide past each other never stop, since no velocity
    gradient is there; with it they swing by v/omega, omega about c/h. It conserves both momenta."""
    free, *_ = zigzag(0.0)
    assert free > 0.07  # spacings; the speed times the time is 0.08
    bound, open_by, momentum, turning = zigzag(1.0)
    assert bound < 0.1 * free
    assert abs(open_by) < 0.01  # its energy is stored in the channel `artificial`
    assert momentum < 1e-12 and turning < 1e-12


def depth(projectile, spacing):
    """How far [m] a bead of 0.6 mm sinks into dust within 0.8 ms; spacing [mm]."""
    bead = {"diameter": "0.6 mm", "density": "2540 kg/m^3"}
    target = {"kind": "block", "size": ["1.8 mm", "1.2 mm"]}
    sample = {"kind": "impact", "target": target, "projectile": bead | projectile}
    sample["speed"] = "0.4 m/s"
    floor = {"kind": "faces", "bottom": {"layer": "0.3 mm"}}
    engine = dust.moving(dust.scene(boundary=floor, sample=sample, spacing=f"{spacing} mm"))
    start, bodies_before = engine.measure(), bodies(engine)
    assert bodies_before["body_velocity"][0, 2] == pytest.approx(-0.4)
    engine.advance(int(0.8e-3 / engine.dt))
    end, bodies_after = engine.measure(), bodies(engine)
    assert abs(end.energy - start.energy + end.lost - start.lost) < 0.01 * start.kinetic
    assert bodies_after["body_velocity"][0, 2] > -0.3  # the dust has braked it
    return bodies_before["body_position"][0, 2] - bodies_after["body_position"][0, 2]


BEADS = {
    "rigid": {"kind": "rigid"},
    "elastic": {"kind": "elastic", "bulk_modulus": "1 MPa", "shear_ratio": 0.6},
}


@pytest.mark.long
def test_an_elastic_bead_falls_about_as_a_rigid_one():
    """Where nine particles span the bead it sinks a fifth less; the next test takes the spacing to
    zero."""
    rigid, elastic = (depth(projectile, 0.07) for projectile in BEADS.values())
    assert 0.75 * rigid < elastic < rigid


@pytest.mark.long
def test_an_elastic_bead_falls_as_a_rigid_one():
    """They differ by an eighth where twelve particles span the bead, and meet at spacing zero:
    linearly extrapolated from 70 and 50 um within 10 %, from 50 and 35 um (slower) within 1 %."""
    end = {}
    for name, projectile in BEADS.items():
        coarse, fine = (depth(projectile, spacing) for spacing in (0.07, 0.05))
        end[name] = fine - 0.05 / 0.02 * (coarse - fine)
    assert end["elastic"] == pytest.approx(end["rigid"], rel=0.1)


def test_what_cannot_be_is_refused():
    with pytest.raises(DustError, match="hole smaller than the diameter"):
        dust.scene(sample=RING | {"hole": "8 mm"})
    without = {"kind": "several", "bodies": [{"diameter": "8 mm"}]}
    with pytest.raises(DustError, match=r'bodies\[0\]: kind is missing, .*"elastic".* is needed'):
        dust.scene(sample=without)
