"""Periodic along x and y, walls below and above: neighbours, contacts and stress across faces."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import RADIUS, Probe, box, make_scene, residual, sample_of
from test_periodic import REST, SCENE, cake, cell, lattice

from dusttaichi import units
from dusttaichi.grains.build import build
from dusttaichi.grains.load_sums import load_sums
from dusttaichi.grains.measure import energies
from dusttaichi.physics.contact import constants

SLAB = {"axes": "xy", "walls": ["bottom", "top"]}


def test_neighbours_across_faces_against_brute_force():
    rng = np.random.default_rng(5)
    edges = np.array([6.1, 7.3, 20.0]) * RADIUS
    room = edges + [0.0, 0.0, 4 * RADIUS]
    scene = make_scene(boundary=cell(room, **SLAB), damping="viscoelastic")
    x = np.empty((0, 3))
    while len(x) < 60:
        new = rng.uniform(size=3) * edges
        d = x - new
        d[:, :2] -= np.round(d[:, :2] / edges[:2]) * edges[:2]
        if len(x) == 0 or np.linalg.norm(d, axis=1).min() > 1.9 * RADIUS:
            x = np.concatenate([x, [new]])
    sim = build(scene, sample_of(x))
    sim.search.skin = 0.0
    i, j = sim.state.pairs()
    found = {tuple(sorted(pair)) for pair in zip(sim.order[i], sim.order[j], strict=True)}
    reach = (2 * sim.radius + sim.search.skin + sim.pair.reach) * units.LENGTH
    close = set()
    for a in range(60):
        for b in range(a):
            for kx in (-1, 0, 1):
                for ky in (-1, 0, 1):
                    image = x[b] + np.array([kx * edges[0], ky * edges[1], 0.0])
                    if np.linalg.norm(x[a] - image) < reach:
                        close.add((b, a))
    assert close and close <= found


def test_wall_contacts_go_with_grains_that_cross():
    """A slab between walls drifts and wraps along x and y: ledger and losses as without drift, foot
    points of wall contacts included."""
    slab = "axes: [x, y], walls: [bottom, top], wall_speed: 2 m/s"  # SLAB, pressed
    found = []
    for drift in ([0.0, 0.0], [3.0, -2.0]):
        sim = cake(slab)
        sim.box = replace(sim.box, strength=np.zeros(6))  # a wall at rest would brake the drift
        sim.fields["v"].from_numpy(sim.fields["v"].to_numpy() + [*drift, 0.0])
        start = energies(sim)
        sim.advance(5000)
        m = energies(sim)
        found.append((residual(start, m), m["loss"].sum(), m["wall_work"]))
    assert found[0][2] > 5.0
    np.testing.assert_allclose(found[1], found[0], rtol=1e-5, atol=1e-5)


def test_sticking_walls_hold_what_crosses_a_face():
    """Walls that stick, at rest, and grains that roll over them across faces: the
    sliding springs do not notice the crossing."""
    scene = make_scene(boundary=cell([4e-6] * 3, **SLAB), damping="viscoelastic")
    wall = constants.wall_constants(SCENE.material, SCENE.interaction)
    height = RADIUS - wall.delta0
    x = [[0.5e-6, 2e-6, height], [3.0e-6, 0.5e-6, height + 3 * RADIUS]]
    v, w = 3.0, 3.0 / RADIUS
    probe = Probe(scene, sample_of(x, [[v, 0, 0], [0, 0, 0]], [[0, w, 0], [0, 0, 0]]))
    start = energies(probe.sim)
    probe.advance(15_000)  # 1.5 us: some 4 um, across a face
    m = energies(probe.sim)
    assert np.abs(probe.sim.fields["wraps"].to_numpy()[:, 0]).sum() > 0
    # rolling past its limit loses energy, sliding stays within its own
    lost = m["loss_wall"]
    assert lost[4] < 1e-3 * lost[3]
    assert abs(residual(start, m)) < 2e-3 * start["kinetic_translation"]


@pytest.mark.long  # virial and stress of a lattice: test_periodic
def test_wall_pressure_and_virial_agree():
    """Exactly, by the virial theorem: the time integral of sum m v v + branch x force is the change
    of sum m x v less what the walls at their planes have given."""
    # normal forces only: a tangential one acts on the wall beside the centre, not above it
    scene = make_scene(boundary=box(), damping="viscoelastic", effects=(), output={"stress": True})
    rng = np.random.default_rng(2)
    x = lattice(3, REST)
    probe = Probe(scene, sample_of(x, 0.05 * rng.normal(size=x.shape)))
    sim = probe.sim

    def moment():
        """sum m x v with the velocities that the next step moves by."""
        ahead = 2.0 * probe.v - probe._grains("v")
        return sim.mass * (probe.x / units.LENGTH).T @ (ahead / units.SPEED)

    start, flux, impulse = moment(), load_sums(sim).momentum_flux(), load_sums(sim).impulses()
    probe.advance(4000)
    planes = sim.box.planes(0.0)
    given = np.zeros((3, 3))
    for n in range(6):
        given[n // 2] += planes[n] * (load_sums(sim).impulses() - impulse)[n]
    left = load_sums(sim).momentum_flux() - flux
    right = moment() - start - given
    # exact for the leapfrog; rounding of 4000 steps
    np.testing.assert_allclose(np.diag(left), np.diag(right), rtol=1e-9)
