"""What numerics.stiffness_scaling changes of a scene, and what it leaves: `dust check`, remarks."""

from dusttaichi.grains.grain_contacts import contact_constants
from dusttaichi.physics import encounter
from dusttaichi.scene import quantities

SHARE = 0.5  # of the sticking speed, up to which the energy of contacts hardly shows


def both(scene):
    """ContactConstants of two grains of the scene's material without scaling, and with it."""
    found = []
    for scale in (1.0, scene.numerics.stiffness_scaling):
        factors = {"mass_scaling": 1.0, "stiffness_scaling": scale}
        numerics = scene.numerics.model_copy(update=factors)
        found.append(contact_constants(scene.model_copy(update={"numerics": numerics}))[0])
    return found


def rows(scene):
    """Rows (what, value) of what softened contacts change, with its size."""
    own, soft = both(scene)

    def change(before, after, dimension):
        pair = (quantities.format(value, dimension, digits=3) for value in (before, after))
        return " -> ".join(pair) + f" (times {after / before:.3g})"

    gaps = (
        quantities.format(gap, "length", digits=3) for gap in (soft.gap, soft.gap + soft.delta_c)
    )
    out = [
        ("stiffness_scaling", f"{scene.numerics.stiffness_scaling:g} of the elastic moduli"),
        ("overlap that a contact at rest is pressed by", change(own.delta0, soft.delta0, "length")),
        ("contacts form and break at a gap of", " and ".join(gaps)),
        ("energy that breaks a contact", change(own.barrier, soft.barrier, "energy")),
        (
            "sticking speed of two grains",
            change(encounter.breaking_speed(own), encounter.breaking_speed(soft), "speed"),
        ),
        ("speed of sound", f"times {(soft.k_n / own.k_n) ** 0.5:.3g}"),
    ]
    if "zeta_crit" in own.numbers:
        slides = change(own.zeta_crit, soft.zeta_crit, "length")
        out.append(("displacement from which a contact slides", slides))
    unchanged = "pull-off force, rolling, largest sliding force and twisting moment, damping ratio"
    return [*out, ("unchanged", f"{unchanged}, distance of grains at rest")]


def remarks(scene, impact):
    """Sentences for the user where an Impact (or None) is one that softened contacts change."""
    if scene.numerics.stiffness_scaling == 1.0 or impact is None:
        return []
    own, soft = both(scene)
    sticks = encounter.breaking_speed(own)
    if impact.speed < SHARE * sticks:
        return []
    speeds = (quantities.format(v, "speed", 3) for v in (impact.speed, sticks))
    return [
        "grains may meet at {}, and those of this material stick below {}".format(*speeds)
        + f"; with numerics.stiffness_scaling {scene.numerics.stiffness_scaling:g} they do so up "
        f"to {encounter.breaking_speed(soft) / sticks:.3g} times that speed: a lower speed is "
        "nearer to grains as they are"
    ]
