"""Rooms that a scene gives in part, exactly as they would fit, or too low to be pressed."""

import numpy as np
import pytest

from dusttaichi import samples
from dusttaichi.domain.domain import Domain
from dusttaichi.errors import DustError
from dusttaichi.grains.environment import environment
from dusttaichi.grains.grain_contacts import contact_constants
from dusttaichi.scene import from_yaml, quantities
from dusttaichi.scene.boundary import own_drive
from dusttaichi.units import GRAINS

TEXT = """
name: room
material: silicate_s12
sample: {kind: lattice, structure: sc, cells: [4, 5, 3]}
boundary: BOUNDARY
stop: {steps: 10}
"""


def domain(boundary):
    scene = from_yaml(TEXT.replace("BOUNDARY", boundary))
    room = environment(scene, samples.make(scene), None, contact_constants(scene))
    made = Domain(1e-4, 1.0, 0.6, *room, units=GRAINS)
    return made.driven(own_drive(scene.boundary), 0)


@pytest.mark.parametrize("kind", ["kind: box", "kind: periodic"])
def test_what_fit_makes_may_be_written_out(kind):
    fit = domain(f"{{{kind}}}").lengths(0)
    edges = [quantities.format(edge * 1e-6, "length") for edge in fit]
    again = domain(f"{{{kind}, size: [{', '.join(edges)}]}}").lengths(0)
    np.testing.assert_allclose(again, fit, rtol=1e-12)
    part = domain(f"{{{kind}, size: [fit, 9 um, fit]}}").lengths(0)
    np.testing.assert_allclose(part, [fit[0], 9.0, fit[2]], rtol=1e-12)


def test_walls_stand_where_the_scene_says():
    made = domain("{kind: box, size: [fit, 9 um, fit], at: {z: [-1 um, 40 um]}}")
    np.testing.assert_allclose(made.room(0)[4:], [-1.0, 40.0], rtol=1e-12)
    assert made.lengths(0)[1] == pytest.approx(9.0)
    with pytest.raises(DustError, match="boundary.at.x: the sample does not fit: it reaches from"):
        domain("{kind: box, at: {x: [0 um, 1.3 um]}}")
    with pytest.raises(DustError, match="boundary.at.x.*size gives a length along x"):
        domain("{kind: box, size: [9 um, 9 um, 9 um], at: {x: [0 um, 9 um]}}")
    with pytest.raises(DustError, match="boundary.at.x.*the first must lie below the second"):
        domain("{kind: box, at: {x: [1 um, 0 um]}}")


def test_a_room_of_two_grains_is_pressed_by_walls_but_not_by_faces():
    """The search needs the distance of faces; at walls the guard of the overlap ends the run."""
    flat = domain("{kind: box, size: [fit, fit, 40 um], wall_speed: 1 m/s}")
    flat.check_start()
    text = TEXT.replace("cells: [4, 5, 3]", "cells: [4, 5, 2]")
    scene = from_yaml(text.replace("BOUNDARY", "{kind: box, wall_speed: 1 m/s}"))
    room = environment(scene, samples.make(scene), None, contact_constants(scene))
    low = Domain(1e-4, 1.0, 0.6, *room, units=GRAINS).driven(own_drive(scene.boundary), 0)
    low.check_start()
    assert low.clock().last_step(scene.stop) == (10, "10 steps")
    periodic = (
        "{kind: periodic, size: [fit, fit, 2.44 um], strain_rate: [0 s^-1, 0 s^-1, -1000 s^-1]}"
    )
    scene = from_yaml(text.replace("BOUNDARY", periodic))
    room = environment(scene, samples.make(scene), None, contact_constants(scene))
    low = Domain(1e-4, 1.0, 0.6, *room, units=GRAINS).driven(own_drive(scene.boundary), 0)
    with pytest.raises(DustError, match="µm high, no more than two grains .* it cannot be"):
        low.check_start()
