"""How fast grains may meet at the start, beside what the contact model is for."""

from dataclasses import dataclass
from math import inf

from dusttaichi.errors import DustError
from dusttaichi.grains.trust import LARGEST_OVERLAP
from dusttaichi.physics import encounter
from dusttaichi.scene import quantities

HARD = 10.0  # impact energy over that which breaks a contact, from which a run says so
SWALLOWED = 1.0  # overlap over the smaller radius that no scene is for, however it is counted


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
        return (
            f"at most {speed}: {self.energy:.3g} times the energy that breaks a contact, overlap "
            f"{100.0 * self.overlap:.2g} % of a radius (the model ends at "
            f"{100.0 * LARGEST_OVERLAP:g} %, {end})"
        )

    def remarks(self):
        """Sentences for the user where such a collision is beyond what contacts are usually for."""
        if self.energy < HARD:
            return []
        return [
            f"grains may meet {self.text()}. JKR contacts are elastic: they neither flatten nor "
            "break grains"
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


def check(impact):
    """Raises DustError where grains would swallow each other."""
    if impact is None or impact.overlap <= SWALLOWED:
        return
    speed, end = (quantities.format(v, "speed", 3) for v in (impact.speed, impact.model_end))
    raise DustError(
        f"Grains may meet at {speed} (velocities of the sample, pushes, walls and sphere): they "
        f"would overlap by {impact.overlap:.3g} of their radius. Adhesive elastic contacts mean "
        f"something up to {LARGEST_OVERLAP:g} of it, here {end}. Try a lower speed."
    )
