"""Samples for the map that no scene has: perturbed, compressed, pulled, and others."""

from functools import cache

import numpy as np

from dusttaichi import samples
from dusttaichi.grains.build import build
from dusttaichi.grains.contacts import contact_state
from dusttaichi.grains.measure import grain_state
from dusttaichi.physics.contact.constants import mixed_constants, pair_constants
from dusttaichi.physics.encounter import breaking_speed
from dusttaichi.physics.stability import close_packed
from dusttaichi.samples import Sample
from dusttaichi.scene import Scene

# compression of a compacted cake
PRESSED = {"grains": 300, "filling_factor": 0.4, "wall_speed": "2 m/s"}
SETTLE = 20_000  # steps without walls, about 6 us, until vibrations and creep have ended


def make(scene, spec):
    """The Sample of a `spec`, in the material of the scene.

    spec: `kind`, its own numbers, and `speed` [m/s], `spin` [rad/s]: standard deviations of random
    velocities and spins of every grain.
    """
    spec = dict(spec)
    speed, spin = spec.pop("speed", 0.0), spec.pop("spin", 0.0)
    sample = KINDS[spec.pop("kind")](scene, **spec)
    rng = np.random.default_rng(3)
    sample.velocities[:] += speed * rng.normal(size=sample.velocities.shape)
    sample.spins[:] += spin * rng.normal(size=sample.spins.shape)
    sample.info.update(samples.describe(sample, *_radii(scene, sample)))
    return sample


def _radii(scene, sample):
    radius = scene.material.radius
    return (radius, 2.0 * radius) if sample.radii is None else (sample.radii, None)


def given(scene, positions, velocities=None, spins=None):
    """Grains at positions [radii] with velocities [m/s] and spins [rad/s]."""
    x = np.array(positions, float) * scene.material.radius
    v, w = (
        np.zeros_like(x) if a is None else np.array(a, float) + np.zeros_like(x)
        for a in (velocities, spins)
    )
    return Sample(x, v, w)


def cluster(scene, grains):
    """Close-packed grains at rest."""
    contact = pair_constants(scene.material, scene.interaction)
    return Sample.at_rest(close_packed(grains) * (2.0 * contact.r - contact.delta0))


def meeting(scene, sticking, offset=0.3):
    """Two grains just before contact, at `sticking` times their sticking speed, off-centre."""
    c = pair_constants(scene.material, scene.interaction)
    v = sticking * breaking_speed(c)
    y = 2.0 * c.r * offset
    x = np.sqrt((2.0 * c.r + c.delta0) ** 2 - y**2)
    half = np.array([0.5 * v, 0.0, 0.0])
    return Sample(
        np.array([[0.0, 0.0, 0.0], [x, y, 0.0]]), np.array([half, -half]), np.zeros((2, 3))
    )


def cake(scene, grains, seed=1):
    """A cake of random ballistic deposition."""
    block = {"kind": "rbd", "grains": grains, "seed": seed}
    return Sample.at_rest(samples.make(scene.with_value("sample", block)).positions)


@cache
def _pressed():
    """Positions and contacts of a cake after compression in a box and relaxation without it."""
    box = {"kind": "box", "wall_speed": PRESSED["wall_speed"]}
    scene = Scene.from_dict(
        {
            "name": "pressed",
            "material": "silicate_s12",
            "boundary": box,
            "sample": {"kind": "rbd", "grains": PRESSED["grains"]},
            "stop": {"steps": 1},
            "interaction": {
                "rolling": {"modifier": 8},
                "sliding": {"modifier": 2.5},
                "damping": "viscoelastic",
            },
            "numerics": {"threads": 1},
        }
    )
    sim = build(scene, samples.make(scene))
    while sim.volume / np.prod(sim.lengths()) < PRESSED["filling_factor"]:
        sim.advance(200)
    free = Scene.from_dict({**scene.input_data, "boundary": {"kind": "open"}})
    sim = build(free, _as_it_is(sim))
    sim.advance(SETTLE)
    settled = _as_it_is(sim)
    return settled.positions, settled.contacts


