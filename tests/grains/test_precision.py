"""Precision, Newton steps and mass scaling: what they change, and by how much."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from scenes import FAR, Probe, box, make_scene, sample_of

from dusttaichi.errors import DustError
from dusttaichi.grains.build import build
from dusttaichi.grains.contact_table import ContactTable
from dusttaichi.grains.time_step import time_step
from dusttaichi.running.ledger import ledger

R = 0.6e-6
F_C = 3 * np.pi * 20e-3 * R / 2  # of two grains


def cluster(rng):
    """Twelve grains that touch their neighbours on a lattice, stirred."""
    grid = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1, 2], indexing="ij"), axis=-1).reshape(-1, 3)
    x = grid * (2 * R - 0.1e-9)
    return x, 0.02 * rng.normal(size=x.shape), 1e4 * rng.normal(size=x.shape)


SCENES = {
    "walls": {"boundary": box("x_min", "bottom", size=(9e-6, 9e-6, 9e-6))},
    "pairs": {"boundary": FAR},
    "unlike": {"boundary": FAR, "materials": {"ice": "ice_t19"}},
    "stress": {"boundary": {"kind": "periodic", "size": ["8 um", "8 um", "8 um"]}},
}


@cache
def outcome(scene_kind, steps, **numerics):
    """The cluster after some steps; one simulation lives at a time. Scenes of one structure follow
    each other in this file, whose compiled kernels serve all of them."""
    x, v, w = cluster(np.random.default_rng(1))
    if scene_kind == "walls":
        x = x + R - 0.2e-9
    sample = sample_of(x, v, w)
    if scene_kind == "unlike":
        sample = replace(sample, radii=R * (1 + 1e-4 * np.random.default_rng(2).random(len(x))))
    probe = Probe(
        make_scene(damping="viscoelastic", **SCENES[scene_kind], numerics=numerics), sample
    )
    start = probe.sim.ledger.measure()
    probe.advance(steps)
    return SimpleNamespace(
        x=probe.x,
        w=probe.w,
        way=probe.x - x,
        force=probe.loads()[0],
        energy=probe.energy(),
        open_by=abs(ledger(probe.sim.ledger.measure(), start)[1]),
        dtype=probe.sim.fields["x"].to_numpy().dtype,
    )


@pytest.mark.long  # the steps themselves: test_contact_radius
def test_fewer_newton_steps_are_less_exact():
    """The fit alone is 8e-5 off in s = sqrt(a/a0), and forces 6 s^5 - 3 s^2 = 3 times that of
    4 F_c; one Newton step squares it to below 1e-7."""
    forces = {n: outcome("pairs", 0, newton_steps=n).force for n in (0, 1, 3)}
    forces[2] = outcome("pairs", 0, precision="f64").force
    worst = [np.abs(forces[n] - forces[3]).max() / (4 * F_C) for n in range(4)]
    assert 1e-7 < worst[0] < 1e-3
    assert worst[1] < 1e-7 and worst[2] < 1e-12


def test_mass_scaling_is_a_slower_clock():
    """Four times the mass at half the speed: the same motion with every time doubled, bit for bit,
    since all factors are powers of two (no damping, whose constant has a time in it)."""

    def pressed(speed, dt, scaling):
        scene = make_scene(
            interaction={"damping": "none"},
            boundary=box(size="fit", wall_speed=speed),
            dt=dt,
            numerics={"mass_scaling": scaling},
        )
        x, _, _ = cluster(np.random.default_rng(1))
        sim = build(scene, sample_of(x))
        sim.advance(2000)
        return sim.fields["x"].to_numpy(), sim.ledger.measure_energies()["kinetic_translation"]

    light, heavy = pressed(0.5, 2e-10, 1.0), pressed(0.25, 4e-10, 4.0)
    assert np.array_equal(light[0], heavy[0])
    assert light[1] == heavy[1] > 0.0


@pytest.mark.parametrize("precision", ["f64", "mixed"])
def test_grains_that_fly_past_each_other_lose_nothing(precision):
    """Listed, and never nearer than a gap of 10 nm: a step turns the line of their centres by 1e-3,
    a displacement past the limit of sliding if they did touch."""
    x, v = [[0, 0, 0], [0, 0, 2 * R + 1e-8]], [[5.0, 0, 0], [-5.0, 0, 0]]
    scene = make_scene(damping="viscoelastic", boundary=FAR, numerics={"precision": precision})
    probe = Probe(scene, sample_of(x, v))
    probe.advance(300)
    assert probe.sim.ledger.measure().lost == 0.0


@pytest.mark.long
def test_single_precision_keeps_the_ledger_of_a_small_cluster():
    """Positions of 3 um are known to 0.2 pm, 1e-3 of the overlap at rest: the ledger shows it."""
    single, double = (outcome("pairs", 200, precision=name) for name in ("f32", "f64"))
    assert (single.dtype, double.dtype) == (np.float32, np.float64)
    assert double.open_by < single.open_by < 1e-2


@pytest.mark.parametrize(
    "scene_kind", ["stress", pytest.param("unlike", marks=pytest.mark.long), "pairs", "walls"]
)
def test_mixed_precision_is_the_same_model(scene_kind):
    """Two hundred steps with deviations in single precision against pointers in double.

    A force is a sum of a few terms that nearly cancel at rest, each rounded to 1e-7 of F_c; over
    half a period that grows by a factor of a few. Geometry in single precision would show 1e-4.
    """
    exact, mixed = (outcome(scene_kind, 200, precision=name) for name in ("f64", "mixed"))
    assert np.abs(exact.force).max() > 0.05 * F_C  # something happens
    assert np.abs(mixed.force - exact.force).max() < 1e-4 * F_C
    assert np.abs(mixed.x - exact.x).max() < 1e-5 * np.abs(exact.way).max()
    assert mixed.energy == pytest.approx(exact.energy, rel=1e-5)
    assert not np.array_equal(mixed.x, exact.x)  # it is not double under another name


def test_same_bits_on_one_and_two_threads():
    first, two = (outcome("walls", 100, precision="mixed", threads=n) for n in (1, 2))
    assert np.array_equal(first.x, two.x) and np.array_equal(first.w, two.w)


def test_single_precision_is_refused_where_it_cannot_resolve_an_overlap():
    scene = make_scene(numerics={"precision": "f32"})
    with pytest.raises(DustError, match=r"numerics\.precision = f32.*6 pm.*mixed or f64"):
        build(scene, sample_of([[0, 0, 0], [1e-4, 0, 0]]))


def test_mass_scaling_lengthens_the_step():
    plain, scaled = (
        make_scene(
            boundary=box(size="fit", wall_speed=0.01), dt="auto", numerics={"mass_scaling": factor}
        )
        for factor in (1.0, 100.0)
    )
    # viscous damping of S12 takes 1e-3 off the longer one's limit, not off the period
    periods = [time_step(ContactTable(scene), 100).period for scene in (plain, scaled)]
    assert periods[1] == pytest.approx(10 * periods[0])


@pytest.mark.parametrize(
    "blocks, reason",
    [
        ({"sample": {"kind": "pair", "speed": "1 m/s", "gap": "1 nm"}}, "a collision"),
        ({}, "no wall or face moves"),
        ({"push": [{"grains": [0], "velocity": ["1 m/s", "0 m/s", "0 m/s"]}]}, "a push"),
    ],
)
def test_mass_scaling_is_refused_where_inertia_matters(blocks, reason):
    with pytest.raises(DustError, match=f"numerics.mass_scaling.*{reason}"):
        make_scene(**blocks, numerics={"mass_scaling": 4})
