"""The start of a scene: fields of the grains, initial contacts and loads."""

import numpy as np

from dusttaichi import units


def start(sample, motion, contacts, search, stepper, *, ledger, sphere, members, numbers, scaling):
    """Put a Sample into the fields of a Motion, at step 0, with velocities half a step back.

    contacts: Contacts. search: Search. stepper: Stepper. ledger: Ledger. sphere: MovingSphere, or
    None. members: Members, or None. numbers: ContactNumbers. scaling: numerics.stiffness_scaling of
    the scene.
    """
    state, push = motion.state, motion.push
    place_grains(sample, motion)
    state.put_numbers(*numbers)
    if push.works:
        push.place(state.fields)
    if sphere is not None:
        sphere.place()
    if motion.outside is not None:
        motion.outside.place(sphere)
    if members is not None:
        members.place(sample.positions[state.order] / units.LENGTH)
    search.update(0)
    contacts.restore(sample, scaling)
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