def _as_it_is(sim):
    """Sample from a simulation: positions and strained contacts, at rest."""
    found = contact_state(sim)
    contacts = {name: found[name] for name in ("pointer_i", "pointer_j", "twist")}
    contacts |= {"i": found["grain_i"], "j": found["grain_j"]}
    contacts["approach"] = np.zeros(len(found["twist"]))
    x = grain_state(sim)[0] * sim.units("m")
    return Sample(x, np.zeros_like(x), np.zeros_like(x), contacts)


def compacted(scene):
    """A cake of silicate after compression, with its strained contacts."""
    x, contacts = _pressed()
    return Sample(x.copy(), np.zeros_like(x), np.zeros_like(x), contacts)


def pulled(scene, grains):
    """A chain with all contacts just before pull-off."""
    c = pair_constants(scene.material, scene.interaction)
    x = np.zeros((grains, 3))
    x[:, 0] = (2.0 * c.r + c.delta_c * (1.0 - 1e-9)) * np.arange(grains)
    i = np.arange(grains - 1)
    along = np.tile([1.0, 0.0, 0.0], (grains - 1, 1))
    contacts = {"i": i, "j": i + 1, "pointer_i": along, "pointer_j": -along}
    contacts |= {name: np.zeros(grains - 1) for name in ("twist", "approach")}
    return Sample(x, np.zeros_like(x), np.zeros_like(x), contacts)


def chain(scene, grains, apart=1.0):
    """A chain of grains along x; apart: distance over that in equilibrium."""
    c = pair_constants(scene.material, scene.interaction)
    x = np.zeros((grains, 3))
    x[:, 0] = apart * (2.0 * c.r - c.delta0) * np.arange(grains)
    return Sample.at_rest(x)


def gas(scene, grains, filling_factor):
    """Random grains without contacts in a periodic cube of a filling factor."""
    r = scene.material.radius
    edge = (grains * 4.0 / 3.0 * np.pi * r**3 / filling_factor) ** (1.0 / 3.0)
    rng, x = np.random.default_rng(7), []
    while len(x) < grains:
        one = edge * rng.random(3)
        apart = np.array(x).reshape(-1, 3) - one
        apart -= edge * np.round(apart / edge)
        if not len(x) or np.min(np.linalg.norm(apart, axis=1)) > 2.02 * r:
            x.append(one)
    sample = Sample.at_rest(np.array(x))
    sample.info["period"] = [edge] * 3
    return sample


def packed(scene, block):
    """A sample of a kind that scenes have."""
    made = samples.make(scene.with_value("sample", block))
    still = np.zeros_like(made.positions)
    return Sample(made.positions, still, still.copy(), info=made.info)


def polydisperse(scene, ratio, around=1, speed_in=0.0):
    """A grain of `ratio` times the radius with `around` small ones.

    They are in equilibrium contact, or at a small distance with speed_in [m/s] towards it.
    """
    small = scene.material.radius
    c = mixed_constants(scene.material, small, scene.material, ratio * small, scene.interaction)
    ways = _sphere(around)
    gap = c.delta0 if speed_in else -c.delta0
    x = np.concatenate([np.zeros((1, 3)), ((1.0 + ratio) * small + gap) * ways])
    v = np.concatenate([np.zeros((1, 3)), -speed_in * ways])
    radii = np.r_[ratio * small, np.full(around, small)]
    return Sample(x, v, np.zeros_like(x), radii=radii)


def _sphere(n):
    """n directions uniformly over the sphere (Fibonacci), (n, 3)."""
    k = np.arange(n) + 0.5
    z, turn = 1.0 - 2.0 * k / n, np.pi * (1.0 + 5.0**0.5) * k
    return np.column_stack(
        [np.sqrt(1.0 - z**2) * np.cos(turn), np.sqrt(1.0 - z**2) * np.sin(turn), z]
    )


KINDS = {
    make.__name__: make
    for make in (
        given, cluster, meeting, cake, compacted, pulled, chain, gas, packed, polydisperse,
    )
}  # fmt: skip
