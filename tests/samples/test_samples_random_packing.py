"""Random packings: no overlap beyond that of a contact at rest, at the filling factor asked for."""

import numpy as np
import pytest
from bodies import D, R, periodic_distances, scene

from dusttaichi.samples import make

GRAIN = 4 / 3 * np.pi * R**3


def packing(**keys):
    return make(scene(kind="random_packing", **keys))


@pytest.mark.parametrize("grains, filling", [(1, 0.05), (300, 0.1), (250, 0.6), (100, 0.6)])
def test_no_overlap_beyond_equilibrium_with_images(grains, filling):
    sample = packing(grains=grains, filling_factor=filling)
    info, x = sample.info, sample.positions
    period = np.array(info["period"])
    assert len(x) == info["grains"] == grains
    assert ((x >= 0) & (x < period)).all()
    # Distances across the period carry the rounding of the cell's edge.
    apart = periodic_distances(x, period)
    assert apart.min() >= D - 1e-14 * period.max()
    assert info["closest"] == pytest.approx(apart.min(), rel=1e-12)
    assert info["filling_factor"] == pytest.approx(filling, rel=1e-12)
    assert not sample.velocities.any() and not sample.spins.any()


def test_dense_packing_is_in_contact_and_random():
    sample = packing(grains=400, seed=2)
    period = np.array(sample.info["period"])
    apart = periodic_distances(sample.positions, period)
    # At random close packing there would be 6 contacts a grain; of points that keep off each
    # other otherwise evenly 0.01, as the shell between D and 2 r is so thin.
    contacts = np.count_nonzero(apart <= 2 * R, axis=1).mean()
    assert 2.5 < contacts < 6
    # No crystal: fcc would have nothing between D and 1.41 D, a random packing has a third there.
    between = np.count_nonzero((apart > 1.1 * D) & (apart < 1.35 * D), axis=1).mean()
    assert between > 2


def test_size_is_the_cell():
    sample = packing(size=["10 um", "12 um", "8 um"], filling_factor=0.5)
    period = np.array(sample.info["period"])
    np.testing.assert_allclose(period, [10e-6, 12e-6, 8e-6], rtol=1e-15)
    # Met to one grain.
    assert 0 <= 0.5 - sample.info["filling_factor"] < GRAIN / period.prod()
    assert periodic_distances(sample.positions, period).min() >= D - 1e-14 * period.max()
