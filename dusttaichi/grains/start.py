"""The start of a scene: fields of the grains, initial contacts and loads."""

import numpy as np

from dusttaichi import units
from dusttaichi.grains.wall_geometry import normals_at, reduced_radii_at


def start(
    sample, motion, contacts, search, stepper, *, ledger, sphere, members, numbers, stiffness_ratio
):
    """Put a Sample into the fields of a Motion, at step 0, with velocities half a step back.

    contacts: Contacts. search: Search. stepper: Stepper. ledger: Ledger. sphere: MovingSphere, or
    None. members: Members, or None. numbers: ContactNumbers. stiffness_ratio: of the sample's
    contacts over those of the scene.
    """
    state, push = motion.state, motion.push
    place_grains(sample, motion)
    push.place(state.fields)
    if sphere is not None:
        sphere.place()
    if motion.outside is not None:
        motion.outside.place(sphere)
    if members is not None:
        members.place(sample.positions[state.order] / units.LENGTH)
    state.put_numbers(*numbers)
    search.update(0)
    restore_contacts(sample, motion, contacts, stiffness_ratio)
    stepper.load_contacts()
    state.clear_sums()
    if push.works:
        push.begin(state["x"], motion.sum_contact_loads()[0])
    motion.set_back(state.of_grains("v"), state.of_grains("w"))
    if sphere is not None:
        sphere.set_back()
    ledger.begin()
    if members is not None:
        members.begin()


def place_grains(sample, motion):
    """Put positions, velocities, spins and properties of grains into their fields."""
    state, bodies, order = motion.state, motion.bodies, motion.state.order
    state.put_grains("x", sample.positions[order] / units.LENGTH, far=True)
    state.put_grains("v", sample.velocities[order] / units.SPEED)
    state.put_grains("w", sample.spins[order] / units.SPIN)
    if state.layout.orientation:
        state["orientation"] = np.tile([1.0, 0.0, 0.0, 0.0], (bodies.count, 1))
    if not bodies.are_equal:
        state["material"] = bodies.properties.material[order]
        state["radius"] = bodies.radii[order]
        state["mass"], state["inertia"] = bodies.mass[:, 0], bodies.inertia[:, 0]


def restore_contacts(sample, motion, contacts, stiffness_ratio):
    """Put histories of contacts that a Sample has into fields; a search has listed their pairs."""
    state, radii = motion.state, motion.bodies.grain_radii
    if sample.contacts is not None:
        i, j = state.pairs()
        distances = contacts.distances(np.arange(len(i)), i, j)
        state.take_contacts(sample.contacts, distances, radii)
    if sample.wall_contacts is not None:
        domain = motion.environment.domain

        def geometry(wall, x, radius):
            return normals_at(domain, wall, x, 0.0), reduced_radii_at(domain, wall, radius)

        state.take_wall_contacts(sample.wall_contacts, radii, geometry)
    state.stiffen(stiffness_ratio)
