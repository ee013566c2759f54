"""Impact speeds at the start, beside the limits of the contact model.

And the changes by softened contacts (numerics.stiffness_scaling).
"""

from dataclasses import dataclass
from math import inf

from dusttaichi.errors import DustError
from dusttaichi.grains.contact_table import ContactTable
from dusttaichi.grains.validity import LARGEST_OVERLAP
from dusttaichi.physics import encounter
from dusttaichi.scene import quantities

NEAR = 0.7  # of the speed at which the contact model ends, from which on a run remarks
SHARE = 0.5  # of the sticking speed, up to which the energy of softened contacts hardly shows
SWALLOWED = 1.0  # overlap over the smaller radius that is refused


@dataclass(frozen=True)
class Impact:
    """The hardest head-on collision of two grains that the speeds of the start allow.

    speed: its relative speed [m/s]. energy: over that which breaks a contact. overlap: largest one,
    over the smaller radius. model_end: speed [m/s] at which that is LARGEST_OVERLAP.
    """

    speed: float
    energy: float
    overlap: float
    model_end: float

    def text(self):
        """One line about it."""
        speed, end = (quantities.format(v, "speed", 3) for v in (self.speed, self.model_end))
        energy = f"{self.energy:.3g}" if self.energy < 1000.0 else f"{self.energy:,.0f}"
        return (
            f"up to {speed}: {energy} times the energy that breaks a contact; overlap up to "
            f"{100.0 * self.overlap:.2g} % of a radius (the contact model holds up to "
            f"{100.0 * LARGEST_OVERLAP:g} %, at {end})"
        )

    def remarks(self):
        """Sentences for the user where such a collision is near the end of the contact model."""
        if self.speed < NEAR * self.model_end:
            return []
        return [
            f"impact speed of two grains: {self.text()}. JKR contacts are elastic: they neither "
            "flatten nor break grains"
        ]


def hardest_impact(pairs, speed):
    """The Impact at a relative speed [m/s], the hardest of these ContactConstants; None at rest."""
    if not speed > 0.0:
        return None
    hardest = overlap = 0.0
    end = inf
    for pair in pairs:
        radius = min(pair.r1, pair.r2)
        breaking = encounter.breaking_speed(pair)  # 0 without adhesion: nothing to compare with
        hardest = max(hardest, (speed / breaking) ** 2 if breaking > 0.0 else 0.0)
        # of the surfaces: softened contacts form before these meet
        overlap = max(overlap, (encounter.overlap(pair, speed) - pair.gap) / radius)
        # contacts at rest may be as deep as that already
        deepest = max(LARGEST_OVERLAP * radius + pair.gap, pair.delta0)
        end = min(end, encounter.speed_of_overlap(pair, deepest))
    return Impact(speed, hardest, overlap, end)


def beyond_model(speeds, impact):
    """Sentence about the `speeds` [m/s], ascending, beyond the contact model; "" without one.

    impact: the Impact at the last one, or None.
    """
    beyond = [speed for speed in speeds if impact is not None and speed > impact.model_end]
    if not beyond:
        return ""
    first = quantities.format(beyond[0], "speed", 3)
    which = f"speeds from {first} on ({len(beyond)} of {len(speeds)}) exceed"
    which = which if len(speeds) > 1 else "this speed exceeds"
    return f"{which} the range of the contact model; the overlap guard may stop such collisions"


def check(impact):
    """Raises DustError where grains would swallow each other."""
    if impact is None or impact.overlap <= SWALLOWED:
        return
    speed, end = (quantities.format(v, "speed", 3) for v in (impact.speed, impact.model_end))
    raise DustError(
        f"Two grains may collide at {speed} (velocities of the sample, pushes, walls and sphere): "
        f"they would overlap by {impact.overlap:.3g} of their radius. The contact model holds up "
        f"to {LARGEST_OVERLAP:g} of it, here up to {end}. Try a lower speed."
    )


# -- softened contacts ----------------------------------------------------------------------------


def with_and_without_scaling(scene):
    """ContactConstants of two grains of the scene's material without scaling, and with it."""
    pairs = []
    for scale in (1.0, scene.numerics.stiffness_scaling):
        factors = {"mass_scaling": 1.0, "stiffness_scaling": scale}
        numerics = scene.numerics.model_copy(update=factors)
        table = ContactTable(scene.model_copy(update={"numerics": numerics}))
        pairs.append(table.farthest_pair)
    return pairs


def softened_rows(scene):
    """Rows (name, value) of the changes by softened contacts."""
    hard, soft = with_and_without_scaling(scene)

    def change(original, softened, dimension):
        pair = (quantities.format(value, dimension, digits=3) for value in (original, softened))
        return " -> ".join(pair) + f" (times {softened / original:.3g})"

    gaps = (
        quantities.format(gap, "length", digits=3) for gap in (soft.gap, soft.gap + soft.delta_c)
    )
    out = [
        ("stiffness_scaling", f"{scene.numerics.stiffness_scaling:g} of the elastic moduli"),
        (
            "overlap that a contact at rest is pressed by",
            change(hard.delta0, soft.delta0, "length"),
        ),
        ("contacts form and break at a gap of", " and ".join(gaps)),
        ("energy that breaks a contact", change(hard.barrier, soft.barrier, "energy")),
        (
            "sticking speed of two grains",
            change(encounter.breaking_speed(hard), encounter.breaking_speed(soft), "speed"),
        ),
        ("speed of sound", f"times {(soft.k_n / hard.k_n) ** 0.5:.3g}"),
    ]
    if "zeta_crit" in hard.numbers:
        slides = change(hard.zeta_crit, soft.zeta_crit, "length")
        out.append(("displacement from which a contact slides", slides))
    unchanged = "pull-off force, rolling, largest sliding force and twisting moment, damping ratio"
    return [*out, ("unchanged", f"{unchanged}, distance of grains at rest")]


def softened_remarks(scene, impact):
    """Sentences for the user where an Impact (or None) is one that softened contacts change."""
    if scene.numerics.stiffness_scaling == 1.0 or impact is None:
        return []
    hard, soft = with_and_without_scaling(scene)
    sticks = encounter.breaking_speed(hard)
    if impact.speed < SHARE * sticks:
        return []
    speeds = (quantities.format(v, "speed", 3) for v in (impact.speed, sticks))
    return [
        "two grains may collide at {}; without stiffness_scaling they stick below {}".format(
            *speeds
        )
        + f", with numerics.stiffness_scaling {scene.numerics.stiffness_scaling:g} up to "
        f"{encounter.breaking_speed(soft) / sticks:.3g} times that speed: a lower speed changes "
        "the outcome less"
    ]
