"""Grains of a sample looked at by brute force: what the tests of samples share."""

import numpy as np
from scipy.sparse.csgraph import connected_components
from scipy.spatial.distance import pdist, squareform

from dusttaichi.errors import DustError
from dusttaichi.physics.contact.constants import pair_constants
from dusttaichi.samples import make
from dusttaichi.scene import Scene

R = 0.6e-6
SIZES = {"kind": "power", "exponent": -3.5, "smallest": "0.3 um", "largest": "1 um"}
ICE = {"ice": "ice_t19"}
MIXED = {"sizes": SIZES, "shares": {"default": 3, "ice": 1}, "seed": 4}


def scene(materials=None, **sample):
    """A scene of S12's silicate with this sample block and nothing around it.

    materials: further ones by name (dict).
    """
    data = {"name": "grains", "material": "silicate_s12", "sample": sample}
    data |= {"boundary": {"kind": "open"}, "stop": {"steps": 1}}
    return Scene.from_dict(data | ({"materials": materials} if materials else {}))


def make_sample(kind, **keys):
    """The Sample of a scene with this sample block."""
    return make(scene(kind=kind, **keys))


def um(value):
    """A length [m] in the YAML."""
    return f"{1e6 * value:.17g} um"


PLAIN = scene(kind="chain", grains=1)
D = 2 * R - pair_constants(PLAIN.material, PLAIN.interaction).delta0
# Positions are sums of a few numbers of up to 100 D and are turned some ten times; each operation
# rounds by 1e-16 of that. Still 1e-7 of the overlap at equilibrium.
ROUNDING = 1e-11 * D


def distances(positions):
    """Of every pair, (N, N), infinite on the diagonal."""
    apart = squareform(pdist(positions))
    np.fill_diagonal(apart, np.inf)
    return apart


def pieces(positions, touch=D + ROUNDING):
    return connected_components(distances(positions) <= touch, directed=False)[0]


def periodic_distances(positions, period):
    apart = positions[:, None] - positions
    apart -= period * np.round(apart / period)
    apart = np.sqrt((apart**2).sum(axis=2))
    np.fill_diagonal(apart, np.inf)
    return apart


def deposited_one_by_one(xy, period, grains):
    """Heights (N,) of Grains that fall at xy (N, 2): the definition, O(N^2), one after another."""
    z = np.empty(len(xy))
    for k, floor in enumerate(grains.radii):
        apart = xy[k] - xy[:k]
        apart -= period * np.round(apart / period)
        square = grains.distance(k, np.arange(k)) ** 2 - (apart[:, 0] ** 2 + apart[:, 1] ** 2)
        on = square > 0
        z[k] = max(floor, np.max(z[:k][on] + np.sqrt(square[on]), initial=floor))
    return z


def refuse_sample(**sample):
    """The text of the error that a sample block is refused with, when read or when made."""
    try:
        make(scene(**sample))
    except DustError as error:
        return str(error)
    raise AssertionError(f"{sample} was accepted")
