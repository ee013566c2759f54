"""Samples of grains of several sizes and materials: drawn as asked, touching as each pair does."""

from dataclasses import replace

import numpy as np
import pytest
from bodies import ICE, MIXED, distances, make_sample, scene

from dusttaichi.errors import DustError
from dusttaichi.physics.contact.constants import mixed_constants
from dusttaichi.samples import make, random_tree, unequal_aggregate
from dusttaichi.samples.mixture import Lognormal, PowerLaw, Radii


def mix_sample(kind, **keys):
    """(scene, Sample) of grains of many sizes and two materials."""
    built = scene(ICE, kind=kind, **MIXED, **keys)
    return built, make(built)


def gaps(scene, sample, period=None):
    """Distance of every two centres less that of their equilibrium contact [m], (N, N)."""
    d = sample.positions[:, None] - sample.positions[None]
    if period is not None:
        d -= period * np.round(d / period)
    touch = np.zeros(d.shape[:2])
    for i in range(len(sample)):
        for j in range(i):
            a, b = (scene.all_materials[sample.materials[k]] for k in (i, j))
            c = mixed_constants(a, sample.radii[i], b, sample.radii[j], scene.interaction)
            touch[i, j] = touch[j, i] = c.r1 + c.r2 - c.delta0
    out = np.linalg.norm(d, axis=2) - touch
    np.fill_diagonal(out, np.inf)
    return out


@pytest.mark.parametrize(
    "kind, keys",
    [
        ("pca", {}),
        ("pca", {"impact_parameter": 0.7}),
        ("pca", {"cluster": 7}),
        ("bcca", {}),
        ("bcca", {"mass_ratio": 0.2}),
        ("chain", {}),
    ],
)
def test_an_aggregate_is_a_tree_of_exact_contacts(kind, keys):
    """Each grain or cluster stays where it first touches: N - 1 contacts at the equilibrium
    distance of their pair (to rounding of positions of 10 um), no pair nearer than that."""
    scene, sample = mix_sample(kind, grains=60, **keys)
    gap = gaps(scene, sample)
    assert gap.min() > -1e-20 * 1e6
    assert np.count_nonzero(np.abs(gap) < 1e-15) == 2 * (len(sample) - 1)
    assert set(sample.materials) == {0, 1} and 0.3e-6 <= sample.radii.min() < sample.radii.max()
    assert len(sample) == 60


def test_a_cut_of_a_mixture():
    """As many as asked for, wholly in the smallest box of the proportions, on exact contacts."""
    scene, sample = mix_sample("pca", shape="box", grains=40, aspect=0.5)
    low, high = (sample.positions - sample.radii[:, None]).min(0), sample.positions.max(0)
    assert len(sample) == 40 and low[2] == pytest.approx(0.0, abs=1e-6) and low[2] > -1e-15
    assert sample.info["aggregated"] > 80 and high[2] < 0.8 * np.ptp(sample.positions[:, 0])
    gap = gaps(scene, sample)
    assert gap.min() > -1e-15 and np.count_nonzero(np.abs(gap) < 1e-15) > 40


def test_an_impact_parameter_makes_aggregates_open():
    """Shots at the middle go deep, grazing ones stay outside: the radius of gyration grows."""
    key = "radius_of_gyration"
    head, graze = (
        np.mean(
            [make_sample("pca", grains=150, impact_parameter=b, seed=n).info[key] for n in range(3)]
        )
        for b in (0.0, 0.9)
    )
    assert graze > 1.15 * head
    # quasi-BCCA of 100 grains at 0.25: a cluster of 20 meets one of 80 in the end
    d = distances(make_sample("bcca", grains=100, mass_ratio=0.25, seed=3).positions)
    touch = np.abs(d - d.min()) < 1e-12
    assert touch[:80, :80].sum() == 2 * 79 and touch[80:, 80:].sum() == 2 * 19
    assert touch[:80, 80:].sum() == 1


