"""Flaws of dust with damage, assigned to particles as by Benz & Asphaug (1995)."""

import numpy as np

NONE = 1e30  # activation strain without a flaw
COLUMNS = 4
"""Strain of the weakest flaw, exponent of n = (strain/weakest)^exponent, number of flaws, and the
inverse radius of a sphere of the particle's volume [1/m]."""


def flaws_of(particles, materials):
    """COLUMNS of each particle, (n, COLUMNS); materials: of the scene, by number.

    In the volume V of the dust of a material the flaw number j activates at (j/(k V))^(1/m) and is
    assigned to a random particle, until each particle has one. In two dimensions a particle is a
    spacing deep.
    """
    out = np.zeros((len(particles), COLUMNS))
    out[:, 0] = NONE
    volume = particles.volume
    if particles.dimension == 2:
        volume = volume * particles.spacing
    out[:, 3] = (4.0 * np.pi / (3.0 * volume)) ** (1.0 / 3.0)
    for number, material in enumerate(materials):
        dust_rows = np.flatnonzero((particles.material == number) & particles.is_dust)
        if material.damage is not None and len(dust_rows):
            out[dust_rows, :3] = _given_out(
                material.damage, len(dust_rows), volume[dust_rows].sum()
            )
    return out


def _given_out(law, count, volume):
    """The first three COLUMNS of `count` particles that share a volume [m^3]."""
    rng = np.random.Generator(np.random.PCG64(law.seed))
    owner, missing = np.zeros(0, dtype=int), True
    while missing:
        owner = np.append(owner, rng.integers(0, count, size=4 * count + 16))
        missing = len(np.unique(owner)) < count
    _, first = np.unique(owner, return_index=True)
    owner = owner[: first.max() + 1]
    # logarithms: k may be larger than any number
    lg = (np.log10(np.arange(1, len(owner) + 1)) - law.lg_k - np.log10(volume)) / law.m
    strain, flaws = 10.0**lg, np.bincount(owner, minlength=count)
    weakest = strain[first]
    strongest = np.zeros(count)
    np.maximum.at(strongest, owner, strain)
    span = np.log(strongest / weakest)
    several = flaws > 1
    exponent = np.where(several, np.log(flaws) / np.where(several, span, 1.0), 1.0)
    return np.stack([weakest, exponent, flaws], axis=1)
