"""Rooms that a scene gives in part, exactly as they would fit or too low; edges at a rate."""

import numpy as np
import pytest
from scenes import RADIUS, Probe, make_scene, residual, sample_of

from dusttaichi import samples
from dusttaichi.domain.clock import NEVER, Clock
from dusttaichi.domain.domain import Domain
from dusttaichi.errors import DustError
from dusttaichi.grains.contact_table import ContactTable
from dusttaichi.grains.placement import place_environment
from dusttaichi.scene import from_yaml, quantities
from dusttaichi.scene.boundary import get_drive
from dusttaichi.scene.stop import Stop
from dusttaichi.units import GRAINS

TEXT = """
name: room
material: silicate_s12
sample: {kind: lattice, structure: sc, cells: [4, 5, 3]}
boundary: BOUNDARY
stop: {steps: 10}
"""


def domain(boundary, cells="4, 5, 3"):
    """The domain of that room at the start of its drive, and its scene."""
    text = TEXT.replace("4, 5, 3", cells).replace("BOUNDARY", boundary)
    scene = from_yaml(text)
    table = ContactTable(scene)
    room = place_environment(table, samples.make(scene), table.wall_overlaps() / GRAINS("m"))
    driven_domain = Domain(1e-4, 1.0, 0.6, *room, units=GRAINS).driven(get_drive(scene.boundary), 0)
    return driven_domain, scene


@pytest.mark.parametrize("kind", ["kind: box", "kind: periodic"])
def test_what_fit_makes_may_be_written_out(kind):
    fit = domain(f"{{{kind}}}")[0].lengths(0)
    edges = [quantities.format(edge * 1e-6, "length") for edge in fit]
    repeated_lengths = domain(f"{{{kind}, size: [{', '.join(edges)}]}}")[0].lengths(0)
    np.testing.assert_allclose(repeated_lengths, fit, rtol=1e-12)
    fitted_lengths = domain(f"{{{kind}, size: [fit, 9 um, fit]}}")[0].lengths(0)
    np.testing.assert_allclose(fitted_lengths, [fit[0], 9.0, fit[2]], rtol=1e-12)


def test_walls_stand_where_the_scene_says():
    placed_domain, _ = domain("{kind: box, size: [fit, 9 um, fit], at: {z: [-1 um, 40 um]}}")
    np.testing.assert_allclose(placed_domain.room(0)[4:], [-1.0, 40.0], rtol=1e-12)
    assert placed_domain.lengths(0)[1] == pytest.approx(9.0)
    with pytest.raises(DustError, match="boundary.at.x: the sample does not fit: it reaches from"):
        domain("{kind: box, at: {x: [0 um, 1.3 um]}}")
    with pytest.raises(DustError, match="boundary.at.x.*size gives a length along x"):
        domain("{kind: box, size: [9 um, 9 um, 9 um], at: {x: [0 um, 9 um]}}")
    with pytest.raises(DustError, match="boundary.at.x.*the first must lie below the second"):
        domain("{kind: box, at: {x: [1 um, 0 um]}}")


def test_a_room_of_two_grains_is_pressed_by_walls_but_not_by_faces():
    """The search needs the distance of faces; at walls the guard of the overlap ends the run."""
    flat, _ = domain("{kind: box, size: [fit, fit, 40 um], wall_speed: 1 m/s}")
    flat.check_start()
    low, scene = domain("{kind: box, wall_speed: 1 m/s}", "4, 5, 2")
    low.check_start()
    assert low.clock().last_step(scene.stop) == (10, "10 steps")
    rate = "strain_rate: [0 s^-1, 0 s^-1, -1000 s^-1]"
    low, _ = domain(f"{{kind: periodic, size: [fit, fit, 2.44 um], {rate}}}", "4, 5, 2")
    with pytest.raises(DustError, match="µm high, no more than two grains .* it cannot be"):
        low.check_start()


@pytest.mark.parametrize("rate", ["1e5 s^-1", ["2e5 s^-1", "-1e5 s^-1", "0 s^-1"]])
def test_edges_go_as_the_rate_says(rate):
    """L = L_0 exp(rate t) along each axis; a growing edge ends nothing (it ended the program)."""
    d = 2 * RADIUS * 0.9999
    edges = [f"{4 * d:.17g} m"] * 3
    boundary = {"kind": "periodic", "size": edges, "strain_rate": rate}
    scene = make_scene(boundary=boundary, damping="viscoelastic", stop={"strain": 0.001})
    lattice = d * np.array(np.meshgrid(*[np.arange(4)] * 3)).reshape(3, -1).T
    sim = Probe(scene, sample_of(lattice)).sim
    end, reason = sim.domain.clock().last_step(scene.stop)
    rates = np.array(scene.boundary.strain_rate)
    assert reason == "strain 0.001"
    assert end == np.ceil(np.log1p(0.001) / (max(rates) * 1e-6 * sim.dt))
    energies_before, start = sim.ledger.measure_energies(), sim.environment.lengths()
    sim.advance(end)
    np.testing.assert_allclose(
        sim.environment.lengths(), start * np.exp(rates * 1e-6 * sim.time), rtol=1e-12
    )
    m = sim.ledger.measure_energies()
    # the leapfrog's own error of the faces' work, second order in the step
    assert abs(residual(energies_before, m)) < 5e-3 * abs(m["face_work"])


def test_a_room_that_only_grows_never_gets_narrow():
    clock = Clock(1e-4, 1.0, (5.0, 5.0, 5.0), growth=(1.0, 0.0, 0.0), least=(2.0, 2.0, 2.0))
    assert clock.step_of_length(2.0, 0) == clock.step_of_length(2.0, 1) == NEVER
    # nor does a room end a stage that is as narrow already, and stays so or grows
    assert clock.step_of_length(5.0, 0) == clock.step_of_length(5.0, 1) == NEVER
    assert clock.last_step(Stop(filling_factor=0.004))[0] == np.ceil(np.log(2.0) / 1e-4)