def test_dust_of_a_wished_filling_factor():
    """Its volume, evenly over the box, and one tree of exact contacts."""
    for grains, wished in ((120, 0.1), (60, 0.17)):
        scene, sample = mix_sample("space_filling", grains=grains, filling_factor=wished, aspect=2)
        edges = np.array([sample.info[k] for k in ("width", "depth", "height")])
        volume = np.sum(4 / 3 * np.pi * sample.radii**3)
        assert volume / edges.prod() == pytest.approx(wished, rel=1e-9)
        assert edges[2] == pytest.approx(2 * edges[0])
        low = sample.positions - sample.radii[:, None] + [edges[0] / 2, edges[1] / 2, 0.0]
        assert low.min() > -1e-15
        gap = gaps(scene, sample)
        assert gap.min() > -1e-15
        assert np.count_nonzero(np.abs(gap) < 1e-15) == 2 * (len(sample) - 1)
        lower = sample.positions[:, 2] < edges[2] / 2
        fraction = np.sum(sample.radii[lower] ** 3) / np.sum(sample.radii**3)
        assert fraction == pytest.approx(0.5, abs=0.15)
    with pytest.raises(DustError, match="no further grains fit"):
        mix_sample("space_filling", grains=30, filling_factor=0.4)


@pytest.mark.parametrize("mixture", [MIXED, {"seed": 2}])
def test_a_deposit_rests_on_exact_contacts(mixture):
    built = scene(ICE, kind="rbd", grains=80, **mixture)
    sample = make(built)
    radii, materials = np.full(80, built.material.radius), np.zeros(80, int)
    if sample.radii is None:
        delta0 = mixed_constants(*2 * (built.material, radii[0]), built.interaction).delta0
        assert sample.info["equilibrium_distance"] == 2 * radii[0] - delta0
        sample = replace(sample, radii=radii, materials=materials)
    gap = gaps(built, sample)
    assert gap.min() > -1e-15 and len(sample) == 80
    on_floor = np.isclose(sample.positions[:, 2], sample.radii, rtol=1e-12)
    # all but those on the floor, and those whose support is outside of the cut, touch one below
    below = [np.any(np.abs(row[:k]) < 1e-15) for k, row in enumerate(gap)]
    assert np.mean(on_floor | np.array(below)) > 0.6


def test_a_packing_has_the_filling_factor_and_no_overlap():
    scene, sample = mix_sample("random_packing", grains=60, filling_factor=0.5)
    period = np.array(sample.info["period"])
    assert gaps(scene, sample, period).min() > -1e-14
    volume = np.sum(4 / 3 * np.pi * sample.radii**3)
    assert volume / period.prod() == pytest.approx(0.5, rel=1e-9)


@pytest.mark.parametrize(
    "block",
    [
        {"grains": 400, "filling_factor": 0.2},
        {"grains": 250, "filling_factor": 0.15, **MIXED},
        {"grains": 120, "filling_factor": 0.21, **MIXED},  # with trials without success
    ],
)
def test_a_tree_grown_in_batches_is_that_of_one_trial_after_another(block, monkeypatch):
    grown = []
    for few in (10_000, 30):
        monkeypatch.setattr(random_tree, "FEW", few)
        grown.append(make(scene(ICE, kind="space_filling", **block)).positions)
    np.testing.assert_array_equal(*grown)


def test_a_tree_grown_in_batches_stops_where_the_box_is_full(monkeypatch):
    monkeypatch.setattr(random_tree, "FEW", 20)
    with pytest.raises(DustError, match="no further grains fit"):
        mix_sample("space_filling", grains=40, filling_factor=0.4)


def test_a_mixed_aggregate_grown_in_batches_is_that_of_one_shot_after_another(monkeypatch):
    grown = []
    for few in (10_000, 20):
        monkeypatch.setattr(unequal_aggregate, "FEW", few)
        grown.append(make(scene(ICE, kind="pca", grains=350, **MIXED)).positions)
    np.testing.assert_array_equal(*grown)


def test_laws_of_sizes():
    """Against the cumulated distributions; 3/sqrt(N) is five of its standard deviations."""
    rng, n = np.random.default_rng(1), 20_000
    power = PowerLaw(kind="power", exponent=-3.5, smallest="0.1 um", largest="1 um").draw(rng, n)
    expected = (1 - 2**-2.5) / (1 - 10**-2.5)
    assert np.mean(power < 0.2e-6) == pytest.approx(expected, abs=3 / n**0.5)
    log = Lognormal(kind="lognormal", median="0.5 um", sigma=0.3, smallest="1 nm", largest="1 mm")
    radii = np.log(log.draw(rng, n))
    assert np.mean(radii) == pytest.approx(np.log(0.5e-6), abs=3 / n**0.5)
    assert np.std(radii) == pytest.approx(0.3, abs=3 / n**0.5)
    two = Radii(kind="list", radii=["0.1 um", "0.3 um"], shares=[3, 1]).draw(rng, n)
    assert np.mean(two == 0.1e-6) == pytest.approx(0.75, abs=3 / n**0.5)
