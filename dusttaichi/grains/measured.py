"""The energies of grains as the ledger of the run takes them."""

from dusttaichi.method import Measurement


def measurement(sim):
    """The Measurement of a Simulation now; its parts are the numbers of sim.measure()."""
    m = sim.measure()
    kinetic = m["kinetic_translation"] + m["kinetic_rotation"] + m["sphere_kinetic"]
    # added up in this order everywhere: the ledger is a small difference of large numbers
    on_sphere = m["potential_sphere"].sum()
    energy = kinetic + m["potential"].sum() + m["potential_wall"].sum() + on_sphere
    work = m["wall_work"] + m["face_work"] + m["push_work"] + m["gravity_work"]
    work += m["stiffness_work"]
    return Measurement(
        kinetic=kinetic,
        potential=m["potential"].sum() + m["potential_wall"].sum() + on_sphere,
        energy=energy,
        losses=m["loss"] + m["loss_wall"] + m["loss_sphere"],
        lost=m["loss"].sum() + m["loss_wall"].sum() + m["loss_sphere"].sum(),
        work=work + m["sphere_work"],
        kick=m["kinetic_kick"],
        bound=_bound(sim, m),
        parts=m,
    )


def _bound(sim, m):
    """Energy that the contacts of now bind [fJ]: as much as at rest, of JKR 1.2 F_c delta0 each; of
    grains that are not all alike, now."""
    if sim.polydisperse is None:
        bound = sim.pair.bound * m["contacts"] + sim.wall.bound * m["wall_contacts"]
        if sim.sphere is not None:
            bound += sim.sphere.contact.bound * m["sphere_contacts"]
        return bound
    return -(m["potential"][0] + m["potential_wall"][0] + m["potential_sphere"][0])
