"""A batch of scenes against the scenes alone, bit for bit."""

import numpy as np
import pytest
from scenes import make_scene, sample_of

from dusttaichi import samples
from dusttaichi.errors import DustError
from dusttaichi.grains.batch import build_batch
from dusttaichi.grains.build import build

SPEEDS = (0.03, 0.08, 0.2, 1.0, 7.0)  # some of them stick, others do not


def pair_scene(speed, threads=1):
    return make_scene(
        damping="viscous",
        dt="0.05 ns",
        threads=threads,
        sample={
            "kind": "pair",
            "gap": "1 nm",
            "speed": f"{speed} m/s",
            "angle": "40 deg",
            "spins": [["0 rad/s", "2e4 rad/s", "0 rad/s"], ["1e5 rad/s"] * 3],
        },
    )


def collision_scene(seed, speed, threads=1):
    body = {"kind": "pca", "grains": 12}
    return make_scene(
        damping="viscous",
        dt="0.2 ns",
        threads=threads,
        sample={
            "kind": "collision",
            "target": {**body, "seed": seed},
            "speed": f"{speed} m/s",
            "projectile": {**body, "seed": seed + 1},
            "gap": "5 nm",
            "impact_parameter": 0.2,
            "seed": seed,
        },
    )


def single(scene, steps):
    sim = build(scene, samples.make(scene))
    sim.advance(steps)
    return sim.grain_state(), sim.contact_state()


def same_bits(batch, number, expected):
    grains, contacts = expected
    assert np.array_equal(batch.grain_state(number), grains)
    found = batch.contact_state(number)
    assert set(found) == set(contacts)
    for name, values in contacts.items():
        assert np.array_equal(found[name], values), name


def check(scenes, steps):
    """scenes: threads -> list of scenes."""
    alone = [single(scene, steps) for scene in scenes(1)]
    for threads in (1, 2):
        together = scenes(threads)
        batch = build_batch(together[0], [samples.make(scene) for scene in together])
        # in pieces, with searches at other moments than those of the scenes alone
        for part in (1, 7, steps - 8):
            batch.advance(part)
            batch.sim.search.ask()
        for number, expected in enumerate(alone):
            same_bits(batch, number, expected)
    return batch, alone


def test_five_pairs_are_the_single_runs():
    batch, alone = check(lambda threads: [pair_scene(v, threads) for v in SPEEDS], 2000)
    bound = [outcome.bound for outcome in batch.outcomes()]
    assert bound == [len(contacts["grain_i"]) == 1 for _, contacts in alone]
    assert True in bound and False in bound
    assert batch.sim.search.count > 3


def test_two_collisions_are_the_single_runs():
    """Of 24 grains each, one of which breaks up; in space they lie on top of each other."""
    cases = ((1, 0.4), (5, 20.0))
    batch, alone = check(lambda n: [collision_scene(*case, n) for case in cases], 600)
    slow, fast = batch.outcomes()
    assert slow.bound and slow.fragments == 1 and slow.largest == 24
    assert not fast.bound and fast.fragments > 5
    for outcome, (grains, contacts) in zip((slow, fast), alone, strict=True):
        assert outcome.contacts == len(contacts["grain_i"])
        m, inertia = batch.sim.mass, batch.sim.inertia
        energy = 0.5 * (m * np.sum(grains[1] ** 2) + inertia * np.sum(grains[2] ** 2)) * 1e-15
        assert outcome.kinetic == pytest.approx(energy, rel=1e-12)  # sums in another order


def test_refused():
    apart = [sample_of([[0, 0, 0]]), sample_of([[1e-6, 0, 0]])]
    with pytest.raises(DustError, match="one or more"):
        build_batch(make_scene(), [])
    with pytest.raises(DustError, match="share their walls"):
        build_batch(make_scene(boundary={"kind": "box"}), apart)
    with pytest.raises(DustError, match="periodic"):
        build_batch(make_scene(boundary={"kind": "periodic"}), apart)
